"""A large cloud in the page, by a browser that draws in software: first points, and memory.

A hall of many million points against the same hall of one million. The page is looked around in:
from outside and inside, in plan, near a wall, with other colours. What it holds then is what the
browser says of itself: the heap of the page alone, and with all arrays and the workers that decode
(``performance.measureUserAgentSpecificMemory``); beside it the memory of the process that draws,
which holds the copies for a graphics card that is not there.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.workbench.browsing import FLAGS, Watched, executable, program

from benchmarks.figures import Cost, Figure, run
from benchmarks.first_points import written
from tribrach import pipeline

REPEATS = 3
PROJECT = """title = "Hall"
[[points]]
file = "control.csv"
role = "control"
[[observations]]
file = "line.csv"
"""
CONTROL = """point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm
A,-20,-15,-2,1,1,1
B,20,15,8,1,1,1
"""
LINE = "from,to,distance_m,sigma_distance_mm\nA,B,50.9902,5\n"
#: where one stands and looks, in the hall [m]
LOOKS = (
    ((-60, -60, 40), (0, 0, 0)),
    ((-15, -10, 1), (20, 15, 3)),
    ((15, 10, 1), (-20, -15, 3)),
    ((17, 0, 2), (20, 1, 2)),
    ((0, 13, 2), (0, 15, 2.2)),
    ((-60, -60, 40), (0, 0, 0)),
)


@dataclass(frozen=True)
class Looked:
    """What a page took.

    first : from its start to the first points drawn [s]; all : until everything was loaded [s];
    heap, whole, process : memory after looking around [MB]; shown : points at the end.
    """

    first: float
    all: float
    heap: float
    whole: float
    process: float
    shown: int


def results(folder: Path) -> Path:
    """A folder of results of two points, to show clouds in."""
    for name, text in (("hall.toml", PROJECT), ("control.csv", CONTROL), ("line.csv", LINE)):
        (folder / name).write_text(text, encoding="utf-8")
    pipeline.run(folder / "hall.toml", folder / "out")
    return folder / "out"


def looked(browser: Any, results: Path, cloud: Path) -> Looked:
    """Open a cloud, look around, and ask the browser for its memory."""
    with program("view", results, "--cloud", cloud) as address:
        context = browser.new_context(viewport={"width": 1400, "height": 860})
        page = Watched(context.new_page())
        page.open(address)
        first, every = page("[tribrach.counts.first / 1000, performance.now() / 1000]")
        for eye, at in LOOKS:
            page(f"tribrach.view({{eye: {list(eye)}, at: {list(at)}}})")
            page.settle()
        for name in ("sigma_z", "station", "intensity"):
            page.page.select_option("select:has(option[value='station'])", name)
            page("tribrach.share()")
        page("tribrach.look('plan')")
        page.settle()
        asked = context.new_cdp_session(page.page)
        asked.send("HeapProfiler.collectGarbage")
        asked.send("Performance.enable")
        told = {m["name"]: m["value"] for m in asked.send("Performance.getMetrics")["metrics"]}
        whole = page("performance.measureUserAgentSpecificMemory().then((m) => m.bytes)")
        process = drawing_process(browser)
        shown = page("tribrach.counts.points")
        page.fine()
        context.close()
    return Looked(first, every, told["JSHeapUsedSize"] / 1e6, whole / 1e6, process, shown)


def drawing_process(browser: Any) -> float:
    """Memory of the largest process of a browser that draws pages [MB]."""
    told = browser.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    largest = 0
    for process in told:
        if process["type"] == "renderer":
            status = Path(f"/proc/{process['id']}/status").read_text(encoding="utf-8")
            largest = max(largest, *(int(x) for x in re.findall(r"VmRSS:\s+(\d+) kB", status)))
    return largest / 1024


def measure(millions: float, few: float) -> Iterator[Figure]:
    """Many points against few."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        folder = Path(scratch)
        seen = results(folder)
        clouds = [written(folder / f"{size:g}.copc.laz", size) for size in (few, millions)]
        yield from figures(playwright, seen, clouds, [few, millions])


def figures(
    playwright: Any, seen: Path, clouds: list[Path], sizes: list[float]
) -> Iterator[Figure]:
    """What pages of two clouds take, each with a browser of its own."""
    told: list[Looked] = []
    for cloud in clouds:
        tries = []
        for _ in range(REPEATS):
            browser = playwright.chromium.launch(executable_path=executable(), args=FLAGS)
            tries.append(looked(browser, seen, cloud))
            browser.close()
            shutil.rmtree(seen / ".tribrach", ignore_errors=True)
        told.append(min(tries, key=lambda one: one.first))
    theirs, ours = told
    size, peer = f"{sizes[1]:g} million", f"{sizes[0]:g} million"
    # a page has no processor seconds of its own: the clock is told in both places
    yield Figure(
        "first points in the page",
        size,
        Cost(ours.first, ours.first),
        peer,
        Cost(theirs.first, theirs.first),
        f"{ours.shown:,} of them shown at the end",
    )
    for what, mine, other in (
        ("heap of the page", ours.heap, theirs.heap),
        ("with all arrays and workers", ours.whole, theirs.whole),
        ("process that draws, in software", ours.process, theirs.process),
    ):
        yield Figure(
            f"memory after looking around: {what}",
            size,
            Cost(ours.all, ours.all, mine),
            peer,
            Cost(theirs.all, theirs.all, other),
            f"{mine:.0f} MB against {other:.0f}",
        )


if __name__ == "__main__":
    run(measure, full=(100, 1), small=(0.4, 0.2))
