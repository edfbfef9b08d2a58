"""Motions that the observations leave open, and how a datum closes them.

A network without control may be shifted, turned or scaled as a whole without any observation
noticing. Those motions are combinations of the seven similarity generators (method section 3.2);
:func:`open_motions` finds them exactly, and :class:`Cofactor` turns the factor of the pinned normal
matrix into the cofactor matrix of the requested datum: hard constraints by their own elimination,
inner constraints by the S-transformation (Baarda 1973).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.geometry.rotation import skew
from tribrach.network.linear import Factor, factorise
from tribrach.observations.unknowns import Layout, State, plane_basis

#: names of the similarity motions, in the order of :func:`generators`
GENERATORS = (
    "shift in E",
    "shift in N",
    "shift in U",
    "rotation about E",
    "rotation about N",
    "rotation about U",
    "scale",
)
#: singular values of the column-scaled whitened system below this are zero
RANK_TOLERANCE = 1e-9
#: entries of a row smaller than this against its largest are rounding: 1 nm on a sight of 1 m
NOISE = 1e-9


def generators(state: State) -> Array:
    """Tangents of the seven similarity motions of a network.

    Points and pose translations move, pose rotations and plane normals turn; scalars and vectors
    are left at zero, :func:`open_motions` finds how they go along.

    Returns (size, 7): three shifts [m], three turns about the centroid [rad] and scale [1].
    """
    layout = state.layout
    out = np.zeros((layout.size, 7))
    positions = state.positions
    centre = positions.mean(axis=0) if len(positions) else np.zeros(3)
    columns = layout.position_columns(np.arange(len(positions)))
    arm = positions - centre
    for axis in range(3):
        out[columns[:, axis], axis] = 1.0
    # a turn w moves a point by w x arm = -[arm]x w
    out[columns.ravel(), 3:6] = -skew(arm).reshape(-1, 3)
    out[columns.ravel(), 6] = arm.ravel()
    poses = layout.columns("pose", np.arange(layout.count("pose")))[:, 3:]
    for axis in range(3):
        out[poses[:, axis], 3 + axis] = 1.0
    n, d = state.plane_n, state.plane_d
    if len(n):
        plane = layout.columns("plane", np.arange(len(n)))
        basis = plane_basis(n)
        out[plane[:, :2].ravel(), 3:6] = np.einsum("nik,nij->nkj", basis, -skew(n)).reshape(-1, 3)
        out[plane[:, 2], :3] = n
        out[plane[:, 2], 3:6] = np.cross(n, centre)
        out[plane[:, 2], 6] = d - n @ centre
    return out


@dataclass(frozen=True)
class OpenMotions:
    """Motions that no observation sees."""

    basis: Array  #: (u, d), the motions over the free columns
    mix: Array  #: (7, d), how each is composed of the generators
    gap: tuple[float, float]  #: largest singular value taken as zero, smallest taken as not


def open_motions(
    design: sp.csr_array, state: State, free_columns: Index, constraints: sp.csr_array
) -> OpenMotions:
    """Find the similarity motions that observations and constraints leave open.

    Scalars and vectors follow each motion as well as the observations let them, so a turn about the
    vertical takes the orientation unknowns along.

    ``design`` (n, u): whitened Jacobian over the free columns; ``state``: unknowns where it was
    linearised; ``free_columns`` (u,): columns of the full tangent vector that are free;
    ``constraints`` (q, u): Jacobian of the hard constraints.
    """
    full = generators(state)
    motion = full[free_columns]
    raw = sp.csr_array(sp.vstack([design, _unit_rows(constraints)]))
    system = _without_noise(raw)
    length = np.sqrt(np.asarray(system.multiply(system).sum(axis=0)).ravel())
    length[length == 0] = 1.0
    scaled = system @ sp.diags_array(1 / length)
    motion = motion * length[:, None]
    follows = free_columns >= state.layout.offset["vector"]
    if follows.any():
        motion[follows] = _follow(scaled, motion, follows)
    fixed = np.ones(state.layout.size, dtype=bool)
    fixed[free_columns] = False
    size = np.linalg.norm(motion, axis=0)
    alive = size > 1e-9 * size.max(initial=0.0)
    if not alive.any():
        return OpenMotions(np.zeros((len(free_columns), 0)), np.zeros((7, 0)), (0.0, 1.0))
    unit = motion[:, alive] / size[alive]
    # an SVD drops turns that move nothing, such as the one about the line of two points
    q, strength, vt = np.linalg.svd(unit, full_matrices=False)
    rank = strength > 1e-9 * strength[0]
    q, back = q[:, rank], vt[rank].T / strength[rank]
    # fixed components must not move: their rows join the test, in metres and radians
    held = full[fixed][:, alive] / size[alive] * np.median(length)
    test = np.vstack([scaled @ q, held @ back])
    if len(test) < q.shape[1]:  # fewer observations than motions: the SVD would lose the rest
        test = np.vstack([test, np.zeros((q.shape[1] - len(test), q.shape[1]))])
    _, value, vt = np.linalg.svd(test, full_matrices=False)
    # what was dropped as noise may have held a motion: singular values move by that much at most
    dropped = np.linalg.norm((raw - system) @ (q / length[:, None]))
    zero = value <= RANK_TOLERANCE * max(1.0, value.max(initial=0.0)) + dropped
    null = vt[zero].T
    mix = np.zeros((7, null.shape[1]))
    mix[alive] = back @ null / size[alive][:, None]
    gap = (float(value[zero].max(initial=0.0)), float(value[~zero].min(initial=np.inf)))
    return OpenMotions(q @ null / length[:, None], mix, gap)


def _without_noise(system: sp.csr_array) -> sp.csr_array:
    """The rows without entries that only the rounding of coordinates makes differ from zero."""
    out = system.copy()
    if out.nnz == 0:
        return out
    largest = abs(system).max(axis=1).toarray().ravel()
    out.data[np.abs(out.data) < NOISE * np.repeat(largest, np.diff(out.indptr))] = 0.0
    return out


def _unit_rows(constraints: sp.csr_array) -> sp.csr_array:
    """Constraint rows scaled to unit length."""
    length = np.sqrt(np.asarray(constraints.multiply(constraints).sum(axis=1)).ravel())
    length[length == 0] = 1.0
    return sp.csr_array(sp.diags_array(1 / length) @ constraints)


def _follow(scaled: sp.csr_array, motion: Array, follows: NDArray[np.bool_]) -> Array:
    """Least-squares response (k, 7) of the following columns to the motion of the others."""
    columns = sp.csc_array(scaled)
    followers, others = columns[:, np.flatnonzero(follows)], columns[:, np.flatnonzero(~follows)]
    normal = sp.csc_array(followers.T @ followers + 1e-10 * sp.eye_array(followers.shape[1]))
    lu = sla.splu(normal)
    response = np.zeros((followers.shape[1], motion.shape[1]))
    driven = others @ motion[~follows]
    for _ in range(6):  # iterative refinement takes the regularisation out again
        response += lu.solve(-(followers.T @ (driven + followers @ response)))
    return response


def pins_of(basis: Array) -> Index:
    """Indices (d,) of unknowns that, held, close the motions (u, d) in the best-conditioned way."""
    if basis.shape[1] == 0:
        return np.empty(0, dtype=np.int64)
    _, _, order = scipy.linalg.qr(basis.T, mode="economic", pivoting=True)
    pins: Index = np.asarray(order[: basis.shape[1]], dtype=np.int64)
    return pins


def point_numbers(layout: Layout, free_columns: Index) -> Index:
    """Number of the point or plane each free column belongs to, -1 for other families.

    Both are seen from some stations and tied to nothing else, so both are eliminated as blocks.
    """
    points, first = layout.count("point"), layout.offset["plane"]
    plane = (free_columns >= first) & (free_columns < first + 3 * layout.count("plane"))
    number = np.where(plane, points + (free_columns - first) // 3, -1)
    return np.where(free_columns < 3 * points, free_columns // 3, number)


class Cofactor:
    """Cofactor matrix ``Q`` (u, u) of the adjusted unknowns, never formed as a whole.

    ``Q = S Q1 S^T`` with ``Q1 = Z - Z C^T (C Z C^T)^-1 C Z``, Z the inverse of the pinned normal
    matrix and ``S = I - G (B^T G)^-1 B^T``, B = G on the datum unknowns (method sections 3.2 and
    3.3).

    ``normal``: ``A^T A`` (u, u) of the whitened design; ``point_of`` (u,): number of the point of
    each column, -1 for others; ``constraints``: hard constraints C (q, u); ``motions``: open
    motions G (u, d); ``datum``: mask (u,) of the unknowns that carry the inner constraints.
    """

    def __init__(
        self,
        normal: sp.csc_array,
        point_of: Index,
        constraints: sp.csr_array,
        motions: Array,
        datum: NDArray[np.bool_],
    ) -> None:
        self.constraints = constraints
        self.motions = motions
        diagonal = normal.diagonal()
        # a column that nothing observes may still be pinned, with a weight like the others'
        seen = diagonal > NOISE**2 * diagonal.max(initial=0.0)
        if not seen.all():
            usual = np.median(diagonal[seen]) if seen.any() else 1.0
            diagonal = np.where(seen, diagonal, usual)
        pinned = np.zeros(len(diagonal))
        pins = pins_of(motions * np.sqrt(diagonal)[:, None])
        pinned[pins] = diagonal[pins]
        total = normal + sp.diags_array(pinned)
        self._weights = self._constraint_weights(diagonal)
        if constraints.shape[0]:
            weighted = sp.diags_array(self._weights) @ constraints
            total = total + constraints.T @ weighted
        self.factor: Factor = factorise(sp.csc_array(total), point_of)
        self._eliminate_constraints()
        self._transform(datum)

    def _constraint_weights(self, diagonal: Array) -> Array:
        """Weights that add the constraints to N without disturbing its scale."""
        if self.constraints.shape[0] == 0:
            return np.zeros(0)
        squared = self.constraints.multiply(self.constraints)
        mean = squared @ (1 / np.where(diagonal > 0, diagonal, np.median(diagonal)))
        weights: Array = 1 / np.maximum(np.asarray(mean).ravel(), 1e-300)
        return weights

    def _eliminate_constraints(self) -> None:
        """``V = Z C^T L^-T`` so that ``Q1 = Z - V V^T``."""
        q = self.constraints.shape[0]
        u = self.constraints.shape[1]
        self._v = np.zeros((u, q))
        self._k = np.zeros((q, q))
        if q:
            # duplicate constraints make K singular: only the independent part is used
            v = self.factor.solve(self.constraints.toarray().T)
            k = self.constraints @ v
            value, vector = np.linalg.eigh((k + k.T) / 2)
            good = value > 1e-12 * value.max()
            self.n_constraints = int(good.sum())
            root = vector[:, good] / np.sqrt(value[good])
            self._v = v @ root
            self._k = root
        else:
            self.n_constraints = 0

    def multiplier_covariance(self) -> Array:
        """Covariance (q, q) of the constraints' Lagrange multipliers: ``(C N^-1 C^T)^-1``.

        Zero for a constraint that only closes a motion. The weights that stabilise N are taken
        out again: ``(C N^-1 C^T)^-1 = (C Z C^T)^-1 - W``.
        """
        inverse = self._k @ self._k.T - np.diag(self._weights)
        size = np.abs(np.diag(self._k @ self._k.T))
        noise = np.abs(inverse) < 1e-9 * np.sqrt(np.outer(size, size))
        cleaned: Array = np.where(noise, 0.0, inverse)
        return cleaned

    def _transform(self, datum: NDArray[np.bool_]) -> None:
        """Low-rank terms of the S-transformation."""
        g = self.motions
        d = g.shape[1]
        u = len(datum)
        self._y, self._t = np.zeros((u, d)), np.zeros((d, d))
        self._b: Array = np.zeros((u, d))
        self._m: Array = np.zeros((d, d))
        if d == 0:
            return
        self._b = np.asarray(np.where(datum[:, None], g, 0.0), dtype=np.float64)
        self._m = np.asarray(np.linalg.inv(self._b.T @ g), dtype=np.float64)
        qb = self._constrained(self._b)
        self._y = qb @ self._m.T
        self._t = self._m @ (self._b.T @ qb) @ self._m.T

    def _constrained(self, b: Array) -> Array:
        """``Q1 b``."""
        out = self.factor.solve(b)
        return out - self._v @ (self._v.T @ b)

    def solve(self, b: Array) -> Array:
        """``Q b`` for b (u,) or (u, k)."""
        g = self.motions
        st = b - self._b @ (self._m.T @ (g.T @ b))
        out = self._constrained(st)
        out = out - g @ (self._m @ (self._b.T @ out))
        return out

    def entries(self, i: Index, j: Index) -> Array:
        """Elements (k,) of Q at index pairs."""
        i, j = np.asarray(i), np.asarray(j)
        out = self.factor.entries(i, j)
        if self._v.shape[1]:
            out = out - np.einsum("ka,ka->k", self._v[i], self._v[j])
        if self.motions.shape[1]:
            g, y = self.motions, self._y
            out = out - np.einsum("ka,ka->k", g[i], y[j]) - np.einsum("ka,ka->k", y[i], g[j])
            out = out + np.einsum("ka,ab,kb->k", g[i], self._t, g[j])
        return out

    def blocks(self, columns: Index) -> Array:
        """Blocks (n, m, m) of Q for groups of columns (n, m); zero where a column is negative."""
        if not len(self.motions):  # nothing is unknown
            return np.zeros((*columns.shape, columns.shape[1]))
        out = self.factor.blocks(np.ascontiguousarray(columns))

        def of(basis: Array) -> Array:
            """Its rows (n, m, d) by block."""
            return np.where((columns >= 0)[:, :, None], basis[columns], 0.0)

        if self._v.shape[1]:
            v = of(self._v)
            out -= v @ v.swapaxes(1, 2)
        if self.motions.shape[1]:
            g, mixed = of(self.motions), of(self.motions) @ of(self._y).swapaxes(1, 2)
            out -= mixed + mixed.swapaxes(1, 2)
            out += g @ self._t @ g.swapaxes(1, 2)
        return out

    def forms(self, columns: sp.csc_array, width: int) -> Array:
        """``B_g^T Q B_g`` (k, width, width) of sparse columns (u, k * width), group by group.

        For groups whose unknowns need not be observed together: no entry of Q is asked for.
        """
        out = self.factor.forms(columns, width)

        def grouped(basis: Array) -> Array:
            """``X^T B_g`` (k, d, width)."""
            product = np.asarray(columns.T @ basis)
            return product.reshape(len(out), width, basis.shape[1]).swapaxes(1, 2)

        if self._v.shape[1]:
            v = grouped(self._v)
            out -= v.swapaxes(1, 2) @ v
        if self.motions.shape[1]:
            g, y = grouped(self.motions), grouped(self._y)
            mixed = g.swapaxes(1, 2) @ y
            out -= mixed + mixed.swapaxes(1, 2)
            out += g.swapaxes(1, 2) @ self._t @ g
        return out

    def row_blocks(self, rows: sp.csr_array, block: Index) -> Array:
        """``M_b Q M_b^T`` (b, m, m) of blocks (b, m) of sparse rows M (n, u) observed together."""
        count, m = block.shape
        length = np.diff(rows.indptr)[block.ravel()]
        place = np.repeat(rows.indptr[block.ravel()], length) + _counted(length)
        line = np.repeat(np.arange(count * m), length)
        # a stored zero asks for nothing
        place, line = (a[rows.data[place] != 0] for a in (place, line))
        keys = line // m * rows.shape[1] + rows.indices[place]
        each, which = np.unique(keys, return_inverse=True)
        owner, column = np.divmod(each, rows.shape[1])
        width = np.bincount(owner, minlength=count)
        first = np.cumsum(width) - width
        out = np.zeros((count, m, m))
        for k in np.unique(width[width > 0]):
            chosen = np.flatnonzero(width == k)
            for part in np.array_split(chosen, max(1, len(chosen) * int(k) ** 2 // 4_000_000)):
                number = np.full(count, -1)
                number[part] = np.arange(len(part))
                inside = np.flatnonzero(number[line // m] >= 0)
                dense = np.zeros((len(part), m, k))
                at = line[inside]
                into = number[at // m], at % m, which.ravel()[inside] - first[at // m]
                np.add.at(dense, into, rows.data[place[inside]])
                q = self.blocks(column[first[part][:, None] + np.arange(k)])
                out[part] = dense @ q @ dense.swapaxes(1, 2)
        return out

    def row_forms(self, rows: sp.csr_array) -> Array:
        """``diag(M Q M^T)`` (n,) for sparse rows M (n, u) over columns observed together."""
        if not rows.data.all():  # a stored zero asks for nothing
            rows = rows.copy()
            rows.eliminate_zeros()
        count = np.diff(rows.indptr)
        out = np.zeros(rows.shape[0])
        for width in np.unique(count[count > 0]):
            which = np.flatnonzero(count == width)
            for part in np.array_split(which, max(1, len(which) * width**2 // 4_000_000)):
                place = rows.indptr[part][:, None] + np.arange(width)
                values, columns = rows.data[place], rows.indices[place].astype(np.int64)
                q = self.blocks(columns)
                out[part] = np.einsum("ni,nij,nj->n", values, q, values)
        return out

    def step(self, gradient: Array, right: Array, moved: Array) -> Array:
        """Solve the constrained system in the datum.

        ``gradient`` (u,): ``A^T w``; ``right`` (q,): right-hand side c of the constraints;
        ``moved`` (u,): corrections so far: the inner constraints hold for the sum. Returns (u,):
        the next corrections [m, rad].
        """
        x = gradient
        if len(right):
            x = x + self.constraints.T @ (self._weights * right)
        x = self.factor.solve(x)
        if len(right):
            x = x + self._v @ (self._k.T @ (right - self.constraints @ x))
        if self.motions.shape[1]:
            x = x - self.motions @ (self._m @ (self._b.T @ (x + moved)))
        return x


def _counted(length: Index) -> Index:
    """``0, 1, ... n - 1`` for each length n, one after the other."""
    total = int(length.sum())
    numbers: Index = np.arange(total) - np.repeat(np.cumsum(length) - length, length)
    return numbers
