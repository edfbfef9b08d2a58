"""Minimum-norm solutions of networks that leave unknowns open, to reproduce publications.

The Moore-Penrose inverse of the whole normal matrix in metres and radians is what some authors
invert where the observations leave unknowns open (method section 4.3). It is a datum of its own
that depends on the units: only quantities that are estimable anyway mean something. Dense, for
small networks; every result says what it is.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index
from tribrach.errors import InputError, NotConverged
from tribrach.network.adjustment import Adjustment
from tribrach.network.assembly import Assembly
from tribrach.network.datum import Cofactor, OpenMotions
from tribrach.network.defects import worst_misclosure
from tribrach.network.network import Network
from tribrach.network.start.start_values import find_start
from tribrach.observations.unknowns import State

#: more unknowns are not inverted densely
_MOST = 3000
#: singular values of the column-scaled system below this are zero
_RANK = 1e-9
#: linearisations before giving up
_ITERATIONS = 30


class DenseCofactor(Cofactor):
    """A cofactor matrix (u, u) that is there as a whole, with the answers of :class:`Cofactor`."""

    def __init__(self, matrix: Array, constraints: int) -> None:
        self.matrix = matrix
        self.n_constraints = constraints
        self.motions = np.zeros((len(matrix), 0))

    def solve(self, b: Array) -> Array:
        """``Q b`` for b (u,) or (u, k)."""
        out: Array = self.matrix @ b
        return out

    def entries(self, i: Index, j: Index) -> Array:
        """Elements (k,) at index pairs."""
        out: Array = self.matrix[np.asarray(i), np.asarray(j)]
        return out

    def blocks(self, columns: Index) -> Array:
        """Blocks (n, m, m) of Q for groups of columns (n, m); zero where a column is negative."""
        there = columns >= 0
        out: Array = self.matrix[columns[:, :, None], columns[:, None, :]]
        return np.where(there[:, :, None] & there[:, None, :], out, 0.0)

    def forms(self, columns: sp.csc_array, width: int) -> Array:
        """``B_g^T Q B_g`` (k, width, width) of sparse columns (u, k * width), group by group."""
        count = columns.shape[1] // width
        grouped = columns.toarray().T.reshape(count, width, len(self.matrix))
        out: Array = grouped @ self.matrix @ grouped.swapaxes(1, 2)
        return out

    def multiplier_covariance(self) -> Array:
        """Not defined for a minimum norm: zeros (q, q)."""
        return np.zeros((self.n_constraints, self.n_constraints))


def adjust_minimum_norm(network: Network) -> Adjustment:
    """Adjust with the Moore-Penrose inverse in metres and radians (method section 4.3).

    Hard constraints hold exactly. ``defect`` of the result counts everything that is open, datum
    and unknowns that cannot be separated.
    """
    network = network.with_start(find_start(network))
    assembly = Assembly(network)
    u = len(assembly.free_columns)
    if u > _MOST:
        raise InputError(
            f"a minimum norm of {u} unknowns is not computed",
            cure=f"take a datum, or at most {_MOST} unknowns",
        )
    state = network.start
    for iteration in range(1, _ITERATIONS + 1):
        try:
            null, inverse = _inverse(assembly, state)
        except np.linalg.LinAlgError as error:
            raise NotConverged(
                "the matrix of the minimum-norm adjustment cannot be inverted",
                [worst_misclosure(assembly, state)],
            ) from error
        design = assembly.design(state)
        white = assembly.whiten(assembly.misclosure(state))
        step = inverse @ (design.T @ white)
        constraints, right = assembly.constraints(state)
        if len(right):
            step += np.linalg.lstsq(constraints.toarray(), right, rcond=None)[0]
        full = np.zeros(assembly.layout.size)
        full[assembly.free_columns] = step
        state = state.retract(full)
        if np.abs(step).max(initial=0.0) < 1e-9:
            return _result(assembly, network, state, null, inverse, iteration)
    raise NotConverged(
        f"the minimum-norm adjustment did not settle in {_ITERATIONS} iterations",
        ["give better start values, or leave out what cannot be separated"],
    )


def _inverse(assembly: Assembly, state: State) -> tuple[Array, Array]:
    """Null vectors (u, d) and Moore-Penrose inverse (u, u) of the normal matrix, constrained."""
    design = assembly.design(state).toarray()
    constraints, _ = assembly.constraints(state)
    basis = _complement(constraints, design.shape[1])
    reduced = design @ basis
    length = np.linalg.norm(reduced, axis=0)
    length[length == 0] = 1.0
    _, values, vt = np.linalg.svd(reduced / length, full_matrices=True)
    values = np.concatenate([values, np.zeros(vt.shape[0] - len(values))])
    # the rank is decided with scaled columns, the inverse then taken in metres and radians
    open_ones = vt[values <= _RANK * max(1.0, values.max(initial=0.0))].T / length[:, None]
    null, _ = np.linalg.qr(open_ones)
    normal = reduced.T @ reduced
    size = np.trace(normal) / len(normal)
    lifted = normal + size * null @ null.T
    scale = 1 / np.sqrt(np.diag(lifted))
    inverse = np.linalg.inv(lifted * np.outer(scale, scale)) * np.outer(scale, scale)
    inverse -= null @ null.T / size
    return basis @ null, basis @ inverse @ basis.T


def _complement(constraints: sp.csr_array, u: int) -> Array:
    """Orthonormal basis (u, u - q) of the steps that keep the constraints."""
    if constraints.shape[0] == 0:
        return np.eye(u)
    _, values, vt = np.linalg.svd(constraints.toarray(), full_matrices=True)
    rank = int((values > 1e-12 * values[0]).sum())
    out: Array = vt[rank:].T
    return out


def _result(
    assembly: Assembly,
    network: Network,
    state: State,
    null: Array,
    inverse: Array,
    iterations: int,
) -> Adjustment:
    """The adjustment; its warnings say what it is."""
    white = assembly.whiten(assembly.misclosure(state))
    constraints, _ = assembly.constraints(state)
    count = int(np.linalg.matrix_rank(constraints.toarray())) if constraints.shape[0] else 0
    d = null.shape[1]
    sentence = (
        f"{d} combinations of unknowns are open; the smallest solution in metres and radians was "
        "taken, which depends on these units: only what is estimable anyway has a meaning"
    )
    motions = OpenMotions(null, np.zeros((7, d)), (0.0, 1.0))
    return Adjustment(
        network=network,
        state=state,
        rows=assembly.rows,
        residuals=-assembly.misclosure(state),
        whitened_residuals=-white,
        design=assembly.design(state),
        free_columns=assembly.free_columns,
        cofactor=DenseCofactor(inverse, count),
        motions=motions,
        iterations=iterations,
        warnings=(*network.warnings, sentence),
        assembly=assembly,
    )
