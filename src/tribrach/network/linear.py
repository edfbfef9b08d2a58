"""Factors of the normal matrix that answer with solutions and with entries of the inverse.

Three ways, chosen by structure, one interface (:class:`Factor`):

* :class:`DenseFactor`: Cholesky and the whole inverse, for small networks;
* :class:`SchurFactor`: points eliminated block by block, dense Cholesky of what remains, for
  many targets seen from some stations;
* :class:`SparseFactor`: LDL^T by fronts with minimum-degree ordering and the selected inverse, for
  large networks of points.

None of them ever inverts a large matrix as a whole. Columns are scaled to unit diagonal first
(Jacobi), so that metres, radians and calibration parameters live together.
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index, Mask
from tribrach.kernels import njit
from tribrach.network.elimination import eliminate
from tribrach.network.selected_inverse import (
    look_up,
    look_up_blocks,
    selected_inverse,
    stored,
)
from tribrach.network.sparse_solution import column_products, half_solutions, roots, solutions

AnyIndex = NDArray[np.integer]


#: up to this many unknowns LAPACK inverts the whole matrix: as fast as the sparse ways once their
#: kernels are compiled, and without compiling them (400 points: 3 s on a first use, not 30)
DENSE_LIMIT = 2000
#: largest remainder that is factored densely after the points are eliminated
REDUCED_LIMIT = 4000
#: right-hand sides that pass a sparse factor together, and half solutions that are kept at a time
_TOGETHER, _SPARSE = 32, 4000
#: pivots of the unit-diagonal matrix below this ask for a rank analysis
PIVOT_LIMIT = 1e-11


class SingularMatrix(ArithmeticError):
    """A pivot vanished: the matrix is singular or nearly so."""


class Factor(Protocol):
    """A factored symmetric positive definite matrix (u, u)."""

    #: smallest pivot of the unit-diagonal matrix: 1 - R^2 of the worst explained unknown
    smallest_pivot: float

    def solve(self, b: Array) -> Array:
        """``N^-1 b`` for b (u,) or (u, k)."""
        ...

    def entries(self, i: Index, j: Index) -> Array:
        """Elements (k,) of the inverse at index pairs."""
        ...

    def blocks(self, columns: Index) -> Array:
        """Blocks (n, m, m) of the inverse for groups of unknowns (n, m), zero where negative."""
        ...

    def forms(self, columns: sp.csc_array, width: int) -> Array:
        """``B_g^T N^-1 B_g`` (k, width, width) of sparse columns (u, k * width), group by group.

        Without any entry of the inverse: for groups whose rows are not observed together.
        """
        ...


def factorise(normal: sp.csc_array, point_of: Index) -> Factor:
    """Factor a normal matrix in the way that suits its structure.

    ``normal`` (u, u): symmetric, positive definite; ``point_of`` (u,): number of the point a column
    belongs to, -1 for other unknowns.
    """
    diagonal = normal.diagonal()
    if not (diagonal > 0).all():
        raise SingularMatrix("an unknown is observed by nothing")
    scale = 1 / np.sqrt(diagonal)
    size = normal.shape[0]
    if size <= DENSE_LIMIT:
        return DenseFactor(normal.toarray(), scale)
    lonely = _independent_points(normal, point_of)
    if size - lonely.sum() <= REDUCED_LIMIT and lonely.sum() >= size / 2:
        return SchurFactor(normal, scale, lonely, point_of)
    return SparseFactor(normal, scale)


def _independent_points(normal: sp.csc_array, point_of: Index) -> NDArray[np.bool_]:
    """Columns of points that share no observation with another point."""
    pairs = normal.tocoo()
    a, b = point_of[pairs.row], point_of[pairs.col]
    tied = (a >= 0) & (b >= 0) & (a != b)
    bad = np.zeros(point_of.max(initial=-1) + 2, dtype=bool)
    bad[a[tied]] = True
    lonely: NDArray[np.bool_] = (point_of >= 0) & ~bad[point_of]
    return lonely


def _inverse(lower: Array) -> Array:
    """Symmetric inverse of ``L L^T``."""
    if lower.size == 0:
        return lower
    inverse, _ = scipy.linalg.lapack.dpotri(lower, lower=1)
    full: Array = np.tril(inverse) + np.tril(inverse, -1).T
    return full


class DenseFactor:
    """Cholesky factor and full inverse of a small matrix."""

    def __init__(self, normal: Array, scale: Array) -> None:
        unit = normal * scale[:, None] * scale
        try:
            lower = scipy.linalg.cholesky(unit, lower=True)
        except scipy.linalg.LinAlgError as error:
            raise SingularMatrix(str(error)) from error
        self.smallest_pivot = float(np.diag(lower).min(initial=np.inf) ** 2)
        self.scale = scale
        self._lower = lower

    @cached_property
    def inverse(self) -> Array:
        """The whole inverse (u, u)."""
        return _inverse(self._lower) * self.scale[:, None] * self.scale

    def solve(self, b: Array) -> Array:
        """``N^-1 b``."""
        scale = self.scale if b.ndim == 1 else self.scale[:, None]
        solution: Array = scipy.linalg.cho_solve((self._lower, True), b * scale) * scale
        return solution

    def entries(self, i: Index, j: Index) -> Array:
        """Elements of the inverse."""
        return self.inverse[i, j]

    def blocks(self, columns: Index) -> Array:
        """Blocks of the inverse."""
        out: Array = self.inverse[columns[:, :, None], columns[:, None, :]]
        out[(columns[:, :, None] < 0) | (columns[:, None, :] < 0)] = 0.0
        return out

    def forms(self, columns: sp.csc_array, width: int) -> Array:
        """Forms of groups of columns."""
        out = np.empty((columns.shape[1] // width, width, width))
        for part in _batches(columns.shape, width):
            dense = columns[:, part.start * width : part.stop * width].toarray()
            half = _forward(self._lower, dense * self.scale[:, None])
            out[part] = _squares(half, width)
        return out


class SchurFactor:
    """Independent points eliminated as blocks; the rest dense.

    With ``N = [P R; R^T S]``, P block diagonal: ``Q_ss = (S - R^T P^-1 R)^-1``,
    ``Q_ps = -Y Q_ss`` and ``Q_pp = P^-1 + Y Q_ss Y^T`` where ``Y = P^-1 R``.
    """

    def __init__(
        self, normal: sp.csc_array, scale: Array, lonely: NDArray[np.bool_], point_of: Index
    ) -> None:
        unit = sp.csr_array(normal.multiply(scale[:, None]).multiply(scale[None, :]))
        self.scale = scale
        self.point = np.flatnonzero(lonely)
        self.rest = np.flatnonzero(~lonely)
        self.place = np.empty(len(lonely), dtype=np.int64)
        self.place[self.point] = np.arange(len(self.point))
        self.place[self.rest] = np.arange(len(self.rest))
        self.is_point = lonely
        self.p_inverse, pivot = _block_inverse(
            sp.csr_array(unit[self.point][:, self.point]), point_of[self.point]
        )
        coupling = sp.csr_array(unit[self.point][:, self.rest])
        self.y = sp.csr_array(self.p_inverse @ coupling)
        self.y.sort_indices()
        reduced = unit[self.rest][:, self.rest].toarray() - (coupling.T @ self.y).toarray()
        try:
            lower = scipy.linalg.cholesky(reduced, lower=True)
        except scipy.linalg.LinAlgError as error:
            raise SingularMatrix(str(error)) from error
        self.smallest_pivot = min(pivot, float(np.diag(lower).min(initial=1.0) ** 2))
        self._lower = lower

    @cached_property
    def q_rest(self) -> Array:
        """Inverse of the reduced matrix, the scaled cofactors of everything but the points."""
        return _inverse(self._lower)

    def solve(self, b: Array) -> Array:
        """``N^-1 b`` by forward elimination of the points and back substitution."""
        column = b if b.ndim == 2 else b[:, None]
        scaled = column * self.scale[:, None]
        out = np.empty_like(scaled, dtype=float)
        points = scaled[self.point]
        right = scaled[self.rest] - self.y.T @ points
        rest = scipy.linalg.cho_solve((self._lower, True), right)
        out[self.rest] = rest
        out[self.point] = self.p_inverse @ points - self.y @ rest
        out *= self.scale[:, None]
        return out if b.ndim == 2 else out[:, 0]

    @cached_property
    def _seen(self) -> tuple[Array, Array]:
        """Cofactors of points with what they are seen from, as ``Y``, and of each point itself."""
        y, p = self.y, self.p_inverse
        return _selected_rows(y.indptr, y.indices, y.data, self.q_rest, p.indptr, p.indices, p.data)  # type: ignore[no-any-return]

    def entries(self, i: Index, j: Index) -> Array:
        """Elements of the inverse: looked up for what is observed together, else computed."""
        i, j = np.asarray(i), np.asarray(j)
        a, b = self.place[i], self.place[j]
        pi, pj = self.is_point[i], self.is_point[j]
        out = np.empty(len(i))
        rest = ~pi & ~pj
        out[rest] = self.q_rest[a[rest], b[rest]]
        y, p = self.y, self.p_inverse
        for first, second, mixed in ((a, b, pi & ~pj), (b, a, ~pi & pj)):
            if mixed.any():
                one, two = first[mixed], second[mixed]
                out[mixed] = _within_rows(y.indptr, y.indices, self._seen[0], one, two)
        both = pi & pj
        if both.any():
            out[both] = _within_rows(p.indptr, p.indices, self._seen[1], a[both], b[both])
        far = np.flatnonzero(np.isnan(out))
        if len(far):
            out[far] = self._far(a[far], b[far], pi[far], pj[far])
        return out * self.scale[i] * self.scale[j]

    def blocks(self, columns: Index) -> Array:
        """Blocks of the inverse."""
        y, p = self.y, self.p_inverse
        out = _point_blocks(
            y.indptr, y.indices, self._seen[0], p.indptr, p.indices, self._seen[1], self.q_rest,
            self.place, self.is_point, self.scale, columns,
        )  # fmt: skip
        return _completed(self, columns, out)

    def _far(self, a: Index, b: Index, a_point: Mask, b_point: Mask) -> Array:
        """Scaled elements between points and what does not see them."""
        y, out = self.y, np.empty(len(a))
        for first, second, mixed in ((a, b, a_point & ~b_point), (b, a, ~a_point & b_point)):
            out[mixed] = -_row_times(
                y.indptr, y.indices, y.data, self.q_rest, first[mixed], second[mixed]
            )
        both = a_point & b_point
        out[both] = _row_form(y.indptr, y.indices, y.data, self.q_rest, a[both], b[both])
        return out

    def forms(self, columns: sp.csc_array, width: int) -> Array:
        """Forms of groups of columns: of the points for themselves, and of what remains."""
        unit = sp.csr_array(sp.diags_array(self.scale) @ columns)
        points = unit[self.point]
        out = group_products(sp.csc_array(points), sp.csc_array(self.p_inverse @ points), width)
        rest = sp.csc_array(unit[self.rest] - self.y.T @ points)
        for part in _batches(rest.shape, width):
            dense = rest[:, part.start * width : part.stop * width].toarray()
            out[part] += _squares(_forward(self._lower, dense), width)
        return out


def _block_inverse(blocks: sp.csr_array, point_of: Index) -> tuple[sp.csr_array, float]:
    """Inverse of a block-diagonal matrix whose blocks are points; smallest relative pivot."""
    order = np.argsort(point_of, kind="stable")
    names, first, count = np.unique(point_of[order], return_index=True, return_counts=True)
    rows, columns, values, pivot = [], [], [], 1.0
    coo = blocks.tocoo()
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.repeat(first, count)
    number = np.searchsorted(names, point_of)
    for width in np.unique(count):
        chosen = np.flatnonzero(count == width)
        local = np.full(len(names), -1, dtype=np.int64)
        local[chosen] = np.arange(len(chosen))
        dense = np.zeros((len(chosen), width, width))
        inside = local[number[coo.row]] >= 0
        i, j = coo.row[inside], coo.col[inside]
        dense[local[number[i]], rank[i], rank[j]] = coo.data[inside]
        try:
            lower = np.linalg.cholesky(dense)
        except np.linalg.LinAlgError as error:
            raise SingularMatrix(str(error)) from error
        pivot = min(pivot, float(np.einsum("nii->ni", lower).min() ** 2))
        block = np.linalg.inv(dense)
        index = order[first[chosen][:, None] + np.arange(width)]
        rows.append(np.broadcast_to(index[:, :, None], block.shape).ravel())
        columns.append(np.broadcast_to(index[:, None, :], block.shape).ravel())
        values.append(((block + block.transpose(0, 2, 1)) / 2).ravel())
    triple = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    inverse = sp.csr_array(triple, shape=blocks.shape)
    inverse.sort_indices()
    return inverse, pivot


#: numbers in a dense batch of columns
_BATCH = 4_000_000


def _completed(factor: Factor, columns: Index, blocks: Array) -> Array:
    """Blocks (n, m, m) with what is NaN in them, since nothing observes it together, computed."""
    k, a, b = np.nonzero(np.isnan(blocks))
    if len(k):
        blocks[k, a, b] = factor.entries(columns[k, a], columns[k, b])
    return blocks


def _batches(shape: tuple[int, ...], width: int) -> list[slice]:
    """Groups of columns that make dense batches of some size."""
    groups = shape[1] // width
    step = max(1, _BATCH // max(1, shape[0] * width))
    return [slice(first, min(first + step, groups)) for first in range(0, groups, step)]


def _forward(lower: Array, columns: Array) -> Array:
    """``L^-1 B``."""
    out: Array = scipy.linalg.solve_triangular(lower, columns, lower=True, overwrite_b=True)
    return out


def _squares(half: Array, width: int) -> Array:
    """``Y_g^T Y_g`` (k, width, width) of dense columns (u, k * width)."""
    groups = half.reshape(len(half), half.shape[1] // width, width).transpose(1, 2, 0)
    out: Array = groups @ groups.transpose(0, 2, 1)
    return out


def group_products(one: sp.csc_array, two: sp.csc_array, width: int) -> Array:
    """Products of groups of columns that are known to be symmetric.

    ``one``, ``two`` (u, k * width): X and Y. Returns (k, width, width): ``X_g^T Y_g``.
    """
    groups = one.shape[1] // width
    out = np.empty((groups, width, width))
    if width > groups:
        for g in range(groups):
            chosen = slice(g * width, (g + 1) * width)
            out[g] = (one[:, chosen].T @ two[:, chosen]).toarray()
        return out
    for a in range(width):
        for b in range(a, width):
            both = one[:, a::width].multiply(two[:, b::width])
            out[:, a, b] = out[:, b, a] = np.asarray(both.sum(axis=0)).ravel()
    return out


@njit(cache=True)
def _selected_rows(  # type: ignore[no-untyped-def]
    y_first, y_index, y_data, q_rest, p_first, p_index, p_data
):
    """``-Y Q_ss`` in the places of Y, and ``P^-1 + Y Q_ss Y^T`` in those of ``P^-1``."""
    mixed = np.zeros(len(y_data))
    own = p_data.copy()
    for a in range(len(y_first) - 1):
        first, last = y_first[a], y_first[a + 1]
        for k in range(first, last):
            row, factor = q_rest[y_index[k]], y_data[k]
            for m in range(first, last):
                mixed[m] -= factor * row[y_index[m]]
    place = np.full(q_rest.shape[0], -1, dtype=np.int64)
    for a in range(len(y_first) - 1):
        first, last = y_first[a], y_first[a + 1]
        for k in range(first, last):
            place[y_index[k]] = k
        for at in range(p_first[a], p_first[a + 1]):
            b = p_index[at]
            for k in range(y_first[b], y_first[b + 1]):
                column = y_index[k]
                if place[column] >= 0:
                    own[at] -= mixed[place[column]] * y_data[k]
                    continue
                for m in range(first, last):  # an entry that the other row of the point lacks
                    own[at] += y_data[m] * q_rest[y_index[m], column] * y_data[k]
        for k in range(first, last):
            place[y_index[k]] = -1
    return mixed, own


@njit(cache=True)
def _point_blocks(  # type: ignore[no-untyped-def]
    y_first, y_index, mixed, p_first, p_index, own, q_rest, place, is_point, scale, columns
):
    """Blocks of the inverse between points and the rest; NaN between what is not seen together."""
    n, m = columns.shape
    out = np.zeros((n, m, m))
    for k in range(n):
        for p in range(m):
            i = columns[k, p]
            for q in range(p, m):
                j = columns[k, q]
                if i < 0 or j < 0:
                    continue
                a, b = place[i], place[j]
                if not is_point[i] and not is_point[j]:
                    found = q_rest[a, b]
                elif is_point[i] and is_point[j]:
                    found = stored(p_first, p_index, own, a, b)
                elif is_point[i]:
                    found = stored(y_first, y_index, mixed, a, b)
                else:
                    found = stored(y_first, y_index, mixed, b, a)
                out[k, p, q] = out[k, q, p] = found * scale[i] * scale[j]
    return out


@njit(cache=True)
def _within_rows(indptr, indices, data, i, j):  # type: ignore[no-untyped-def]
    """Elements of compressed rows, their columns in order; NaN where none is stored."""
    out = np.empty(len(i))
    for k in range(len(i)):
        out[k] = stored(indptr, indices, data, i[k], j[k])
    return out


@njit(cache=True)
def _row_times(indptr, indices, data, dense, i, j):  # type: ignore[no-untyped-def]
    """``(Y dense)[i, j]`` for pairs."""
    out = np.zeros(len(i))
    for k in range(len(i)):
        for a in range(indptr[i[k]], indptr[i[k] + 1]):
            out[k] += data[a] * dense[indices[a], j[k]]
    return out


@njit(cache=True)
def _row_form(indptr, indices, data, dense, i, j):  # type: ignore[no-untyped-def]
    """``(Y dense Y^T)[i, j]`` for pairs."""
    out = np.zeros(len(i))
    for k in range(len(i)):
        for a in range(indptr[i[k]], indptr[i[k] + 1]):
            for b in range(indptr[j[k]], indptr[j[k] + 1]):
                out[k] += data[a] * dense[indices[a], indices[b]] * data[b]
    return out


class SparseFactor:
    """LDL^T of a permuted sparse matrix; the selected inverse is computed when first asked for."""

    def __init__(self, normal: sp.csc_array, scale: Array) -> None:
        unit = sp.csc_array(normal.multiply(scale[:, None]).multiply(scale[None, :]))
        self.scale = scale
        self._lower = low = eliminate(unit)
        self._d, self._place = low.d, low.place
        self.smallest_pivot = float(low.d.min())
        if not self.smallest_pivot > 0:
            raise SingularMatrix("a pivot is not positive")

    def solve(self, b: Array) -> Array:
        """``N^-1 b``; several columns pass the factor together."""
        columns = b.reshape(len(b), -1)
        low, scaled = self._lower, np.empty(columns.shape)
        scaled[self._place] = columns * self.scale[:, None]
        for first in range(0, scaled.shape[1], _TOGETHER):
            part = np.ascontiguousarray(scaled[:, first : first + _TOGETHER])
            solutions(low.indptr, low.indices, low.data, self._d, part)
            scaled[:, first : first + _TOGETHER] = part
        out: Array = scaled[self._place] * self.scale[:, None]
        return out.reshape(b.shape)

    def forms(self, columns: sp.csc_array, width: int) -> Array:
        """Forms of groups of columns, each along its ways through the elimination tree."""
        unit = sp.csc_array(sp.diags_array(self.scale) @ columns)
        out = np.empty((columns.shape[1] // width, width, width))
        step = max(1, _SPARSE // width)
        for first in range(0, len(out), step):
            part = unit[:, first * width : (first + step) * width]
            half = self._halves(part.indptr, self._place[part.indices], part.data)
            out[first : first + step] = group_products(half, half, width)
        return out

    def entries(self, i: Index, j: Index) -> Array:
        """Elements of the inverse: from the selected inverse, by half solutions outside it."""
        i, j = np.asarray(i), np.asarray(j)
        a, b = self._place[i], self._place[j]
        low = self._lower
        value, diagonal = self._selected
        row, column = np.maximum(a, b), np.minimum(a, b)
        out: Array = look_up(low.indptr, low.indices, value, diagonal, row, column)
        out *= self.scale[i] * self.scale[j]
        outside = np.flatnonzero(np.isnan(out))
        if len(outside):
            out[outside] = self._outside(row[outside], column[outside])
            out[outside] *= self.scale[i[outside]] * self.scale[j[outside]]
        return out

    def blocks(self, columns: Index) -> Array:
        """Blocks of the inverse."""
        low = self._lower
        value, diagonal = self._selected
        out = look_up_blocks(
            low.indptr, low.indices, value, diagonal, self._place, self.scale, columns
        )
        return _completed(self, columns, out)

    @cached_property
    def _selected(self) -> tuple[Array, Array]:
        """Elements of the inverse in the places of L, and its diagonal."""
        low = self._lower
        return selected_inverse(low.indptr, low.indices, low.data, self._d)

    def _outside(self, row: Index, column: Index) -> Array:
        """Scaled elements outside the pattern of the factor, by half a solution for each column."""
        out = np.zeros(len(row))
        # unknowns without any connection have none
        tied = np.flatnonzero(self._root[row] == self._root[column])
        waiting = [tied[np.lexsort((row[tied], column[tied]))]] if len(tied) else []
        while waiting:
            pairs = waiting.pop()
            each, which = np.unique(
                np.concatenate([row[pairs], column[pairs]]), return_inverse=True
            )
            if len(each) > _SPARSE < len(pairs):
                waiting += np.array_split(pairs, 2)
                continue
            first, second = which.ravel().reshape(2, -1)
            half = self._halves(np.arange(len(each) + 1), each, np.ones(len(each)))
            out[pairs] = column_products(half.indptr, half.indices, half.data, first, second)
        return out

    @cached_property
    def _root(self) -> AnyIndex:
        """Last place (u,) that each place is connected with: one for each part of the network."""
        return roots(self._lower.indptr, self._lower.indices)

    def _halves(self, first: AnyIndex, places: AnyIndex, values: Array) -> sp.csc_array:
        """``D^-1/2 L^-1 B`` of sparse columns, by places in the order of elimination."""
        low = self._lower
        given = first.astype(np.int64), places.astype(np.int64), values
        y = half_solutions(low.indptr, low.indices, low.data, self._d, *given)
        half = sp.csc_array(y, shape=(len(self.scale), len(first) - 1))
        half.sort_indices()
        return half
