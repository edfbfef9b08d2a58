"""Robust adjustment by reweighting, for finding blunders.

Residuals over their standard deviations give weights that shrink the influence of outliers; values
with a joint or block covariance share theirs symmetrically (bifactor, Yang et al. 2002). The robust
solution points at suspects: :attr:`RobustResult.suspects` go into
:func:`tribrach.network.blunders.snooping.snoop`, and what is reported is the least-squares solution
without those that the tests confirm (method section 3.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.snooping import restart
from tribrach.network.network import Network
from tribrach.network.reliability import UNCONTROLLED, redundancy_numbers, weigh
from tribrach.network.significance import w_critical
from tribrach.observations.base import Observations
from tribrach.sentences import Sentence
from tribrach.statistics import robust_sigma

Method = Literal["huber", "danish", "igg3"]

#: no weight falls below this, so that every observation keeps its place in the network
SMALLEST = 1e-6
#: redundancy numbers below this leave a robust estimate helpless
HELPLESS = 0.2


def weight_function(method: Method, vbar: Array) -> Array:
    """Weights of standardised residuals: Huber (c 1.345), Danish (2), IGG III (1.5, 4).

    ``method``: ``huber``, ``danish`` or ``igg3``; ``vbar`` (n,): residuals over their standard
    deviations. Returns (n,): factors on the weights, 0 to 1.
    """
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
    """The reweighted solution."""

    adjustment: Adjustment  #: with the last weights
    weights: Array  #: (n,), factor on the weight of each row
    #: (n,), residual over its own standard deviation under the given weights and the robust scale
    standardised: Array
    iterations: int  #: reweighted adjustments
    warnings: tuple[str, ...]  #: what limits a robust estimate of this network, in sentences

    @property
    def suspects(self) -> dict[tuple[int, int], float]:
        """Largest standardised residual of each observation (table, item) beyond 3.29."""
        rows, size = self.adjustment.rows, np.abs(self.standardised)
        out: dict[tuple[int, int], float] = {}
        for row in np.flatnonzero(size > w_critical()):
            key = int(rows.table[row]), int(rows.item[row])
            out[key] = max(out.get(key, 0.0), float(size[row]))
        return out

    def sentences(self, limit: float = 0.3) -> list[str]:
        """Warnings, and one sentence for each observation whose weight fell below the limit."""
        rows, network = self.adjustment.rows, self.adjustment.network
        smallest: dict[tuple[int, int], float] = {}
        for row in np.flatnonzero(self.weights < limit):
            key = int(rows.table[row]), int(rows.item[row])
            smallest[key] = min(smallest.get(key, 1.0), float(self.weights[row]))
        state = self.adjustment.state
        return [
            *self.warnings,
            *(
                Sentence(
                    "the robust adjustment gives {etwork} the weight {weight:2}: check it",
                    etwork=Network.describe(network.observations[table], item, state),
                    weight=weight,
                )
                for (table, item), weight in smallest.items()
            ),
        ]


def adjust_robust(
    network: Network, method: Method = "igg3", *, max_iterations: int = 30
) -> RobustResult:
    """Adjust with weights that follow the residuals until they settle (method section 3.5)."""
    first = adjust(network)
    spread = _spread(first)
    weights = np.ones(len(first.rows))
    adjustment, iteration, steady = first, 0, False
    while not steady and iteration < max_iterations:
        iteration += 1
        new = np.maximum(weight_function(method, _standardised(adjustment, spread)), SMALLEST)
        steady = bool(np.abs(new - weights).max(initial=0.0) < 1e-3)
        weights = new
        adjustment = adjust(restart(_reweighted(first, weights), adjustment))
    return RobustResult(
        adjustment,
        weights,
        _standardised(adjustment, spread),
        iteration,
        _warnings(first, steady, iteration),
    )


def _warnings(first: Adjustment, steady: bool, iterations: int) -> tuple[str, ...]:
    """What limits a robust estimate of this network."""
    out: list[str] = []
    system = weigh(first)
    weak = (redundancy_numbers(system) < HELPLESS) & system.controlled
    if weak.any():
        out.append(
            Sentence(
                "{n} of {total} values have redundancy below {least:g}: a robust estimate cannot "
                "protect against errors there",
                n=int(weak.sum()),
                total=len(weak),
                least=HELPLESS,
            )
        )
    if not steady:
        out.append(f"the robust weights did not settle in {iterations} iterations")
    return tuple(out)


def _spread(adjustment: Adjustment) -> Array:
    """Standard deviations (n,) of the residuals, ``Q_vv = C - A Q A^T``; infinite if uncontrolled.

    Those of the least-squares solution stay the measure while the weights change.
    """
    own = _variances(adjustment)
    design = adjustment.assembly.design(adjustment.state, whitened=False)
    left = own - adjustment.cofactor.row_forms(design)
    good = left > UNCONTROLLED * own
    return np.where(good, np.sqrt(np.where(good, left, 1.0)), np.inf)


def _variances(adjustment: Adjustment) -> Array:
    """A-priori variances (n,) of the rows; joint covariances replace the values' own."""
    network, rows = adjustment.network, adjustment.rows
    tables = [np.einsum("nii->ni", o.covariance).copy() for o in network.observations]
    for joint in network.joint:
        for t, i, r, variance in zip(
            joint.table, joint.item, joint.row, np.diag(joint.covariance), strict=True
        ):
            tables[t][i, r] = variance
    out = np.empty(len(rows))
    for number, variances in enumerate(tables):
        inside = rows.table == number
        out[inside] = variances[rows.item[inside], rows.row[inside]]
    return out


def _standardised(adjustment: Adjustment, spread: Array) -> Array:
    """Residuals (n,) over their spread and a robust scale, which is never below one."""
    vbar = adjustment.residuals / spread
    controlled = np.isfinite(spread)
    scale = 1.0
    if controlled.any():
        scale = max(1.0, robust_sigma(vbar[controlled], about=0.0))
    standardised: Array = vbar / scale
    return standardised


def _reweighted(first: Adjustment, weights: Array) -> Network:
    """Covariances divided by the weights; shared ones symmetrically by their square roots."""
    network, rows = first.network, first.rows
    factors = [np.ones(o.values.shape) for o in network.observations]
    for number, factor in enumerate(factors):
        inside = rows.table == number
        factor[rows.item[inside], rows.row[inside]] = 1 / np.sqrt(weights[inside])
    return with_sigmas(network, factors)


def with_sigmas(network: Network, factors: Sequence[Array]) -> Network:
    """Multiply sigmas by ``factors`` (n, rows) of each table, correlations kept."""
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
    """Observations whose covariances (n, m, m) are multiplied by factors (n, m) on both sides."""
    return replace(o, covariance=o.covariance * factor[:, :, None] * factor[:, None, :])
