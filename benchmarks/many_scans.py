"""Many sweeps of a street from nothing: the pairs that are proposed against those that matter.

Sweeps every 5 m along a simulated street (that of the tests), so that the pairs that matter are
those of neighbours. In one run, on the same surfels: the pairs of neighbours alone, the proposed
pairs with the comparison of plans, and with ``all`` every pair.
Run: ``python benchmarks/many_scans.py [sweeps, 16] [all]``.
"""

import sys
import time
from collections.abc import Callable
from itertools import pairwise as neighbours
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.registration.clouds.streets import sweeps

from tribrach.registration.clouds.pair import CloudPair, register_pair
from tribrach.registration.clouds.together import pairwise, settled

SEED = 32


def timed(what: str, work: Callable[[], list[CloudPair]]) -> tuple[list[CloudPair], float]:
    """Pairs and their seconds of the processor."""
    start = time.process_time()
    pairs = work()
    spent = time.process_time() - start
    taken = sum(p.fit is not None for p in pairs)
    print(f"{what}: {len(pairs)} pairs tried, {taken} registered, {spent:.1f} s")
    return pairs, spent


def main() -> None:
    """Everything, from the arguments."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 16
    start = time.process_time()
    scans, poses = sweeps(count, SEED)
    print(f"{count} sweeps simulated and prepared in {time.process_time() - start:.1f} s")
    register_pair(scans[0], scans[1])  # compiled functions are loaded
    _, least = timed("neighbours", lambda: [register_pair(a, b) for a, b in neighbours(scans)])
    pairs, proposed = timed("proposed", lambda: pairwise(scans))
    print(f"proposed over neighbours {proposed / least:.2f}")
    if "all" in sys.argv:
        _, every = timed("all", lambda: pairwise(scans, choice="all"))
        print(f"all over neighbours {every / least:.2f}")
    found = settled(scans, pairs)
    loops, group = found.consistency.loops, found.groups[0]
    first = poses[int(group.stations[0])]
    off = [
        np.linalg.norm(pose.translation - (first.inverse @ poses[int(name)]).translation)
        for name, pose in group.poses.items()
    ]
    print(
        f"{len(group.stations)} of {count} joined, {sum(loop.closes for loop in loops)} of "
        f"{len(loops)} loops close, largest error {1e3 * max(off):.2f} mm"
    )


if __name__ == "__main__":
    main()
