"""Halls and streets with surfaces of many reflectances, and things in them that are no planes."""

import numpy as np

from tribrach.geometry.pose import Pose
from tribrach.scan.observed_noise import ObservedNoise, patch_residuals
from tribrach.simulate import scene as sc
from tribrach.simulate.scanner import ScanGrid, Scanner, scan


def hall(seed: int, leaves: int = 250) -> sc.Scene:
    """Walls in panels of several reflectances at 4 to 45 m, ground, pillars, spheres, leaves."""
    rng = np.random.default_rng(seed)
    things = [
        sc.ground((0, 0, -1.7), 120, 0.35),
        sc.rectangle((0, 0, 6.0), (0, 0, -1), 14, 12, 0.7),
    ]
    for away, normal in ((7, (-1, 0)), (-25, (1, 0)), (4, (0, -1)), (-45, (0, 1))):
        n = np.array([*normal, 0.0])
        beside = np.array([-n[1], n[0], 0.0])
        for k, reflectance in enumerate(rng.permutation([0.05, 0.1, 0.2, 0.35, 0.5, 0.8])):
            wide = 1.2 * abs(away) / 2
            middle = -n * abs(away) + beside * (k - 2.5) * wide + [0, 0, 1.0]
            things.append(sc.rectangle(middle, n, wide, 8.0, reflectance))
    for _ in range(6):
        x, y = rng.uniform(-6, 6, 2)
        if np.hypot(x, y) > 2:
            things.append(sc.cylinder((x, y, 0), rng.uniform(0.1, 0.4), 4, rng.uniform(0.1, 0.8)))
            things.append(sc.sphere((y, x, 0.2), rng.uniform(0.1, 0.3), rng.uniform(0.2, 0.8)))
    for _ in range(leaves):
        at = np.array([*rng.uniform(-10, 10, 2), rng.uniform(-1.7, 3)])
        if np.linalg.norm(at) > 1.5:
            size, turned = rng.uniform(0.02, 0.12, 2), rng.normal(size=3)
            things.append(sc.rectangle(at, turned, *size, rng.uniform(0.1, 0.6)))
    return sc.Scene.of(things)


def simulated(
    scanner: Scanner, seed: int, points: int = 400_000, leaves: int = 250, grid: bool = True
) -> ObservedNoise:
    """Patches of a scan of a hall."""
    parts = list(
        scan(
            hall(seed, leaves),
            Pose(np.eye(3), np.zeros(3)),
            scanner,
            ScanGrid.panorama((0.4, 2.5), points),
            seed,
        )
    )
    xyz = np.concatenate([p.xyz for p in parts])
    light, row, column = (
        np.concatenate([getattr(p, n) for p in parts]) for n in ("intensity", "row", "column")
    )
    return patch_residuals(xyz, light, row if grid else None, column if grid else None)
