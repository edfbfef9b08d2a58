"""Matches targets of a scan to a list of points by distances, without pose and names.

Pairs (i, j) that could be the same are the nodes of an association graph; two nodes are joined if
the distance between the targets equals that between the points (for levelled scans also the height
difference). The largest cliques are the candidates; a rigid fit and a chi-square test decide, and a
second solution of the same size makes the matching ambiguous (method section 8.4). Coordinates (n,
3) and sigmas in metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from heapq import heapify, heappop, heappush

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geometry.alignment import group_planar, group_rigid
from tribrach.geometry.rotation import skew
from tribrach.statistics import chi2


@dataclass(frozen=True)
class MatchingGates:
    """When targets and points match (method section 8.4) (by hand: test_matching)."""

    distance_sigmas: float = 4.0  #: distances and heights may differ by this many sigmas
    #: solutions whose sum of squares is beyond this quantile of chi-square do not fit
    fit_level: float = 0.9999
    #: a solution with a pair less is a rival if its sum of squares is smaller by more than this
    #: quantile of chi-square with three degrees of freedom, the share of one pair
    rival_level: float = 0.999
    #: points nearer to one line (one place if levelled) than this determine no motion [m]
    least_spread_m: float = 1e-3
    most_nodes: int = 3600  #: association graphs with more nodes are refused: bounds the time


GATES = MatchingGates()


@dataclass(frozen=True)
class Matching:
    """Pairs of targets and points, and how certain they are."""

    pairs: Index  #: (k, 2), numbers of target and point
    rotation: Array  #: (3, 3), world from scanner
    translation: Array  #: (3,), world from scanner [m]
    chi_square: float  #: weighted sum of squared residuals
    others: tuple[Index, ...] = ()  #: pairs of every other solution that fits as well
    #: (3,), place in the world that rotations are about [m]
    centre: Array = field(default_factory=lambda: np.zeros(3))
    #: (6, 6), covariance of translation [m] and rotation [rad] about ``centre``, zero for what is
    #: not estimated
    cofactor: Array = field(default_factory=lambda: np.zeros((6, 6)))

    def placed_sigma(self, local: Array) -> Array:
        """Sigmas of a coordinate that the motion gives to points that it carries [m]."""
        world = local @ self.rotation.T + self.translation
        lever = _lever(world - self.centre)
        variance = np.einsum("nij,jk,nik->n", lever, self.cofactor, lever)
        sigma: Array = np.sqrt(variance / 3)
        return sigma

    @property
    def ambiguous(self) -> bool:
        """True if another solution fits as well; naming one target by hand then decides."""
        return len(self.others) > 0

    def __str__(self) -> str:
        """The matching in a sentence."""
        text = f"{len(self.pairs)} targets matched"
        if self.ambiguous:
            text += f", ambiguous: {len(self.others)} other ways fit as well; name one target"
        return text


def match(
    targets: Array,
    points: Array,
    *,
    sigma_targets: Array | float = 0.002,
    sigma_points: Array | float = 0.002,
    levelled: bool = False,
    known: Mapping[int, int] | None = None,
) -> Matching:
    """Match targets of a scan to points.

    ``known`` are the points of those targets whose names are given; other pairs of either are not
    formed. ``levelled``: the z axis of the scanner is the plumb line.
    """
    n, m = len(targets), len(points)
    if n * m > GATES.most_nodes:
        raise InputError(
            f"{n} targets and {m} points are too many to match without names",
            cure="name three targets or give an approximate pose",
        )
    s2 = np.broadcast_to(np.asarray(sigma_targets, dtype=float), n)[:, None] ** 2
    s2 = s2 + np.broadcast_to(np.asarray(sigma_points, dtype=float), m)[None, :] ** 2
    needed = 2 if levelled else 3
    nodes = _allowed(n, m, known or {})
    graph = _associations(targets, points, s2, levelled, nodes)

    def fitting(some: Index, of: list[int], least: int) -> list[Matching]:
        """Solutions of the pairs of some nodes with their graph."""
        cliques = [np.divmod(some[members], m) for members in _largest_cliques(of, least)]
        fits = [_fit(targets, points, np.stack(c, axis=1), s2, levelled) for c in cliques]
        return [fit for fit in fits if fit is not None]

    solutions: list[Matching] = []
    if known:
        # what agrees with the names comes first: more targets may fit a storey further
        named = np.isin(nodes, [i * m + j for i, j in known.items()])
        bits = [graph[k] for k in np.flatnonzero(named)]
        kept = [k for k in range(len(nodes)) if named[k] or all(b >> k & 1 for b in bits)]
        some = nodes[kept]
        few = _associations(targets, points, s2, levelled, some)
        sound = fitting(some, few, needed + 1)
        solutions = [x for x in sound if set(known.items()) <= set(map(tuple, x.pairs.tolist()))]
    solutions = solutions or fitting(nodes, graph, needed)
    if not solutions:
        raise InputError(
            f"no {needed} targets have the mutual distances of {needed} points",
            cure="check the units and the point list, or name the targets",
        )
    size = max(len(s.pairs) for s in solutions)
    full = sorted((s for s in solutions if len(s.pairs) == size), key=lambda s: s.chi_square)
    best = full[0]
    rivals = [s for s in solutions if len(s.pairs) == size - 1 and s.chi_square < best.chi_square]
    # a smaller solution is a rival only where its residuals are less by more than one pair's share
    rivals = [s for s in rivals if best.chi_square - s.chi_square > chi2.ppf(GATES.rival_level, 3)]
    others = [s.pairs for s in [*full[1:], *rivals]]
    if not others:
        others = _repeated(targets, s2.mean(axis=1), best.pairs, levelled, known or {})
    return replace(best, others=tuple(others))


def _repeated(
    targets: Array, variance: Array, pairs: Index, levelled: bool, known: Mapping[int, int]
) -> list[Index]:
    """Smaller solutions at the places where targets that are arranged alike twice lie as well.

    Marks at the same places of two storeys: a station that sees both fits one storey off with all
    of them, and where it stands with half. Targets that nothing matches there speak against
    nothing, since other stations see other targets.
    """
    n, needed = len(targets), 2 if levelled else 3
    if n * n > GATES.most_nodes:
        return []
    nodes = np.flatnonzero(~np.eye(n, dtype=bool))
    s2 = variance[:, None] + variance[None]
    graph = _associations(targets, targets, s2, levelled, nodes)
    point = np.full(n, -1)
    point[pairs[:, 0]] = pairs[:, 1]
    held = [i for i, j in known.items() if point[i] == j]
    out: dict[tuple[int, ...], Index] = {}
    for members in _largest_cliques(graph, needed + 1):
        own = np.stack(np.divmod(nodes[members], n), axis=1)
        turned = _fit(targets, targets, own, s2, levelled)
        if turned is None:
            continue
        # where a target with a name would lie elsewhere, the name speaks against it
        away = targets[held] @ turned.rotation.T + turned.translation - targets[held]
        if (np.linalg.norm(away, axis=1) > GATES.distance_sigmas * np.sqrt(variance[held])).any():
            continue
        moved = np.stack([own[:, 0], point[own[:, 1]]], axis=1)
        moved = moved[moved[:, 1] >= 0]
        if len(moved) >= needed:
            out[tuple(moved.ravel().tolist())] = moved
    return list(out.values())


def _allowed(n: int, m: int, known: Mapping[int, int]) -> Index:
    """Pairs ``i * m + j`` that may be formed."""
    free = np.ones((n, m), dtype=bool)
    for i, j in known.items():
        free[i, :] = free[:, j] = False
    for i, j in known.items():
        free[i, j] = True
    return np.flatnonzero(free)


def _associations(
    targets: Array, points: Array, s2: Array, levelled: bool, nodes: Index
) -> list[int]:
    """Neighbours of each pair ``i * m + j`` of the nodes as bits of an integer."""
    if len(nodes) == 0:
        return []
    n, m = s2.shape
    length_t = np.linalg.norm(targets[:, None] - targets[None], axis=2)
    length_p = np.linalg.norm(points[:, None] - points[None], axis=2)
    rise_t, rise_p = (x[:, None, 2] - x[None, :, 2] for x in (targets, points))
    number = np.full(n * m, -1)
    number[nodes] = np.arange(len(nodes))
    number = number.reshape(n, m)
    # pairs of points by their distances: few of them are as far apart as two targets
    order = np.argsort(length_p, axis=None, kind="stable")
    lengths = length_p.ravel()[order]
    joined = np.zeros((len(nodes), len(nodes)), dtype=bool)
    for a in range(n):
        widest = GATES.distance_sigmas * np.sqrt(s2[a].max() + s2.max(axis=1))
        # a little more than the gates, which decide below
        first = np.searchsorted(lengths, length_t[a] - 1.001 * widest)
        count = np.searchsorted(lengths, length_t[a] + 1.001 * widest, side="right") - first
        count[a] = 0
        b = np.repeat(np.arange(n), count)
        ends = np.cumsum(count)
        c, d = np.divmod(order[np.arange(len(b)) - (ends - count)[b] + first[b]], m)
        gate = GATES.distance_sigmas * np.sqrt(s2[a, c] + s2[b, d])
        fits = (c != d) & (np.abs(length_t[a, b] - length_p[c, d]) < gate)
        if levelled:
            fits &= np.abs(rise_t[a, b] - rise_p[c, d]) < gate
        one, two = number[a, c[fits]], number[b[fits], d[fits]]
        both = (one >= 0) & (two >= 0)
        joined[one[both], two[both]] = True
    packed = np.packbits(joined, axis=1, bitorder="little")
    return [int.from_bytes(row.tobytes(), "little") for row in packed]


def _bits(mask: int) -> Iterator[int]:
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def _largest_cliques(graph: list[int], smallest: int) -> list[list[int]]:
    """Maximal cliques of the largest size and of one less.

    Bron and Kerbosch (1973) with pivot, from nodes of few neighbours to those of many (Eppstein et
    al. 2010); a branch ends where its colours are too few (Tomita and Seki 2003).
    """
    cliques: list[list[int]] = []
    largest = smallest
    done = 0
    for v, later in _fewest_first(graph):
        stack = [([v], graph[v] & later, graph[v] & done)]
        done |= 1 << v
        while stack:
            clique, candidates, excluded = stack.pop()
            if _fewer_colours(graph, candidates, max(largest - 1, smallest) - len(clique)):
                continue
            if not candidates:
                if not excluded:
                    cliques.append(clique)
                    largest = max(largest, len(clique))
                continue
            near = [(graph[u] & candidates, u) for u in _bits(candidates | excluded)]
            pivot = max(near, key=lambda x: x[0].bit_count())[1]
            for u in _bits(candidates & ~graph[pivot]):
                stack.append(([*clique, u], candidates & graph[u], excluded & graph[u]))
                candidates &= ~(1 << u)
                excluded |= 1 << u
    return [c for c in cliques if len(c) >= max(largest - 1, smallest)]


def _fewest_first(graph: list[int]) -> Iterator[tuple[int, int]]:
    """Each node with those that come later; the next one has the fewest neighbours among these."""
    left = (1 << len(graph)) - 1
    degree = [row.bit_count() for row in graph]
    queue = [(d, v) for v, d in enumerate(degree)]
    heapify(queue)
    while queue:
        d, v = heappop(queue)
        if not left >> v & 1 or d != degree[v]:
            continue
        left &= ~(1 << v)
        for u in _bits(graph[v] & left):
            degree[u] -= 1
            heappush(queue, (degree[u], u))
        yield v, left


def _fewer_colours(graph: list[int], nodes: int, needed: int) -> bool:
    """Whether greedy colours, of which a clique has one a node, are fewer than needed."""
    colours = 0
    while nodes and colours < needed:
        colours += 1
        alike = nodes
        while alike:
            low = alike & -alike
            nodes ^= low
            alike = (alike ^ low) & ~graph[low.bit_length() - 1]
    return colours < needed


def _fit(targets: Array, points: Array, pairs: Index, s2: Array, levelled: bool) -> Matching | None:
    """The solution if a proper motion carries the targets onto the points within their sigmas."""
    local, world = targets[pairs[:, 0]], points[pairs[:, 1]]
    one, weights = np.zeros(len(pairs), dtype=np.int64), 1 / s2[pairs[:, 0], pairs[:, 1]]
    rotation, translation = np.eye(3), np.zeros(3)
    if levelled:
        plan = group_planar(one, 1, local[:, :2], world[:, :2], weights)
        rotation[:2, :2], translation[:2] = plan.rotation[0], plan.translation[0]
        translation[2] = np.average(world[:, 2] - local[:, 2], weights=weights)
        sound, unknowns = plan.spread[0] > GATES.least_spread_m, 4
    else:
        space = group_rigid(one, 1, local, world, weights)
        rotation, translation = space.rotation[0], space.translation[0]
        sound, unknowns = space.spread[0] > GATES.least_spread_m, 6
    v = world - local @ rotation.T - translation
    square = float((weights[:, None] * v**2).sum())
    if not sound or square > chi2.ppf(GATES.fit_level, 3 * len(pairs) - unknowns):
        return None
    centre = np.average(world, axis=0, weights=weights)
    cofactor = _cofactor(world - centre, weights, levelled)
    ordered = pairs[np.argsort(pairs[:, 0])]
    return Matching(ordered, rotation, translation, square, (), centre, cofactor)


def _lever(offset: Array) -> Array:
    """Derivatives (n, 3, 6) of points at offsets (n, 3) by a translation and a rotation."""
    eye = np.broadcast_to(np.eye(3), (len(offset), 3, 3))
    return np.concatenate([eye, -skew(offset)], axis=2)


def _cofactor(offset: Array, weights: Array, levelled: bool) -> Array:
    """Covariance (6, 6) of a motion fitted to points at offsets (n, 3) from their centroid."""
    free = [0, 1, 2, 5] if levelled else [0, 1, 2, 3, 4, 5]
    lever = _lever(offset)[:, :, free]
    normal = np.einsum("n,nij,nik->jk", weights, lever, lever)
    out = np.zeros((6, 6))
    out[np.ix_(free, free)] = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
    return out
