"""Places that look alike: where else two stations may lie to each other, and what decides.

What a station sees twice, the other station may show at either place. The symmetries of both make
the alternatives of a pose; targets that were named, and loops over other stations, choose among
them. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, product

import numpy as np

from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log


@dataclass(frozen=True)
class AlternativesGates:
    """When something decides between places that look alike (by hand: test_alternatives)."""

    #: poses that differ by less are one: shift [m], turn [rad]
    same_m: float = 0.1
    same_rad: float = float(np.radians(1.0))
    #: targets that were named speak for a place where they are off by less [m] ...
    named_m: float = 0.05
    not_named_m: float = 0.15  #: ... and against one where they are off by more
    #: approximate poses further off than so many of their sigmas are called wrong
    wrong_sigmas: float = 4.0
    #: of two places the approximate pose speaks for one if its square [sigmas] is less by so much:
    #: a thousand to one
    decided: float = float(2 * np.log(1000.0))


GATES = AlternativesGates()


@dataclass(frozen=True)
class ApproximateSigma:
    """What approximate poses may be wrong by, one relative to another.

    They are no observations: these sigmas say how near a fit has to be for an approximate pose to
    speak for it, and which scans cannot see each other.
    """

    shift: float = 0.25  #: sigma of the shift [m]
    turn: float = float(np.radians(1.25))  #: sigma of the turn [rad]

    def wrong(self, shift: float, turn: float) -> bool:
        """True if an approximate pose that is off by so much [m], [rad] is nowhere near."""
        return shift >= GATES.wrong_sigmas * self.shift or turn >= GATES.wrong_sigmas * self.turn

    def likely(self, off: Sequence[tuple[float, float]]) -> tuple[int, list[int]] | None:
        """The place that an approximate pose speaks for, None if it does not.

        ``off`` is the shift [m] and turn [rad] of the approximate pose from each place. Named are
        the nearest place, and those that have more than a thousandth of its likelihood.

        Errors of the approximate pose are taken as normal.
        """
        squares = [(shift / self.shift) ** 2 + (turn / self.turn) ** 2 for shift, turn in off]
        best = int(np.argmin(squares))
        if self.wrong(*off[best]):
            return None
        least = squares[best] + GATES.decided
        return best, [k for k, square in enumerate(squares) if k != best and square < least]


#: of approximate poses of which nothing is said
APPROXIMATE = ApproximateSigma()


@dataclass(frozen=True, eq=False)
class OpenPair:
    """Two stations that may lie at several places to each other."""

    #: names of the stations
    first: str
    second: str
    poses: tuple[Pose, ...]  #: poses first from second

    @property
    def ends(self) -> frozenset[str]:
        """Names of both stations."""
        return frozenset((self.first, self.second))


def _apart(one: Pose, other: Pose) -> tuple[float, float]:
    """Shift [m] and turn [rad] between two poses."""
    shift = float(np.linalg.norm(one.translation - other.translation))
    return shift, float(np.linalg.norm(log(one.rotation @ other.rotation.T)))


def same_place(one: Pose, other: Pose) -> bool:
    """True if two poses differ by less than places that look alike do."""
    shift, turn = _apart(one, other)
    return shift < GATES.same_m and turn < GATES.same_rad


def symmetric_places(pose: Pose, own: Sequence[Pose], other: Sequence[Pose]) -> list[Pose]:
    """Places that the symmetries of both stations make of one, the twofold ones last.

    ``own`` and ``other`` are motions that lay the first and the second station on themselves.
    """
    still = Pose.identity()
    places = [g @ pose @ h for g in (still, *own) for h in (still, *other)][1:]
    return places + [g @ g @ pose for g in own] + [pose @ h @ h for h in other]


@dataclass(frozen=True, eq=False)
class Witnesses:
    """What decides between places that look alike, besides what the stations see of each other."""

    #: approximate poses of stations in one frame, and what they may be wrong by
    approximate: Mapping[str, Pose] = field(default_factory=dict)
    sigma: ApproximateSigma = APPROXIMATE
    #: centres (3,) in the frame of each station of the targets that the user named [m]
    targets: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    #: known points (3,) by name, asked only where they are needed [m]
    points: Callable[[], Mapping[str, Array]] = dict

    def choose(self, pair: OpenPair) -> tuple[Pose, str] | None:
        """The only pose that named targets or approximate poses speak for, and what speaks."""
        named = self._by_named(pair)
        if named is not None:
            return named, "a named target"
        if pair.first not in self.approximate or pair.second not in self.approximate:
            return None
        prior = self.approximate[pair.first].inverse @ self.approximate[pair.second]
        found = self.sigma.likely([_apart(pose, prior) for pose in pair.poses])
        if found is None or found[1]:
            return None
        return pair.poses[found[0]], "the approximate pose"

    def _by_named(self, pair: OpenPair) -> Pose | None:
        """The only pose that named targets of both stations agree with.

        A target that both see lies at one place; two known points lie as far apart as they are
        known to.
        """
        mine, other = (self.targets.get(name, {}) for name in (pair.first, pair.second))
        if not mine or not other:
            return None
        points = self.points()
        asked = [(i, j) for i in mine for j in other if i == j or (i in points and j in points)]
        if not asked:
            return None
        apart = [0.0 if i == j else float(np.linalg.norm(points[i] - points[j])) for i, j in asked]
        here = np.array([mine[i] for i, _ in asked])
        there = np.array([other[j] for _, j in asked])
        off = [
            float(np.abs(np.linalg.norm(here - pose @ there, axis=1) - apart).max())
            for pose in pair.poses
        ]
        best = int(np.argmin(off))
        rest = off[:best] + off[best + 1 :]
        if off[best] > GATES.named_m or any(d < GATES.not_named_m for d in rest):
            return None
        return pair.poses[best]


def by_loops(
    groups: Sequence[Mapping[str, Pose]], pairs: Sequence[OpenPair]
) -> list[tuple[OpenPair, Pose]]:
    """Pairs between two groups that lie at one place only if both are to agree."""
    of = {name: k for k, group in enumerate(groups) for name in group}
    between: dict[tuple[int, int], list[tuple[OpenPair, list[Pose]]]] = {}
    for pair in pairs:
        ends = of[pair.first], of[pair.second]
        if ends[0] == ends[1]:
            continue
        one, two = groups[ends[0]][pair.first], groups[ends[1]][pair.second].inverse
        placed = [one @ pose @ two for pose in pair.poses]
        if ends[0] > ends[1]:
            ends, placed = ends[::-1], [pose.inverse for pose in placed]
        between.setdefault(ends, []).append((pair, placed))
    out: dict[frozenset[str], tuple[OpenPair, Pose]] = {}
    for joined in between.values():
        for a, b in combinations(joined, 2):
            indices = product(range(len(a[1])), range(len(b[1])))
            closed = [(k, m) for k, m in indices if same_place(a[1][k], b[1][m])]
            if len(closed) == 1:
                for (pair, _), k in zip((a, b), closed[0], strict=True):
                    out[pair.ends] = pair, pair.poses[k]
    return list(out.values())
