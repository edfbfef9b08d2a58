"""Many sweeps of a street from nothing: the pairs that are proposed against those that matter.

Sweeps every 5 m along a simulated street (that of the tests), so that the pairs that matter are
those of neighbours. In one run, on the same surfels: the pairs of neighbours alone, the proposed
pairs with the comparison of plans, and with a second size of 1 every pair.
"""

from collections.abc import Iterator
from itertools import pairwise as neighbours

import numpy as np
from tests.registration.clouds.streets import sweeps

from benchmarks.figures import Figure, cost_of, run
from tribrach.registration.clouds.pair import register_pair
from tribrach.registration.clouds.together import pairwise, settled

SEED = 32


def measure(count: float, every: float) -> Iterator[Figure]:
    """So many sweeps; all pairs besides where ``every`` is not zero."""
    scans, poses = sweeps(int(count), SEED)
    register_pair(scans[0], scans[1])  # compiled functions are loaded
    near, least = cost_of(lambda: [register_pair(a, b) for a, b in neighbours(scans)])
    pairs, proposed = cost_of(lambda: pairwise(scans))
    found = settled(scans, pairs)
    loops, group = found.consistency.loops, found.groups[0]
    first = poses[int(group.stations[0])]
    off = [
        np.linalg.norm(pose.translation - (first.inverse @ poses[int(name)]).translation)
        for name, pose in group.poses.items()
    ]
    told = (
        f"{len(pairs)} pairs tried, {len(group.stations)} of {count:.0f} joined, "
        f"{sum(loop.closes for loop in loops)} of {len(loops)} loops close, largest error "
        f"{1e3 * max(off):.2f} mm"
    )
    peer = f"the {len(near)} pairs of neighbours alone"
    size = f"{count:.0f} sweeps"
    yield Figure("registering by proposed pairs", size, proposed, peer, least, told)
    if every:
        _, cost = cost_of(lambda: pairwise(scans, choice="all"))
        yield Figure("registering by all pairs", size, cost, peer, least)


if __name__ == "__main__":
    run(measure, full=(16, 0), small=(4, 0))
