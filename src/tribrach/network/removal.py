"""Says what one observation does to the result, from the factor at hand: nothing is adjusted again.

An observation that takes part is taken out, as if each of its values had an unknown bias of its
own; one that is held out or off is put in, by its prediction (method section 3.4). Both hold within
the linearisation at the solution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array
from tribrach.network.quality import CONTROLLED, check_covariances, design_of
from tribrach.network.solved import SolvedSystem
from tribrach.observations.base import Use


@dataclass(frozen=True)
class Removal:
    """A network without an observation, or with one more."""

    takes_part: bool  #: true if the observation takes part now and is taken out
    #: weighted sum of squares and redundancy after that
    vtpv: float
    dof: int
    #: A posteriori; NaN without redundancy, or where the network needs the observation
    sigma0: float
    #: (P + S, 3), moves of points and station positions [m]; NaN where the network needs the
    #: observation
    moved: Array
    #: true if nothing else controls a part of the observation: without it the network is open, or
    #: what it determines is
    needed: bool = False

    @property
    def largest(self) -> int:
        """Number of the position that moves most; -1 if there is none."""
        length = np.nan_to_num(np.linalg.norm(self.moved, axis=1))
        return int(np.argmax(length)) if len(length) else -1


def what_if(adjustment: SolvedSystem, table: int, item: int) -> Removal:
    """Predict the network without an observation, or with one that takes no part yet."""
    o = adjustment.network.observations[table]
    if o.use[item] == Use.ACTIVE:
        return _without(adjustment, table, item)
    return _with(adjustment, table, item)


def _without(adjustment: SolvedSystem, table: int, item: int) -> Removal:
    """``g = -S^-1 y`` is the error that the values would have; without them it is gone."""
    width = adjustment.network.observations[table].rows
    rows = adjustment.assembly.row_numbers(table, np.full(width, item), np.arange(width))
    white = adjustment.once("whitener by columns", lambda: sp.csc_array(adjustment.whitener))
    own = white[:, rows]
    weighted = np.asarray((own.T @ adjustment.design).toarray())
    pull = np.asarray(own.T @ adjustment.whitened_residuals)
    weight = np.asarray((own.T @ own).toarray())
    effect = adjustment.cofactor.solve(np.ascontiguousarray(weighted.T))
    s = weight - weighted @ effect
    inverse = np.linalg.inv(np.linalg.cholesky(weight))
    share = np.linalg.eigvalsh(inverse @ (s + s.T) @ inverse.T / 2)
    dof = adjustment.dof - width
    if share[0] < CONTROLLED or dof < 0:
        moved = np.full((len(adjustment.state.positions), 3), np.nan)
        return Removal(True, adjustment.vtpv, dof, np.nan, moved, needed=True)
    error = -np.linalg.solve(s, pull)
    vtpv = max(0.0, adjustment.vtpv + float(pull @ error))
    # the values less their errors
    return _moved(adjustment, True, vtpv, dof, -effect @ error)


def _with(adjustment: SolvedSystem, table: int, item: int) -> Removal:
    """``d`` against its prediction, whose covariance is ``C + A Q A^T``."""
    o = adjustment.network.observations[table]
    one = np.array([item])
    gap = o.misclosure(adjustment.state)[item]
    gain = np.linalg.solve(check_covariances(adjustment, o, one)[0], gap)
    design = design_of(adjustment, o, one)
    step = adjustment.cofactor.solve(np.asarray(design.T @ gain))
    return _moved(
        adjustment, False, adjustment.vtpv + float(gap @ gain), adjustment.dof + o.rows, step
    )


def _moved(
    adjustment: SolvedSystem, takes_part: bool, vtpv: float, dof: int, step: Array
) -> Removal:
    """The figures, and a step (u,) of the free columns as moves of positions."""
    count = len(adjustment.state.positions)
    place = adjustment.reduced[adjustment.layout.position_columns(np.arange(count))]
    moved = np.append(step, 0.0)[place]
    sigma0 = adjustment.sigma0 * float(np.sqrt(vtpv / dof)) if dof > 0 else float("nan")
    return Removal(takes_part, vtpv, dof, sigma0, moved)
