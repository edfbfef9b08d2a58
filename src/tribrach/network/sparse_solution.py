"""Solutions with ``L D L^T``: several right-hand sides at once, and halves of sparse ones.

Half a solution ``y = D^-1/2 L^-1 b`` is all that forms ``b^T N^-1 c = y_b^T y_c`` need. Where b has
few entries, y has entries only on their ways to the root of the elimination tree (Gilbert 1994),
which are far fewer than those of the factor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.kernels import njit

Index = NDArray[np.integer]


def solutions(indptr: Index, indices: Index, data: Array, d: Array, b: Array) -> None:
    """Solve ``L D L^T x = b`` for dense right-hand sides, in their place.

    ``indptr``, ``indices``, ``data``: L in compressed columns, its unit diagonal left out, row
    numbers in order; data is (k,); ``d`` (n,): the diagonal of D; ``b`` (n, m): right-hand sides by
    rows in memory; the solutions afterwards.
    """
    _solve(indptr, indices, data, d, b)


def half_solutions(
    indptr: Index, indices: Index, data: Array, d: Array, first: Index, rows: Index, values: Array
) -> tuple[Array, Index, Index]:
    """Compute ``D^-1/2 L^-1 B`` of sparse columns.

    ``indptr``, ``indices``, ``data``: L in compressed columns, its unit diagonal left out, row
    numbers in order; data is (k,); ``d`` (n,): the diagonal of D, positive; ``first``, ``rows``,
    ``values``: B (n, m) in compressed columns; ``rows`` in any order.
    """
    return _half(  # type: ignore[no-any-return]
        indptr, indices, data, d, first, rows, values
    )


def roots(indptr: Index, indices: Index) -> Index:
    """Roots (n,) of the elimination tree of L above each column; parts that are apart differ."""
    return _roots(indptr, indices)  # type: ignore[no-any-return]


def column_products(
    indptr: Index, indices: Index, data: Array, first: Index, second: Index
) -> Array:
    """Products ``x_i^T x_j`` (k,) of sparse columns ``first``, ``second`` (k,), rows in order."""
    return _products(indptr, indices, data, first, second)  # type: ignore[no-any-return]


@njit(cache=True)
def _roots(indptr, indices):  # type: ignore[no-untyped-def]
    """The last column for each, from the last on."""
    n = len(indptr) - 1
    out = np.empty(n, dtype=np.int64)
    for j in range(n - 1, -1, -1):
        out[j] = out[indices[indptr[j]]] if indptr[j] < indptr[j + 1] else j
    return out


@njit(cache=True)
def _products(indptr, indices, data, first, second):  # type: ignore[no-untyped-def]
    """Both columns passed together."""
    out = np.zeros(len(first))
    for k in range(len(first)):
        a, a_end = indptr[first[k]], indptr[first[k] + 1]
        b, b_end = indptr[second[k]], indptr[second[k] + 1]
        while a < a_end and b < b_end:
            if indices[a] < indices[b]:
                a += 1
            elif indices[a] > indices[b]:
                b += 1
            else:
                out[k] += data[a] * data[b]
                a += 1
                b += 1
    return out


@njit(cache=True)
def _solve(indptr, indices, data, d, b):  # type: ignore[no-untyped-def]
    """Forward elimination, diagonal, back substitution, row by row of b."""
    n, m = b.shape
    for j in range(n):
        for at in range(indptr[j], indptr[j + 1]):
            i, factor = indices[at], data[at]
            for k in range(m):
                b[i, k] -= factor * b[j, k]
    for j in range(n - 1, -1, -1):
        for k in range(m):
            b[j, k] /= d[j]
        for at in range(indptr[j], indptr[j + 1]):
            i, factor = indices[at], data[at]
            for k in range(m):
                b[j, k] -= factor * b[i, k]


@njit(cache=True)
def _way(indptr, indices, column, rows, seen, way):  # type: ignore[no-untyped-def]
    """First place in ``way`` of what a column reaches; ways that join come before."""
    begin = len(way)
    for row in rows:
        j, count = row, 0
        while seen[j] != column:
            seen[j] = column
            count += 1
            if indptr[j] == indptr[j + 1]:
                break
            j = indices[indptr[j]]
        begin -= count
        j = row
        for k in range(count):
            way[begin + k] = j
            if k + 1 < count:
                j = indices[indptr[j]]
    return begin


@njit(cache=True)
def _half(indptr, indices, data, d, first, rows, values):  # type: ignore[no-untyped-def]
    """Values, row numbers and first places of half solutions."""
    n, m = len(d), len(first) - 1
    seen, way = np.full(n, -1, dtype=np.int64), np.empty(n, dtype=np.int64)
    ends = np.zeros(m + 1, dtype=np.int64)
    for c in range(m):
        ends[c + 1] = ends[c] + n
        ends[c + 1] -= _way(indptr, indices, c, rows[first[c] : first[c + 1]], seen, way)
    out_rows, out = np.empty(ends[m], dtype=np.int64), np.empty(ends[m])
    work = np.zeros(n)
    for c in range(m):
        chosen = rows[first[c] : first[c + 1]]
        begin = _way(indptr, indices, m + c, chosen, seen, way)
        for at in range(first[c], first[c + 1]):
            work[rows[at]] += values[at]
        for k in range(begin, n):
            j = way[k]
            x = work[j]
            work[j] = 0.0
            for at in range(indptr[j], indptr[j + 1]):
                work[indices[at]] -= data[at] * x
            out_rows[ends[c] + k - begin] = j
            out[ends[c] + k - begin] = x / np.sqrt(d[j])
    return out, out_rows, ends
