"""Nearest-neighbour distances between two clouds, against the cKDTree of scipy; tiles on disk.

Two stations in one hall, points in scan order. Each way runs in a process of its own, on all
processors, so that the peak memory is its. The tiled mode takes clouds from files in chunks. The
mode of commands runs ``tribrach compare`` of two LAZ files, distances and M3C2, for clouds of
several sizes, and says how its processor time grows.
Run: ``python benchmarks/cloud_distances.py [millions of points, 1] [repeats, 3]``, or
``python benchmarks/cloud_distances.py tiles [millions of points, 100]``, or
``python benchmarks/cloud_distances.py compare [millions of points, 3 10]``.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

HALL = np.array([[-20.0, -15.0, -2.0], [20.0, 15.0, 8.0]])
PLACES = np.array([[3.0, 2.0, 0.0], [-6.0, -3.0, 0.1]])
CHUNK = 1_000_000
LIMIT = 0.2


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


def tiled(points: int, folder: Path) -> None:
    """Clouds of any size from files, in parts of bounded memory."""
    from tribrach.comparison.nearest import Neighbours
    from tribrach.comparison.streams import Spool
    from tribrach.comparison.tiles import tiles

    files = Spool(folder, 2)
    for number in (0, 1):
        for chunk in station(points, number):
            files.add(number, chunk)
    start, count, total, largest = time.perf_counter(), 0, 0.0, 0
    with tiles(files.stream(0), files.stream(1), LIMIT) as cut:
        for tile in cut:
            reference = tile.reference(LIMIT)
            largest = max(largest, len(reference))
            tree = Neighbours(reference)
            for queries in tile.queries():
                distances = tree.query(queries, LIMIT)[0]
                near = distances[np.isfinite(distances)]
                count, total = count + len(near), total + near.sum()
    took = time.perf_counter() - start
    print(
        f"{points / 1e6:g} against {points / 1e6:g} million points in tiles: {took:.1f} s, "
        f"{points / took / 1e6:.2f} million points/s, at most {largest / 1e6:.1f} million of the "
        f"reference in memory, peak {peak():.0f} MB; mean of {count} distances "
        f"{1e3 * total / count:.4f} mm"
    )


def commands(millions: list[float]) -> None:
    """``tribrach compare`` as a whole process, the second of two runs, and its growth."""
    runs = []
    for size in millions:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for number, letter in enumerate("ab"):
                write(folder / f"{letter}.laz", int(size * 1e6), number)
            command = [sys.executable, "-m", "tribrach", "compare", "a.laz", "b.laz"]
            for _ in range(1 if runs else 2):  # the first compiles
                before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
                child = [sys.executable, __file__, "run", *command]
                out = subprocess.run(child, cwd=folder, check=True, capture_output=True, text=True)
                wall = time.perf_counter() - start
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        runs.append((size, cpu))
        print(
            f"compare of {size:g} with {size:g} million points: {cpu:.1f} s of the processors, "
            f"{wall:.1f} s, peak {float(out.stdout.split()[-1]):.0f} MB"
        )
    if len(runs) > 1:
        (small, first), (large, last) = runs[0], runs[-1]
        growth = np.log(last / first) / np.log(large / small)
        print(f"growth with the number of points: exponent {growth:.2f}")


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


def peak() -> float:
    """Peak memory [MB] of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def alone(way: str, folder: str) -> list[float]:
    """Wall and processor seconds and peak memory [MB] of one way in a process of its own."""
    command = [sys.executable, __file__, way, folder]
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [float(word) for word in out.split()]


def worker(way: str, folder: Path) -> None:
    """Run one way on the stored clouds; its distances go into the folder."""
    a, b = np.load(folder / "a.npy"), np.load(folder / "b.npy")
    function = {"scipy": scipy, "ours": ours}[way]
    function(a[:20_000], b[:20_000])  # libraries and compiled code are loaded
    start = time.perf_counter(), time.process_time()
    distances = function(a, b)
    print(time.perf_counter() - start[0], time.process_time() - start[1], peak())
    np.save(folder / f"{way}.npy", distances)


def compared(millions: float, repeats: int) -> None:
    """Both ways by turns, the best of each."""
    runs: dict[str, list[list[float]]] = {"scipy": [], "ours": []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for letter, number in (("a", 0), ("b", 1)):
            points = np.concatenate(list(station(int(millions * 1e6), number)))
            np.save(folder / f"{letter}.npy", points)
        for _ in range(repeats):
            for way, figures in runs.items():
                figures.append(alone(way, name))
        difference = np.abs(np.load(folder / "scipy.npy") - np.load(folder / "ours.npy")).max()
    best = {way: np.min(figures, axis=0) for way, figures in runs.items()}
    for way, (wall, cpu, memory) in best.items():
        print(f"{way}: {wall:.2f} s ({cpu:.2f} s of the processors), peak {memory:.0f} MB")
    ratio = best["scipy"] / best["ours"]
    print(f"scipy over ours: {ratio[0]:.2f} ({ratio[1]:.2f} of the processors)")
    print(f"largest difference of a distance: {difference:.1e} m")


def main() -> None:
    arguments = sys.argv[1:]
    if arguments[:1] == ["tiles"]:
        with tempfile.TemporaryDirectory() as folder:
            tiled(int(float((arguments[1:] or ["100"])[0]) * 1e6), Path(folder))
        return
    if arguments[:1] == ["compare"]:
        commands([float(size) for size in arguments[1:] or ["3", "10"]])
        return
    if arguments[:1] == ["run"]:  # a command in a process of its own, and its peak memory
        subprocess.run(arguments[1:], check=True, stdout=subprocess.DEVNULL)
        print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)
        return
    millions = float(arguments[0]) if arguments else 1.0
    compared(millions, int(arguments[1]) if len(arguments) > 1 else 3)


if __name__ == "__main__":
    if len(sys.argv) > 2 and sys.argv[1] in ("scipy", "ours"):
        worker(sys.argv[1], Path(sys.argv[2]))
    else:
        main()
