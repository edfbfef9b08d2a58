"""Placing points with their three sigmas: points per second beside the memory bandwidth.

The kernel reads 24 bytes and writes 36 bytes a point; a plain copy of the same memory is the
physical limit.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.figures import Figure, cost_of, run
from tribrach.cloud.covariance import place_with_sigmas
from tribrach.cloud.placement import Placement
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise

BYTES = 24 + 24 + 12


def measure(millions: float) -> Iterator[Figure]:
    """The kernel beside a copy."""
    points = int(millions * 1e6)
    rng = np.random.default_rng(1)
    xyz = rng.normal(0, 20, (points, 3))
    a = rng.normal(size=(6, 6)) * 1e-4
    noise = ScanNoise(1.2e-3, 1e-5, 4e-5, 4e-5, 4e-3, 3e-4)
    where = Placement("S1", Pose(np.eye(3), np.zeros(3)), a @ a.T, noise)
    place_with_sigmas(xyz[:1000], where)
    _, kernel = cost_of(lambda: place_with_sigmas(xyz, where), 5)
    source = np.zeros(points * BYTES // 16)
    target = np.empty_like(source)
    _, copy = cost_of(lambda: np.copyto(target, source), 5)
    told = f"{millions / kernel.wall:.1f} million points a second"
    size = f"{millions:g} million points"
    peer = "a copy of the same bytes, one thread"
    yield Figure("placing points with their three sigmas", size, kernel, peer, copy, told)


if __name__ == "__main__":
    run(measure, full=(4,), small=(1,))
