"""Computes what each observation contributes, how it is checked, and what an error would spoil.

With ``W`` the whitener (``P = W^T W``) and ``A_w`` the whitened design, for each observed value i

* ``(P v)_i`` its weighted residual and ``S_ii`` its variance, ``S = P Q_vv P = P - P A Q A^T P``;
* redundancy number ``r_i = (Q_vv P)_ii``; their sum is the redundancy;
* external reliability ``Q A^T P e_i g``: displacements by an error g that stays undetected.

Only rows and selected entries are formed, never anything of size n x n (method section 3.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.network.solved import SolvedSystem
from tribrach.statistics import largest_first

#: share of its own weight that must be left in S_ii for a value to count as controlled
UNCONTROLLED = 1e-8
#: unknowns times right-hand sides that a report may cost, a few seconds
BUDGET = 4_000_000
#: smaller effects are rounding [m]
MICROMETRE = 1e-6


@dataclass(frozen=True)
class WeightedResiduals:
    """Weighted residuals and what belongs to them, in the order of ``adjustment.rows``."""

    adjustment: SolvedSystem  #: the adjustment that they belong to
    rows: sp.csr_array  #: (n, u), ``P A``
    pull: Array  #: (n,), ``P v`` [1/m, 1/rad]
    weight: Array  #: (n,), diagonal of P
    s: Array  #: (n,), diagonal of ``P Q_vv P``
    #: (n,), true where s is more than rounding: other values check this one
    controlled: NDArray[np.bool_]

    @property
    def w(self) -> Array:
        """Test values ``w = (P v)_i / sqrt(S_ii)`` (n,); NaN where nothing controls the value."""
        safe = np.where(self.controlled, self.s, 1.0)
        return np.where(self.controlled, self.pull / np.sqrt(safe), np.nan)

    @property
    def gross_error(self) -> Array:
        """Estimated errors ``g = -(P v)_i / S_ii`` (n,) [m, rad] with ``l = true + g``."""
        safe = np.where(self.controlled, self.s, 1.0)
        return np.where(self.controlled, -self.pull / safe, np.nan)

    def detectable(self, delta0: float) -> Array:
        """Minimal detectable biases ``delta0 / sqrt(S_ii)`` (n,) [m, rad]."""
        safe = np.where(self.controlled, self.s, 1.0)
        return np.where(self.controlled, delta0 / np.sqrt(safe), np.nan)


def weigh(adjustment: SolvedSystem) -> WeightedResiduals:
    """Weighted residuals of an adjustment."""

    def parts() -> tuple[sp.csr_array, Array, Array, Array]:
        whitener = adjustment.whitener
        rows = sp.csr_array(whitener.T @ adjustment.design)
        pull = whitener.T @ adjustment.whitened_residuals
        weight = np.asarray(whitener.multiply(whitener).sum(axis=0)).ravel()
        return rows, pull, weight, weight - adjustment.cofactor.row_forms(rows)

    rows, pull, weight, s = adjustment.once(weigh, parts)
    return WeightedResiduals(adjustment, rows, pull, weight, s, s > UNCONTROLLED * weight)


def redundancy_numbers(system: WeightedResiduals) -> Array:
    """``r_i = 1 - A_i Q (P A)_i^T`` (n,); correlated values may lie outside 0 to 1."""
    adjustment = system.adjustment
    plain = adjustment.assembly.joint_whitener is None and all(
        o.rows == 1 for o in adjustment.network.observations
    )
    if plain:
        return 1 - adjustment.cofactor.row_forms(adjustment.design)
    raw = adjustment.assembly.design(adjustment.state, whitened=False)
    n = len(system.s)
    both = np.arange(2 * n).reshape(2, n).T
    forms = adjustment.cofactor.row_blocks(sp.csr_array(sp.vstack([raw, system.rows])), both)
    return 1 - forms[:, 0, 1]


def correlations_of_tests(system: WeightedResiduals, chosen: Index) -> Array:
    """Correlations (n, k) of all test values with those of chosen rows (k,); NaN uncontrolled."""
    whitener = sp.csc_array(system.adjustment.whitener)
    effect = system.adjustment.cofactor.solve(system.rows[chosen].toarray().T)
    s = (whitener.T @ whitener[:, chosen]).toarray() - system.rows @ effect
    root = np.sqrt(np.where(system.controlled, system.s, np.nan))
    correlation: Array = s / root[:, None] / root[chosen]
    return correlation


@dataclass(frozen=True)
class External:
    """Largest displacement of a position by an error in each value."""

    displacement: Array  #: (n,), largest displacement [m], NaN where nothing controls the value
    position: Index  #: (n,), index of the position that moves most
    #: (n,), false where only the positions that the value itself touches were looked at
    exact: NDArray[np.bool_]
    #: (P + S,), largest displacement of each position by such an error [m]; infinite where a value
    #: that nothing controls moves it, NaN where not every error was followed
    worst: Array


def solutions_affordable(adjustment: SolvedSystem) -> int:
    """How many right-hand sides a report may solve for."""
    return max(100, BUDGET // max(adjustment.n_unknowns, 1))


def external_reliability(system: WeightedResiduals, error: Array) -> External:
    """Follow an undetected error in each value to the positions that it moves.

    In networks too large to follow every error through all unknowns, the effect on the positions
    that the value touches is exact, and the largest of them are followed everywhere. With inner
    constraints the displacements belong to that datum.

    ``error`` (n,): error of each value [m, rad], NaN where unlimited.
    """
    n = system.rows.shape[0]
    most = solutions_affordable(system.adjustment)
    if n <= most:
        everything = np.arange(n)
        displacement, position, worst = _everywhere(system, error, everything)
        exact = np.ones(n, dtype=bool)
    else:
        displacement, position = _at_ends(system, error)
        largest = largest_first(np.nan_to_num(displacement))[: most // 4]
        displacement[largest], position[largest], _ = _everywhere(system, error, largest)
        exact = np.zeros(n, dtype=bool)
        exact[largest] = True
        worst = np.full(len(system.adjustment.state.positions), np.nan)
    displacement[~system.controlled] = np.nan
    return External(displacement, position, exact, worst)


def _everywhere(
    system: WeightedResiduals, error: Array, chosen: Index
) -> tuple[Array, Index, Array]:
    """Largest displacement of any position for chosen rows; of each position by any of them."""
    adjustment = system.adjustment
    count = len(adjustment.state.positions)
    place = adjustment.reduced[adjustment.layout.position_columns(np.arange(count))]
    largest, where = np.zeros(len(chosen)), np.zeros(len(chosen), dtype=np.int64)
    worst = np.zeros(count)
    for part in np.array_split(np.arange(len(chosen)), max(1, len(chosen) // 500)):
        rows = chosen[part]
        shift = adjustment.cofactor.solve(system.rows[rows].toarray().T)
        # a last row of zeros stands for the components that are fixed
        each = np.vstack([shift, np.zeros((1, len(part)))])[place]
        length = np.sqrt((each**2).sum(axis=1))
        loose = ~(system.controlled[rows] & np.isfinite(error[rows]))
        # what nothing controls moves a position that follows its sigma
        follows = length[:, loose] / np.sqrt(system.weight[rows[loose]]) > MICROMETRE
        worst[follows.any(axis=1)] = np.inf
        length *= np.nan_to_num(error[rows])
        if count:
            # of positions that move alike, the first: the last digits are those of a machine
            where[part] = length.astype(np.float32).argmax(axis=0)
            largest[part] = length.max(axis=0)
            worst = np.maximum(worst, length.max(axis=1))
    return largest, where, worst


def _at_ends(system: WeightedResiduals, error: Array) -> tuple[Array, Index]:
    """Largest displacement among the positions that each value touches."""
    adjustment, weighted = system.adjustment, system.rows
    layout = adjustment.layout
    positions = len(adjustment.state.positions)
    owner = np.full(layout.size, -1, dtype=np.int64)
    owner[layout.position_columns(np.arange(positions))] = np.arange(positions)[:, None]
    owner = owner[adjustment.free_columns]
    n = weighted.shape[0]
    largest, where = np.zeros(n), np.zeros(n, dtype=np.int64)
    count = np.diff(weighted.indptr)
    for width in np.unique(count[count > 0]):
        which = np.flatnonzero(count == width)
        for rows in np.array_split(which, max(1, len(which) * int(width) ** 2 // 4_000_000)):
            place = weighted.indptr[rows][:, None] + np.arange(width)
            columns = weighted.indices[place].astype(np.int64)
            blocks = adjustment.cofactor.blocks(columns)
            shift = np.einsum("nij,nj->ni", blocks, weighted.data[place])
            owners = owner[columns]
            same = (owners[:, :, None] == owners[:, None, :]) & (owners >= 0)[:, :, None]
            length = np.sqrt(np.einsum("nij,nj->ni", same, shift**2))
            best, line = length.astype(np.float32).argmax(axis=1), np.arange(len(rows))
            where[rows] = np.maximum(owners[line, best], 0)
            largest[rows] = length[line, best] * np.nan_to_num(error[rows])
    return largest, where
