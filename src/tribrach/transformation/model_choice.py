"""Tests whether a scale is real and which model is enough.

The given covariances judge where the global test of the richest fit lets them, else sigma0 a
posteriori.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribrach.answers import Number, Result
from tribrach.errors import AdjustmentError, InputError
from tribrach.statistics import chi2, f, norm, t
from tribrach.transformation.fit import CommonPoints, TransformationFit, fit_points
from tribrach.transformation.models import MODELS
from tribrach.transformation.testing import trusted

#: differences of a scale from one below this are rounding
_ROUNDING = 1e-12


@dataclass(frozen=True)
class ScaleTest(Result, also=("needed", "sigma_is"), without=("posterior",)):
    """Whether the scale of a similarity is real."""

    #: scale less one, and its standard deviation
    excess: float
    sigma: Number
    #: their ratio, and its limit at 95 %
    t: Number
    limit: float
    posterior: bool

    @property
    def needed(self) -> bool:
        """Is the scale significant?"""
        return abs(self.t) > self.limit

    @property
    def sigma_is(self) -> Literal["prior", "posterior"]:
        """Where sigma0 comes from."""
        return "posterior" if self.posterior else "prior"


def scale_test(points: CommonPoints) -> ScaleTest | None:
    """Test the scale of a similarity.

    The given covariances decide unless the global test of the similarity fails at 95 %; then, and
    without covariances, sigma0 a posteriori.
    """
    count = 7 if points.dimension == 3 else 4
    model = next(m for m in MODELS if (m.count, m.dimension) == (count, points.dimension))
    try:
        fit = fit_points(points, model)
    except (InputError, AdjustmentError):
        return None
    if fit.dof < 1:
        return None
    posterior = not trusted(fit)
    factor = fit.vtpv / fit.dof if posterior else 1.0
    sigma = float(np.sqrt(factor * fit.cofactor[-1, -1]))
    excess = float(fit.transformation.factors[0] - 1)
    limit = float(t.ppf(0.975, fit.dof) if posterior else norm.ppf(0.975))
    # points that fit exactly: what is left of the scale is rounding
    exact = abs(excess) < _ROUNDING and not sigma > _ROUNDING
    value = 0.0 if exact else excess / sigma if sigma > 0 else float(np.sign(excess)) * np.inf
    return ScaleTest(excess, sigma, float(value), limit, posterior)


@dataclass(frozen=True)
class Rung(Result):
    """What a model gains over the next stiffer one."""

    #: number of parameters
    count: int
    words: str
    vtpv: float
    dof: int
    rms: float  #: root mean square of the differences [m]
    #: gain and its limit at 95 %: chi-square with given covariances that hold, else F; null for the
    #: stiffest model and where nothing is left to compare with
    statistic: Number
    limit: Number

    @property
    def needed(self) -> str:
        """Are the further parameters real? Nothing where that cannot be told."""
        known = np.isfinite(self.statistic) and np.isfinite(self.limit)
        return ("yes" if self.statistic > self.limit else "no") if known else ""


def ladder(points: CommonPoints) -> list[Rung]:
    """Fit every model that the points determine, from the stiffest to the richest.

    The noise that gains are measured with is that of the richest model with redundancy.
    """
    fits: list[TransformationFit] = []
    for model in (m for m in MODELS if m.dimension == points.dimension):
        try:
            fits.append(fit_points(points, model))
        except (InputError, AdjustmentError):
            continue
    rich = [fit for fit in fits if fit.dof > 0]
    rungs: list[Rung] = []
    for fit in fits:
        statistic = limit = np.nan
        if rungs and fit.dof > 0:
            more = fit.model.count - rungs[-1].count
            gain = max(rungs[-1].vtpv - fit.vtpv, 0.0)
            best = rich[-1]
            if trusted(best):
                statistic, limit = gain, float(chi2.ppf(0.95, more))
            elif best.vtpv > 0:
                statistic = gain / more / (best.vtpv / best.dof)
                limit = float(f.ppf(0.95, more, best.dof))
        count, words = fit.model.count, fit.model.words
        rungs.append(Rung(count, words, fit.vtpv, fit.dof, fit.rms, statistic, limit))
    return rungs
