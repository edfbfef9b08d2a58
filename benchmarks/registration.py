"""Ten scans from nothing, step by step; and the fit alone against small_gicp.

Stations in a courtyard among houses, one million points each unless told otherwise, without
approximate poses; errors are against the truth. Then one pair is fitted from 3 cm and 0.1 degrees
off on the same thinned clouds: by small_gicp (point to plane, `pip install tribrach[peers]`) with
its normals and trees ready, and with them included, and by ours with its trees included: its
normals come with the thinning.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.figures import Cost, Figure, cost_of, run
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp, log
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.registration.clouds.fine import Indexed, align
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.registration.clouds.together import pairwise, settled
from tribrach.simulate.scanner import ScanGrid, Scanner, scan
from tribrach.simulate.scene import Scene, box, cylinder, ground
from tribrach.simulate.setups import levelled
from tribrach.units import SEC

try:
    import small_gicp
except ImportError:
    small_gicp = None

NOISE = ScanNoise(0.001, 1e-5, 10 * SEC, 10 * SEC, 0.00225, 0.00019)
#: repeats of the fit, the best counts
REPEATS = 5


def site() -> Scene:
    """A courtyard of houses of different sizes, and what stands in it."""
    rng = np.random.default_rng(5)
    parts = [ground((0, 0, 0), 300)]
    for k in range(12):
        turn = 2 * np.pi * k / 12
        place = (38 * np.cos(turn), 26 * np.sin(turn))
        size = rng.uniform((8, 6, 5), (16, 11, 14))
        heading = turn + rng.normal(0, 0.1)
        parts.append(box((*place, size[2] / 2), size, 0.5, heading))
    for x, y in rng.uniform((-20, -13), (20, 13), (14, 2)):
        height = rng.uniform(1, 4)
        if height > 2.5:
            parts.append(cylinder((x, y, height / 2), 0.15, height, 0.35))
        else:
            size = (*rng.uniform(0.5, 2.0, 2), height)
            parts.append(box((x, y, height / 2), size, 0.4, rng.uniform(0, 3)))
    return Scene.of(parts)


def stations(count: int) -> list[Pose]:
    """Levelled scanners on two rows through the yard."""
    rng = np.random.default_rng(6)
    places = [(-18 + 9 * (k // 2) % 45, 5.5 - 11 * (k % 2), 1.7) for k in range(count)]
    moved = np.array(places) + rng.normal(0, 0.8, (count, 3)) * [1, 1, 0.05]
    return [levelled(p, rng.uniform(-3, 3), 10 * SEC, rng) for p in moved]


def registered(millions: float, count: int) -> tuple[list[Figure], list[PreparedScan], list[Pose]]:
    """All stations from nothing; steps against reading every point once."""
    scene, poses = site(), stations(count)
    scanner, grid = Scanner(NOISE), ScanGrid.panorama((0.7, 2.4), int(millions * 1.25e6))
    scans: list[PreparedScan] = []
    made, limit, points = [], [], 0
    for k, pose in enumerate(poses):
        blocks = [b.xyz for b in scan(scene, pose, scanner, grid, k)]
        points += sum(map(len, blocks))
        one, cost = cost_of(lambda b=blocks, k=k: prepare(f"S{k}", b))
        scans.append(one)
        made.append(cost)
        xyz = np.concatenate(blocks)
        limit.append(cost_of(lambda x=xyz: np.linalg.norm(x, axis=1).sum())[1])
    pairs, searching = cost_of(lambda: pairwise(scans))
    found, settling = cost_of(lambda: settled(scans, pairs))
    group, loops = found.groups[0], found.consistency.loops
    taken = sum(p.fit is not None for p in pairs)
    origin = poses[int(group.stations[0][1:])]
    off = [origin.inverse @ poses[int(n[1:])] for n in group.stations]
    both = zip(group.stations, off, strict=True)
    worst = max(np.linalg.norm(group.poses[n].translation - p.translation) for n, p in both)
    told = (
        f"{taken} of {len(pairs)} pairs registered, {len(group.poses)} stations joined, "
        f"{sum(loop.closes for loop in loops)} of {len(loops)} loops close, largest error of a "
        f"station {1e3 * worst:.2f} mm"
    )
    size = f"{count} scans of {points / count / 1e6:.2f} million points"
    peer = "the ranges of all points by numpy"
    base = summed(limit)
    steps = {
        "surfels and views": summed(made),
        "pairs: search, fit, covariance": searching,
        "loops and adjustment": settling,
    }
    figures = [Figure(f"stations by clouds: {k}", size, v, peer, base) for k, v in steps.items()]
    whole = summed(list(steps.values()))
    figures.append(Figure("stations by clouds: together", size, whole, peer, base, told))
    return figures, scans, poses


def summed(costs: list[Cost]) -> Cost:
    """Costs of several pieces together."""
    return Cost(
        sum(cost.wall for cost in costs),
        sum(cost.processor for cost in costs),
        max(cost.memory or 0.0 for cost in costs),
    )


def fitted(scans: list[PreparedScan], poses: list[Pose]) -> Iterator[Figure]:
    """One pair, the fit alone, on the same thinned clouds."""
    true = poses[0].inverse @ poses[1]
    start = Pose(exp(np.array([3e-4, -2e-4, 1.7e-3])) @ true.rotation, true.translation + 0.02)
    a, b = (s.fine.surfels for s in scans[:2])

    def error(pose: Pose) -> str:
        shift = 1e3 * np.linalg.norm(pose.translation - true.translation)
        turn = np.linalg.norm(log(pose.rotation @ true.rotation.T)) / SEC
        return f"error {shift:.3f} mm, {turn:.1f} arcsec"

    def ours() -> Pose:
        return align(Indexed.of(a), Indexed.of(b), start).pose

    def prepared() -> list[object]:
        return [small_gicp.preprocess_points(np.asarray(s.center), 1e-3, 10, 2) for s in (a, b)]

    def theirs(ready: list[object]) -> Pose:
        found = small_gicp.align(
            ready[0][0],
            ready[1][0],
            ready[0][1],
            start.matrix,
            "PLANE_ICP",
            max_correspondence_distance=0.2,
            num_threads=2,
            max_iterations=50,
            rotation_epsilon=1e-7,
            translation_epsilon=1e-6,
        )
        return Pose(found.T_target_source[:3, :3], found.T_target_source[:3, 3])

    pose, cost = cost_of(ours, REPEATS)
    what, size = "fit of two clouds, trees included", f"{len(a)} and {len(b)} surfels"
    peers = ("small_gicp, its normals and trees ready", "small_gicp with its normals and trees")
    if small_gicp is None:
        yield from (Figure(what, size, cost, peer, None, error(pose)) for peer in peers)
        return
    known = prepared()
    ways = (lambda: theirs(known), lambda: theirs(prepared()))
    for peer, way in zip(peers, ways, strict=True):
        other, spent = cost_of(way, REPEATS)
        told = f"{error(pose)}; the peer {error(other)}"
        yield Figure(what, size, cost, peer, spent, told)


def measure(millions: float, count: float) -> Iterator[Figure]:
    """So many stations of so many million points."""
    _, scans, poses = registered(0.02, 2)  # compiled code is loaded
    list(fitted(scans, poses))
    figures, scans, poses = registered(millions, int(count))
    yield from figures
    yield from fitted(scans, poses)


if __name__ == "__main__":
    run(measure, full=(1, 10), small=(0.1, 3))
