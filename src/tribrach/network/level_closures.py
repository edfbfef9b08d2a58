"""Closures of levelling lines before anything is adjusted: loops, double runs, given heights.

Sections between points make a graph. Each section beyond a tree of shortest sections closes a loop,
a double run is the loop of two sections, and a chain between two given heights closes on their
difference. A misclosure is compared with a limit that grows with the root of the length.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tribrach.sentences import Sentence

#: names that a sentence lists
_NAMED = 8


@dataclass(frozen=True)
class LevelSection:
    """A height difference along a line."""

    start: str
    end: str
    #: end less start [m], and the length of the line [m]
    difference: float
    length: float


@dataclass(frozen=True)
class LevelClosure:
    """A loop, or a chain between two given heights."""

    points: tuple[str, ...]  #: in their order; a loop ends where it begins
    #: [m]
    length: float
    misclosure: float
    limit: float  #: that a misclosure must not exceed [m]
    #: those of the points that sections branch at, or that have a given height
    marks: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """True if the misclosure is within its limit."""
        return abs(self.misclosure) <= self.limit

    @property
    def loop(self) -> bool:
        """True if it ends where it begins."""
        return self.points[0] == self.points[-1]

    def sentence(self) -> str:
        """The closure in one sentence, without the stop."""
        names = self.marks or (self.points[:-1] if self.loop else self.points)
        listed = ", ".join(names[:_NAMED])
        if len(names) > _NAMED:
            listed += f" and {len(names) - _NAMED} more"
        return Sentence(
            "{what} {listed} ({length:2} km) closes with {own.misclosure:mm+1}, "
            "the limit is {own.limit:mm1}",
            what="the loop" if self.loop else "the line between given heights",
            listed=listed,
            length=self.length / 1000,
            own=self,
        )


def level_closures(
    sections: Sequence[LevelSection], given: Mapping[str, float], per_root_km: float
) -> list[LevelClosure]:
    """Loops and chains between given heights, each with its misclosure.

    ``given``: heights by name [m]; ``per_root_km``: limit of a misclosure for a line of one
    kilometre [m].
    """
    edges: dict[str, list[tuple[str, int]]] = {}
    for k, section in enumerate(sections):
        edges.setdefault(section.start, []).append((section.end, k))
        edges.setdefault(section.end, []).append((section.start, k))
    knots = {name for name, ways in edges.items() if len(ways) != 2} | given.keys()
    way, rise, used = _trees(sections, edges)
    out = []
    for k, section in enumerate(sections):
        if k in used or section.start == section.end:
            continue
        a, b = way[section.start], way[section.end]
        shared = 0
        while shared < min(len(a), len(b)) and a[shared] == b[shared]:
            shared += 1
        # from the end back to where both ways part, and from there to the start
        back = [*reversed(b[shared - 1 :]), *a[shared:]]
        length = section.length + sum(
            _length(sections, edges, p, q, used) for p, q in pairwise(back)
        )
        off = rise[section.start] + section.difference - rise[section.end]
        out.append(_closure((section.start, *back), length, off, per_root_km, knots))
    roots: dict[str, list[str]] = {}
    for name in given:
        if name in way:
            roots.setdefault(way[name][0], []).append(name)
    for names in roots.values():
        for first, other in pairwise(names):
            a, b = way[first], way[other]
            shared = 0
            while shared < min(len(a), len(b)) and a[shared] == b[shared]:
                shared += 1
            points = [*reversed(a[shared - 1 :]), *b[shared:]]
            length = sum(_length(sections, edges, p, q, used) for p, q in pairwise(points))
            off = (rise[other] - rise[first]) - (given[other] - given[first])
            out.append(_closure(tuple(points), length, off, per_root_km, knots))
    return out


def _closure(
    points: tuple[str, ...],
    length: float,
    misclosure: float,
    per_root_km: float,
    knots: Collection[str],
) -> LevelClosure:
    """A closure with its limit and the points that name it."""
    limit = per_root_km * float(np.sqrt(length / 1000))
    marks = tuple(name for name in dict.fromkeys(points) if name in knots)
    return LevelClosure(points, length, misclosure, limit, marks if len(marks) > 1 else ())


def _trees(
    sections: Sequence[LevelSection], edges: Mapping[str, Sequence[tuple[str, int]]]
) -> tuple[dict[str, list[str]], dict[str, float], set[int]]:
    """Shortest ways from one point of each part, heights along them, and the sections they use."""
    way: dict[str, list[str]] = {}
    rise: dict[str, float] = {}
    used: set[int] = set()
    for root in edges:
        if root in way:
            continue
        queue: list[tuple[float, int, str, list[str], float, int]] = [(0.0, 0, root, [], 0.0, -1)]
        count = 0
        while queue:
            far, _, name, before, height, by = heapq.heappop(queue)
            if name in way:
                continue
            way[name], rise[name] = [*before, name], height
            used |= {by} - {-1}
            for other, k in edges[name]:
                if other not in way:
                    count += 1
                    sign = 1.0 if sections[k].start == name else -1.0
                    step = height + sign * sections[k].difference
                    heapq.heappush(
                        queue, (far + sections[k].length, count, other, way[name], step, k)
                    )
    return way, rise, used


def _length(
    sections: Sequence[LevelSection],
    edges: Mapping[str, Sequence[tuple[str, int]]],
    p: str,
    q: str,
    used: set[int],
) -> float:
    """Length of the section of the tree between two neighbours [m]."""
    return min(sections[k].length for other, k in edges[p] if other == q and k in used)
