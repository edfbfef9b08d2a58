"""First points of a cloud in the page, by its size: header, root of the hierarchy, first node.

What a viewer fetches and decodes before it shows anything, of a hall of many million points
against the same hall of one million.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from laspy import CopcReader

from benchmarks.cloud_distances import station
from benchmarks.figures import Cost, Figure, cost_of, run
from tribrach.io.clouds.copc import CopcWriter
from tribrach.io.clouds.header import CloudHeader
from tribrach.scan.scan import Field

FIELDS = (Field("intensity", "<u2"), Field("sigma_z", "<f4"))
REPEATS = 5


def written(path: Path, millions: float) -> Path:
    """A cloud in COPC: a hall seen from one place, noise of 2 mm."""
    rng = np.random.default_rng(1)
    with CopcWriter(path, CloudHeader("hall", FIELDS, step=1e-4)) as writer:
        for xyz in station(round(1e6 * millions), 0):
            light = rng.integers(0, 2000, len(xyz)).astype(np.uint16)
            sigma = rng.uniform(1e-3, 5e-3, len(xyz)).astype(np.float32)
            writer.write(xyz, {"intensity": light, "sigma_z": sigma})
    return path


def first_points(path: Path) -> tuple[int, int]:
    """Points of the first node, and bytes that were read for it."""
    with CopcReader.open(str(path)) as reader:
        points = len(reader.query(level=0))
        before = int(reader.header.offset_to_point_data) + reader.copc_info.hierarchy_root_size
        node = next(iter(reader.root_page.entries.values())).byte_size
        return points, int(before + node)


def measure(millions: float, few: float) -> Iterator[Figure]:
    """Many points against few."""
    with tempfile.TemporaryDirectory() as folder:
        told: list[tuple[int, int]] = []
        costs: list[Cost] = []
        for size in (few, millions):
            path = written(Path(folder) / f"{size:g}.copc.laz", size)
            found, cost = cost_of(lambda path=path: first_points(path), REPEATS)
            told.append(found)
            # the memory of the process is that of the writer
            costs.append(Cost(cost.wall, cost.processor))
    (points, size), (other, base) = told[1], told[0]
    words = f"{size / 1e3:.0f} kB for {points:,} points against {base / 1e3:.0f} for {other:,}"
    yield Figure(
        "first points", f"{millions:g} million", costs[1], f"{few:g} million", costs[0], words
    )


if __name__ == "__main__":
    run(measure, full=(100, 1), small=(0.4, 0.2))
