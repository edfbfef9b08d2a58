"""Relative poses of a project's stations from their clouds, found once and remembered.

A station's scans are one cloud. Pairs of one station share its errors, and so does everything else
that is taken from the same points: the covariances that enter the network say so.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log
from tribrach.job.approximate_poses import NO_POSES, ApproximatePoses
from tribrach.job.find_surfels import station_surfels
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.registration.clouds.graph import CloudEdge, consistent
from tribrach.registration.clouds.likeness import Walls, likeness
from tribrach.registration.clouds.pair import ApproximateSigma, CloudPair, register_pair
from tribrach.registration.clouds.prepared import PreparedScan
from tribrach.registration.clouds.proposals import (
    Choice,
    all_pairs,
    promise_of,
    try_all,
    try_proposed,
)
from tribrach.registration.pose_graph import Joint
from tribrach.statistics import chi2

__all__ = ["CloudPairs", "cloud_pairs", "contradicted", "observable"]


#: approximate poses may be wrong by this [m], [rad]; probability that a good edge contradicts them
_SLACK = np.repeat([0.05, 5e-3], 3)


_LEVEL = 1e-6


@dataclass(frozen=True, eq=False)
class CloudPairs:
    """Pairs of stations by their clouds.

    Parameters
    ----------
    edges
        Relative poses that the loops bear out.
    joints
        Those of them that hold all six directions.
    sentences
        What is weak and what was not used.
    obstacles
        By the names of two stations why they have no pose.
    """

    edges: tuple[CloudEdge, ...]
    joints: tuple[Joint, ...]
    sentences: tuple[str, ...]
    obstacles: Mapping[frozenset[str], str]


def cloud_pairs(
    scans: Sequence[StationScan],
    floor: tuple[float, float],
    state: Remembered,
    progress: Progress,
    known: ApproximatePoses = NO_POSES,
    choice: Choice = "proposed",
) -> CloudPairs:
    """Register the pairs of stations that are needed; those of unchanged scans are remembered.

    Parameters
    ----------
    scans
        Of all stations.
    floor
        Sigmas [m], [rad] of what residuals never show.
    state
        Where pairs are remembered.
    known
        Approximate poses by the names of the stations.
    choice
        ``proposed`` for the pairs that promise most, ``all`` for every pair.
    progress
        Called with what is being done.

    Raises
    ------
    InputError
        A scan whose scanner's place is not known, or without surfaces.
    """
    stations: dict[str, list[StationScan]] = {}
    for scan in scans:
        if not scan.origin_known:
            raise InputError(
                "it is not known where the scanner stood in these coordinates",
                file=scan.scan.path,
                record=scan.name,
                cure='say origin = "scanner" if it is at zero, or leave clouds out of registration',
            )
        stations.setdefault(scan.station, []).append(scan)
    clouds = _Clouds(stations, state, progress)
    names = list(stations)
    priors = known.poses
    found: dict[tuple[int, int], dict[str, Any]] = {}

    def attempt(a: str, b: str) -> tuple[CloudEdge | None, int]:
        prior = priors[a].inverse @ priors[b] if a in priors and b in priors else None
        facts = _facts(clouds, floor, state, a, b, prior, known.sigma)
        found[names.index(a), names.index(b)] = facts
        edge = _edge(a, b, facts)
        return edge, 0 if edge is None else int(facts["rank"])

    if all_pairs(len(names), choice):
        try_all(names, attempt, progress)
    else:
        alike, radii = _plans(clouds, state, progress)
        promise = promise_of(names, alike, radii, priors, known.sigma.shift)
        try_proposed(names, promise, radii, attempt, progress)
    edges, ranks = [], {}
    sentences: list[str] = []
    obstacles: dict[frozenset[str], str] = {}
    for (i, j), facts in sorted(found.items()):
        a, b = names[i], names[j]
        edge = _edge(a, b, facts)
        if edge is None:
            obstacles[frozenset((a, b))] = " ".join(facts["sentences"])
            continue
        edges.append(edge)
        ranks[edge.ends] = facts["rank"], facts["agree"]
        sentences += facts["sentences"]
    graph = consistent(edges)
    joints = tuple(
        Joint(e.first, e.second, e.pose, float(ranks[e.ends][1]))
        for e in graph.used
        if ranks[e.ends][0] == 6
    )
    sentences = [*known.sentences, *sentences, *graph.sentences]
    return CloudPairs(graph.used, joints, tuple(sentences), obstacles)


def observable(
    edges: Sequence[CloudEdge], stations: Mapping[str, Any], shared: float = 1.0
) -> list[CloudEdge]:
    """Edges between placed stations with the covariances that they have in one network.

    Errors of a scan enter all pairs that it is in. In a network of n stations with all pairs, each
    with the covariance C, pairs taken as independent would give relative poses with 2 C / n
    instead of C; so C is multiplied by (d_i + d_j + 2) / 4, d the pairs of either station, which
    is n / 2 there and 1 for a single pair. shared : further factor for points that speak elsewhere
    as well.
    """
    placed = [e for e in edges if e.first in stations and e.second in stations]
    degree = Counter(name for e in placed for name in e.ends)
    return [
        replace(e, covariance=e.covariance * shared * (degree[e.first] + degree[e.second] + 2) / 4)
        for e in placed
    ]


def contradicted(
    edges: Sequence[CloudEdge], poses: Mapping[str, Pose]
) -> list[tuple[CloudEdge, float]]:
    """Edges that poses of both stations contradict, and by how much [m].

    Directions that the clouds leave open contradict nothing. poses : approximate, world from
    scanner.
    """
    out = []
    limit = float(chi2.ppf(1 - _LEVEL, 6))
    for edge in edges:
        if edge.first not in poses or edge.second not in poses:
            continue
        between = poses[edge.first].inverse @ poses[edge.second]
        shift = edge.pose.translation - between.translation
        turn = log((between.rotation.T @ edge.pose.rotation)[None])[0]
        off = np.concatenate([shift, turn])
        if off @ np.linalg.solve(edge.covariance + np.diag(_SLACK**2), off) > limit:
            out.append((edge, float(np.linalg.norm(shift))))
    return out


class _Clouds:
    """Surfels of stations, made or read when the first of them is needed."""

    def __init__(
        self,
        stations: Mapping[str, Sequence[StationScan]],
        state: Remembered,
        progress: Progress,
    ) -> None:
        self.stations, self._state, self._progress = stations, state, progress

    def __getitem__(self, name: str) -> PreparedScan:
        return self._all[name]

    @cached_property
    def _all(self) -> dict[str, PreparedScan]:
        return station_surfels(self.stations, self._state, self._progress)


def _edge(a: str, b: str, facts: Mapping[str, Any]) -> CloudEdge | None:
    """The relative pose of a pair, None if none was taken."""
    if facts["pose"] is None:
        return None
    pose = Pose.from_matrix(np.array(facts["pose"]))
    return CloudEdge(a, b, pose, np.array(facts["covariance"]))


def _plans(
    clouds: _Clouds, state: Remembered, progress: Progress
) -> tuple[Array, dict[str, float]]:
    """Likeness (n, n) of plans and reaches [m] by station, from the last run if they hold."""
    names = list(clouds.stations)
    sources = [(name, [s.scan for s in clouds.stations[name]]) for name in names]
    key = state.key(_plans, sources)
    facts = state.recall("clouds-plans", key)
    if facts is None:
        made = [clouds[name] for name in names]
        alike = likeness([Walls.of(scan) for scan in made], progress)
        facts = {"alike": alike.tolist(), "radii": {cloud.name: cloud.radius for cloud in made}}
        state.remember("clouds-plans", key, facts)
    return np.array(facts["alike"]), facts["radii"]


def _facts(
    clouds: _Clouds,
    floor: tuple[float, float],
    state: Remembered,
    a: str,
    b: str,
    prior: Pose | None,
    sigma: ApproximateSigma,
) -> dict[str, Any]:
    """What became of a pair, from the last run if nothing changed."""
    sources = [(name, [s.scan for s in clouds.stations[name]]) for name in (a, b)]
    key = state.key(_facts, sources, floor, None if prior is None else (prior.matrix, sigma))
    product = f"clouds-{a}-{b}"
    known = state.recall(product, key)
    if known is not None:
        return known
    facts = _to_facts(register_pair(clouds[a], clouds[b], prior, sigma=sigma, floor=floor))
    state.remember(product, key, facts)
    return facts


def _to_facts(pair: CloudPair) -> dict[str, Any]:
    """A pair as plain numbers."""
    fit = pair.fit
    if fit is None:
        return {"pose": None, "sentences": list(pair.sentences)}
    return {
        "pose": fit.pose.matrix.tolist(),
        "covariance": fit.precision.covariance.tolist(),
        "rank": fit.precision.rank,
        "agree": float(fit.verdict.agree),
        "sentences": list(pair.sentences),
    }
