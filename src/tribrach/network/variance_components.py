"""Variance components: tests whether groups of observations deserve the sigmas they were given.

Two estimates, both iterated until every component is one (method section 3.6):

* Förstner's (1979) simplified ``s_g^2 = v_g^T P_g v_g / r_g`` with ``r_g = tr(R_gg)``;
* Helmert's full one (Grafarend & Schaffrin 1979): ``H s = q`` with ``q_g = v_g^T P_g v_g`` and
  ``H_ij = n_i d_ij - 2 tr(Q N_i) d_ij + tr(Q N_i Q N_j)``.

At convergence they are the same; the full one gets there in fewer steps, knows how the components
go together, and costs a dense matrix of the size of the unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index, Mask
from tribrach.errors import AdjustmentError
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.snooping import restart
from tribrach.network.network import Network
from tribrach.sentences import Sentence

__all__ = ["VarianceComponent", "VarianceComponents", "estimate_components"]

Method = Literal["foerstner", "helmert"]

#: largest number of unknowns for the full estimate
HELMERT_LIMIT = 2000
#: unknowns up to which sigmas of factors come from all of H, and random vectors beyond
EXACT, PROBES = 600, 40
#: largest last change of a variance
SETTLED = 1e-6


@dataclass(frozen=True)
class VarianceComponent:
    """The variance component of one group of observations."""

    #: name of the group
    group: str
    #: number of its values
    count: int
    #: sum of their redundancy numbers
    redundancy: float
    #: factor on the sigmas that were given
    sigma_factor: float
    #: standard deviation of that factor; NaN where the sigmas were kept
    sigma_of_factor: float
    #: why the component is not simply what the residuals say; empty if it is
    note: str = ""


@dataclass(frozen=True)
class VarianceComponents:
    """The estimated components and the adjustment with them."""

    #: with rescaled groups; its network carries them
    adjustment: Adjustment
    #: one for each group
    components: tuple[VarianceComponent, ...]
    #: adjustments that were needed
    iterations: int
    #: false if the components still changed
    converged: bool

    def sentences(self) -> list[str]:
        """What a reader must know: sigmas kept, limits reached, no convergence."""
        out = [f"variance component of {c.group}: {c.note}" for c in self.components if c.note]
        if not self.converged:
            out.append(f"the variance components did not settle in {self.iterations} iterations")
        return out


def estimate_components(
    network: Network,
    *,
    method: Method = "foerstner",
    minimum_redundancy: float = 5.0,
    max_iterations: int = 50,
    limits: tuple[float, float] = (0.1, 100.0),
) -> VarianceComponents:
    """Estimate one variance factor for each group and adjust with it (method section 3.6).

    A group that falls below ``minimum_redundancy`` on the way keeps its sigmas too.
    """
    groups = _Groups(network)
    low, high = limits[0] ** 2, limits[1] ** 2
    variance, usable = np.ones(len(groups.names)), np.ones(len(groups.names), dtype=bool)
    adjustment = adjust(network)
    start = adjustment.network
    converged, iteration = False, 0
    while True:
        shares = groups.shares(adjustment)
        usable &= shares.redundancy >= minimum_redundancy
        ratio = _estimate(method, groups, adjustment, shares, usable)
        updated = np.where(usable, np.clip(variance * ratio, low, high), 1.0)
        converged = bool(np.abs(updated / variance - 1).max(initial=0.0) < SETTLED)
        if converged or iteration == max_iterations:
            break
        variance, iteration = updated, iteration + 1
        scaled = _rescaled(start, variance[groups.number])
        adjustment = adjust(restart(scaled, adjustment))
    spread = groups.spread(adjustment, shares, usable)
    notes = _notes(shares, usable, updated, minimum_redundancy, (low, high))
    factor = np.sqrt(variance)
    rows = zip(groups.names, shares.count, shares.redundancy, factor, spread, notes, strict=True)
    table = tuple(
        VarianceComponent(name, int(n), float(r), float(s), float(s * d), note)
        for name, n, r, s, d, note in rows
    )
    return VarianceComponents(adjustment, table, iteration, converged)


@dataclass(frozen=True)
class _Shares:
    """Of each group (g,): values, redundancy, weighted sum of squares."""

    count: Array
    redundancy: Array
    square: Array


class _Groups:
    """Names of the groups and the group of each table.

    Raises
    ------
    AdjustmentError
        A joint covariance ties observations of different groups together.
    """

    def __init__(self, network: Network) -> None:
        of_table = [o.group for o in network.observations]
        for joint in network.joint:
            tied = sorted({of_table[t] for t in joint.table})
            if len(tied) > 1:
                raise AdjustmentError(
                    "variance components cannot be estimated",
                    [f"one covariance matrix ties the groups {' and '.join(tied)} together"],
                )
        self.names = list(dict.fromkeys(of_table))
        self.number: Index = np.array([self.names.index(g) for g in of_table], dtype=np.int64)

    def shares(self, adjustment: Adjustment) -> _Shares:
        """Values, redundancy and weighted sum of squares of each group."""
        group, size = self.number[adjustment.rows.table], len(self.names)
        share = 1 - adjustment.cofactor.row_forms(adjustment.design)
        square = adjustment.whitened_residuals**2
        return _Shares(
            np.bincount(group, minlength=size).astype(float),
            np.bincount(group, share, size).astype(float),
            np.bincount(group, square, size).astype(float),
        )

    def spread(self, adjustment: Adjustment, shares: _Shares, usable: Mask) -> Array:
        """Relative sigmas (g,) of the roots of the components, from ``2 H^-1``.

        Both estimates have it at convergence; NaN for groups that keep their sigmas, which are
        not estimated.
        """
        out = np.full(len(self.names), np.nan)
        if usable.any():
            small = adjustment.n_unknowns <= EXACT
            matrix = self.helmert_matrix(adjustment) if small else self._probed(adjustment, shares)
            inverse = np.linalg.inv(matrix[np.ix_(usable, usable)])
            out[usable] = np.sqrt(np.maximum(2 * np.diag(inverse), 0.0)) / 2
        return out

    def _probed(self, adjustment: Adjustment, shares: _Shares) -> Array:
        """The same matrix from random signs (Hutchinson 1990), good to a few per cent."""
        group, size = self.number[adjustment.rows.table], len(self.names)
        signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(group), PROBES))
        matrix = np.diag(2 * shares.redundancy - shares.count)
        for k in range(size):
            mine = (group == k)[:, None] * signs
            seen = adjustment.design @ adjustment.cofactor.solve(adjustment.design.T @ mine)
            square = (seen**2).mean(axis=1)
            matrix[:, k] += np.bincount(group, square, size)
        return (matrix + matrix.T) / 2

    def helmert_matrix(self, adjustment: Adjustment) -> Array:
        """``H_ij = |R_ij|^2`` (g, g): squared Frobenius norms of the blocks of ``R``."""
        if adjustment.n_unknowns > HELMERT_LIMIT:
            raise AdjustmentError(
                "the full estimate of variance components is too large for this network",
                ["Förstner's estimate gives the same components: choose that"],
            )
        group = self.number[adjustment.rows.table]
        products, matrix = [], np.zeros((len(self.names), len(self.names)))
        for k in range(len(self.names)):
            rows = sp.csr_array(adjustment.design[np.flatnonzero(group == k)])
            product = adjustment.cofactor.solve((rows.T @ rows).toarray())
            products.append(product)
            matrix[k, k] = rows.shape[0] - 2 * np.trace(product)
        for i, a in enumerate(products):
            for j, b in enumerate(products):
                matrix[i, j] += float((a * b.T).sum())
        return matrix


def _estimate(
    method: Method, groups: _Groups, adjustment: Adjustment, shares: _Shares, usable: Mask
) -> Array:
    """Variance ratios (g,), one for groups left alone."""
    redundancy = np.where(shares.redundancy > 1e-6, shares.redundancy, np.inf)
    if method == "foerstner" or not usable.any():
        ratio = np.where(usable, shares.square / redundancy, 1.0)
        return np.maximum(ratio, SETTLED)
    matrix = groups.helmert_matrix(adjustment)
    # groups that keep their sigmas stand on the right-hand side with the component one
    inverse = np.linalg.inv(matrix[np.ix_(usable, usable)])
    ratio = np.ones(len(usable))
    ratio[usable] = inverse @ (shares.square - matrix[:, ~usable].sum(axis=1))[usable]
    return np.maximum(ratio, SETTLED)


def _notes(
    shares: _Shares, usable: Mask, variance: Array, minimum: float, limits: tuple[float, float]
) -> list[str]:
    """Why a component is not simply what the residuals say; empty if it is."""
    out: list[str] = []
    for r, good, s in zip(shares.redundancy, usable, variance, strict=True):
        if not good:
            out.append(
                Sentence(
                    "redundancy {r:1} is below {minimum:g}: sigmas kept as given",
                    r=r,
                    minimum=minimum,
                )
            )
        elif s in limits:
            out.append(
                Sentence(
                    "the factor stopped at its limit {value:g}: look for blunders", value=np.sqrt(s)
                )
            )
        else:
            out.append("")
    return out


def _rescaled(network: Network, variance: Array) -> Network:
    """Covariances of each table multiplied by its variance factor."""
    observations = tuple(
        replace(o, covariance=o.covariance * s)
        for o, s in zip(network.observations, variance, strict=True)
    )
    joint = tuple(replace(g, covariance=g.covariance * variance[g.table[0]]) for g in network.joint)
    return replace(network, observations=observations, joint=joint)
