"""Variance components: tests whether groups of observations deserve the sigmas they were given.

Two estimates, both iterated until every component is one (method section 3.6):

* Förstner's (1979) simplified ``s_g^2 = v_g^T P_g v_g / r_g`` with ``r_g = tr(R_gg)``;
* Helmert's full one (Grafarend & Schaffrin 1979): ``H s = q`` with ``q_g = v_g^T P_g v_g`` and
  ``H_ij = n_i d_ij - 2 tr(Q N_i) d_ij + tr(Q N_i Q N_j)``.

At convergence they are the same; the full one gets there in fewer steps, knows how the components
go together, and costs a dense matrix of the size of the unknowns.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index, Mask
from tribrach.errors import AdjustmentError
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.snooping import restart
from tribrach.network.network import EstimatedFactors, Network, is_given
from tribrach.sentences import Sentence
from tribrach.statistics import chi2

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

    group: str  #: name of the group
    count: int  #: number of its values
    redundancy: float  #: sum of their redundancy numbers
    sigma_factor: float  #: factor on the sigmas that were given
    sigma_of_factor: float  #: standard deviation of that factor; NaN where the sigmas were kept
    note: str = ""  #: why the component is not simply what the residuals say; empty if it is


@dataclass(frozen=True)
class VarianceComponents:
    """The estimated components and the adjustment with them."""

    adjustment: Adjustment  #: with rescaled groups; its network carries them
    components: tuple[VarianceComponent, ...]  #: one for each group
    iterations: int  #: adjustments that were needed
    converged: bool  #: false if the components still changed

    def sentences(self) -> list[str]:
        """Sentences on sigmas kept, limits reached and lack of convergence."""
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
    alpha: float | None = 0.05,
) -> VarianceComponents:
    """Estimate one variance factor for each group and adjust with it (method section 3.6).

    A group that falls below ``minimum_redundancy`` on the way keeps its sigmas. So does one whose
    factor the residuals do not tell from 1 at ``alpha``, and control that would become better than
    it was given; with ``alpha`` None every factor is taken as it comes.
    """
    groups = _Groups(network)
    first = adjust(network)
    kept: dict[int, Sentence] = {}
    total = 0
    while True:
        round_ = _iterate(groups, first, method, minimum_redundancy, max_iterations, limits, kept)
        total += round_.iterations
        found = {} if alpha is None else groups.not_significant(network, round_, alpha)
        if not found:
            break
        kept |= found
    notes = _notes(round_, minimum_redundancy, limits, kept)
    shares, factor, spread = round_.shares, np.sqrt(round_.variance), round_.spread
    rows = zip(groups.names, shares.count, shares.redundancy, factor, spread, notes, strict=True)
    table = tuple(
        VarianceComponent(name, int(n), float(r), float(s), float(s * d), note)
        for name, n, r, s, d, note in rows
    )
    return VarianceComponents(round_.stated(groups), table, total, round_.converged)


@dataclass(frozen=True)
class _Round:
    """Factors of some groups while the others keep their sigmas."""

    adjustment: Adjustment
    #: (g,), redundancy and squares, variance factors, and which of them are estimated
    shares: _Shares
    variance: Array
    usable: Mask
    #: (g, g), covariance of the factors divided by their values; zero where they are kept
    covariance: Array
    iterations: int
    converged: bool

    @property
    def spread(self) -> Array:
        """Relative sigmas (g,) of the roots of the factors; NaN where they are kept."""
        out = np.sqrt(np.maximum(np.diag(self.covariance), 0.0)) / 2
        return np.where(self.usable, out, np.nan)

    def stated(self, groups: _Groups) -> Adjustment:
        """The adjustment, whose network knows how well its sigmas are known."""
        used = np.flatnonzero(self.usable)
        if not len(used):
            return self.adjustment
        known = EstimatedFactors(
            tuple(groups.names[k] for k in used), self.covariance[np.ix_(used, used)]
        )
        network = replace(self.adjustment.network, factors=known)
        return replace(self.adjustment, network=network)


def _iterate(
    groups: _Groups,
    first: Adjustment,
    method: Method,
    minimum: float,
    most: int,
    limits: tuple[float, float],
    kept: Collection[int],
) -> _Round:
    """Variance factors of all groups that are not kept, until they are those of the residuals."""
    low, high = limits[0] ** 2, limits[1] ** 2
    size = len(groups.names)
    variance, usable = np.ones(size), ~np.isin(np.arange(size), list(kept))
    adjustment, iteration = first, 0
    while True:
        shares = groups.shares(adjustment)
        usable &= shares.redundancy >= minimum
        ratio = _estimate(method, groups, adjustment, shares, usable)
        updated = np.where(usable, np.clip(variance * ratio, low, high), 1.0)
        converged = bool(np.abs(updated / variance - 1).max(initial=0.0) < SETTLED)
        if converged or iteration == most:
            break
        variance, iteration = updated, iteration + 1
        scaled = _rescaled(first.network, variance[groups.number])
        adjustment = adjust(restart(scaled, adjustment))
    covariance = groups.covariance(adjustment, shares, usable)
    return _Round(adjustment, shares, variance, usable, covariance, iteration, converged)


@dataclass(frozen=True)
class _Shares:
    """Values, redundancy and weighted sum of squares of each group (g,)."""

    count: Array
    redundancy: Array
    square: Array


class _Groups:
    """Names of the groups and the group of each table."""

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

    def covariance(self, adjustment: Adjustment, shares: _Shares, usable: Mask) -> Array:
        """Covariance ``2 H^-1`` (g, g) of factors over their values; zero of groups that keep."""
        out = np.zeros((len(self.names), len(self.names)))
        if usable.any():
            small = adjustment.n_unknowns <= EXACT
            matrix = self.helmert_matrix(adjustment) if small else self._probed(adjustment, shares)
            square = np.ix_(usable, usable)
            out[square] = 2 * np.linalg.inv(matrix[square])
        return out

    def not_significant(self, network: Network, found: _Round, alpha: float) -> dict[int, Sentence]:
        """Why groups keep their sigmas: residuals do not tell their factors from 1.

        ``nu s^2`` is about chi-square of nu = 2 over the relative variance of ``s^2``.
        """
        given = {o.group for o in network.observations if is_given(type(o), o.group)}
        out: dict[int, Sentence] = {}
        for k in np.flatnonzero(found.usable).tolist():
            square, nu = float(found.variance[k]), 2 / max(float(found.covariance[k, k]), 1e-12)
            low, high = (
                float(np.sqrt(square * nu / chi2.ppf(p, nu))) for p in (1 - alpha / 2, alpha / 2)
            )
            if low <= 1 <= high:
                out[k] = Sentence(
                    "{factor:2} is not told from 1 ({low:2} to {high:2}): sigmas kept as given",
                    factor=float(np.sqrt(square)),
                    low=low,
                    high=high,
                )
            elif square < 1 and self.names[k] in given:
                out[k] = Sentence(
                    "{factor:2}: control is not made better than it was given",
                    factor=float(np.sqrt(square)),
                )
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
    found: _Round, minimum: float, limits: tuple[float, float], kept: Mapping[int, Sentence]
) -> list[str]:
    """Why a component is not simply what the residuals say; empty if it is."""
    out: list[str] = []
    for k, (r, s) in enumerate(zip(found.shares.redundancy, found.variance, strict=True)):
        if k in kept:
            out.append(kept[k])
        elif not found.usable[k]:
            out.append(
                Sentence(
                    "redundancy {r:1} is below {minimum:g}: sigmas kept as given",
                    r=r,
                    minimum=minimum,
                )
            )
        elif s in (limits[0] ** 2, limits[1] ** 2):
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
