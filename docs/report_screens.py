"""Looks at reports as readers do: ``python docs/report_screens.py OUT [NAME ... | NAME=PAGE ...]``.

Every page is taken at 1400 and at 390 pixels, bright and dark, its first screen and the whole of
it with everything unfolded, and printed to PDF. Without pages it simulates the surveys of the
tutorials with few points, runs them and the other commands as the tutorials say, or those that are
named (those before them must have been run), and looks at what they leave; what they leave stays
in OUT/runs. Chromium must be installed; with pdftoppm (poppler-utils) there are the printed pages,
and a sheet of them. What it prints: the number of pages on paper, how full the emptiest one but
the last is, pages wider than their screen, and first screens without a verdict.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.epochs import test_series  # noqa: E402
from tests.job.test_gnss_chapter import ghilani  # noqa: E402
from tests.workbench.browsing import executable  # noqa: E402

#: name, width and height in pixels, colours
VIEWS = (
    ("1400", 1400, 900, "light"),
    ("dark", 1400, 900, "dark"),
    ("390", 390, 844, "light"),
    ("390-dark", 390, 844, "dark"),
)
#: a full page is cut into screens of this height, since very high pictures cannot be looked at
SLICE = 1800
FEW = "60000"
REFERENCES = [word for k in range(1, 6) for word in ("--reference", f"R{k}")]
#: commands of the tutorials in their order, and the page that each group leaves
TUTORIALS: dict[str, tuple[list[list[str]], str]] = {
    "calibration": (
        [
            ["simulate", "newcastle-lab-ceiling", "--out", "lab", "--points", FEW],
            ["calibrate", "lab/calibrate.toml", "--html", "lab/calibration.html"],
        ],
        "lab/calibration.html",
    ),
    "check": (
        [
            ["check", "lab/polar.csv", "--range-mm", "1.2", "--angle-arcsec", "8", "--lengths",
             "lab/control.csv", "--html", "lab/check.html"],
        ],
        "lab/check.html",
    ),
    "check-project": (
        [["check", "lab/newcastle-lab-ceiling.toml", "--html", "lab/check-project.html"]],
        "lab/check-project.html",
    ),
    "plan": ([["plan", "plan/hall.toml", "--html", "plan/plan.html"]], "plan/plan.html"),
    "demo": ([["demo", "--out", "demo", "--points", "100000"]], "demo/out/report.html"),
    "noise": (
        [
            ["noise", *(f"demo/scans/S{k}.laz" for k in (1, 2)), "--sheet", "Topcon GTL-1000",
             "--html", "demo/noise.html"],
        ],
        "demo/noise.html",
    ),
    "register": (
        [
            ["register", *(f"demo/scans/S{k}.laz" for k in (1, 2, 3, 4)), "--html",
             "demo/registered.html"],
        ],
        "demo/registered.html",
    ),
    "complete": (
        [
            ["complete", *(f"demo/out/clouds/S{k}.laz" for k in (1, 2, 3, 4)), "--sigma-mm",
             "5", "--html", "demo/complete.html"],
        ],
        "demo/complete.html",
    ),
    "hanoi": (
        [
            ["simulate", "hanoi-facade", "--out", "hanoi", "--points", "100000"],
            ["run", "hanoi/hanoi-facade.toml"],
        ],
        "hanoi/out/report.html",
    ),
    "compare": (
        [
            ["compare", "hanoi/out/clouds/S3_S3-sites.laz", "hanoi/out/clouds/S4_S4-sites.laz",
             "--sites", "hanoi/sites.csv", "--json", "hanoi/table.json", "--html",
             "hanoi/table.html"],
        ],
        "hanoi/table.html",
    ),
    "regress": (
        [["regress", "hanoi/table.json", "--html", "hanoi/regression.html"]],
        "hanoi/regression.html",
    ),
    "adjust": (
        [["adjust", "hanoi/traverse.gsi", "--html", "hanoi/traverse.html"]],
        "hanoi/traverse.html",
    ),
    "courtyard": (
        [
            ["simulate", "sphere-courtyard", "--out", "courtyard", "--points", FEW],
            ["run", "courtyard/sphere-courtyard.toml"],
        ],
        "courtyard/out/report.html",
    ),
    "antennas": (
        [
            ["simulate", "konya-building", "--out", "konya", "--points", FEW],
            ["run", "konya/konya-building.toml"],
        ],
        "konya/out/report.html",
    ),
    "wall": (
        [
            ["simulate", "retaining-wall", "--out", "wall", "--points", FEW],
            ["run", "wall/epoch1.toml"],
            ["run", "wall/epoch2.toml"],
        ],
        "wall/out/epoch2/report.html",
    ),
    "epochs": (
        [
            ["epochs", "wall/out/epoch1/epoch.json", "wall/out/epoch2/epoch.json",
             *REFERENCES, "--html", "wall/moved.html"],
        ],
        "wall/moved.html",
    ),
    "moved": (
        [
            ["compare", "wall/out/epoch2/clouds/S2.laz", "wall/out/epoch1/clouds/S2.laz",
             "--method", "m3c2", "--moved", "--html", "wall/compared.html"],
        ],
        "wall/compared.html",
    ),
    "series": (
        [
            ["series", "series/march.csv", "--points", "series/points.csv", "--html",
             "series/march.html"],
        ],
        "series/march.html",
    ),
    "gnss": (
        [["adjust", "gnss/p.toml", "--html", "gnss/vectors.html"]],
        "gnss/vectors.html",
    ),
}  # fmt: skip


def written_out(folder: Path) -> None:
    """The files that the page on planning shows."""
    text = (ROOT / "docs/planning.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```(?:toml|csv)\n(.*?)```", text, re.DOTALL)
    folder.mkdir(exist_ok=True)
    for name, block in zip(("hall.toml", "targets.csv", "stations.csv"), blocks, strict=False):
        (folder / name).write_text(block, encoding="utf-8")


def measured(folder: Path) -> None:
    """What the pages on series and on GNSS ask the reader to have: cycles, and vectors."""
    series, gnss = folder / "series", folder / "gnss"
    for one in (series, gnss):
        one.mkdir(exist_ok=True)
    test_series.readings(series, 60, "march.csv")
    test_series.control(series)
    ghilani(gnss, "v.csv")


def made(folder: Path, names: list[str]) -> dict[str, Path]:
    """The pages of the tutorials that are named, of all if none is, run in a folder."""
    pages = {}
    folder.mkdir(exist_ok=True)
    written_out(folder / "plan")
    measured(folder)
    for name in names or TUTORIALS:
        commands, page = TUTORIALS[name]
        for words in commands:
            print("tribrach", *words, flush=True)
            call = [sys.executable, "-m", "tribrach", *words]
            subprocess.run(call, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        pages[name] = folder / page
    return pages


def screens(browser: Any, name: str, page_file: Path, out: Path) -> None:
    """First screens and whole pages."""
    for old in out.glob(f"{name}-*.png"):
        # a page that has become shorter leaves none of its former screens
        if re.fullmatch(rf"{re.escape(name)}-((390-)?dark|390|1400|page)-\d+", old.stem):
            old.unlink()
    for view, width, height, colours in VIEWS:
        size = {"width": width, "height": height}
        context = browser.new_context(viewport=size, color_scheme=colours)
        page = context.new_page()
        page.set_default_timeout(240_000)
        page.goto(page_file.resolve().as_uri())
        page.screenshot(path=out / f"{name}-{view}-first.png")
        wide = page.evaluate("document.documentElement.scrollWidth")
        if wide > width:
            print(f"{name}: {wide} pixels wide on a screen of {width}")
        box = page.locator("#summary .verdict").bounding_box()
        if box is None or box["y"] + box["height"] > height:
            print(f"{name}: no verdict on the first screen of {width} by {height}")
        page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        page.evaluate("document.querySelectorAll('.up').forEach((one) => one.remove())")
        high = page.evaluate("document.documentElement.scrollHeight")
        page.set_viewport_size({"width": width, "height": min(SLICE, high)})
        for k in range(-(-high // SLICE)):
            page.evaluate(f"window.scrollTo({{top: {k * SLICE}, behavior: 'instant'}})")
            page.screenshot(path=out / f"{name}-{view}-{k + 1:02}.png")
        context.close()


def printed(browser: Any, name: str, page_file: Path, out: Path) -> None:
    """The page on paper, and a sheet of all its pages."""
    page = browser.new_page()
    page.set_default_timeout(240_000)
    page.goto(page_file.resolve().as_uri())
    page.pdf(path=out / f"{name}.pdf", prefer_css_page_size=True, print_background=True)
    page.close()
    if shutil.which("pdftoppm") is None:
        return
    call = ["pdftoppm", "-r", "70", "-png", str(out / f"{name}.pdf"), str(out / f"{name}-page")]
    subprocess.run(call, check=True)
    files = sorted(out.glob(f"{name}-page-*.png"))
    pages = [Image.open(file).convert("RGB") for file in files]
    columns, (width, height) = 3, pages[0].size
    rows = -(-len(pages) // columns)
    sheet = Image.new("RGB", (columns * (width + 6), rows * (height + 6)), "#888")
    for k, one in enumerate(pages):
        sheet.paste(one, ((k % columns) * (width + 6), (k // columns) * (height + 6)))
    sheet.save(out / f"{name}-print.png")
    full = [_filled(one) for one in pages]
    emptiest = int(np.argmin(full[:-1])) if len(full) > 1 else 0
    print(f"{name}: {len(pages)} pages; page {emptiest + 1} is filled to {full[emptiest]:.0%}")


def _filled(page: Image.Image) -> float:
    """How far down a page something stands, without its head and foot."""
    grey = np.asarray(page.convert("L"))
    top, bottom = round(0.07 * len(grey)), round(0.94 * len(grey))
    rows = np.flatnonzero((grey[top:bottom] < 200).any(axis=1))
    return float(rows[-1] + 1) / (bottom - top) if len(rows) else 0.0


def main() -> None:
    """Look at the pages that are named, or at those of the tutorials."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    words = sys.argv[2:]
    pages = {name: Path(file) for name, file in (w.split("=", 1) for w in words if "=" in w)}
    if len(pages) < max(1, len(words)):
        pages |= made(out / "runs", [word for word in words if "=" not in word])
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable(), args=["--no-sandbox"])
        for name, file in pages.items():
            screens(browser, name, file, out)
            printed(browser, name, file, out)
        browser.close()


if __name__ == "__main__":
    main()
