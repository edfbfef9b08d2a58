"""Tests the loops of pairs of clouds, leaves bad pairs out, and makes a network of the rest.

Every pair is a relative pose with its covariance. Around a loop these compose to no motion at all;
what is left has a covariance of its own and is tested (chi-square, six degrees of freedom). A pair
whose loops all fail to close is named and left out; the rest becomes observations of one network
with the first station held. Metres and radians.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tribrach._types import Array
from tribrach.answers import Number, Result
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log, skew
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.poses import RelativePoses
from tribrach.registration.alternatives import OpenPair, by_loops
from tribrach.registration.pose_graph import Joint, join
from tribrach.sentences import Sentence
from tribrach.statistics import chi2
from tribrach.units import SEC


@dataclass(frozen=True)
class CloudLoopGates:
    """When a loop of pairs of clouds closes (method section 2.11)."""

    #: probability that a good loop is called open; the usual level of a test of blunders
    alpha: float = 0.001


GATES = CloudLoopGates()


@dataclass(frozen=True, eq=False)
class CloudEdge:
    """A relative pose of two stations from their clouds."""

    #: names of the stations
    first: str
    second: str
    pose: Pose  #: pose of the second station in the first
    #: (6, 6), its covariance in the order of :class:`~tribrach.observations.poses.RelativePoses`
    #: [m], [rad]
    covariance: Array

    @property
    def turn_sigma(self) -> float:
        """Of the turn, about all axes together [rad]."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))

    @property
    def ends(self) -> frozenset[str]:
        """Names of both stations."""
        return frozenset((self.first, self.second))

    @property
    def name(self) -> str:
        """Names of both stations, for sentences."""
        return f"{self.first} - {self.second}"


@dataclass(frozen=True, eq=False)
class StationLoop(Result, without=("edges",), also=("closes",)):
    """A loop of stations, its closure [m, rad] and the test of it."""

    #: names of the stations around the loop
    stations: tuple[str, ...]
    edges: tuple[CloudEdge, ...]
    #: left around the loop [m, rad]
    shift: Number
    turn: Number
    #: predicted for these, as lengths of three components
    shift_sigma: Number
    turn_sigma: Number
    statistic: Number
    limit: Number

    @property
    def closes(self) -> bool:
        """True if the loop closes within what the covariances allow."""
        return self.statistic <= self.limit

    @property
    def words(self) -> str:
        """The loop and its closure in words."""
        return Sentence(
            "{stations}: {own.shift:mm1} (predicted {shift_sigma:1}), {degrees:arcsec0} "
            "(predicted {degrees2:0}), test {own.statistic:1} of {own.limit:1}",
            stations=" - ".join((*self.stations, self.stations[0])),
            own=self,
            shift_sigma=1000.0 * self.shift_sigma,
            degrees=np.degrees(self.turn) * 3600 * SEC,
            degrees2=np.degrees(self.turn_sigma) * 3600,
        )


@dataclass(frozen=True, eq=False)
class Consistency:
    """Edges after the test of the loops."""

    used: tuple[CloudEdge, ...]  #: edges that are used
    dropped: tuple[CloudEdge, ...]  #: edges that are left out
    loops: tuple[StationLoop, ...]  #: all loops of the given edges
    sentences: tuple[str, ...]  #: what was left out and why


def consistent(edges: Sequence[CloudEdge]) -> Consistency:
    """Choose the edges that the loops confirm.

    While a loop does not close, the edge of it that is in the fewest closed and the most open loops
    is left out; where several are alike, all of them are, because nothing tells which one is wrong.
    """
    kept = list(edges)
    dropped: list[CloudEdge] = []
    sentences: list[str] = []
    every = loops(edges)
    while True:
        present = loops(kept)
        bad = [loop for loop in present if not loop.closes]
        if not bad:
            return Consistency(tuple(kept), tuple(dropped), tuple(every), tuple(sentences))
        worst = max(bad, key=lambda loop: loop.statistic / loop.limit)
        standing = {id(e): _standing(e, present) for e in worst.edges}
        least = min(standing.values())
        doubtful = [e for e in worst.edges if standing[id(e)] == least]
        names = " and ".join(e.name for e in doubtful)
        how = "is" if len(doubtful) == 1 else "are"
        sentences.append(
            Sentence(
                "the loop {worst.words} does not close; {names} {how} not used",
                worst=worst,
                names=names,
                how=how,
            )
        )
        kept = [e for e in kept if not any(e is d for d in doubtful)]
        dropped += doubtful


def _standing(edge: CloudEdge, among: Sequence[StationLoop]) -> tuple[int, int]:
    """Closed loops, less open ones: the less, the more doubtful."""
    own = [loop for loop in among if any(edge is e for e in loop.edges)]
    closed = sum(loop.closes for loop in own)
    return closed - (len(own) - closed), closed


def loops(edges: Sequence[CloudEdge]) -> list[StationLoop]:
    """All triangles of edges, and for edges in no triangle the shortest loops."""
    by_ends = {e.ends: e for e in edges}
    out, covered = [], set()
    for three in _triangles(edges):
        sides = [frozenset((three[k], three[(k + 1) % 3])) for k in range(3)]
        out.append(_closed(three, [by_ends[side] for side in sides]))
        covered.update(sides)
    for edge in edges:
        if edge.ends not in covered:
            path = _shortest([e for e in edges if e is not edge], edge.second, edge.first)
            if path:
                around = [by_ends[frozenset(pair)] for pair in pairwise(path)]
                out.append(_closed((edge.first, *path[:-1]), [edge, *around]))
                covered.update(e.ends for e in (edge, *around))
    return out


def _triangles(edges: Sequence[CloudEdge]) -> list[tuple[str, str, str]]:
    """Names of three stations that edges join with each other, in order."""
    near: dict[str, set[str]] = {}
    for e in edges:
        near.setdefault(e.first, set()).add(e.second)
        near.setdefault(e.second, set()).add(e.first)
    return [
        (a, b, c)
        for a in sorted(near)
        for b in sorted(n for n in near[a] if n > a)
        for c in sorted(n for n in near[a] & near[b] if n > b)
    ]


def _shortest(edges: Sequence[CloudEdge], start: str, end: str) -> list[str]:
    """Stations of a shortest path with both ends; empty without a path."""
    before: dict[str, str] = {start: start}
    front = [start]
    while front and end not in before:
        near = []
        for at in front:
            for e in edges:
                if at in e.ends:
                    other = e.second if e.first == at else e.first
                    if other not in before:
                        before[other] = at
                        near.append(other)
        front = near
    if end not in before:
        return []
    path = [end]
    while path[-1] != start:
        path.append(before[path[-1]])
    return path[::-1]


def _closed(stations: tuple[str, ...], edges: Sequence[CloudEdge]) -> StationLoop:
    """The loop over edges that follow each other, with errors carried to the first station.

    An edge's error moves points X of its first frame by ``dt + w x (X - t)``, with
    ``w = R w_right``.
    """
    at, pose = stations[0], Pose.identity()
    frames = []
    for edge in edges:
        forward = edge.first == at
        step = edge.pose if forward else edge.pose.inverse
        frames.append((pose if forward else pose @ step, edge))
        pose, at = pose @ step, edge.second if forward else edge.first
    covariance = np.zeros((6, 6))
    for frame, edge in frames:
        turn = frame.rotation @ edge.pose.rotation
        move = np.zeros((6, 6))
        move[:3, :3] = frame.rotation
        move[:3, 3:] = -skew(pose.translation - frame @ edge.pose.translation) @ turn
        move[3:, 3:] = turn
        covariance += move @ edge.covariance @ move.T
    closure = np.concatenate([pose.translation, log(pose.rotation)])
    return StationLoop(
        stations=stations,
        edges=tuple(edges),
        shift=float(np.linalg.norm(closure[:3])),
        turn=float(np.linalg.norm(closure[3:])),
        shift_sigma=float(np.sqrt(np.trace(covariance[:3, :3]))),
        turn_sigma=float(np.sqrt(np.trace(covariance[3:, 3:]))),
        statistic=float(closure @ np.linalg.solve(covariance, closure)),
        limit=float(chi2.ppf(1 - GATES.alpha, 6)),
    )


def groups(stations: Sequence[str], edges: Sequence[CloudEdge]) -> list[tuple[str, ...]]:
    """Groups of stations that edges connect."""
    left, out = list(stations), []
    while left:
        group, front = {left[0]}, [left[0]]
        while front:
            at = front.pop()
            for e in edges:
                if at in e.ends:
                    new = set(e.ends) - group
                    group |= new
                    front += new
        out.append(tuple(n for n in left if n in group))
        left = [n for n in left if n not in group]
    return sorted(out, key=lambda group: -len(group))


def decided_by_loops(
    stations: Sequence[str], edges: Sequence[CloudEdge], pairs: Sequence[OpenPair]
) -> list[tuple[OpenPair, Pose]]:
    """Pairs of several places of which the loops over edges that hold all directions leave one."""
    joints = [Joint(e.first, e.second, e.pose, 1.0) for e in edges]
    return by_loops(join(stations, joints).groups, pairs)


def observe(survey: Survey, edges: Sequence[CloudEdge]) -> None:
    """Add edges to a survey as observations between its stations."""
    if edges:
        survey.add(
            RelativePoses,
            values=[[*e.pose.translation, 0.0, 0.0, 0.0] for e in edges],
            covariance=np.array([e.covariance for e in edges]),
            rotation=np.array([e.pose.rotation for e in edges]),
            start=[e.first for e in edges],
            end=[e.second for e in edges],
            source=[f"clouds {e.name}" for e in edges],
        )


def network_of(
    stations: Sequence[str],
    edges: Sequence[CloudEdge],
    frames: Mapping[str, Callable[[Survey], None]] | None = None,
) -> Network:
    """Make a network of connected stations in the frame of the first one, which is held.

    ``frames`` say what adds a station that knows its place, instead of holding the first one.

    The errors of a scan enter every pair that it is in: taken as independent, all pairs of n
    stations would make relative poses n / 2 times better than one pair. Covariances are therefore
    multiplied by ``(d_i + d_j + 2) / 4``, where d is the number of pairs of either station.
    """
    survey = Survey()
    known = {name: add for name, add in (frames or {}).items() if name in stations}
    for add in known.values():
        add(survey)
    if not known:
        survey.station(
            stations[0], translation=np.zeros(3), rotation=np.eye(3), free=np.zeros(6, dtype=bool)
        )
    for name in stations:
        if name not in survey.stations:
            survey.station(name)
    inner = [e for e in edges if e.ends <= set(stations)]
    pairs = Counter(name for e in inner for name in e.ends)
    shared = [(pairs[e.first] + pairs[e.second] + 2) / 4 for e in inner]
    observe(
        survey,
        [replace(e, covariance=f * e.covariance) for e, f in zip(inner, shared, strict=True)],
    )
    return survey.network()
