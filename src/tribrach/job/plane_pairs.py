"""Relative poses of pairs of stations from their planes, found once and remembered."""

from __future__ import annotations

from collections.abc import Callable

from tribrach.job.state import Remembered
from tribrach.registration.planes.poses import PairPoses, pair_poses
from tribrach.registration.views import Surroundings


def remembered_pairs(state: Remembered) -> Callable[[Surroundings, Surroundings], PairPoses]:
    """What finds the poses of a pair, or recalls them where both stations are as they were."""
    marks: dict[str, str] = {}

    def mark(station: Surroundings) -> str:
        if station.name not in marks:
            marks[station.name] = state.key(Surroundings, station)
        return marks[station.name]

    def pair(first: Surroundings, second: Surroundings) -> PairPoses:
        key = state.key(pair_poses, mark(first), mark(second))
        product = f"planes-{first.name}-{second.name}"
        return state.once(product, key, PairPoses, lambda: pair_poses(first, second))

    return pair
