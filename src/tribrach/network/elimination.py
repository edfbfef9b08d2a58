"""Elimination of a sparse symmetric matrix: ``P N P^T = L D L^T`` by dense fronts.

The order is that of approximate minimum degree, found on a smaller graph: unknowns that are coupled
with the same others, as the three coordinates of a point are, stand in it as one. Neighbouring
columns of L whose rows below are the same make a panel (as in
:mod:`~tribrach.network.selected_inverse`). Panels are eliminated in postorder: each gathers its
rows of N and what the panels before left for them in a dense matrix, its front, takes its columns
out and leaves the rest for the next (Duff & Reid 1983). All of it is products of dense matrices,
where elimination column by column waits for memory.
"""

from __future__ import annotations

import hashlib
from collections import deque
from dataclasses import dataclass

import numpy as np
import qdldl
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.kernels import blas_in_one_thread, njit

Index = NDArray[np.integer]

#: columns of the widest panel
_WIDEST = 64


@dataclass(frozen=True)
class Elimination:
    """A factor, in the order of elimination."""

    place: Index  #: (n,), place of each unknown in the order
    #: L in compressed columns, its unit diagonal left out, row numbers in order
    indptr: Index
    indices: Index
    data: Array
    #: (n,), the diagonal of D. After a pivot that is not positive nothing more is computed: it is
    #: there, and what follows is zero.
    d: Array


def eliminate(matrix: sp.csc_array) -> Elimination:
    """Factor a symmetric positive definite matrix (n, n), both halves of it stored.

    Matrices with the same pattern, as those of one adjustment are, share the search for an order.
    """
    matrix.sort_indices()
    place, panels = _analysed(matrix)
    # lower half of the permuted matrix by columns
    columns = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
    row, column = place[matrix.indices], place[columns]
    lower = np.flatnonzero(row >= column)
    ordered = sp.csc_array((matrix.data[lower], (row[lower], column[lower])), shape=matrix.shape)
    width, below = np.diff(panels.first), np.diff(panels.start)
    number = np.repeat(np.arange(len(width)), width)
    length = width[number] - 1 - (np.arange(len(place)) - panels.first[number]) + below[number]
    indptr = np.concatenate([[0], np.cumsum(length)])
    with blas_in_one_thread():
        indices, data, d = _eliminated(
            ordered.indptr.astype(np.int64),
            ordered.indices.astype(np.int32),
            ordered.data,
            panels.first,
            panels.start,
            panels.rows,
            panels.waiting,
            indptr,
        )
    return Elimination(place, indptr, indices, data, d)


@dataclass(frozen=True)
class _Panels:
    """Panels in postorder."""

    first: Index  #: (p + 1,), first column of each, and the number of columns
    start: Index  #: (p + 1,), first place in ``rows`` of each
    rows: Index  #: rows below each
    waiting: Index  #: (p,), how many panels before left something for it


#: digests of patterns, with what was found for them
_REMEMBERED: deque[tuple[bytes, tuple[Index, _Panels]]] = deque(maxlen=2)


def _analysed(matrix: sp.csc_array) -> tuple[Index, _Panels]:
    """Place of each column (n,) in the order of elimination, and the panels."""
    digest = hashlib.blake2b(matrix.indptr.tobytes())
    digest.update(matrix.indices.tobytes())
    for known, found in _REMEMBERED:
        if known == digest.digest():
            return found
    found = _analysis(matrix)
    _REMEMBERED.append((digest.digest(), found))
    return found


def _analysis(matrix: sp.csc_array) -> tuple[Index, _Panels]:
    """As `_analysed`, of a pattern that is new."""
    group, member = _alike(matrix)
    graph = sp.csc_array(matrix[member][:, member])
    order, pattern = _ordered(graph)
    parent, post = _postorder(pattern)
    pattern = sp.csc_array(pattern[post][:, post])
    pattern.sort_indices()
    order = order[post]
    size = np.bincount(group)[order]
    begin = np.concatenate([[0], np.cumsum(size)])
    # members of a group stand one after the other
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    place = np.empty(len(group), dtype=np.int64)
    place[np.argsort(rank[group], kind="stable")] = np.arange(len(group))

    count = np.diff(pattern.indptr)
    joins = np.zeros(len(order), dtype=bool)
    joins[1:] = (parent[:-1] == np.arange(1, len(order))) & (count[1:] == count[:-1] - 1)
    heads, room = [], 0
    for k, (width, joined) in enumerate(zip(size.tolist(), joins.tolist(), strict=True)):
        if joined and room >= width:
            room -= width
        else:
            heads.append(k)
            room = _WIDEST - width
    head = np.array([*heads, len(order)])
    last = head[1:] - 1
    # rows below the last group of each panel, all members of each group
    groups, owner = _ranges(pattern.indptr[last], count[last])
    groups = pattern.indices[groups]
    rows, _ = _ranges(begin[groups], size[groups])
    below = np.bincount(owner, weights=size[groups], minlength=len(last)).astype(np.int64)
    number = np.repeat(np.arange(len(last)), np.diff(head))
    above = parent[last]
    waiting = np.bincount(number[above[above >= 0]], minlength=len(last))
    start = np.concatenate([[0], np.cumsum(below)])
    return place, _Panels(begin[head], start, rows, waiting)


def _ranges(first: Index, count: Index) -> tuple[Index, Index]:
    """Numbers of several ranges one after the other, and which range each is of."""
    owner = np.repeat(np.arange(len(count)), count)
    ends = np.cumsum(count)
    return np.arange(len(owner)) - (ends - count)[owner] + first[owner], owner


def _alike(matrix: sp.csc_array) -> tuple[Index, Index]:
    """Group (n,) of columns with the same rows, and a member of each group."""
    n = matrix.shape[1]
    count = np.diff(matrix.indptr)
    label = np.random.default_rng(0).integers(2**63, size=n, dtype=np.uint64)
    ends = np.concatenate([[np.uint64(0)], np.cumsum(label[matrix.indices], dtype=np.uint64)])
    total = ends[matrix.indptr[1:]] - ends[matrix.indptr[:-1]]  # overflow does no harm
    _, member, group = np.unique(total, return_index=True, return_inverse=True)
    # those that only seem alike stay alone
    one = member[group]
    same = count == count[one]
    left, owner = _ranges(matrix.indptr[:-1][same], count[same])
    right, _ = _ranges(matrix.indptr[one][same], count[same])
    wrong = owner[matrix.indices[left] != matrix.indices[right]]
    same[np.flatnonzero(same)[wrong]] = False
    if not same.all():
        alone = np.flatnonzero(~same)
        group[alone] = len(member) + np.arange(len(alone))
        member = np.concatenate([member, alone])
    return group, member


def _ordered(graph: sp.csc_array) -> tuple[Index, sp.csc_array]:
    """Order of elimination (m,) of a graph, and the pattern of its factor (m, m) in it."""
    pattern = sp.csc_array((np.ones(graph.nnz), graph.indices, graph.indptr), shape=graph.shape)
    pattern.setdiag(1.0 + np.diff(graph.indptr))
    # its factor is that of a matrix with a dominant diagonal: no entry of it vanishes
    lower, _, order = qdldl.Solver(sp.csc_matrix(pattern)).factors()
    return order, sp.csc_array(lower)


def _postorder(pattern: sp.csc_array) -> tuple[Index, Index]:
    """Parents (m,) in the elimination tree by new numbers, and the columns (m,) in postorder."""
    m = pattern.shape[1]
    pattern.sort_indices()
    parent = np.full(m, -1)
    some = np.diff(pattern.indptr) > 0
    parent[some] = pattern.indices[pattern.indptr[:-1][some]]
    size = [1] * m
    above = parent.tolist()
    for k, up in enumerate(above):  # children come before their parents
        if up >= 0:
            size[up] += size[k]
    # subtrees are laid one before the other, each parent behind its children
    place, room = [0] * m, [0] * m
    total = 0
    for k in range(m - 1, -1, -1):
        up = above[k]
        end = room[up] if up >= 0 else m - total
        if up >= 0:
            room[up] -= size[k]
        else:
            total += size[k]
        place[k] = end - 1
        room[k] = end - 1
    number = np.array(place, dtype=np.int64)
    post = np.empty(m, dtype=np.int64)
    post[number] = np.arange(m)
    renumbered = np.full(m, -1)
    renumbered[number[some]] = number[parent[some]]
    return renumbered, post


@njit(cache=True)
def _eliminated(  # type: ignore[no-untyped-def]
    a_first, a_rows, a_data, first, start, rows, waiting, indptr
):
    """L and D, front by front; what is left waits on a stack, the last panel's on top."""
    n = len(indptr) - 1
    indices = np.empty(indptr[n], dtype=np.int32)
    data = np.zeros(indptr[n])
    d = np.zeros(n)
    where = np.empty(n, dtype=np.int64)
    stack = np.empty(0)
    used, owners = 0, np.empty(len(first), dtype=np.int64)
    depth = 0
    for p in range(len(first) - 1):
        s, e = first[p], first[p + 1]
        w, m = e - s, start[p + 1] - start[p]
        for k in range(w):
            where[s + k] = k
        for k in range(m):
            where[rows[start[p] + k]] = w + k
        front = np.zeros((w + m, w + m))
        for j in range(s, e):
            for at in range(a_first[j], a_first[j + 1]):
                front[where[a_rows[at]], j - s] = a_data[at]
        for _ in range(waiting[p]):
            depth -= 1
            child = owners[depth]
            b = start[child]
            c = start[child + 1] - b
            used -= c * c
            for i in range(c):
                to = where[rows[b + i]]
                for j in range(i + 1):
                    front[to, where[rows[b + j]]] += stack[used + i * c + j]
        if not _taken_out(front, w, d[s:e]):
            break
        for k in range(w):
            at = indptr[s + k]
            for q in range(k + 1, w):
                indices[at] = s + q
                data[at] = front[q, k]
                at += 1
            for q in range(m):
                indices[at + q] = rows[start[p] + q]
                data[at + q] = front[w + q, k]
        if m == 0:
            continue
        if used + m * m > len(stack):
            grown = np.empty(max(2 * len(stack), used + m * m))
            grown[:used] = stack[:used]
            stack = grown
        _left(front, w, d[s:e], stack[used : used + m * m].reshape(m, m))
        owners[depth] = p
        used += m * m
        depth += 1
    return indices, data, d


@njit(cache=True)
def _taken_out(front, w, d):  # type: ignore[no-untyped-def]
    """Columns of L in those of the front, and D; False at a pivot that is not positive."""
    m = len(front) - w
    for k in range(w):
        d[k] = front[k, k]
        if not d[k] > 0:
            return False
        for i in range(k + 1, w):
            factor = front[i, k] / d[k]
            for j in range(k + 1, i + 1):
                front[i, j] -= factor * front[j, k]
        for i in range(k + 1, w):
            front[i, k] /= d[k]
    if m > 0:
        # rows below: times the inverse of L^T, over D
        inverse = np.eye(w)
        for i in range(1, w):
            for q in range(i):
                for k in range(q + 1):
                    inverse[i, k] -= front[i, q] * inverse[q, k]
        below = np.dot(front[w:, :w].copy(), inverse.T)
        for i in range(m):
            for k in range(w):
                front[w + i, k] = below[i, k] / d[k]
    return True


@njit(cache=True)
def _left(front, w, d, out):  # type: ignore[no-untyped-def]
    """What a front leaves (m, m) for later ones, its lower half."""
    m = len(front) - w
    one = front[w:, :w].copy()
    two = one * d
    product = np.dot(one, two.T)
    for i in range(m):
        for j in range(i + 1):
            out[i, j] = front[w + i, w + j] - product[i, j]
