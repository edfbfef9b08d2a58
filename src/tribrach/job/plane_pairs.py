"""Relative poses of pairs of stations from their planes, found once and remembered."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tribrach.geometry.pose import Pose
from tribrach.job.state import Remembered
from tribrach.registration.planes.poses import PairPoses, PlanePose, pair_poses
from tribrach.registration.views import Agreement, Surroundings

__all__ = ["remembered_pairs"]


def remembered_pairs(state: Remembered) -> Callable[[Surroundings, Surroundings], PairPoses]:
    """What finds the poses of a pair, or recalls them where both stations are as they were.

    Parameters
    ----------
    state
        Where pairs are remembered.

    Returns
    -------
    callable
        The possible poses of two stations of the project.
    """
    marks: dict[str, str] = {}

    def mark(station: Surroundings) -> str:
        if station.name not in marks:
            marks[station.name] = state.key(Surroundings, station)
        return marks[station.name]

    def pair(first: Surroundings, second: Surroundings) -> PairPoses:
        key = state.key(pair_poses, mark(first), mark(second))
        product = f"planes-{first.name}-{second.name}"
        facts = state.recall(product, key)
        if facts is None:
            facts = _to_facts(pair_poses(first, second))
            state.remember(product, key, facts)
        return _from_facts(facts)

    return pair


def _to_facts(pair: PairPoses) -> dict[str, Any]:
    """A pair as plain numbers."""
    return {
        "first": pair.first,
        "second": pair.second,
        "poses": [
            {
                "rotation": one.pose.rotation.tolist(),
                "translation": one.pose.translation.tolist(),
                "pairs": one.pairs.tolist(),
                "rms": one.rms,
                "seen": [getattr(one.seen, name) for name in _SEEN],
                "overlap": one.overlap,
                "open": one.open.tolist(),
            }
            for one in pair.poses
        ],
        "open": pair.open.tolist(),
        "lacking": pair.lacking,
    }


#: counts of an agreement, in the order of its fields
_SEEN = ("agree", "hidden", "through", "sky", "outside")


def _from_facts(facts: dict[str, Any]) -> PairPoses:
    """The pair of remembered numbers."""
    poses = tuple(
        PlanePose(
            Pose(np.array(one["rotation"]), np.array(one["translation"])),
            np.array(one["pairs"], dtype=np.int64).reshape(-1, 2),
            one["rms"],
            Agreement(*one["seen"]),
            one["overlap"],
            np.array(one["open"], dtype=np.float64).reshape(-1, 3),
        )
        for one in facts["poses"]
    )
    lacking = np.array(facts["open"], dtype=np.float64).reshape(-1, 3)
    return PairPoses(facts["first"], facts["second"], poses, lacking, facts["lacking"])
