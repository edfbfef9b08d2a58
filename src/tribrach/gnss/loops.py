"""Loops that baselines close, and their closures.

Minimal loops are those of a minimum cycle basis: as many independent loops as the network has, the
shortest ones (Horton 1987, SIAM J. Comput. 16). Repeated baselines are loops of two. Triangles that
the basis leaves out are checked as well. The closure is ``w = sum of +- vectors`` with covariance
``C_w = A C A^T``, tested by ``w^T C_w^-1 w`` against chi-square (method section 2.7).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from tribrach._types import Array, Index
from tribrach.answers import Matrix, Result, Vector
from tribrach.statistics import chi2

#: a loop as (baseline, +1 or -1) in the order it is walked
Walk = tuple[tuple[int, int], ...]
#: above this many candidates of the shortest basis the loops of a shortest tree are taken
MOST_CANDIDATES = 400_000
#: triangles beyond this number are not listed
MOST_TRIANGLES = 2_000


@dataclass(frozen=True)
class BaselineLoop(Result, also=("size", "ppm", "passes"), without=("points", "walk")):
    """A closed loop of baselines."""

    points: tuple[int, ...]  #: indices of the points in the order they are walked
    walk: Walk  #: baselines with their directions, +1 or -1
    closure: Vector  #: (3,), sum of the vectors [m]
    covariance: Matrix  #: (3, 3), of the closure [m^2]
    length: float  #: of all sides [m]
    statistic: float  #: ``w^T C_w^-1 w``
    #: its degrees of freedom: fewer than three where the covariance is singular, zero where the
    #: loop tells nothing
    dof: int
    limit: float  #: above it the loop does not pass
    independent: bool  #: the loop is part of the basis

    @property
    def size(self) -> float:
        """Length of the closure [m]."""
        return float(np.linalg.norm(self.closure))

    @property
    def ppm(self) -> float:
        """Closure per length of the loop [1e-6]."""
        return 1e6 * self.size / self.length if self.length > 0 else 0.0

    @property
    def passes(self) -> bool:
        """True if the closure agrees with the covariances."""
        return self.dof == 0 or self.statistic <= self.limit


def minimal_loops(start: Index, end: Index, length: Array) -> list[Walk]:
    """Minimum cycle basis of baselines with ends (n,) and lengths (n,) [m], repeated ones first."""
    sides, repeated = _sides(start, end)
    pairs: list[Walk] = [
        ((first, 1), (k, -1 if start[first] == start[k] else 1)) for first, k in repeated
    ]
    if not len(sides):
        return pairs
    _, numbers = np.unique(np.concatenate([start[sides], end[sides]]), return_inverse=True)
    a, b = numbers[: len(sides)], numbers[len(sides) :]
    count = int(numbers.max()) + 1
    weight = np.maximum(length[sides], 1e-6)
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    graph = csr_matrix((np.concatenate([weight, weight]), (rows, columns)), shape=(count, count))
    wanted = len(sides) - count + int(connected_components(graph, directed=False)[0])
    masks = _basis(_candidates(graph, a, b, weight), wanted)
    walks = (_walk(mask, a, b) for mask in masks)
    named = [tuple((int(sides[k]), sign) for k, sign in walk) for walk in walks]
    return [*pairs, *sorted(named, key=lambda walk: sum(float(length[k]) for k, _ in walk))]


def triangles(start: Index, end: Index) -> list[Walk]:
    """Triangles of baselines between points, none twice, at most :data:`MOST_TRIANGLES`."""
    sides, _ = _sides(start, end)
    neighbours: dict[int, dict[int, int]] = {}
    for k in sides:
        a, b = int(start[k]), int(end[k])
        neighbours.setdefault(a, {})[b] = int(k)
        neighbours.setdefault(b, {})[a] = int(k)
    walks: list[Walk] = []
    for a, b, c in _triples(neighbours):
        edges = (neighbours[a][b], neighbours[b][c], neighbours[c][a])
        walks.append(
            tuple((k, 1 if start[k] == p else -1) for k, p in zip(edges, (a, b, c), strict=True))
        )
        if len(walks) == MOST_TRIANGLES:
            break
    return walks


def close_loops(
    walks: Sequence[Walk],
    start: Index,
    end: Index,
    vectors: Array,
    covariance: Array | csr_matrix,
    *,
    independent: int | None = None,
    alpha: float = 0.05,
) -> list[BaselineLoop]:
    """Closures of loops of baselines (n, 3) [m] with covariances.

    ``covariance`` [m^2] is (3n, 3n), dense or sparse, or (n, 3, 3) if uncorrelated;
    ``independent``: how many of the first walks are of the basis, all if None.
    """
    many = len(walks) if independent is None else independent
    out = []
    for number, walk in enumerate(walks):
        edges = np.array([k for k, _ in walk])
        signs = np.array([sign for _, sign in walk], dtype=float)
        closure = signs @ vectors[edges]
        block = _block(covariance, edges)
        matrix = np.einsum("a,aibj,b->ij", signs, block, signs)
        scale = float(np.einsum("aiai->", block))
        statistic, dof = _statistic(closure, matrix, scale)
        length = float(np.linalg.norm(vectors[edges], axis=1).sum())
        limit = float(chi2.ppf(1 - alpha, dof)) if dof else 0.0
        points = tuple(int(start[k] if sign > 0 else end[k]) for k, sign in walk)
        out.append(
            BaselineLoop(
                points, tuple(walk), closure, matrix, length, statistic, dof, limit, number < many
            )
        )
    return out


def _block(covariance: Array | csr_matrix, edges: Index) -> Array:
    """Covariance (k, 3, k, 3) of some vectors."""
    k = len(edges)
    if not isinstance(covariance, np.ndarray) or covariance.ndim == 2:
        rows = (3 * edges[:, None] + np.arange(3)).ravel()
        part = covariance[rows][:, rows]
        dense = part if isinstance(part, np.ndarray) else part.toarray()
        return np.asarray(dense, dtype=float).reshape(k, 3, k, 3)
    block = np.zeros((k, 3, k, 3))
    block[np.arange(k), :, np.arange(k), :] = covariance[edges]
    return block


def _statistic(closure: Array, matrix: Array, scale: float) -> tuple[float, int]:
    """``w^T C^+ w`` over the directions in which the closure can differ from zero."""
    values, axes = np.linalg.eigh(matrix)
    open_ = values > 1e-9 * max(scale, 1e-30)
    along = closure @ axes
    return float((along[open_] ** 2 / values[open_]).sum()), int(open_.sum())


def _sides(start: Index, end: Index) -> tuple[Index, list[tuple[int, int]]]:
    """First baseline of each pair of points, and (first, repeated) of the others."""
    first: dict[tuple[int, int], int] = {}
    repeated = []
    for k, (a, b) in enumerate(zip(start.tolist(), end.tolist(), strict=True)):
        key = (min(a, b), max(a, b))
        if key in first:
            repeated.append((first[key], k))
        else:
            first[key] = k
    return np.array(list(first.values()), dtype=np.int64), repeated


def _candidates(graph: csr_matrix, a: Index, b: Index, weight: Array) -> list[int]:
    """Loops as bits over the sides, the shortest first: a shortest path there, a side, one back."""
    count = graph.shape[0]
    roots = np.arange(count)
    if count * len(a) > MOST_CANDIDATES:
        roots = _roots(graph)
    side_of = {}
    for k, (i, j) in enumerate(zip(a.tolist(), b.tolist(), strict=True)):
        side_of[i, j] = side_of[j, i] = k
    lengths, masks = [], []
    for root in roots.tolist():
        rows = dijkstra(graph, directed=False, indices=np.array([root]), return_predecessors=True)
        distance, before = rows[0][0], rows[1][0]
        path = [0] * count
        for v in np.argsort(distance):
            if before[v] >= 0:
                path[v] = path[before[v]] | 1 << side_of[int(before[v]), int(v)]
        reached = np.flatnonzero(np.isfinite(distance[a]))
        total = distance[a] + distance[b] + weight
        for k in reached.tolist():
            # what both paths share falls out; a side of the tree itself leaves nothing
            loop = path[a[k]] ^ path[b[k]] ^ 1 << k
            if loop:
                lengths.append(float(total[k]))
                masks.append(loop)
    return [masks[k] for k in np.argsort(lengths, kind="stable")]


def _roots(graph: csr_matrix) -> Index:
    """One point of each part, for networks too large for all shortest paths."""
    labels = connected_components(graph, directed=False)[1]
    return np.unique(labels, return_index=True)[1]


def _basis(masks: list[int], wanted: int) -> list[int]:
    """The first ``wanted`` independent loops, by elimination over their sides modulo two."""
    pivots: dict[int, int] = {}
    chosen: list[int] = []
    for mask in dict.fromkeys(masks):
        if len(chosen) == wanted:
            break
        rest = mask
        while rest and (top := rest.bit_length()) in pivots:
            rest ^= pivots[top]
        if rest:
            pivots[rest.bit_length()] = rest
            chosen.append(mask)
    return chosen


def _walk(mask: int, a: Index, b: Index) -> Walk:
    """A loop's sides in the order they are walked."""
    left = [k for k in range(mask.bit_length()) if mask >> k & 1]
    first = left.pop(0)
    walk, here = [(first, 1)], int(b[first])
    while left:
        k = next(k for k in left if here in (a[k], b[k]))
        left.remove(k)
        walk.append((k, 1 if a[k] == here else -1))
        here = int(b[k] if a[k] == here else a[k])
    return tuple(walk)


def _triples(neighbours: dict[int, dict[int, int]]) -> Iterator[tuple[int, int, int]]:
    """Three points that are joined to each other, each three once."""
    for a in sorted(neighbours):
        later = sorted(b for b in neighbours[a] if b > a)
        for i, b in enumerate(later):
            for c in later[i + 1 :]:
                if c in neighbours[b]:
                    yield a, b, c
