"""Placing points with their three sigmas: points per second beside the memory bandwidth.

The kernel reads 24 bytes and writes 36 bytes a point; a plain copy of the same memory is the
physical limit. Run: ``python benchmarks/point_covariance.py``.
"""

import time

import numpy as np

from tribrach.cloud.covariance import place_with_sigmas
from tribrach.cloud.placement import Placement
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise

POINTS = 4_000_000
REPEATS = 5
BYTES = 24 + 24 + 12


def best(work) -> float:
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    rng = np.random.default_rng(1)
    xyz = rng.normal(0, 20, (POINTS, 3))
    a = rng.normal(size=(6, 6)) * 1e-4
    noise = ScanNoise(1.2e-3, 1e-5, 4e-5, 4e-5, 4e-3, 3e-4)
    where = Placement("S1", Pose(np.eye(3), np.zeros(3)), a @ a.T, noise)
    place_with_sigmas(xyz[:1000], where)
    kernel = best(lambda: place_with_sigmas(xyz, where))
    source = np.zeros(POINTS * BYTES // 16)
    target = np.empty_like(source)
    copy = best(lambda: np.copyto(target, source))
    rate, moved = POINTS / kernel / 1e6, POINTS * BYTES / kernel / 1e9
    print(f"points with sigmas: {rate:.1f} million per second, {moved:.2f} GB/s of their data")
    print(f"memory bandwidth (copy, one thread): {2 * source.nbytes / copy / 1e9:.2f} GB/s")
    print(f"kernel over a copy of the same bytes: {kernel / copy:.1f} x")


if __name__ == "__main__":
    main()
