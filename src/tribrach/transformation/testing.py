"""Which common points do not fit, and what do check points say?

Point test: the force ``C^-1 w`` of a point against its covariance, chi-square with d values where
covariances are given, else F against the fit without the point. Whether A or B is wrong in a point
cannot be told. Method section 3.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.distributions import chi2, f
from tribrach.transformation.fit import Fit

__all__ = [
    "ALPHA0",
    "CheckResult",
    "PointTests",
    "check_points",
    "compare_points",
    "point_tests",
    "trusted",
]

Array = NDArray[np.float64]

ALPHA0 = 0.001


@dataclass(frozen=True)
class PointTests:
    """Tests of the m used points, in their order.

    statistic, limit (m,) : NaN where nothing controls a point; redundancy (m,) : sum of its
    redundancy numbers, 0 to d; error (m, d) [m] : estimated blunder in B's axes; left (m,) :
    ``v^T P v`` of the fit without the point.
    """

    statistic: Array
    limit: Array
    redundancy: Array
    error: Array
    left: Array

    @property
    def suspicious(self) -> NDArray[np.bool_]:
        """Points (m,) beyond their limit."""
        return np.nan_to_num(self.statistic) > np.where(np.isnan(self.limit), np.inf, self.limit)


def trusted(fit: Fit) -> bool:
    """True if the given covariances may judge single points: there are some and they hold."""
    if not fit.points.weighted or fit.dof <= 0:
        return fit.points.weighted
    return fit.vtpv <= float(chi2.ppf(0.95, fit.dof))


def point_tests(fit: Fit, alpha0: float = ALPHA0, *, prior: bool | None = None) -> PointTests:
    """Tests of all used points.

    prior : judge by the given covariances; if None, where there are some.
    """
    d, m = fit.points.dimension, len(fit.force)
    own = fit.weight - fit.solved @ fit.cofactor @ fit.solved.transpose(0, 2, 1)
    share = np.einsum("mij,mji->m", own, np.linalg.inv(fit.weight))
    values, vectors = np.linalg.eigh(own)
    largest = np.einsum("mii->m", fit.weight)[:, None]
    good = values > 1e-9 * largest
    along = np.einsum("mji,mj->mi", vectors, fit.force)
    safe = np.where(good, values, 1.0)
    square = np.where(good, along**2 / safe, 0.0).sum(axis=1)
    error = np.einsum("mij,mj->mi", vectors, np.where(good, along / safe, 0.0))
    rows = good.sum(axis=1)
    left = np.maximum(fit.vtpv - square, 0.0)
    statistic, limit = np.full(m, np.nan), np.full(m, np.nan)
    known = rows > 0
    by_prior = fit.points.weighted if prior is None else prior
    if by_prior:
        statistic[known] = square[known]
        limit[known] = chi2.ppf(1 - alpha0, rows[known])
    else:
        rest = fit.dof - rows
        known &= rest > 0
        noise = left[known] / rest[known]
        # an exact rest is rounding: whatever does not fit it is wrong
        tiny = 1e-24 * float(np.square(fit.points.b).max(initial=1.0))
        statistic[known] = square[known] / rows[known] / np.maximum(noise, tiny)
        limit[known] = f.ppf(1 - alpha0, rows[known], rest[known])
    return PointTests(statistic, limit, np.clip(share, 0, d), error, left)


@dataclass(frozen=True)
class CheckResult:
    """Points held out against the transformation.

    place (c,) : numbers among all points; difference (c, d) : b - T(a) [m] with its predicted
    covariance (c, d, d); statistic (c,) : squared in that metric; dof : of the variance factor,
    None where it is not estimated.
    """

    place: NDArray[np.int64]
    difference: Array
    covariance: Array
    statistic: Array
    dof: int | None

    def limit(self, probability: float = 0.99) -> Array:
        """Limits (c,) of the statistics."""
        d = self.difference.shape[1]
        n = len(self.statistic)
        if self.dof is None:
            return np.full(n, float(chi2.ppf(probability, d)))
        return np.full(n, d * float(f.ppf(probability, d, self.dof)))

    @property
    def rmse(self) -> Array:
        """Root mean square (d,) [m] along each axis."""
        out: Array = np.sqrt((self.difference**2).mean(axis=0))
        return out


def check_points(fit: Fit) -> CheckResult | None:
    """Check points against the fit; None if there are none."""
    place = np.flatnonzero(fit.points.check)
    return compare_points(fit, place) if len(place) else None


def compare_points(fit: Fit, place: NDArray[np.int64]) -> CheckResult:
    """Points (c,) that take no part in a fit, by their numbers, against it."""
    points = fit.points
    n, d = points.a.shape
    own_a, own_b = (s.of_points(n, d)[place] for s in (points.spread_a, points.spread_b))
    if not points.weighted:
        own_b = np.broadcast_to(np.eye(d) * fit.factor, own_b.shape)
    c = fit.predicted(points.a[place], own_a) + own_b
    w = fit.difference[place]
    solved = np.linalg.solve(c, w[:, :, None])[:, :, 0] if np.isfinite(c).all() else np.nan * w
    dof = None if points.weighted else fit.dof
    return CheckResult(place, w, c, np.einsum("ni,ni->n", w, solved), dof)
