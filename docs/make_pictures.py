"""Draws the pictures of the docs from a run: ``python docs/make_pictures.py demo/out``.

Drawings are taken out of the report as they stand there. The picture of its first screen needs a
Chromium or Chrome, which is looked for by name.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from lxml import etree
from lxml import html as parser
from PIL import Image

PICTURES = Path(__file__).parent / "pictures"
STYLE = Path(__file__).parents[1] / "src/tribrach/report/templates/report.css.j2"
#: by file the place in the report
DRAWINGS = {
    "plan.svg": "//figure[@class='plan']//svg",
    "panorama.svg": "//figure[@id='panorama-S1-S1-targets']/svg",
    "error_budget.svg": "//figure[@id='budget-S1']/svg",
    "point_sigma.svg": "//figure[@id='point-sigma']/svg",
    "predicted_observed.svg": "//figure[starts-with(@id, 'predicted-observed')]/svg",
}
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
_NAMES = {"viewbox": "viewBox", "refx": "refX", "refy": "refY", "markerwidth": "markerWidth",
          "markerheight": "markerHeight", "preserveaspectratio": "preserveAspectRatio"}  # fmt: skip


def style() -> str:
    """The rules of the report for what is drawn, on white paper."""
    text = STYLE.read_text(encoding="utf-8")
    light = re.search(r":root \{[^}]*\}", text)
    assert light is not None
    drawn = "still|sheet|ellipse|arrow|suspect|sight|axis|line|ring|label|north|bar|curve|tick"
    symbols = "control|check|station|free"
    rules = re.findall(
        rf"(?m)^\.(?:{drawn})[ ,{{.-].*$|^g\.(?:{symbols}).*$|^circle\.ring.*$", text
    )
    font = "text { font-family: system-ui, sans-serif; }"
    return "\n".join([light.group(), font, *rules])


def drawing(tree: etree._Element, place: str) -> str:
    """A drawing as a file of its own."""
    (svg,) = tree.xpath(place)[:1]
    for element in svg.iter():
        for name in list(element.attrib):
            if name in _NAMES:
                element.set(_NAMES[name], element.attrib.pop(name))
    svg.set("xmlns", "http://www.w3.org/2000/svg")
    width, height = svg.get("viewBox").split()[2:]
    svg.set("width", width)
    svg.set("height", height)
    look = etree.SubElement(svg, "style")
    look.text = style()
    back = etree.Element("rect", width="100%", height="100%", fill="#fff")
    svg.insert(0, back)
    return etree.tostring(svg, encoding="unicode", with_tail=False) + "\n"


def first_screen(report: Path, target: Path) -> None:
    """What a reader sees first, 1400 by 900 pixels."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print("no Chromium here: the first screen is left as it is")
        return
    with tempfile.TemporaryDirectory() as folder:
        call = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                f"--user-data-dir={folder}", "--window-size=1400,900",
                f"--screenshot={target}", report.resolve().as_uri()]  # fmt: skip
        subprocess.run(call, check=True, capture_output=True)
    # as many colours as the eye tells apart in it, a third of the bytes
    Image.open(target).convert("RGB").quantize(256).save(target, optimize=True)


def main(results: Path) -> None:
    """Draw all of them from a folder of results."""
    report = results / "report.html"
    tree = parser.document_fromstring(report.read_text(encoding="utf-8"))
    for name, place in DRAWINGS.items():
        (PICTURES / name).write_text(drawing(tree, place), encoding="utf-8")
    first_screen(report, PICTURES / "report.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "demo/out"))
