"""Robust adjustment by reweighting, for finding blunders.

Standardised residuals ``|w|`` give weights that shrink the influence of outliers; values with a
joint or block covariance share theirs symmetrically (bifactor). The robust solution points at
suspects; what is reported is the least-squares solution without those confirmed (method 3.5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Network
from tribrach.network.observations.base import Observations
from tribrach.network.quality import assess

__all__ = ["RobustResult", "adjust_robust", "weight_function"]

Array = NDArray[np.float64]
Method = Literal["huber", "danish", "igg3"]

#: no weight falls below this, so that every observation keeps its place in the network
SMALLEST = 1e-6


def weight_function(method: Method, vbar: Array) -> Array:
    """Weights of standardised residuals: Huber (c 1.345), Danish (2), IGG III (1.5, 4)."""
    vbar = np.abs(vbar)
    safe = np.maximum(vbar, 1e-12)
    if method == "huber":
        return np.minimum(1.0, 1.345 / safe)
    if method == "danish":
        return np.where(vbar <= 2, 1.0, np.exp(1 - (vbar / 2) ** 2))
    if method == "igg3":
        k0, k1 = 1.5, 4.0
        middle = k0 / safe * ((k1 - vbar) / (k1 - k0)) ** 2
        return np.where(vbar <= k0, 1.0, np.where(vbar <= k1, middle, 0.0))
    raise ValueError(f"{method!r} is not huber, danish or igg3")


@dataclass(frozen=True)
class RobustResult:
    """adjustment : the reweighted solution; weights (n,) of its rows; warnings in words."""

    adjustment: Adjustment
    weights: Array
    iterations: int
    warnings: tuple[str, ...]

    def sentences(self, limit: float = 0.3) -> list[str]:
        """Warnings, and one sentence for each observation whose weight fell below the limit."""
        rows, network = self.adjustment.rows, self.adjustment.network
        out = list(self.warnings)
        seen: set[tuple[int, int]] = set()
        for row in np.flatnonzero(self.weights < limit):
            key = int(rows.table[row]), int(rows.item[row])
            if key not in seen:
                seen.add(key)
                o = network.observations[key[0]]
                words = Network.describe(o, key[1], self.adjustment.state)
                out.append(
                    f"the robust adjustment gives {words} the weight {self.weights[row]:.2f}: "
                    "check it"
                )
        return out


def adjust_robust(
    network: Network, method: Method = "igg3", *, max_iterations: int = 30
) -> RobustResult:
    """Adjust with weights that follow the residuals until they settle."""
    first = adjust(network)
    quality = assess(first)
    weak = (quality.redundancy < 0.2) & np.isfinite(quality.w)
    warnings = []
    if weak.any():
        warnings.append(
            f"{int(weak.sum())} of {len(weak)} values have redundancy below 0.2: a robust "
            "estimate cannot protect against errors there"
        )
    weights = np.ones(len(first.rows))
    adjustment, iterations = first, 0
    for _ in range(max_iterations):
        iterations += 1
        vbar = _standardised(adjustment, quality.redundancy, network)
        # the scale starts robust and never falls below the a-priori one
        scale = max(1.0, 1.4826 * float(np.median(np.abs(vbar))))
        new = np.maximum(weight_function(method, vbar / scale), SMALLEST)
        settled = np.abs(new - weights).max() < 1e-3
        weights = new
        adjustment = adjust(_reweighted(network, first, weights).with_start(adjustment.state))
        if settled:
            break
    return RobustResult(adjustment, weights, iterations, tuple(warnings))


def _standardised(adjustment: Adjustment, redundancy: Array, network: Network) -> Array:
    """Residuals over their standard deviation under the original weights."""
    sigma = np.concatenate(
        [
            o.sigma[items].ravel()
            for o, items in zip(network.observations, adjustment.assembly.active, strict=True)
        ]
    )
    share = np.sqrt(np.clip(redundancy, 1e-4, 1.0))
    standardised: Array = adjustment.residuals / (sigma * share)
    return standardised


def _reweighted(network: Network, first: Adjustment, weights: Array) -> Network:
    """Covariances divided by the weights; shared ones symmetrically by their square roots."""
    rows = first.rows
    factors = [np.ones(o.values.shape) for o in network.observations]
    for number, factor in enumerate(factors):
        mine = rows.table == number
        factor[rows.item[mine], rows.row[mine]] = 1 / np.sqrt(weights[mine])
    observations = tuple(
        _scaled(o, factor) for o, factor in zip(network.observations, factors, strict=True)
    )
    joint = []
    for group in network.joint:
        factor = np.array(
            [factors[t][i, r] for t, i, r in zip(group.table, group.item, group.row, strict=True)]
        )
        joint.append(replace(group, covariance=group.covariance * np.outer(factor, factor)))
    return replace(network, observations=observations, joint=tuple(joint))


def _scaled(o: Observations, factor: Array) -> Observations:
    return replace(o, covariance=o.covariance * factor[:, :, None] * factor[:, None, :])
