"""Factors of the normal matrix that answer with solutions and with entries of the inverse.

Three ways, chosen by structure, one interface (:class:`Factor`):

* :class:`DenseFactor`: Cholesky and the whole inverse, for small networks;
* :class:`SchurFactor`: points eliminated block by block, dense Cholesky of what remains, for
  many targets seen from some stations;
* :class:`SparseFactor`: LDL^T with minimum-degree ordering and the selected inverse, for large
  networks of points.

None of them ever inverts a large matrix as a whole. Columns are scaled to unit diagonal first
(Jacobi), so that metres, radians and calibration parameters live together.
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np
import qdldl
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.kernels import njit
from tribrach.network.selected_inverse import look_up, selected_inverse

__all__ = ["DenseFactor", "Factor", "SchurFactor", "SingularMatrix", "SparseFactor", "factorise"]


#: below this many unknowns the whole inverse is cheaper than any bookkeeping
DENSE_LIMIT = 900
#: largest remainder that is factored densely after the points are eliminated
REDUCED_LIMIT = 4000
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


def factorise(normal: sp.csc_array, point_of: Index) -> Factor:
    """Factor a normal matrix in the way that suits its structure.

    Parameters
    ----------
    normal : sparse array (u, u)
        Symmetric, positive definite.
    point_of : array (u,)
        Number of the point a column belongs to, -1 for other unknowns.

    Returns
    -------
    Factor
        Solves with the matrix and gives entries of its inverse.

    Raises
    ------
    SingularMatrix
        A pivot is zero or negative.
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

    def entries(self, i: Index, j: Index) -> Array:
        """Elements of the inverse, from the sparse ``Y`` and the dense ``Q_ss``."""
        i, j = np.asarray(i), np.asarray(j)
        a, b = self.place[i], self.place[j]
        pi, pj = self.is_point[i], self.is_point[j]
        out = np.empty(len(i))
        both_rest = ~pi & ~pj
        out[both_rest] = self.q_rest[a[both_rest], b[both_rest]]
        for first, second, mixed in ((a, b, pi & ~pj), (b, a, ~pi & pj)):
            out[mixed] = -_row_times(
                self.y.indptr, self.y.indices, self.y.data, self.q_rest, first[mixed], second[mixed]
            )
        both = pi & pj
        y, p = self.y, self.p_inverse
        out[both] = _row_form(y.indptr, y.indices, y.data, self.q_rest, a[both], b[both])
        out[both] += np.asarray(p[a[both], b[both]]).ravel() if both.any() else 0.0
        return out * self.scale[i] * self.scale[j]


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
        inverse = np.linalg.inv(dense)
        index = order[first[chosen][:, None] + np.arange(width)]
        rows.append(np.broadcast_to(index[:, :, None], inverse.shape).ravel())
        columns.append(np.broadcast_to(index[:, None, :], inverse.shape).ravel())
        values.append(((inverse + inverse.transpose(0, 2, 1)) / 2).ravel())
    triple = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(triple, shape=blocks.shape), pivot


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
        unit = sp.csc_matrix(normal.multiply(scale[:, None]).multiply(scale[None, :]))
        self.scale = scale
        try:
            self._solver = qdldl.Solver(unit)
        except RuntimeError as error:  # all that qdldl raises, at a zero pivot
            raise SingularMatrix(str(error)) from error
        lower, self._d, permutation = self._solver.factors()
        self._lower = sp.csc_array(lower)
        self._lower.sort_indices()
        self.smallest_pivot = float(self._d.min())
        if self.smallest_pivot <= 0:
            raise SingularMatrix("a pivot is not positive")
        self._place = np.empty(len(scale), dtype=np.int64)
        self._place[permutation] = np.arange(len(scale))
        self._inverse: tuple[Array, Array] | None = None

    def solve(self, b: Array) -> Array:
        """``N^-1 b``, column by column."""
        if b.ndim == 1:
            solution: Array = self._solver.solve(b * self.scale) * self.scale
            return solution
        return np.stack([self.solve(column) for column in b.T], axis=1)

    def entries(self, i: Index, j: Index) -> Array:
        """Elements of the inverse: from the selected inverse, by solving where outside it."""
        if self._inverse is None:
            low = self._lower
            self._inverse = selected_inverse(low.indptr, low.indices, low.data, self._d)
        a, b = self._place[np.asarray(i)], self._place[np.asarray(j)]
        low = self._lower
        value, diagonal = self._inverse
        row, column = np.maximum(a, b), np.minimum(a, b)
        out: Array = look_up(low.indptr, low.indices, value, diagonal, row, column)
        out *= self.scale[i] * self.scale[j]
        outside = np.isnan(out)
        if outside.any():
            out[outside] = self._by_solving(np.asarray(i)[outside], np.asarray(j)[outside])
        return out

    def _by_solving(self, i: Index, j: Index) -> Array:
        """Elements outside the pattern of the factor, one solve per distinct column."""
        out = np.empty(len(i))
        columns, which = np.unique(j, return_inverse=True)
        unit = np.zeros(len(self.scale))
        for k, column in enumerate(columns):
            unit[column] = 1.0
            same = which == k
            out[same] = self.solve(unit)[i[same]]
            unit[column] = 0.0
        return out
