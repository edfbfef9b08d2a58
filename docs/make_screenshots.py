"""Takes the pictures of the workbench in these pages: ``python docs/make_screenshots.py``.

It simulates the demo (or takes a finished one: ``python docs/make_screenshots.py DEMO``), works on
a copy of it as a person would, and writes ``docs/pictures/workbench-*.webp``. Chromium must be
installed; it draws in software, so every machine gives nearly the same picture.
"""

import io
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.workbench.browsing import FLAGS, Watched, executable, program, until  # noqa: E402

PICTURES = ROOT / "docs/pictures"
SIZE = {"width": 1440, "height": 880}
POINTS = "budget=1000000"
#: who decides in the pictures
os.environ["LOGNAME"] = "AB"


def overview(page: Watched) -> None:
    """The cloud by the sigma of its heights, with the network in it."""


def targets(page: Watched) -> None:
    """A target: ellipsoid, lines of its observations, and the scans that it was found in."""
    page.page.click("#tab-points")
    page.page.click("#panel button.name:text-is('E3')")
    page.page.click("#tab-selection")
    # from above a man's height, and far enough that the ground is not seen as single points
    page("tribrach.view({eye: [1058, 2004, 11], at: [1090, 2013, 9.6]})")


def picked(page: Watched) -> None:
    """A point of the facade, with the matrix of its position and what it is made of."""
    page.page.click("button[title^='Pick points']")
    page("tribrach.view({eye: [1060, 2020, 12], at: [1090, 2031, 10]})")
    page.settle()
    box = page.page.locator(".picture").bounding_box()
    page.page.mouse.click(box["x"] + box["width"] * 0.55, box["y"] + box["height"] * 0.45)
    until(lambda: page("tribrach.selection && tribrach.selection.type === 'cloud'"), "a point")
    until(lambda: not page("tribrach.selection.point.asking"), "its budget")


def moves(page: Watched) -> None:
    """The worst observation is off: what moves, drawn and listed."""
    page.page.locator(".rows .row").nth(0).locator("button.use").click()
    page.page.fill("dialog textarea", "Target loose on the wall, field book page 12")
    page.page.click("dialog button[type=submit]")
    until(lambda: page("tribrach.session.revision > 1 && !tribrach.stale"), "the tests")
    page.page.click("#tab-changes")


def section(page: Watched) -> None:
    """What a slice at the height of the eyes leaves, in plan, by station."""
    page("tribrach.look('plan')")


#: layers that a picture does without
HIDDEN = "&hide=edges&hide=planes&hide=rejected&hide=comparisons"
#: name, view in the address, and what is done before the picture is taken
VIEWS: list[tuple[str, str, Callable[[Watched], None]]] = [
    ("overview", "colour=sigma_z", overview),
    ("targets", f"colour=intensity&ellipsoids=500{HIDDEN}", targets),
    (
        "point",
        f"colour=sigma&range=0.004,0.011{HIDDEN}&hide=ellipsoids&hide=rays",
        picked,
    ),
    ("moves", f"theme=dark{HIDDEN}&hide=ellipsoids", moves),
    (
        "slice",
        f"colour=station&tab=points&size=2.5&slice=1055,2028,7.4,40,38,0.75,0{HIDDEN}&hide=rays&hide=ellipsoids",
        section,
    ),
]


def take(browser: Any, address: str, name: str, view: str, does: Callable[[Watched], None]) -> None:
    """One picture."""
    context = browser.new_context(viewport=SIZE)
    # software draws so many points in its own time
    context.set_default_timeout(240_000)
    page = Watched(context.new_page())
    page.open(f"{address}{'&' if '?' in address else '?'}{POINTS}#{view}", settled=False)
    page.settle()
    does(page)
    page.page.mouse.move(5, 5)
    page.page.wait_for_timeout(1500)
    # what the last look asked for is there
    page.settle()
    page.page.wait_for_timeout(500)
    page.fine()
    picture = Image.open(io.BytesIO(page.page.screenshot())).convert("RGB")
    path = PICTURES / f"workbench-{name}.webp"
    picture.save(path, quality=80, method=6)
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1000:.0f} kB")
    context.close()


def main() -> None:
    """All of them, or those that are named after the demo."""
    with tempfile.TemporaryDirectory() as folder:
        demo = Path(folder) / "demo"
        if len(sys.argv) > 1:
            shutil.copytree(sys.argv[1], demo)
        else:
            subprocess.run(
                [sys.executable, "-m", "tribrach", "demo", "--out", str(demo)], check=True
            )
        wanted = sys.argv[2:] or [name for name, _, _ in VIEWS]
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=executable(), args=FLAGS)
            for name, view, does in VIEWS:
                if name in wanted:
                    # each with a session of its own, so that none sees what another decided
                    with program("workbench", next(demo.glob("*.toml"))) as address:
                        take(browser, address, name, view, does)
            browser.close()


if __name__ == "__main__":
    main()
