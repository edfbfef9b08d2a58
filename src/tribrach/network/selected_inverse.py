"""Entries of the inverse of ``L D L^T`` on the pattern of L, without the rest of the inverse.

Takahashi, Fagan & Chin 1973, by panels: neighbouring columns of L whose rows below are the same
are taken together. With ``[L_S; L_R]`` a panel of columns S and rows R below them,
``B = L_R L_S^-1`` and Z the inverse,

    Z_RS = -Z_RR B,    Z_SS = L_S^-T D_S^-1 L_S^-1 - B^T Z_RS,

all of it products of small dense matrices. Z_RR lies on the pattern, since what a column couples
is coupled by every later column; it is gathered strip by strip, so that no more than a strip of it
is dense at a time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.kernels import blas_in_one_thread, njit

Index = NDArray[np.integer]

#: columns of the widest panel and of a gathered strip
_WIDEST = 256


def selected_inverse(
    indptr: Index, indices: Index, data: Array, d: Array, widest: int = _WIDEST
) -> tuple[Array, Array]:
    """Compute entries of ``(L D L^T)^-1`` on the pattern of L.

    ``indptr``, ``indices``, ``data``: L in compressed columns, its unit diagonal left out, row
    numbers in order; data is (k,); ``d`` (n,): the diagonal of D; ``widest``: most columns of a
    panel and of a strip. Returns ``value`` (k,): entries of the inverse in the places of ``data``;
    ``diagonal`` (n,): diagonal of the inverse.
    """
    first = _panels(indptr, indices, widest)
    with blas_in_one_thread():
        value, diagonal = _selected(indptr, indices, data, d, first, widest)
    return value, diagonal


def look_up(
    indptr: Index, indices: Index, value: Array, diagonal: Array, row: Index, column: Index
) -> Array:
    """Entries (k,) at pairs of row >= column; NaN outside the pattern."""
    entries: Array = _look_up(indptr, indices, value, diagonal, row, column)
    return entries


def look_up_blocks(
    indptr: Index,
    indices: Index,
    value: Array,
    diagonal: Array,
    place: Index,
    scale: Array,
    columns: Index,
) -> Array:
    """Look blocks of a permuted and scaled inverse up.

    ``indptr``, ``indices``, ``value``, ``diagonal``: entries of the inverse on the pattern of L;
    ``place``, ``scale`` (n,): place of each unknown in the order of elimination, and what
    multiplies its row and column; ``columns`` (k, m): unknowns of each block, negative for none.
    Returns (k, m, m): zero where an unknown is none, NaN outside the pattern.
    """
    return _look_up_blocks(  # type: ignore[no-any-return]
        indptr, indices, value, diagonal, place, scale, columns
    )


@njit(cache=True)
def _panels(indptr, indices, widest):  # type: ignore[no-untyped-def]
    """First columns of the panels, and the number of columns at the end."""
    n = len(indptr) - 1
    first = np.empty(n + 1, dtype=np.int64)
    count = 0
    for j in range(n):
        # its rows are those of the column before it, which has this column in addition
        joins = (
            j > 0
            and indptr[j] > indptr[j - 1]
            and indices[indptr[j - 1]] == j
            and indptr[j + 1] - indptr[j] == indptr[j] - indptr[j - 1] - 1
            and j - first[count - 1] < widest
        )
        if not joins:
            first[count] = j
            count += 1
    first[count] = n
    return first[: count + 1].copy()


@njit(cache=True)
def _selected(indptr, indices, data, d, first, widest):  # type: ignore[no-untyped-def]
    """Values and diagonal, panel by panel from the last."""
    n = len(d)
    value = np.empty(len(data))
    diagonal = np.empty(n)
    where = np.full(n, -1, dtype=np.int64)
    for panel in range(len(first) - 2, -1, -1):
        s, e = first[panel], first[panel + 1]
        rows = indices[indptr[e - 1] : indptr[e]]
        inverse, b = _panel(indptr, data, s, e, len(rows))
        below = _times_gathered(indptr, indices, value, diagonal, where, rows, b, widest)
        for k in range(e - s):
            for q in range(k, e - s):  # row q of the inverse of L_S over the root of D
                inverse[q, k] /= np.sqrt(d[s + q])
        inside = np.dot(inverse.T, inverse) + np.dot(b.T, below)
        for k in range(e - s):
            diagonal[s + k] = inside[k, k]
            at = indptr[s + k]
            for q in range(k + 1, e - s):
                value[at] = inside[q, k]
                at += 1
            for q in range(len(rows)):
                value[at + q] = -below[q, k]
    return value, diagonal


@njit(cache=True)
def _panel(indptr, data, s, e, m):  # type: ignore[no-untyped-def]
    """``L_S^-1`` (w, w) and ``B = L_R L_S^-1`` (m, w) of columns s to e."""
    w = e - s
    lower, rest = np.zeros((w, w)), np.empty((m, w))
    for k in range(w):
        at = indptr[s + k]
        for q in range(k + 1, w):
            lower[q, k] = data[at]
            at += 1
        for q in range(m):
            rest[q, k] = data[at + q]
    inverse = np.eye(w)
    for i in range(1, w):
        for q in range(i):
            for k in range(q + 1):
                inverse[i, k] -= lower[i, q] * inverse[q, k]
    return inverse, np.dot(rest, inverse)


@njit(cache=True)
def _times_gathered(  # type: ignore[no-untyped-def]
    indptr, indices, value, diagonal, where, rows, b, widest
):
    """``Z_RR B`` (m, w) from known entries; ``where`` (n,) is -1 before and after."""
    m = len(rows)
    out = np.zeros(b.shape)
    for k in range(m):
        where[rows[k]] = k
    for begin in range(0, m, widest):
        end = min(begin + widest, m)
        strip = np.zeros((m - begin, end - begin))  # the lower half of the matrix from here on
        for k in range(begin, end):
            for at in range(indptr[rows[k]], indptr[rows[k] + 1]):
                place = where[indices[at]]
                if place >= 0:
                    strip[place - begin, k - begin] = value[at]
        # the upper half is the same: with the diagonal only once
        out[begin:end] += np.dot(strip.T, b[begin:])
        for k in range(begin, end):
            strip[k - begin, k - begin] = diagonal[rows[k]]
        out[begin:] += np.dot(strip, b[begin:end])
    for k in range(m):
        where[rows[k]] = -1
    return out


@njit(cache=True)
def _look_up(indptr, indices, value, diagonal, row, column):  # type: ignore[no-untyped-def]
    """Entries one by one."""
    out = np.empty(len(row))
    for k in range(len(row)):
        out[k] = _look_up_one(indptr, indices, value, diagonal, row[k], column[k])
    return out


@njit(cache=True)
def _look_up_one(indptr, indices, value, diagonal, i, j):  # type: ignore[no-untyped-def]
    """An entry with row >= column by bisection of its column."""
    return diagonal[i] if i == j else stored(indptr, indices, value, j, i)


@njit(cache=True)
def stored(indptr, indices, data, i, j):  # type: ignore[no-untyped-def]
    """Element of a compressed row by bisection of its columns; NaN where none is stored."""
    a, b = indptr[i], indptr[i + 1]
    while a < b:
        middle = (a + b) // 2
        if indices[middle] < j:
            a = middle + 1
        else:
            b = middle
    if a < indptr[i + 1] and indices[a] == j:
        return data[a]
    return np.nan


@njit(cache=True)
def _look_up_blocks(  # type: ignore[no-untyped-def]
    indptr, indices, value, diagonal, place, scale, columns
):
    """Each pair of a block once."""
    n, m = columns.shape
    out = np.zeros((n, m, m))
    for k in range(n):
        for p in range(m):
            i = columns[k, p]
            for q in range(p, m):
                j = columns[k, q]
                if i < 0 or j < 0:
                    continue
                a, b = max(place[i], place[j]), min(place[i], place[j])
                found = _look_up_one(indptr, indices, value, diagonal, a, b)
                out[k, p, q] = out[k, q, p] = found * scale[i] * scale[j]
    return out
