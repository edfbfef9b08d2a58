"""A simulated street with houses, cars and poles, and the sweeps of a scanner that drives along."""

import numpy as np

from tests.registration.clouds.scenes import NOISE
from tribrach.geometry.pose import Pose
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.simulate.scanner import ScanGrid, Scanner, scan
from tribrach.simulate.scene import Primitive, Scene, box, cylinder, ground
from tribrach.simulate.setups import levelled
from tribrach.units import SEC

#: zenith angles of a sweep
_V = (np.radians(75.0), np.radians(115.0))


def street(seed: int, length: float) -> Scene:
    """Houses of all sizes on both sides of a straight street, some with gaps between them."""
    rng = np.random.default_rng(seed)
    parts: list[Primitive] = [ground((0, 0, 0), 300)]
    for side in (-1, 1):
        x = -40.0
        while x < length + 40:
            width, depth, height = rng.uniform((6, 6, 4), (16, 10, 12))
            y = side * (rng.uniform(7, 11) + depth / 2)
            turn = rng.normal(0, 0.02)
            parts.append(box((x + width / 2, y, height / 2), (width, depth, height), 0.5, turn))
            x += width + (rng.uniform(1, 6) if rng.random() < 0.5 else 0.0)
        for place in np.arange(-40, length + 40, 7.0):
            if rng.random() < 0.6:
                at = (place + rng.uniform(-1.5, 1.5), side * rng.uniform(4.2, 5), 0.75)
                parts.append(box(at, (4.2, 1.8, 1.5), 0.4, rng.normal(0, 0.03)))
            if rng.random() < 0.4:
                parts.append(cylinder((place, side * rng.uniform(5.5, 6.5), 2.5), 0.12, 5, 0.35))
    return Scene.of(parts)


def sweeps(
    count: int, seed: int, *, step: float = 5.0, points: int = 60_000
) -> tuple[list[PreparedScan], list[Pose]]:
    """Sweeps ``000000``, ``000001``, ... every few metres along the street, and true poses."""
    scene, rng = street(seed, step * count), np.random.default_rng(seed + 1)
    scanner, grid = Scanner(NOISE, farthest=80), ScanGrid.panorama(_V, points)
    scans, poses = [], []
    for k in range(count):
        place = (step * k, rng.normal(0, 0.3), 1.73)
        pose = levelled(place, rng.normal(0, 0.05), 10 * SEC, rng)
        blocks = scan(scene, pose, scanner, grid, 100 * seed + k)
        scans.append(prepare(f"{k:06d}", [np.concatenate([block.xyz for block in blocks])]))
        poses.append(pose)
    return scans, poses
