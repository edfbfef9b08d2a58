"""LDL^T of a sparse positive definite matrix by panels of columns with the same rows.

Left-looking (Ng & Peyton 1993): every panel collects what the panels before it contribute, all of
it products of small dense matrices, and is then factored by itself.
"""

from __future__ import annotations

import numba
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach.network.elimination_order import filled_pattern, panels

__all__ = ["panel_factor", "solve_factored"]

Array = NDArray[np.float64]

#: columns of the widest panel
_WIDEST = 64


def panel_factor(matrix: sp.csc_array, widest: int = _WIDEST) -> tuple[sp.csc_array, Array]:
    """L without its unit diagonal (n, n) and D (n,) of an ordered matrix with both halves.

    If a pivot is not positive, D has it there and 0 further on, and L is not complete.
    widest : columns of a panel, at most.
    """
    indptr, indices = filled_pattern(matrix)
    first = panels(indptr, indices, widest)
    data, d = _factor(matrix.indptr, matrix.indices, matrix.data, indptr, indices, first)
    return sp.csc_array((data, indices, indptr), shape=matrix.shape), d


def solve_factored(lower: sp.csc_array, d: Array, b: Array) -> Array:
    """``(L D L^T)^-1 b`` (n,)."""
    x = b.astype(float)
    _solve(lower.indptr, lower.indices, lower.data, d, x)
    return x


@numba.njit(cache=True)
def _solve(indptr, indices, data, d, x):  # type: ignore[no-untyped-def]
    """Forward and back in place."""
    n = len(x)
    for j in range(n):
        for at in range(indptr[j], indptr[j + 1]):
            x[indices[at]] -= data[at] * x[j]
    for j in range(n - 1, -1, -1):
        total = x[j] / d[j]
        for at in range(indptr[j], indptr[j + 1]):
            total -= data[at] * x[indices[at]]
        x[j] = total


@numba.njit(cache=True)
def _factor(ap, ai, ax, indptr, indices, first):  # type: ignore[no-untyped-def]
    """Data of L and D; ``ap, ai, ax`` : the matrix by columns."""
    n, count = len(indptr) - 1, len(first) - 1
    d, data = np.zeros(n), np.zeros(len(indices))
    owner, start = np.empty(n, dtype=np.int64), np.zeros(count + 1, dtype=np.int64)
    for p in range(count):
        e = first[p + 1]
        owner[first[p] : e] = p
        start[p + 1] = start[p] + (indptr[e] - indptr[e - 1]) * (e - first[p])
    # rows below of each panel, as rows of the Cholesky factor
    store = np.empty(start[count])
    where = np.empty(n, dtype=np.int64)
    # panels that contribute to a panel next, as a chain; how far each has been used
    head, following = np.full(count, -1, dtype=np.int64), np.full(count, -1, dtype=np.int64)
    used = np.zeros(count, dtype=np.int64)
    for p in range(count):
        s, e = first[p], first[p + 1]
        rows = indices[indptr[e - 1] : indptr[e]]
        front = _front(ap, ai, ax, s, e, rows, where)
        other = head[p]
        while other != -1:
            upcoming, stop = following[other], first[other + 1]
            theirs = indices[indptr[stop - 1] : indptr[stop]]
            block = store[start[other] : start[other + 1]].reshape(len(theirs), stop - first[other])
            used[other] = _take_away(front, block, theirs, used[other], s, e, where)
            if used[other] < len(theirs):
                heir = owner[theirs[used[other]]]
                following[other], head[heir] = head[heir], other
            other = upcoming
        good = _eliminate(front)
        _keep(front, s, good, indptr, data, d)
        if good < e - s:
            break
        store[start[p] : start[p + 1]] = front[:, e - s :].T.copy().ravel()
        if len(rows):
            following[p], head[owner[rows[0]]] = head[owner[rows[0]]], p
    return data, d


@numba.njit(cache=True)
def _front(ap, ai, ax, s, e, rows, where):  # type: ignore[no-untyped-def]
    """Columns s to e of the matrix, each a row (w, w + m) over S and the rows below.

    where (n,) : gets the place of each of these rows.
    """
    w = e - s
    for k in range(w):
        where[s + k] = k
    for k in range(len(rows)):
        where[rows[k]] = w + k
    front = np.zeros((w, w + len(rows)))
    for j in range(s, e):
        for at in range(ap[j], ap[j + 1]):
            if ai[at] >= j:
                front[j - s, where[ai[at]]] = ax[at]
    return front


@numba.njit(cache=True)
def _take_away(front, block, rows, begin, s, e, where):  # type: ignore[no-untyped-def]
    """Subtract what an earlier panel contributes to columns s to e; its first row beyond them.

    block (m, w), rows (m,) : of the earlier panel; begin : its first row within s to e.
    """
    end = begin
    while end < len(rows) and rows[end] < e:
        end += 1
    product = np.dot(block[begin:end], block[begin:].T)
    for b in range(end - begin):
        into = front[rows[begin + b] - s]
        for a in range(b, len(rows) - begin):
            into[where[rows[begin + a]]] -= product[b, a]
    return end


@numba.njit(cache=True)
def _eliminate(front):  # type: ignore[no-untyped-def]
    """Cholesky factor of the columns of a front, in place; how many pivots are positive.

    The first that is not is left as it is.
    """
    w, width = front.shape
    for k in range(w):
        mine = front[k]
        for q in range(k):
            other, share = front[q], front[q, k]
            for i in range(k, width):
                mine[i] -= share * other[i]
        if not mine[k] > 0:
            return k
        root = np.sqrt(mine[k])
        for i in range(k, width):
            mine[i] /= root
    return w


@numba.njit(cache=True)
def _keep(front, s, good, indptr, data, d):  # type: ignore[no-untyped-def]
    """Columns of L and D from those of the Cholesky factor."""
    for k in range(good):
        d[s + k] = front[k, k] ** 2
        at = indptr[s + k]
        for q in range(k + 1, front.shape[1]):
            data[at] = front[k, q] / front[k, k]
            at += 1
    if good < len(front):
        d[s + good] = front[good, good]
