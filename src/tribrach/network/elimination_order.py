"""In which order are the columns of a sparse symmetric matrix eliminated, and what fills in?

The order is of approximate minimum degree (Amestoy, Davis & Duff 1996), found on the graph of
groups of columns that are coupled to the same others, such as the coordinates of a point; then
it follows the elimination tree from the leaves (Liu 1990), so that columns with the same rows
stand side by side.
"""

from __future__ import annotations

import numba
import numpy as np
import qdldl
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["elimination_order", "filled_pattern", "panels"]

Index = NDArray[np.integer]


def elimination_order(matrix: sp.csc_array) -> Index:
    """Columns (n,) of a symmetric matrix (n, n) that is given with both halves, first to last.

    Only its pattern matters.
    """
    ones = sp.csc_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    pattern = sp.csc_array(ones + sp.eye_array(matrix.shape[0]))
    pattern.sort_indices()
    group, members = _groups(pattern)
    chosen = members[np.searchsorted(group[members], np.arange(group.max(initial=-1) + 1))]
    small = sp.csc_array(pattern[chosen][:, chosen])
    # any diagonally dominant matrix of that pattern: its numbers have no part in the order
    small.data[:] = -1.0
    dominant = sp.csc_matrix(small + sp.diags_array(np.diff(small.indptr) + 1.0))
    _, _, by_group = qdldl.Solver(dominant).factors()
    rank = np.empty(len(chosen), dtype=np.int64)
    rank[by_group] = np.arange(len(chosen))
    order = np.argsort(rank[group], kind="stable")
    ordered = sp.csc_array(pattern[order][:, order])
    found: Index = order[_from_the_leaves(_tree(ordered.indptr, ordered.indices))]
    return found


def _groups(pattern: sp.csc_array) -> tuple[Index, Index]:
    """Number of the group (n,) of each column; columns (n,) sorted by group.

    Columns belong together if they have the same rows, told by the sum of a draw for each row.
    """
    draw = np.random.default_rng(0).integers(1, 1 << 62, pattern.shape[0], dtype=np.uint64)
    key = np.add.reduceat(draw[pattern.indices], pattern.indptr[:-1])
    _, group = np.unique(key, return_inverse=True)
    return group, np.argsort(group, kind="stable")


def filled_pattern(matrix: sp.csc_array) -> tuple[Index, Index]:
    """Where the factor of an ordered matrix has entries: indptr (n + 1,), indices by columns.

    matrix : with both halves. The row numbers of a column are in order; its diagonal is left out.
    """
    indptr, indices = _filled(matrix.indptr, matrix.indices, _tree(matrix.indptr, matrix.indices))
    return (indptr.astype(np.int32) if len(indices) < np.iinfo(np.int32).max else indptr), indices


@numba.njit(cache=True)
def _tree(indptr, indices):  # type: ignore[no-untyped-def]
    """Parent of each column in the elimination tree, -1 for a root (Liu 1990)."""
    n = len(indptr) - 1
    parent = np.full(n, -1, dtype=np.int64)
    ancestor = np.full(n, -1, dtype=np.int64)
    for i in range(n):
        for at in range(indptr[i], indptr[i + 1]):
            k = indices[at]
            while k != -1 and k < i:
                following = ancestor[k]
                ancestor[k] = i
                if following == -1:
                    parent[k] = i
                k = following
    return parent


@numba.njit(cache=True)
def _from_the_leaves(parent):  # type: ignore[no-untyped-def]
    """Columns in an order that takes every subtree before its root and without a gap."""
    n = len(parent)
    child = np.full(n, -1, dtype=np.int64)
    sibling = np.full(n, -1, dtype=np.int64)
    for j in range(n - 1, -1, -1):
        if parent[j] >= 0:
            sibling[j] = child[parent[j]]
            child[parent[j]] = j
    order = np.empty(n, dtype=np.int64)
    stack = np.empty(n, dtype=np.int64)
    done = 0
    for root in range(n):
        if parent[root] >= 0:
            continue
        stack[0], height = root, 1
        while height:
            j = stack[height - 1]
            if child[j] >= 0:
                stack[height] = child[j]
                child[j] = sibling[child[j]]
                height += 1
            else:
                order[done] = j
                done += 1
                height -= 1
    return order


@numba.njit(cache=True)
def _filled(indptr, indices, parent):  # type: ignore[no-untyped-def]
    """Pattern by columns; each row is walked from its entries up the tree."""
    n = len(parent)
    counts = np.zeros(n + 1, dtype=np.int64)
    mark = np.full(n, -1, dtype=np.int64)
    for i in range(n):
        mark[i] = i
        for at in range(indptr[i], indptr[i + 1]):
            k = indices[at]
            while k < i and mark[k] != i:
                mark[k] = i
                counts[k + 1] += 1
                k = parent[k]
    first = np.cumsum(counts)
    out = np.empty(first[n], dtype=np.int32)
    place = first[:-1].copy()
    mark[:] = -1
    for i in range(n):
        mark[i] = i
        for at in range(indptr[i], indptr[i + 1]):
            k = indices[at]
            while k < i and mark[k] != i:
                mark[k] = i
                out[place[k]] = i
                place[k] += 1
                k = parent[k]
    return first, out


@numba.njit(cache=True)
def panels(indptr, indices, widest):  # type: ignore[no-untyped-def]
    """First columns of the panels, then n: neighbouring columns whose rows below are the same."""
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
