"""`tribrach run` of some scans, from their files to their clouds, and how it grows with points.

Overviews of a simulated courtyard, tied by spheres over marks. Each command is a process of its
own with results of its own, so that its peak memory is its; the peer decodes every file once, in
chunks, which no method avoids.

Of two million points or more: in fewer the overviews see too little of the spheres.

``python -m benchmarks.whole_run write FOLDER COUNT MILLIONS`` leaves a project of so many files of
so many million points each.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

from benchmarks.figures import Figure, Growth, run, whole_process
from tribrach.io.twins import write_twin
from tribrach.simulate.aiming import overview
from tribrach.simulate.setups import levelled
from tribrach.simulate.twin import TwinStation, child_rng
from tribrach.simulate.twins import sphere_courtyard

DECODED = """
import sys, laspy
for name in sys.argv[1:]:
    with laspy.open(name) as file:
        sum(len(chunk) for chunk in file.chunk_iterator(500_000))
"""
#: places over the ground of the courtyard [m], and where their scanners look
PLACES = {
    **{name: place for name, place in sphere_courtyard.PLACES.items() if name != "S6"},
    "S8": ((9.8, -5.9, 1.72), 1.2),
    "S9": ((1.9, 4.6, 1.68), -1.5),
    "S10": ((-4.6, -6.7, 1.74), 0.2),
    "S11": ((15.7, 7.1, 1.69), 2.4),
}


def write(folder: Path, count: int, points: int) -> Path:
    """A project of so many files, ten at most, of so many points."""
    twin = sphere_courtyard.build(1_000, 1)
    rng = child_rng(1, "poses")
    stations = [
        TwinStation(
            name,
            levelled(sphere_courtyard.ORIGIN + place, turn, sphere_courtyard.LEVELLING, rng),
            True,
        )
        for name, (place, turn) in islice(PLACES.items(), count)
    ]
    scans = [
        overview(one.name, twin.scene, one.pose, points, sphere_courtyard.ZENITH)
        for one in stations
    ]
    return write_twin(replace(twin, stations=stations, scans=scans), folder, truth=0)


def measure(count: float, *millions: float) -> Iterator[Figure | Growth]:
    """Runs with so many files, of so many million points each."""
    sizes, seconds = [], []
    for each in millions:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            project = write(folder / "project", int(count), int(1e6 * each))
            size = f"{count:g} files of {each:g} million points"
            figure = _run(project, folder / "results", size)
            sizes.append(1e6 * count * each)
            seconds.append(figure.ours.processor)
            yield figure
    if len(sizes) > 1:
        yield Growth("tribrach run", "points", tuple(sizes), tuple(seconds))


def _run(project: Path, results: Path, size: str) -> Figure:
    words = [sys.executable, "-m", "tribrach", "run", str(project), "--quiet"]
    ours = whole_process([*words, "--out", str(results)])
    files = [str(path) for path in sorted(project.parent.rglob("*.laz"))]
    theirs = whole_process([sys.executable, "-c", DECODED, *files])
    return Figure("tribrach run", size, ours, "decoding every file once", theirs)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["write", place, count, millions]:
            print(write(Path(place), int(count), int(1e6 * float(millions))))
        case _:
            run(measure, full=(10, 2, 10), small=(3, 1))
