"""Relative poses of a project's stations from their clouds, found once and remembered.

A station's scans are one cloud. Pairs of one station share its errors, and so does everything else
that is taken from the same points: the covariances that enter the network say so.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log
from tribrach.job.approximate_poses import NO_POSES, ApproximatePoses
from tribrach.job.each import Item, each
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.registration.alternatives import (
    APPROXIMATE,
    ApproximateSigma,
    OpenPair,
    Witnesses,
)
from tribrach.registration.clouds.graph import CloudEdge, consistent, decided_by_loops
from tribrach.registration.clouds.likeness import Walls, likeness
from tribrach.registration.clouds.pair import CloudPair, register_pair
from tribrach.registration.clouds.prepared import PreparedScan, SurfacesOfScan, surfaces
from tribrach.registration.clouds.proposals import (
    Choice,
    all_pairs,
    promise_of,
    try_all,
    try_proposed,
)
from tribrach.registration.pose_graph import Joint
from tribrach.scan.scan import Scan
from tribrach.sentences import joined
from tribrach.statistics import chi2


def station_surfels(
    stations: Mapping[str, Sequence[StationScan]], state: Remembered, progress: Progress
) -> dict[str, PreparedScan]:
    """Prepare every station for registration; those of unchanged scans come from the last run."""
    items = [
        Item(
            f"surfels-{name}",
            f"surfels of {name}",
            (name, [(scan.name, scan.scan) for scan in scans]),
            source=scans[0].scan.path,
            cost=sum(scan.scan.records or 0 for scan in scans),
        )
        for name, scans in stations.items()
    ]
    made = each(_of_station, items, state=state, progress=progress)
    return {name: found.indexed(name) for name, found in zip(stations, made, strict=True)}


def _of_station(
    name: str, scans: Sequence[tuple[str, Scan]], *, progress: Progress
) -> SurfacesOfScan:
    """The surfels and the view of a station, whose search trees are for the caller."""
    return surfaces(name, _points(scans, progress))


def _points(scans: Sequence[tuple[str, Scan]], progress: Progress) -> Iterator[Array]:
    for name, scan in scans:
        done = 0
        for chunk in scan.chunks():
            done += len(chunk)
            progress(f"points of {name}", done, scan.records)
            yield chunk.xyz


#: approximate poses may be wrong by this [m], [rad]; probability that a good edge contradicts them
_SLACK = np.repeat([0.05, 5e-3], 3)
_LEVEL = 1e-6


@dataclass(frozen=True, eq=False)
class CloudPairs:
    """Pairs of stations by their clouds."""

    edges: tuple[CloudEdge, ...]  #: relative poses that the loops bear out
    joints: tuple[Joint, ...]  #: those of them that hold all six directions
    sentences: tuple[str, ...]  #: what is weak and what was not used
    obstacles: Mapping[frozenset[str], str]  #: by the names of two stations why they have no pose
    open: tuple[OpenPair, ...] = ()  #: pairs that lie at one of several places


def cloud_pairs(
    clouds: StationSurfels,
    floor: tuple[float, float],
    state: Remembered,
    progress: Progress,
    known: ApproximatePoses = NO_POSES,
    choice: Choice = "proposed",
    witnesses: Witnesses | None = None,
) -> CloudPairs:
    """Register the pairs that are needed, or remember them; ``floor``: least sigmas [m], [rad]."""
    names = list(clouds.stations)
    priors = known.poses
    found: dict[tuple[int, int], _Tried] = {}

    def attempt(a: str, b: str) -> tuple[CloudEdge | None, int]:
        prior = priors[a].inverse @ priors[b] if a in priors and b in priors else None
        tried = _tried(clouds, floor, state, a, b, prior, known.sigma)
        found[names.index(a), names.index(b)] = tried
        return tried.edge, tried.rank

    if all_pairs(len(names), choice):
        try_all(names, attempt, progress)
    else:
        plans = _plans(clouds, state, progress)
        promise = promise_of(names, plans.alike, plans.radii, priors, known.sigma.shift)
        try_proposed(names, promise, plans.radii, attempt, progress)
    _decide(found, clouds, floor, state, witnesses or Witnesses())
    edges, ranks = [], {}
    sentences: list[str] = []
    obstacles: dict[frozenset[str], str] = {}
    for i, j in sorted(found):
        tried = found[i, j]
        if tried.edge is None:
            obstacles[frozenset((names[i], names[j]))] = joined(" ", tried.sentences)
            continue
        edges.append(tried.edge)
        ranks[tried.edge.ends] = tried.rank, tried.agree
        sentences += tried.sentences
    graph = consistent(edges)
    joints = tuple(
        Joint(e.first, e.second, e.pose, float(ranks[e.ends][1]))
        for e in graph.used
        if ranks[e.ends][0] == 6
    )
    sentences = [*known.sentences, *sentences, *graph.sentences]
    open_ = tuple(_open(names, ends, found[ends]) for ends in sorted(found) if found[ends].places)
    return CloudPairs(graph.used, joints, tuple(sentences), obstacles, open_)


def _open(names: Sequence[str], ends: tuple[int, int], tried: _Tried) -> OpenPair:
    """The places of a pair of stations of these numbers."""
    return OpenPair(names[ends[0]], names[ends[1]], tried.places)


def _decide(
    found: dict[tuple[int, int], _Tried],
    clouds: StationSurfels,
    floor: tuple[float, float],
    state: Remembered,
    witnesses: Witnesses,
) -> None:
    """Register pairs of several places where named targets or loops leave one."""
    names = list(clouds.stations)
    asked: set[tuple[int, int]] = set()
    while True:
        left = {k: _open(names, k, t) for k, t in found.items() if t.places and k not in asked}
        chosen = [(o, *choice) for o in left.values() if (choice := witnesses.choose(o))]
        if not chosen:
            whole = [t.edge for t in found.values() if t.edge is not None and t.rank == 6]
            used = consistent(whole).used
            looped = decided_by_loops(names, used, list(left.values()))
            chosen = [(o, pose, "their loop") for o, pose in looped]
        if not chosen:
            return
        for o, pose, speaks in chosen:
            ends = names.index(o.first), names.index(o.second)
            asked.add(ends)
            found[ends] = _tried(clouds, floor, state, o.first, o.second, pose, APPROXIMATE, speaks)


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
    edges: Sequence[CloudEdge], poses: Mapping[str, Pose], elsewhere: Mapping[str, float]
) -> list[tuple[CloudEdge, float]]:
    """Edges that poses of both stations contradict, and by how much [m].

    Directions that the clouds leave open contradict nothing. poses : approximate, world from
    scanner; elsewhere : what all of a reference may be wrong by [m].
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
        loose = _SLACK**2 + np.repeat([elsewhere.get(edge.first, 0.0) ** 2, 0.0], 3)
        if off @ np.linalg.solve(edge.covariance + np.diag(loose), off) > limit:
            out.append((edge, float(np.linalg.norm(shift))))
    return out


class StationSurfels:
    """Surfels of stations, made or read when the first of them is needed."""

    def __init__(self, scans: Sequence[StationScan], state: Remembered, progress: Progress) -> None:
        self.stations: dict[str, list[StationScan]] = {}
        for scan in scans:
            if not scan.origin_known:
                raise InputError(
                    "it is not known where the scanner stood in these coordinates",
                    file=scan.scan.path,
                    record=scan.name,
                    cure='say origin = "scanner" if it is at zero, or leave clouds out of '
                    "registration",
                )
            self.stations.setdefault(scan.station, []).append(scan)
        self._state, self._progress = state, progress

    @property
    def sources(self) -> list[tuple[str, list[Scan]]]:
        """The scans of each station, whose files decide whether a product holds."""
        return [(name, [s.scan for s in scans]) for name, scans in self.stations.items()]

    def __getitem__(self, name: str) -> PreparedScan:
        return self._all[name]

    @cached_property
    def _all(self) -> dict[str, PreparedScan]:
        return station_surfels(self.stations, self._state, self._progress)


@dataclass(frozen=True, eq=False)
class _Plans:
    """Likeness (n, n) of plans, and reaches [m] by station."""

    alike: Array
    radii: Mapping[str, float]


def _plans(clouds: StationSurfels, state: Remembered, progress: Progress) -> _Plans:
    """The plans of all stations, from the last run if they hold."""
    names = list(clouds.stations)

    def made() -> _Plans:
        scans = [clouds[name] for name in names]
        alike = likeness([Walls.of(scan) for scan in scans], progress)
        return _Plans(alike, {scan.name: scan.radius for scan in scans})

    return state.once("clouds-plans", state.key(_plans, clouds.sources), _Plans, made)


@dataclass(frozen=True, eq=False)
class _Tried:
    """Result of trying a pair.

    edge : its relative pose, None if none was taken; rank : directions that it holds; agree : share
    of the surface that bears it out.
    """

    edge: CloudEdge | None
    rank: int
    agree: float
    sentences: tuple[str, ...]
    places: tuple[Pose, ...] = ()  #: between which nothing decides

    @classmethod
    def of(cls, a: str, b: str, pair: CloudPair) -> _Tried:
        """What counts of a pair of two stations."""
        fit = pair.fit
        if fit is None:
            places = () if pair.open is None else pair.open.poses
            return cls(None, 0, 0.0, pair.sentences, tuple(places))
        edge = CloudEdge(a, b, Pose.from_matrix(fit.pose.matrix), fit.precision.covariance)
        return cls(edge, fit.precision.rank, fit.verdict.agree, pair.sentences)


def _tried(
    clouds: StationSurfels,
    floor: tuple[float, float],
    state: Remembered,
    a: str,
    b: str,
    prior: Pose | None,
    sigma: ApproximateSigma,
    speaks: str = "the approximate pose",
) -> _Tried:
    """What became of a pair, from the last run if nothing changed."""
    sources = [(name, [s.scan for s in clouds.stations[name]]) for name in (a, b)]
    given = None if prior is None else (prior.matrix, sigma, speaks)
    key = state.key(_tried, sources, floor, given)

    def made() -> _Tried:
        pair = register_pair(clouds[a], clouds[b], prior, sigma=sigma, floor=floor, speaks=speaks)
        return _Tried.of(a, b, pair)

    return state.once(f"clouds-{a}-{b}", key, _Tried, made)
