"""A scan in memory, and everything that is made of it in one visit.

A room as a scanner with a grid of rows and columns measures it, in LAZ. Loading is compared, as a
whole process, with laspy that reads the file at once and gives the same columns; a visit that looks
for spheres and planes and takes the sample of the error budget with the same work product by
product, each of which decodes the scan for itself.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np

from benchmarks.figures import Cost, Figure, Growth, cost_of, run, whole_process
from tribrach.io.scans.formats import read_scans
from tribrach.job.find_planes import plane_wish, surroundings
from tribrach.job.find_targets import extract, target_wish
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.job.surface_samples import SurfaceSamples, sample_wish
from tribrach.job.visits import Wish, visit
from tribrach.project.sections import TargetSection

PEER = """
import sys, laspy, numpy as np
file = laspy.read(sys.argv[1])
columns = [np.asarray(file.xyz), np.float32(file.intensity)]
columns += [np.int32(file[name]) for name in ("row", "column")]
"""
OURS = """
import sys
from pathlib import Path
from tribrach.io.scans.formats import read_scans
from tribrach.scan.loading import load
(scan,) = read_scans(Path(sys.argv[1]))
load(scan)
"""
#: half the width, length and height of the room, and the noise of ranges [m]
ROOM, NOISE = (10.0, 8.0, 3.0), 1e-3
WANTED = TargetSection(sphere_radius_m=[0.1])
AREA, FLOOR = 0.5, 1e-3


def room(path: Path, points: float) -> int:
    """Write the scan, column by column of its grid; the number of its points."""
    rows = int(np.sqrt(points / 2))
    columns = int(points) // rows
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.scales = np.full(3, 1e-4)
    header.add_extra_dims([laspy.ExtraBytesParams(name, np.uint16) for name in ("row", "column")])
    rng = np.random.default_rng(0)
    with laspy.open(path, mode="w", header=header) as file:
        for some in np.array_split(np.arange(columns), max(1, rows * columns // 500_000)):
            column, row = (a.ravel() for a in np.meshgrid(some, np.arange(rows), indexing="ij"))
            h, v = 2 * np.pi * column / columns, 0.5 + 2.0 * row / rows
            beam = np.stack([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)])
            with np.errstate(divide="ignore"):
                far = np.min(np.array(ROOM)[:, None] / np.abs(beam), axis=0)
            part = laspy.ScaleAwarePointRecord.zeros(len(far), header=header)
            part.x, part.y, part.z = beam * (far + rng.normal(0, NOISE, len(far)))
            part.intensity = rng.integers(100, 3000, len(far))
            part["row"], part["column"] = row, column
            file.write_points(part)
    return rows * columns


def silent(what: str, done: int, total: int | None) -> None:
    """Nobody is told of what is done."""


def one_by_one(scan: StationScan, folder: Path) -> None:
    """Targets, planes and sample, each for itself."""
    state = Remembered(folder)
    extract([scan], WANTED, state, silent)
    surroundings([scan], AREA, FLOOR, state, silent)
    SurfaceSamples(state, silent).of([scan])


def together(scan: StationScan, folder: Path) -> None:
    """The same in one visit."""
    state = Remembered(folder)

    def wanted(one: StationScan) -> list[Wish]:
        return [target_wish(one, WANTED), plane_wish(one, AREA, FLOOR)]

    visit([scan], wanted, lambda one: [sample_wish(one)], state=state, progress=silent)


def products(folder: Path) -> dict[str, bytes]:
    """What was remembered, by name, but for the digests of files, which hold places and dates."""
    kept = (Remembered(folder).folder).iterdir()
    return {path.name: path.read_bytes() for path in kept if not path.name.startswith("file-")}


def visits(path: Path, folder: Path) -> Figure:
    """One visit against a decoding for each product, compiled loops loaded."""
    (scan,) = read_scans(path)
    station = StationScan("S", "S", replace(scan, origin="stated"), None, False, {})
    together(station, folder / "warm")
    _, apart = cost_of(lambda: one_by_one(station, folder / "apart"))
    _, ours = cost_of(lambda: together(station, folder / "together"))
    same = products(folder / "apart") == products(folder / "together")
    told = f"products {'the same' if same else 'NOT the same'}"
    size = f"{scan.records:,} points"
    apart, ours = (Cost(cost.wall, cost.processor) for cost in (apart, ours))
    return Figure("targets, planes, sample in one visit", size, ours, "each by itself", apart, told)


def measure(*millions: float) -> Iterator[Figure | Growth]:
    """Rooms of so many million points."""
    sizes, seconds = [], []
    for million in millions:
        with tempfile.TemporaryDirectory() as name:
            path = Path(name) / "room.laz"
            points = room(path, 1e6 * million)
            ours, peer = (
                whole_process([sys.executable, "-c", code, str(path)], 2) for code in (OURS, PEER)
            )
            told = f"{1e6 * (ours.memory or 0) / points:.0f} bytes a point, of the peer "
            told += f"{1e6 * (peer.memory or 0) / points:.0f}"
            yield Figure("loading a scan", f"{points:,} points", ours, "laspy.read", peer, told)
            sizes.append(points)
            seconds.append(ours.processor)
            yield visits(path, Path(name))
    if len(sizes) > 1:
        yield Growth("loading a scan", "points", tuple(sizes), tuple(seconds))


if __name__ == "__main__":
    run(measure, full=(3, 30), small=(0.3,))
