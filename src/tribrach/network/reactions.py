"""Tests whether the observations agree with the hard constraints (method section 2.13).

A constraint pulls the adjustment by its reaction, the Lagrange multiplier. Against its own
sigma it tests the constraint; divided by its variance it tells by how much the observations
alone would miss it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Use
from tribrach.sentences import Sentence

#: units as sentences show them
_SHOWN = {"m": (1e-3, " mm"), "rad": (1e-3, " mrad")}


@dataclass(frozen=True)
class Reactions:
    """Tests of the hard constraints, arrays (q,) in the order of ``labels``."""

    labels: tuple[str, ...]  #: the constraints in words
    gap: Array  #: (q,), by how much the other observations miss the constraint [m, rad]
    sigma: Array  #: (q,), standard deviation of the gap, a priori
    #: (q,), their ratio, standard normal if the constraint is true; NaN where the constraint only
    #: fixes the datum, which no observation can contradict
    test: Array
    units: tuple[str, ...]  #: ``m``, ``rad`` or ``1`` of each

    def sentences(self, critical: float = 3.29) -> list[str]:
        """One sentence for each constraint that the observations contradict."""
        return [
            Sentence(
                "the constraint {label} is contradicted: without it the observations miss it "
                "by {gap:2}{name} with a sigma of {sigma:2}{name}, {test:1} times as much",
                label=label,
                gap=gap / size,
                name=name,
                sigma=sigma / size,
                test=abs(test),
            )
            for label, gap, sigma, test, (size, name) in zip(
                self.labels,
                self.gap,
                self.sigma,
                self.test,
                [_SHOWN.get(unit, (1.0, "")) for unit in self.units],
                strict=True,
            )
            if abs(test) > critical
        ]


def constraint_reactions(adjustment: Adjustment) -> Reactions:
    """Reactions of all hard constraints of an adjustment."""
    assembly, network = adjustment.assembly, adjustment.network
    constraints, _ = assembly.constraints(adjustment.state)
    labels: list[str] = []
    units: list[str] = []
    for constraint in network.constraints:
        o = constraint.observations
        for item in np.flatnonzero(o.use == Use.ACTIVE):
            words = network.describe(o, int(item), adjustment.state)
            labels += [f"{words} {c}".rstrip() for c in o.components]
            units += o.units
    q = constraints.shape[0]
    if q == 0:
        return Reactions((), np.zeros(0), np.zeros(0), np.zeros(0), ())
    # C^T k = A^T P w at the solution; the residual is v = -w
    gradient = -(adjustment.design.T @ adjustment.whitened_residuals)
    gram = sp.csc_array(constraints @ constraints.T)
    multiplier = np.linalg.lstsq(gram.toarray(), constraints @ gradient, rcond=1e-12)[0]
    variance = np.diag(adjustment.cofactor.multiplier_covariance())
    scale = sla.norm(constraints, axis=1) ** 2
    informative = variance * scale.min() > 1e-12 * np.abs(variance).max(initial=0.0) * scale
    informative &= variance > 0
    safe = np.where(informative, variance, 1.0)
    gap = np.where(informative, multiplier / safe, np.nan)
    sigma = np.where(informative, 1 / np.sqrt(safe), np.nan)
    return Reactions(tuple(labels), gap, sigma, gap / sigma, tuple(units))
