"""Which pairs of many scans are registered, and in which order.

Of n scans there are n (n - 1) / 2 pairs, of which few overlap. Those that promise most are tried
first: the best neighbours of every scan and a tree over all of them. From then on the graph says
what it still needs. Groups that are apart try their most promising pairs, the next one after every
refusal, until they are one or no pair is left: no connection is lost that all pairs together would
have found. Pairs that no short loop controls try to get one, at places that the poses found so far
put next to each other. Loops that do not close take pairs away, and what is then apart is tried
again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import minimum_spanning_tree

from tribrach._types import Array, Progress
from tribrach.geometry.pose import Pose
from tribrach.registration.clouds.graph import CloudEdge, StationLoop, consistent, groups, loops


@dataclass(frozen=True)
class ProposalGates:
    """How many pairs are tried (by hand: test_proposals)."""

    all_pairs: int = 6  #: with so few scans all pairs are tried
    neighbours: int = 2  #: neighbours of every scan that are tried in any case
    short_loop: int = 4  #: stations of a loop that controls its pairs well, at most
    loop_tries: int = 4  #: pairs that are tried for a loop over one pair
    #: ... and share of the lesser of two scans that both see by their places, at least
    loop_common: float = 0.1
    #: weight of pairs whose approximate poses are beyond each other's reach
    beyond_reach: float = 0.01


GATES = ProposalGates()

#: registers the scans of two names: the edge, None if there is none, and the directions of six
#: that it holds
Attempt = Callable[[str, str], tuple[CloudEdge | None, int]]


#: every pair, or those that promise most
Choice = Literal["proposed", "all"]


def all_pairs(count: int, choice: Choice) -> bool:
    """True if every pair of so many scans is tried: where that is wanted, or they are few."""
    return choice == "all" or count <= GATES.all_pairs


def common_area(distance: Array, first: Array, second: Array) -> Array:
    """Share of the lesser of two circles that lies in the other one: the lens."""
    d, r, s = np.broadcast_arrays(distance, np.maximum(first, second), np.minimum(first, second))
    with np.errstate(divide="ignore", invalid="ignore"):
        one = np.arccos(np.clip((d**2 + s**2 - r**2) / (2 * d * s), -1, 1))
        two = np.arccos(np.clip((d**2 + r**2 - s**2) / (2 * d * r), -1, 1))
    lens = s**2 * (one - np.sin(2 * one) / 2) + r**2 * (two - np.sin(2 * two) / 2)
    share = np.where(d <= r - s, 1.0, np.where(d >= r + s, 0.0, lens / (np.pi * s**2)))
    return np.asarray(share, dtype=np.float64)


def promise_of(
    names: Sequence[str],
    alike: Array,
    radii: Mapping[str, float],
    priors: Mapping[str, Pose],
    sigma: float,
) -> Array:
    """What each pair of scans promises: how alike they are, and near by their approximate poses.

    Scans without an approximate pose may be anywhere. Pairs further apart than their reaches and
    four sigmas together come last.
    """
    reach = np.array([radii[name] for name in names])
    known = np.array([name in priors for name in names], dtype=bool)
    place = np.array([priors[n].translation if n in priors else np.zeros(3) for n in names])
    distance = np.linalg.norm(place[:, None] - place[None], axis=2)
    common = common_area(distance, reach[:, None] + 2 * sigma, reach[None] + 2 * sigma)
    beyond = distance > reach[:, None] + reach[None] + 4 * sigma
    weight = np.where(beyond, GATES.beyond_reach, 0.1 + 0.9 * common)
    both = known[:, None] & known[None]
    return np.asarray(np.where(both, weight * (0.2 + 0.8 * alike), alike), dtype=np.float64)


def try_all(
    names: Sequence[str], attempt: Attempt, progress: Progress = lambda what, done, total: None
) -> None:
    """Try every pair."""
    both = list(combinations(names, 2))
    for number, (a, b) in enumerate(both):
        progress("pairs of clouds", number, len(both))
        attempt(a, b)
    progress("pairs of clouds", len(both), len(both))


def try_proposed(
    names: Sequence[str],
    promise: Array,
    radii: Mapping[str, float],
    attempt: Attempt,
    progress: Progress = lambda what, done, total: None,
) -> None:
    """Try the pairs that are needed, the most promising ones first."""
    work = _Work(list(names), promise, radii, attempt, progress)
    work.run(_first(promise))
    while True:
        present = consistent(list(work.edges.values()))
        pairs = work.joining(present.used)
        pairs = pairs or work.closing(present.used, loops(present.used))
        if not pairs:
            break
        work.run(pairs)
    progress("pairs of clouds", work.done, work.done)


Pair = tuple[int, int]


def _first(promise: Array) -> list[Pair]:
    """A tree over all scans and the best neighbours of each."""
    n = len(promise)
    # absent entries are no edges of the tree: every cost is positive
    cost = np.triu(promise.max() - promise + 1.0, 1)
    tree = minimum_spanning_tree(csr_array(cost)).tocoo()
    chosen = {_pair(int(i), int(j)) for i, j in zip(tree.row, tree.col, strict=True)}
    for k in range(n):
        others = [int(j) for j in np.argsort(-promise[k], kind="stable") if j != k]
        chosen |= {_pair(k, j) for j in others[: GATES.neighbours]}
    return list(chosen)


def _pair(i: int, j: int) -> Pair:
    """Two numbers, the lesser first."""
    return (i, j) if i < j else (j, i)


@dataclass
class _Work:
    """Pairs that were tried, and what came of them."""

    names: list[str]  #: of the scans
    promise: Array  #: (n, n), of each pair
    radii: Mapping[str, float]  #: reach of the scans by name [m]
    attempt: Attempt  #: registers a pair
    progress: Progress  #: told of it
    tried: set[Pair] = field(default_factory=set)  #: numbers of the scans, the lesser first
    edges: dict[Pair, CloudEdge] = field(default_factory=dict)  #: pairs that have a pose
    #: those of them that leave a direction open: they connect nothing for good
    weak: set[Pair] = field(default_factory=set)
    looked: Counter[Pair] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        """Number the names."""
        self.number = {name: k for k, name in enumerate(self.names)}

    @property
    def done(self) -> int:
        """How many pairs were tried."""
        return len(self.tried)

    def run(self, pairs: Iterable[Pair]) -> None:
        """Try pairs, the most promising ones first."""
        order = sorted(set(pairs) - self.tried, key=lambda p: (-self.promise[p], p))
        total = self.done + len(order)
        for i, j in order:
            self.progress("pairs of clouds", self.done, total)
            edge, held = self.attempt(self.names[i], self.names[j])
            self.tried.add((i, j))
            if edge is not None:
                self.edges[i, j] = edge
                if held < 6:
                    self.weak.add((i, j))

    def pair(self, edge: CloudEdge) -> Pair:
        """Numbers of the stations of an edge."""
        return _pair(self.number[edge.first], self.number[edge.second])

    def joining(self, used: Sequence[CloudEdge]) -> list[Pair]:
        """The most promising pair of each group of stations with any other."""
        whole = [e for e in used if self.pair(e) not in self.weak]
        parts = [[self.number[n] for n in part] for part in groups(self.names, whole)]
        if len(parts) < 2:
            return []
        of = np.empty(len(self.names), dtype=np.int64)
        for k, part in enumerate(parts):
            of[part] = k
        open_ = self.untried & (of[:, None] != of[None])
        best: list[Pair] = []
        for part in parts:
            score = np.where(open_[part], self.promise[part], -1.0)
            row, column = np.unravel_index(int(np.argmax(score)), score.shape)
            if score[row, column] >= 0:
                best.append(_pair(part[int(row)], int(column)))
        return best

    @property
    def untried(self) -> Array:
        """Which pairs (n, n) were not tried."""
        out = ~np.eye(len(self.names), dtype=bool)
        for i, j in self.tried:
            out[i, j] = out[j, i] = False
        return out

    def closing(self, used: Sequence[CloudEdge], closed: Sequence[StationLoop]) -> list[Pair]:
        """Most promising pairs that close a short loop about each pair in none, or any loop."""
        looped = {self.pair(e) for loop in closed for e in loop.edges}
        short = [loop for loop in closed if len(loop.stations) <= GATES.short_loop]
        controlled = {self.pair(e) for loop in short for e in loop.edges}
        bare = [e for e in used if self.pair(e) not in controlled]
        bare = [e for e in bare if self.looked[self.pair(e)] < GATES.loop_tries]
        if not bare:
            return []
        near: dict[int, set[int]] = {k: {k} for k in range(len(self.names))}
        for e in used:
            i, j = self.pair(e)
            near[i].add(j)
            near[j].add(i)
        score = np.where(self.untried, self.promise * self._common(used), 0.0)
        out: list[Pair] = []
        for e in bare:
            i, j = self.pair(e)
            rows, columns = sorted(near[i] - {j}), sorted(near[j] - {i})
            if (i, j) not in looped:
                rows, columns = self._sides(e, used)
            best = _best(score, rows, columns)
            self.looked[i, j] += 1
            if best is None:
                self.looked[i, j] = GATES.loop_tries
            else:
                out.append(best)
        return out

    def _sides(self, edge: CloudEdge, used: Sequence[CloudEdge]) -> tuple[list[int], list[int]]:
        """Numbers of the stations on either side of an edge that is in no loop."""
        parts = groups(self.names, [other for other in used if other is not edge])
        numbers = [[self.number[name] for name in part] for part in parts]
        i, j = self.pair(edge)
        return next(p for p in numbers if i in p), next(p for p in numbers if j in p)

    def _common(self, used: Sequence[CloudEdge]) -> Array:
        """What scans of one group see in common (n, n) by the places of edges; 0 if too little."""
        n = len(self.names)
        out = np.zeros((n, n))
        ways: dict[str, list[tuple[str, Pose]]] = {name: [] for name in self.names}
        for e in used:
            ways[e.first].append((e.second, e.pose))
            ways[e.second].append((e.first, e.pose.inverse))
        for part in groups(self.names, used):
            poses = {part[0]: Pose.identity()}
            front = [part[0]]
            while front:
                at = front.pop(0)
                for other, step in ways[at]:
                    if other not in poses:
                        poses[other] = poses[at] @ step
                        front.append(other)
            rows = [self.number[name] for name in part]
            place = np.array([poses[name].translation for name in part])
            reach = np.array([self.radii[name] for name in part])
            distance = np.linalg.norm(place[:, None] - place[None], axis=2)
            common = common_area(distance, reach[:, None], reach[None])
            out[np.ix_(rows, rows)] = np.where(common >= GATES.loop_common, common, 0.0)
        return out


def _best(score: Array, rows: Sequence[int], columns: Sequence[int]) -> Pair | None:
    """The pair of a row and a column with the largest score, None if all are zero."""
    part = score[np.ix_(rows, columns)]
    if not part.size or part.max() <= 0:
        return None
    row, column = np.unravel_index(int(np.argmax(part)), part.shape)
    return _pair(rows[int(row)], columns[int(column)])
