"""A cloud from LAZ to LAZ with three sigmas, against the bare loop without any, and peak memory.

The bare loop reads chunks with laspy, rotates and shifts them with numpy and writes chunks with
laspy; it knows no uncertainty. Each runs in a process of its own, so that the peak memory is its;
once with everything loaded before, and once as a whole, from the start of Python to its end.
"""

import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import laspy
import numpy as np

from benchmarks.figures import Cost, Figure, alone, cost_of, least, run, whole_process

FIELDS = ("intensity", "gps_time", "return_number", "number_of_returns")
CHUNK = 1_000_000


def make(path: Path, points: int) -> None:
    """A room scanned in columns, 2 mm noise, intensity and time."""
    rng, columns = np.random.default_rng(0), 4000
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [1e-4] * 3
    with laspy.open(path, "w", header=header) as file:
        for first in range(0, points, CHUNK):
            i = np.arange(first, min(first + CHUNK, points))
            h = (i // columns) * 2 * np.pi / (points / columns)
            v = np.radians(20 + (i % columns) * 120 / columns)
            d = np.stack([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)], axis=1)
            wall = np.abs(d) / [20.0, 15.0, 4.0]
            xyz = d * (1 / wall.max(axis=1) + rng.normal(0, 2e-3, len(i)))[:, None]
            record = laspy.ScaleAwarePointRecord.zeros(len(i), header=header)
            record.x, record.y, record.z = xyz.T
            record.intensity = (1000 + 500 * np.sin(7 * h) + rng.normal(0, 50, len(i))).astype("u2")
            record.gps_time = i * 1e-6
            record.return_number[:] = record.number_of_returns[:] = 1
            file.write_points(record)


def bare(source: str, destination: str) -> None:
    """The loop that everybody writes."""
    rotation = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    shift = np.array([500000.0, 2331000.0, 20.0])
    with laspy.open(source) as file:
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales, header.offsets = [1e-4] * 3, shift
        with laspy.open(destination, "w", header=header) as out:
            for chunk in file.chunk_iterator(CHUNK):
                xyz = np.stack([chunk.x, chunk.y, chunk.z], axis=1) @ rotation.T + shift
                record = laspy.ScaleAwarePointRecord.zeros(len(chunk), header=header)
                record.x, record.y, record.z = xyz.T
                for name in FIELDS:
                    record[name] = chunk[name]
                out.write_points(record)


def ours(source: str, destination: str) -> None:
    """The same with a covariance behind every point."""
    from tribrach.cloud.placement import Placement
    from tribrach.geodesy.output_frame import OutputFrame
    from tribrach.geodesy.work_frame import WorkFrame
    from tribrach.geometry.pose import Pose
    from tribrach.instruments.scan_noise import ScanNoise
    from tribrach.io.scans.formats import read_scans
    from tribrach.job.clouds import CloudProduct
    from tribrach.job.scans import MeasuredScan
    from tribrach.project.sections import CloudSection

    rotation = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    pose = Pose(rotation, np.array([500000.0, 2331000.0, 20.0]))
    noise = ScanNoise(1.2e-3, 1e-5, 4e-5, 4e-5, 4e-3, 3e-4)
    a = np.random.default_rng(1).normal(size=(6, 6)) * 1e-4
    scan = MeasuredScan("S1", "S1", read_scans(Path(source))[0], noise)
    where = Placement("S1", pose, a @ a.T, noise)
    frame, wish = OutputFrame(WorkFrame()), CloudSection()
    file = Path(destination)
    cloud = CloudProduct(file.name, "S1", [scan], [where], frame, wish, [1], "a priori")
    cloud.write(file, lambda what, done, total: None)


def measure(millions: float) -> Iterator[Figure]:
    """With everything loaded, and as whole processes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make(folder / "scan.laz", int(millions * 1e6))
        make(folder / "few.laz", 10_000)
        # byte code is in a folder of its own, as an installer leaves it beside the sources
        kept = {"PYTHONPYCACHEPREFIX": str(folder / "bytecode"), "PYTHONDONTWRITEBYTECODE": ""}
        warm: dict[str, list[Cost]] = {"bare": [], "ours": []}
        cold: dict[str, list[Cost]] = {"bare": [], "ours": []}
        for _ in range(3 if millions <= 20 else 1):
            for way in warm:
                warm[way].append(Cost(**alone("georeferencing", way, folder)))
                words = [sys.executable, "-m", "benchmarks.georeferencing", way, name, "once"]
                cold[way].append(whole_process(words, **kept))
    size = f"{millions:g} million points"
    peer = "the bare loop of laspy and numpy, without sigmas"
    for what, costs in (("libraries loaded", warm), ("whole process", cold)):
        own = least(costs["ours"])
        told = f"{millions / own.wall:.2f} million points a second"
        what = f"LAZ to LAZ with three sigmas, {what}"
        yield Figure(what, size, own, peer, least(costs["bare"]), told)


def work(way: str, folder: Path, *, once: bool) -> None:
    """One way; with few points before, so that libraries and kernels are loaded, unless once."""
    function = {"bare": bare, "ours": ours}[way]
    target = folder / f"{way}.laz"
    if not once:
        function(str(folder / "few.laz"), str(target))
        target.unlink()
    _, cost = cost_of(lambda: function(str(folder / "scan.laz"), str(target)))
    target.unlink()
    print(json.dumps(asdict(cost)))


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["bare" | "ours" as way, place, *rest]:
            work(way, Path(place), once=rest == ["once"])
        case _:
            run(measure, full=(10,), small=(0.5,))
