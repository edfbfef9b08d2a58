"""M3C2 at 100,000 core points beside py4dgeo's, on the same clouds with the same radii.

Two clouds of a wavy facade in scan order, 3 mm of noise, the second 10 mm before the first. Both
programs start from arrays in memory, build their own search structure, find the normals and the
distances, with two threads each; they take turns, and the best of each counts. The depth is an odd
number of radii: py4dgeo cuts its cylinders into pieces of a radius, and for an even number counts a
core point that is itself in the cloud twice, or not at all, where two pieces meet.
"""

import logging
import os
from collections.abc import Iterator

import numba
import numpy as np

from benchmarks.figures import Cost, Figure, cost_of, least, run
from tribrach.comparison.cloud_parts import whole
from tribrach.comparison.m3c2 import M3C2Settings, m3c2

try:
    import py4dgeo
except ModuleNotFoundError:
    py4dgeo = None

CORES, REPEATS, THREADS = 100_000, 3, 2
SCALE, DIAMETER, DEPTH = 0.2, 0.1, 0.15
TOWARDS = np.array([0.0, -1.0, 0.0])


def facade(rng, n: int, offset: float) -> np.ndarray:
    """Points (n, 3) of 20 m by 10 m, column after column."""
    rows = int(np.sqrt(n / 2))
    x, z = np.meshgrid(np.linspace(0, 20, n // rows), np.linspace(0, 10, rows), indexing="ij")
    x, z = (v.ravel() + 1e-3 * rng.normal(size=v.size) for v in (x, z))
    y = 0.2 * np.sin(x / 2) - offset + 3e-3 * rng.normal(size=x.size)
    return np.stack([x, y, z], axis=1)


def ours(a, b, core):
    settings = M3C2Settings([SCALE], DIAMETER, DEPTH, direction=TOWARDS)
    found = m3c2(whole(a), whole(b), core, settings)
    return found.distance, found.lod95, found.first.count


def theirs(a, b, core):
    peer = py4dgeo.M3C2(
        epochs=(py4dgeo.Epoch(a), py4dgeo.Epoch(b)),
        corepoints=core,
        cyl_radius=DIAMETER / 2,
        normal_radii=[SCALE / 2],
        max_distance=DEPTH,
        orientation_vector=TOWARDS,
    )
    distance, uncertainty = peer.run()
    return distance, uncertainty["lodetection"], uncertainty["num_samples1"]


def measure(millions: float) -> Iterator[Figure]:
    """Both by turns; the least of each."""
    rng = np.random.default_rng(1)
    points = int(millions * 1e6)
    a, b = facade(rng, points, 0.0), facade(rng, points, 0.01)
    core = a[np.sort(rng.choice(len(a), min(CORES, len(a) // 4), replace=False))]
    size = f"{len(a) / 1e6:.1f} million points twice, {len(core)} core points"
    peer, told, spent = "py4dgeo", "", None
    numba.set_num_threads(THREADS)
    ours(a[:5000], b[:5000], core[:200])
    if py4dgeo is None:
        _, cost = cost_of(lambda: ours(a, b, core), REPEATS)
        yield Figure("M3C2 with normals", size, cost, peer, spent)
        return
    py4dgeo.set_py4dgeo_logfile(os.devnull)
    logging.getLogger("py4dgeo").setLevel(logging.WARNING)
    py4dgeo.set_num_threads(THREADS)
    costs: dict[str, list[Cost]] = {"ours": [], "theirs": []}
    found = {}
    for _ in range(REPEATS):
        for name, way in (("ours", ours), ("theirs", theirs)):
            found[name], cost = cost_of(lambda way=way: way(a, b, core))
            costs[name].append(cost)
    apart = [np.nanmax(np.abs(x - y)) for x, y in zip(found["ours"], found["theirs"], strict=True)]
    told = f"distances apart by {apart[0]:.1e} m, levels of detection by {apart[1]:.1e} m at most; "
    same = np.array_equal(found["ours"][2], found["theirs"][2])
    told += f"points of every cylinder {'the same' if same else 'not the same'}"
    own, peers = least(costs["ours"]), least(costs["theirs"])
    yield Figure("M3C2 with normals", size, own, peer, peers, told)


if __name__ == "__main__":
    run(measure, full=(2,), small=(0.2,))
