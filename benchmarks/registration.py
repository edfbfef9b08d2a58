"""Ten scans from nothing, step by step; and the fit alone against small_gicp.

Stations in a courtyard among houses, one million points each unless told otherwise, without
approximate poses. Every step has its seconds by the clock and of the processor, its share, and the
peak memory after it; errors are against the truth. Then one pair is fitted from 3 cm and 0.1
degrees off on the same thinned clouds: by small_gicp (point to plane, `pip install
tribrach[peers]`) with its normals and trees ready, and with them included, and by ours with its
trees included: its normals come with the thinning.
Run: ``python benchmarks/registration.py [millions of points, 1] [stations, 10]``.
"""

import resource
import sys
import time
from collections.abc import Callable

import numpy as np

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
FINE = 0.1
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


def peak() -> float:
    """Peak memory [MB] of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


class Clock:
    """Seconds of steps."""

    def __init__(self) -> None:
        self.steps: dict[str, list[float]] = {}

    def run(self, step: str, work: Callable[[], object]) -> object:
        """Do something and add its time."""
        wall, cpu = time.perf_counter(), time.process_time()
        out = work()
        spent = self.steps.setdefault(step, [0.0, 0.0])
        spent[0] += time.perf_counter() - wall
        spent[1] += time.process_time() - cpu
        return out

    def show(self, steps: list[str]) -> None:
        """A line for each step, and the sum."""
        total = sum(self.steps[s][0] for s in steps)
        for step in steps:
            wall, cpu = self.steps[step]
            print(f"{step}: {wall:.1f} s ({cpu:.1f} s of the processors), {wall / total:.0%}")
        print(f"together {total:.1f} s, peak memory {peak():.0f} MB")


def registered(millions: float, count: int) -> tuple[list[PreparedScan], list[Pose]]:
    """All stations from nothing."""
    scene, poses, clock = site(), stations(count), Clock()
    scanner, grid = Scanner(NOISE), ScanGrid.panorama((0.7, 2.4), int(millions * 1.25e6))
    scans: list[PreparedScan] = []
    points = 0
    for k, pose in enumerate(poses):
        blocks = clock.run(
            "simulation", lambda p=pose, k=k: [b.xyz for b in scan(scene, p, scanner, grid, k)]
        )
        points += sum(map(len, blocks))  # type: ignore[arg-type]
        scans.append(clock.run("surfels and views", lambda b=blocks, k=k: prepare(f"S{k}", b)))  # type: ignore[arg-type]
    print(f"{count} scans of {points / count / 1e6:.2f} million points")
    pairs = clock.run("pairs: search, fit, covariance", lambda: pairwise(scans))
    found = clock.run("loops and adjustment", lambda: settled(scans, pairs))  # type: ignore[arg-type]
    clock.show(["surfels and views", "pairs: search, fit, covariance", "loops and adjustment"])
    group = found.groups[0]  # type: ignore[attr-defined]
    taken = sum(p.fit is not None for p in pairs)  # type: ignore[attr-defined]
    loops = found.consistency.loops  # type: ignore[attr-defined]
    print(
        f"{taken} of {len(pairs)} pairs registered, {len(group.poses)} stations joined, "  # type: ignore[arg-type]
        f"{sum(loop.closes for loop in loops)} of {len(loops)} loops close"
    )
    origin = poses[int(group.stations[0][1:])]
    off = [origin.inverse @ poses[int(n[1:])] for n in group.stations]
    both = zip(group.stations, off, strict=True)
    worst = max(np.linalg.norm(group.poses[n].translation - p.translation) for n, p in both)
    print(f"largest error of a station {1e3 * worst:.2f} mm")
    return scans, poses


def fitted(scans: list[PreparedScan], poses: list[Pose]) -> None:
    """One pair, the fit alone, on the same thinned clouds."""
    true = poses[0].inverse @ poses[1]
    start = Pose(exp(np.array([3e-4, -2e-4, 1.7e-3])) @ true.rotation, true.translation + 0.02)
    a, b = (s.fine.surfels for s in scans[:2])
    best: dict[str, tuple[float, str]] = {}

    def ours() -> Pose:
        return align(Indexed.of(a), Indexed.of(b), start).pose

    def prepared() -> list[object]:
        return [small_gicp.preprocess_points(np.asarray(s.center), 1e-3, 10, 2) for s in (a, b)]

    known = prepared() if small_gicp is not None else []

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

    ways: dict[str, Callable[[], Pose]] = {"ours": ours}
    if small_gicp is not None:
        ways["small_gicp"] = lambda: theirs(known)
        ways["small_gicp with normals and trees"] = lambda: theirs(prepared())
    for way in list(ways) * REPEATS:
        begin = time.perf_counter()
        pose = ways[way]()
        spent = time.perf_counter() - begin
        shift = 1e3 * np.linalg.norm(pose.translation - true.translation)
        turn = np.linalg.norm(log(pose.rotation @ true.rotation.T)) / SEC
        if way not in best or spent < best[way][0]:
            best[way] = (spent, f"error {shift:.3f} mm, {turn:.1f} arcsec")
    print(f"fit of {len(a)} and {len(b)} surfels:")
    for way, (spent, words) in best.items():
        print(f"{way}: {spent:.2f} s, {words}")
    for way in list(ways)[1:]:
        print(f"ours over {way}: {best['ours'][0] / best[way][0]:.2f}")
    if small_gicp is None:
        print("small_gicp is not installed: no ratio")


def main() -> None:
    arguments = sys.argv[1:]
    millions = float(arguments[0]) if arguments else 1.0
    fitted(*registered(millions, int(arguments[1]) if len(arguments) > 1 else 10))


if __name__ == "__main__":
    main()
