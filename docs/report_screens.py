"""Looks at reports as their readers do: ``python docs/report_screens.py OUT [NAME=PAGE ...]``.

Every page is taken at 1400 and at 390 pixels, bright and dark, its first screen and the whole of
it with everything unfolded, and printed to PDF. Without pages it simulates the surveys of the
tutorials with few points, runs them as the tutorials say, and looks at what they leave. Chromium
must be installed; with pdftoppm (poppler-utils) there is a sheet of the printed pages. What it
prints: the number of pages on paper, how full the emptiest one but the last is, and pages wider
than their screen.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.workbench.browsing import FLAGS, executable  # noqa: E402

#: name, width and height in pixels, colours
VIEWS = (("1400", 1400, 900, "light"), ("dark", 1400, 900, "dark"), ("390", 390, 844, "light"))
#: a full page is cut into screens of this height, since very high pictures cannot be looked at
SLICE = 1800
FEW = "60000"
REFERENCES = [word for k in range(1, 6) for word in ("--reference", f"R{k}")]
#: commands of the tutorials, and the pages that they leave
TUTORIALS: dict[str, tuple[list[list[str]], str]] = {
    "demo": ([["demo", "--out", "demo", "--points", "100000"]], "demo/out/report.html"),
    "courtyard": (
        [
            ["simulate", "sphere-courtyard", "--out", "courtyard", "--points", FEW],
            ["run", "courtyard/sphere-courtyard.toml"],
        ],
        "courtyard/out/report.html",
    ),
    "hanoi": (
        [
            ["simulate", "hanoi-facade", "--out", "hanoi", "--points", "100000"],
            ["run", "hanoi/hanoi-facade.toml"],
        ],
        "hanoi/out/report.html",
    ),
    "calibration": (
        [
            ["simulate", "newcastle-lab-ceiling", "--out", "lab", "--points", FEW],
            ["calibrate", "lab/calibrate.toml", "--html", "lab/calibration.html"],
        ],
        "lab/calibration.html",
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
}  # fmt: skip


def made(folder: Path) -> dict[str, Path]:
    """The pages of all tutorials, run in a folder."""
    pages = {}
    for name, (commands, page) in TUTORIALS.items():
        for words in commands:
            print("tribrach", *words, flush=True)
            call = [sys.executable, "-m", "tribrach", *words]
            subprocess.run(call, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        pages[name] = folder / page
    return pages


def screens(browser: Any, name: str, page_file: Path, out: Path) -> None:
    """First screens and whole pages."""
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
    call = ["pdftoppm", "-r", "45", "-png", str(out / f"{name}.pdf"), str(out / f"{name}-page")]
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
    with tempfile.TemporaryDirectory() as folder:
        named = [word.split("=", 1) for word in sys.argv[2:]]
        pages = {name: Path(file) for name, file in named} or made(Path(folder))
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=executable(), args=FLAGS)
            for name, file in pages.items():
                screens(browser, name, file, out)
                printed(browser, name, file, out)
            browser.close()


if __name__ == "__main__":
    main()
