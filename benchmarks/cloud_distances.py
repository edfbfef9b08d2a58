"""Nearest-neighbour distances between two clouds, against the cKDTree of scipy; tiles on disk.

Two stations in one hall, points in scan order. Each way runs in a process of its own, on all
processors, so that the peak memory is its. In tiles, clouds are taken from files in chunks, as by
``tribrach compare``, which is timed as a whole process as well.
"""

import json
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np

from benchmarks.figures import Cost, Figure, Growth, alone, cost_of, run, whole_process

HALL = np.array([[-20.0, -15.0, -2.0], [20.0, 15.0, 8.0]])
PLACES = np.array([[3.0, 2.0, 0.0], [-6.0, -3.0, 0.1]])
CHUNK = 1_000_000
LIMIT = 0.2
REPEATS = 3


def station(points: int, number: int) -> Iterator[np.ndarray]:
    """Chunks of a scan in columns, 2 mm noise."""
    place, rng = PLACES[number], np.random.default_rng(number)
    rows = int(np.sqrt(points / 2.2))
    columns = points // rows
    for first in range(0, rows * columns, CHUNK):
        i = np.arange(first, min(first + CHUNK, rows * columns))
        h = (i // rows + 0.5) * 2 * np.pi / columns
        v = np.radians(30 + 100 * (i % rows + 0.37) / rows)
        d = np.stack([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)], axis=1)
        wall = np.where(d >= 0, HALL[1] - place, HALL[0] - place) / d
        yield d * (wall.min(axis=1) + rng.normal(0, 2e-3, len(i)))[:, None] + place


def scipy(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Tree and query of scipy."""
    from scipy.spatial import cKDTree

    return cKDTree(b).query(a, workers=os.cpu_count())[0]


def ours(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Tree and query of Tribrach."""
    from tribrach.comparison.nearest import nearest

    return nearest(a, b)[0]


def tiled(millions: float) -> Iterator[Figure]:
    """Clouds of any size from files in parts of bounded memory, against one read of them."""
    from tribrach.comparison.nearest import Neighbours
    from tribrach.comparison.streams import Spool
    from tribrach.comparison.tiles import tiles

    points = int(millions * 1e6)
    with tempfile.TemporaryDirectory() as folder:
        files = Spool(Path(folder), 2)
        for number in (0, 1):
            for chunk in station(points, number):
                files.add(number, chunk)

        def distances() -> tuple[int, float, int]:
            count, total, largest = 0, 0.0, 0
            with tiles(files.stream(0), files.stream(1), LIMIT) as cut:
                for tile in cut:
                    reference = tile.reference(LIMIT)
                    largest = max(largest, len(reference))
                    tree = Neighbours(reference)
                    for queries in tile.queries():
                        apart = tree.query(queries, LIMIT)[0]
                        near = apart[np.isfinite(apart)]
                        count, total = count + len(near), total + near.sum()
            return count, total, largest

        (count, total, largest), cost = cost_of(distances)
        _, reading = cost_of(lambda: [sum(map(len, files.stream(k)())) for k in (0, 1)])
    told = (
        f"at most {largest / 1e6:.1f} million points of the reference in memory; mean of {count} "
    )
    told += f"distances {1e3 * total / count:.4f} mm"
    size = f"{millions:g} against {millions:g} million points"
    peer = "reading both once"
    yield Figure("nearest points in tiles on disk", size, cost, peer, reading, told)


def by_command(millions: float) -> Figure:
    """``tribrach compare`` of two LAZ files, distances and M3C2; laspy decodes both."""
    with tempfile.TemporaryDirectory() as name:
        files = [Path(name) / f"{letter}.laz" for letter in "ab"]
        for number, file in enumerate(files):
            write(file, int(millions * 1e6), number)
        words = ["compare", *map(str, files), "--json", f"{name}/compared.json", "--quiet"]
        cost = whole_process([sys.executable, "-m", "tribrach", *words])
        decode = "import sys, laspy\nfor name in sys.argv[1:]:\n"
        decode += "    with laspy.open(name) as f:\n"
        decode += "        for c in f.chunk_iterator(1_000_000): c.x, c.y, c.z"
        limit = whole_process([sys.executable, "-c", decode, *map(str, files)])
    size = f"{millions:g} with {millions:g} million points"
    return Figure("tribrach compare A B", size, cost, "laspy decoding both", limit)


def write(path: Path, points: int, number: int) -> None:
    """A station as LAZ."""
    import laspy

    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [1e-4] * 3
    with laspy.open(path, "w", header=header) as file:
        for chunk in station(points, number):
            record = laspy.ScaleAwarePointRecord.zeros(len(chunk), header=header)
            record.x, record.y, record.z = chunk.T
            file.write_points(record)


def worker(way: str, folder: Path) -> None:
    """Run one way on the stored clouds; its distances go into the folder."""
    a, b = np.load(folder / "a.npy"), np.load(folder / "b.npy")
    function = {"scipy": scipy, "ours": ours}[way]
    function(a[:20_000], b[:20_000])  # libraries and compiled code are loaded
    distances, cost = cost_of(lambda: function(a, b), REPEATS)
    np.save(folder / f"{way}.npy", distances)
    print(json.dumps(asdict(cost)))


def compared(millions: float) -> Iterator[Figure]:
    """Both ways, each in a process of its own."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for letter, number in (("a", 0), ("b", 1)):
            points = np.concatenate(list(station(int(millions * 1e6), number)))
            np.save(folder / f"{letter}.npy", points)
        costs = {way: Cost(**alone("cloud_distances", way, name)) for way in ("scipy", "ours")}
        apart = np.abs(np.load(folder / "scipy.npy") - np.load(folder / "ours.npy")).max()
    size = f"{millions:g} against {millions:g} million points"
    told = f"distances apart by {apart:.1e} m at most"
    peer = "cKDTree of scipy, all processors"
    yield Figure("nearest points", size, costs["ours"], peer, costs["scipy"], told)


def measure(millions: float, in_tiles: float, *commands: float) -> Iterator[Figure | Growth]:
    """In memory against scipy, in tiles on disk, and the whole command with its growth."""
    yield from compared(millions)
    yield from tiled(in_tiles)
    by_command(0.01)  # compiled code is kept
    figures = [by_command(size) for size in commands]
    yield from figures
    if len(figures) > 1:
        seconds = tuple(figure.ours.processor for figure in figures)
        yield Growth(figures[0].what, "points", tuple(1e6 * size for size in commands), seconds)


if __name__ == "__main__":
    if sys.argv[1:2] in (["scipy"], ["ours"]):
        worker(sys.argv[1], Path(sys.argv[2]))
    else:
        run(measure, full=(1, 30, 3, 10, 30), small=(0.1, 0.3, 0.3))
