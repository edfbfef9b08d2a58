"""Variance components: do the groups of observations deserve the sigmas they were given?

Förstner's simplified estimate ``s_g^2 = v_g^T P_g v_g / r_g`` with ``r_g = tr(R_gg)``, iterated
until every component is one (method section 3.6; Förstner 1979). At convergence it is the same
as Helmert's full estimate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import AdjustmentError
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Network

__all__ = ["Component", "VarianceComponents", "estimate_components"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Component:
    """One group: values, redundancy, factor on its given sigmas and that factor's own sigma."""

    group: str
    count: int
    redundancy: float
    sigma_factor: float
    sigma_of_factor: float
    note: str = ""


@dataclass(frozen=True)
class VarianceComponents:
    """The adjustment with rescaled groups, and the table of components."""

    adjustment: Adjustment
    components: tuple[Component, ...]
    iterations: int
    converged: bool


def estimate_components(
    network: Network,
    *,
    minimum_redundancy: float = 5.0,
    max_iterations: int = 50,
    limits: tuple[float, float] = (0.1, 100.0),
) -> VarianceComponents:
    """Estimate one variance factor per group and adjust with it.

    Groups with less redundancy than ``minimum_redundancy`` keep their sigmas, with a note. The
    factor on sigma stays within ``limits``.

    Raises
    ------
    AdjustmentError : a joint covariance ties observations of different groups together.
    """
    groups = [o.group for o in network.observations]
    _check_joint(network, groups)
    names = list(dict.fromkeys(groups))
    number = np.array([names.index(g) for g in groups])
    variance = np.ones(len(names))
    adjustment = adjust(network)
    converged, iterations = False, 0
    for _ in range(max_iterations):
        iterations += 1
        count, redundancy, square = _shares(adjustment, number, len(names))
        usable = redundancy >= minimum_redundancy
        ratio = np.where(usable, square / np.where(usable, redundancy, 1.0), 1.0)
        low, high = limits[0] ** 2, limits[1] ** 2
        updated = np.clip(variance * np.maximum(ratio, 1e-6), low, high)
        ratio, variance = updated / variance, updated
        converged = bool(np.abs(ratio - 1).max() < 1e-6)
        if converged:
            break
        scaled = _rescaled(network, variance[number])
        adjustment = adjust(scaled.with_start(adjustment.state))
    table = []
    for k, name in enumerate(names):
        note = (
            ""
            if usable[k]
            else (f"redundancy {redundancy[k]:.1f} is below {minimum_redundancy:g}: sigmas kept")
        )
        factor = float(np.sqrt(variance[k]))
        spread = factor / np.sqrt(2 * redundancy[k]) if redundancy[k] > 0 else np.inf
        table.append(
            Component(name, int(count[k]), float(redundancy[k]), factor, float(spread), note)
        )
    return VarianceComponents(adjustment, tuple(table), iterations, converged)


def _shares(adjustment: Adjustment, number: NDArray[np.int64], count: int) -> tuple[Array, ...]:
    """Values, redundancy and weighted sum of squares of each group."""
    group = number[adjustment.rows.table]
    share = 1 - adjustment.cofactor.row_forms(adjustment.design)
    square = adjustment.whitened_residuals**2
    return (
        np.bincount(group, minlength=count).astype(float),
        np.bincount(group, share, count).astype(float),
        np.bincount(group, square, count).astype(float),
    )


def _rescaled(network: Network, variance: Array) -> Network:
    """Covariances of each table multiplied by its variance factor."""
    observations = tuple(
        replace(o, covariance=o.covariance * s)
        for o, s in zip(network.observations, variance, strict=True)
    )
    joint = tuple(replace(g, covariance=g.covariance * variance[g.table[0]]) for g in network.joint)
    return replace(network, observations=observations, joint=joint)


def _check_joint(network: Network, groups: list[str]) -> None:
    for joint in network.joint:
        tied = sorted({groups[t] for t in joint.table})
        if len(tied) > 1:
            raise AdjustmentError(
                "variance components cannot be estimated",
                [f"one covariance matrix ties the groups {' and '.join(tied)} together"],
            )
