"""Tests common points, switches off those that do not fit, and compares check points.

Point test: the force ``C^-1 w`` of a point against its covariance, chi-square with d values where
covariances are given, else F against the fit without the point. Whether A or B is wrong in a point
cannot be told. Points that do not fit are switched off one by one, with their names and sizes
(method section 3.4, for whole points instead of single values).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import AdjustmentError, InputError
from tribrach.sentences import Sentence, joined
from tribrach.statistics import chi2, f
from tribrach.transformation.fit import TransformationFit, fit_points

#: significance of the test of a single point
ALPHA0 = 0.001
#: wrong points are looked for that hide each other among so few points, so many of them at most
_FEW, _DEEPEST = 100, 6


@dataclass(frozen=True)
class PointTests:
    """Tests of the m used points, in their order."""

    #: (m,), naN where nothing controls a point
    statistic: Array
    limit: Array
    redundancy: Array  #: (m,), sum of its redundancy numbers, 0 to d
    error: Array  #: (m, d), estimated blunder in B's axes [m]
    left: Array  #: (m,), ``v^T P v`` of the fit without the point

    @property
    def suspicious(self) -> NDArray[np.bool_]:
        """Points (m,) beyond their limit."""
        return np.nan_to_num(self.statistic) > np.where(np.isnan(self.limit), np.inf, self.limit)


def trusted(fit: TransformationFit) -> bool:
    """True if the given covariances may judge single points: there are some and they hold."""
    if not fit.points.weighted or fit.dof <= 0:
        return fit.points.weighted
    return fit.vtpv <= float(chi2.ppf(0.95, fit.dof))


def point_tests(fit: TransformationFit, alpha0: float = ALPHA0) -> PointTests:
    """Test every used point."""
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
    if fit.points.weighted:
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
    """Points held out, compared with the transformation."""

    place: NDArray[np.int64]  #: (c,), their numbers among all points
    difference: Array  #: (c, d), b - T(a) [m]
    covariance: Array  #: (c, d, d), predicted covariance of the difference [m^2]
    statistic: Array  #: (c,), squared difference in that metric
    dof: int | None  #: of the variance factor, None where it is not estimated

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


def check_points(fit: TransformationFit) -> CheckResult | None:
    """Check points against the fit; None if there are none."""
    place = np.flatnonzero(fit.points.check)
    return compare_points(fit, place) if len(place) else None


def compare_points(fit: TransformationFit, place: NDArray[np.int64]) -> CheckResult:
    """Compare points that take no part in a fit with it.

    ``place`` (c,): numbers of the points.
    """
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


@dataclass(frozen=True)
class Snooped:
    """A fit without the points that do not fit."""

    fit: TransformationFit  #: of the points that are left
    steps: tuple[str, ...]  #: what was done, in words
    removed: tuple[str, ...]  #: names of the points that stayed off


def snoop_points(fit: TransformationFit) -> Snooped:
    """Switch worst points off one by one; those that fit come back, redundancy stays one."""
    steps: list[str] = []
    removed: list[int] = []
    while True:
        tests = point_tests(fit)
        ahead = 0 if tests.suspicious.any() else _hidden(fit)
        if not tests.suspicious.any() and not ahead:
            break
        # without sigmas several wrong points hide each other in a large sigma0
        trial = _one_less(fit, tests, steps, removed, hidden=ahead > 0)
        if trial is None:
            break
        fit = trial
        for _ in range(ahead - 1):
            fit = _one_less(fit, point_tests(fit), steps, removed, hidden=True) or fit
    fit, kept = _recalled(fit, removed, steps)
    return Snooped(fit, tuple(steps), tuple(fit.points.names[k] for k in kept))


def _one_less(
    fit: TransformationFit, tests: PointTests, steps: list[str], removed: list[int], *, hidden: bool
) -> TransformationFit | None:
    """The fit without its worst point, noted in steps and removed; None if the point stays."""
    places = np.flatnonzero(fit.points.used)
    worst = int(np.argmax(np.nan_to_num(tests.statistic / tests.limit)))
    k = int(places[worst])
    words = _words(fit, tests, worst, k)
    try:
        trial = _without(fit, k, Sentence("does not fit: {words}", words=words))
    except (AdjustmentError, InputError):
        trial = None
    if trial is None or trial.dof < 1:
        steps.append(
            Sentence("{words}; kept, since without it nothing would check the others", words=words)
        )
        return None
    others = [] if hidden else _alternatives(fit, tests, worst, places)
    doubt = f"; it could as well be {' or '.join(others)}" if others else ""
    together = " together with others" if hidden else ""
    steps.append(
        Sentence(
            "{words}; switched off{together}{doubt}", words=words, together=together, doubt=doubt
        )
    )
    removed.append(k)
    return trial


def _hidden(fit: TransformationFit) -> int:
    """How many points must go before all of them are seen to be wrong; 0 if none are.

    Only for fits of few points without sigmas (among many, some cannot hide each other), at most a
    quarter of them, at a stricter level, since the points were chosen to leave little.
    """
    count = int(fit.points.used.sum())
    if fit.points.weighted or count > _FEW:
        return 0
    gone: list[int] = []
    most = min(count // 4, _DEEPEST)
    level = 1 - ALPHA0 / max(count, 1) / 10
    for _ in range(most):
        trial = _one_less(fit, point_tests(fit), [], gone, hidden=True)
        if trial is None or trial.dof < 2 * trial.points.dimension:
            return 0
        fit = trial
        result = compare_points(fit, np.array(gone))
        if len(gone) > 1 and (result.statistic > result.limit(level)).all():
            return len(gone)
    return 0


def _words(fit: TransformationFit, tests: PointTests, row: int, k: int) -> str:
    size = 1e3 * tests.error[row]
    parts = joined(
        ", ",
        (
            Sentence("{axis} {value:+1}", axis=axis, value=value)
            for axis, value in zip("xyz", size, strict=False)
        ),
    )
    return Sentence(
        "point {name} is off by about ({parts}) mm in B (test {statistic:1} against "
        "{limit:1}); A or B may be wrong",
        name=fit.points.names[k],
        parts=parts,
        statistic=tests.statistic[row],
        limit=tests.limit[row],
    )


def _without(fit: TransformationFit, k: int, reason: str) -> TransformationFit:
    used, reasons = fit.points.used.copy(), list(fit.points.reasons)
    used[k], reasons[k] = False, reason
    return fit_points(replace(fit.points, used=used, reasons=tuple(reasons)), fit.model)


def _alternatives(
    fit: TransformationFit, tests: PointTests, worst: int, places: NDArray[np.int64]
) -> list[str]:
    """Other points whose removal would leave about as good a fit."""
    best = max(float(tests.left[worst]), 1e-12 * fit.vtpv)
    d = fit.points.dimension
    level = 1.0 if fit.points.weighted else best / max(fit.dof - d, 1)
    # twice the logarithm of the likelihood, as far as chance moves it
    near = tests.left - best <= chi2.ppf(0.95, 1) * level
    near[worst] = False
    return [fit.points.names[int(k)] for k in places[near & tests.suspicious]][:3]


def _recalled(
    fit: TransformationFit, removed: list[int], steps: list[str]
) -> tuple[TransformationFit, list[int]]:
    """Removed points that agree with the final fit take part again."""
    kept: list[int] = []
    for k in removed:
        result = compare_points(fit, np.array([k]))
        if result.statistic[0] > result.limit(1 - ALPHA0)[0]:
            kept.append(k)
            continue
        used, reasons = fit.points.used.copy(), list(fit.points.reasons)
        used[k], reasons[k] = True, ""
        fit = fit_points(replace(fit.points, used=used, reasons=tuple(reasons)), fit.model)
        steps.append(f"point {fit.points.names[k]} fits the others after all and is back")
    return fit, kept
