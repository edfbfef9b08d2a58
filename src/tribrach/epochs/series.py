"""Many cycles of one network against a baseline, and what the points do through time.

The baseline is the joint adjustment of several cycles of which each may lie anywhere (method
section 12.6). Time series are fitted with a trend, a daily period and jumps, each of them tested.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Instant, Result
from tribrach.epochs.coloured_noise import NOISES, ColouredFit, coloured_fit, learned_prior
from tribrach.epochs.differences import Epoch, laid_on, motion_columns
from tribrach.errors import AdjustmentError
from tribrach.statistics import norm, robust_sigma

#: seconds of a day
DAY = 86400.0
#: residuals over their robust sigma beyond which a value is an outlier
_OUTLIER = 4.0
#: values on either side of a jump
_SIDE = 4
#: jumps of one series
_MOST_JUMPS = 5
#: values of a series that is fitted
_LEAST = 10
#: power of tests for which detectable trends are stated
_POWER = 0.8
#: kinds of noise less probable than this count as excluded
_EXCLUDED = 0.05
#: probabilities are not told beyond this
_LEAST_CHANCE = 1e-300


def baseline(cycles: Sequence[Epoch], label: str, align_by: Sequence[str] = ()) -> Epoch:
    """The coordinates of several cycles together, each free to lie where it does.

    ``x_i = x + G t_i + e_i``: the normal matrix is the sum of the weights of the cycles without
    their motions, and what it leaves open are the motions again.

    Method section 12.6.
    """
    first = cycles[0]
    if len(cycles) == 1:
        return Epoch(
            label, first.names, first.xyz, first.covariance, first.motions, first.dof, first.factor
        )
    names = list(dict.fromkeys(name for cycle in cycles for name in cycle.names))
    place = {name: k for k, name in enumerate(names)}
    axes = tuple(k for k in range(3) if np.isfinite(first.xyz[:, k]).any())
    d, n = len(axes), len(names)
    xyz = np.full((n, 3), np.nan)
    for cycle in cycles:
        new = [k for k, name in enumerate(cycle.names) if np.isnan(xyz[place[name]]).all()]
        laid = _laid(cycle, names, xyz, align_by)
        for k in new:
            xyz[place[cycle.names[k]]] = laid[k]
    normal, right = np.zeros((n * d, n * d)), np.zeros(n * d)
    for cycle in cycles:
        laid = _laid(cycle, names, xyz, align_by)
        at = np.array([place[name] for name in cycle.names])
        rows = (at[:, None] * d + np.arange(d)).ravel()
        weights = _weights(cycle, laid, axes)
        step = (laid - xyz[at])[:, axes].ravel()
        normal[np.ix_(rows, rows)] += weights
        right[rows] += weights @ step
    basis = motion_columns(xyz, axes, first.motions)
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    pinned = normal + float(np.median(np.diag(normal))) / n * (basis @ basis.T)
    value, vector = np.linalg.eigh(pinned / np.outer(size, size))
    if value[0] <= 1e-11 * value[-1]:
        raise AdjustmentError(
            "the cycles of the baseline are not connected",
            ["take more of them, or cycles with more common points"],
        )
    inverse = (vector / value) @ vector.T / np.outer(size, size)
    # inner constraints over all points
    s = np.eye(n * d) - basis @ np.linalg.pinv(basis)
    inverse = s @ inverse @ s.T
    xyz[:, axes] += (s @ (inverse @ right)).reshape(n, d)
    covariance = np.zeros((n, 3, n, 3))
    covariance[np.ix_(range(n), axes, range(n), axes)] = inverse.reshape(n, d, n, d)
    return Epoch(
        label, tuple(names), xyz, covariance.reshape(3 * n, 3 * n), first.motions, 0, float("nan")
    )


def _laid(cycle: Epoch, names: Sequence[str], xyz: Array, align_by: Sequence[str]) -> Array:
    """Coordinates (k, 3) of a cycle laid on what is known so far."""
    known = [k for k, row in enumerate(xyz) if np.isfinite(row).any()]
    if not known:
        return cycle.xyz
    place = {name: k for k, name in enumerate(names)}
    target = np.array([xyz[place[name]] for name in cycle.names])
    common = np.isfinite(target).any(axis=1)
    chosen = common & np.isin(cycle.names, list(align_by))
    by = chosen if chosen.sum() >= 2 else common
    axes = tuple(k for k in range(3) if np.isfinite(target[common][:, k]).all())
    return laid_on(
        np.where(np.isnan(target), cycle.xyz, target), cycle.xyz, axes, cycle.motions, by
    )


def _weights(cycle: Epoch, xyz: Array, axes: tuple[int, ...]) -> Array:
    """Weights of the coordinates of a cycle with its motions taken out."""
    columns = (np.arange(len(cycle.names))[:, None] * 3 + np.array(axes)).ravel()
    covariance = cycle.covariance[np.ix_(columns, columns)]
    basis = motion_columns(xyz, axes, cycle.motions)
    typical = float(np.median(np.diag(covariance)))
    weights = np.linalg.inv(covariance + typical * (basis @ basis.T))
    pg = weights @ basis
    out: Array = weights - pg @ np.linalg.pinv(basis.T @ pg, hermitian=True) @ pg.T
    return out


@dataclass(frozen=True)
class Jump(Result, without=("at",)):
    """A step of a series."""

    #: number of the first value behind it
    at: int
    time: Instant
    #: in metres
    size: float
    sigma: float
    #: normal value as improbable as the size without a jump, and its limit, which counts how many
    #: places and series were tried
    test: float
    limit: float


@dataclass(frozen=True, eq=False)
class SeriesFit(Result, without=("fitted", "likely")):
    """What a series along one axis consists of [m, m/day]."""

    axis: Literal["E", "N", "U"]
    rate: float
    rate_sigma: float
    #: is the trend real by its test, and is the daily period?
    trend: bool
    period: bool
    #: of the daily period
    amplitude: float
    amplitude_sigma: float
    phase: float  #: of the largest value, as a part of a day after midnight UTC
    jumps: tuple[Jump, ...]  #: in the order of time
    outliers: tuple[Instant, ...]  #: times of values that took no part
    scatter: float  #: of the residuals over the sigmas of the values
    correlation: float  #: of neighbouring residuals
    noise: dict[str, float]  #: probability of each kind of noise: white, correlated, flicker, walk
    #: sigma of the rate if the noise were of the kind that makes it smallest, and of that which
    #: makes it largest, of the kinds that are not excluded
    rate_sigma_range: tuple[float, float]
    detectable: float  #: rate that the test would have found with 80 %
    fitted: Array  #: the fitted values (n,)
    likely: Array  #: logarithm of how likely the residuals are (k,) under each law of noise

    @property
    def month(self) -> float:
        """Trend over 30 days [m]."""
        return 30 * self.rate

    @property
    def month_sigma(self) -> float:
        """Its standard deviation [m]."""
        return 30 * self.rate_sigma

    @property
    def month_detectable(self) -> float:
        """Trend over 30 days that is found with 80 % [m]."""
        return 30 * self.detectable


def fit_together(
    series: Sequence[tuple[Array, Array, Array, Literal["E", "N", "U"]]],
) -> list[SeriesFit | None]:
    """Fits of the series (days, values, sigma, axis) of one site, in their order.

    Together they say which noise is met how often, so that a short series need not say it alone;
    and the level of the tests holds for all of them.

    Method section 12.6.
    """
    alone = [fit_series(*one) for one in series]
    prior = learned_prior([fit.likely for fit in alone if fit is not None])
    family = sum(fit is not None for fit in alone)
    return [fit_series(*one, family=max(family, 1), prior=prior) for one in series]


def fit_series(
    days: Array,
    values: Array,
    sigma: Array,
    axis: Literal["E", "N", "U"],
    *,
    confidence: float = 0.99,
    family: int = 1,
    prior: Array | None = None,
) -> SeriesFit | None:
    """Trend, daily period, jumps and outliers of a series; None if it is too short.

    Sigmas and tests of the parameters are averages over white and correlated noise, flicker noise
    and walks, each as likely as the residuals make it.

    ``family`` series are tested together: the confidence holds for all of them.

    Method section 12.6.
    """
    n = len(days)
    if n < _LEAST:
        return None
    level = (1 - confidence) / family
    weights = 1 / np.maximum(sigma, 1e-9)
    used = np.ones(n, dtype=bool)
    at: list[int] = []
    for _ in range(3):
        at = _jumps(days, values, weights, used, level, prior)
        left = _solve(days, values, weights, used, at)[1] * weights
        spread = max(robust_sigma(left[used], about=0.0), 1e-12)
        now = np.abs(left) <= _OUTLIER * spread
        if (now == used).all() or now.sum() < _LEAST:
            break
        used = now
    x, left, design = _solve(days, values, weights, used, at)
    dof = int(used.sum()) - len(x)
    if dof < 2:
        return None
    white = (left * weights)[used]
    fit = coloured_fit(days[used], values[used], 1 / weights[used], design[used], prior)
    x = fit.estimate
    daily = _has_period(days)
    amplitude = float(np.hypot(x[2], x[3])) if daily else 0.0
    first = 4 if daily else 2
    places = max(n - 2 * _SIDE, 1)
    jumps = []
    for i, k in enumerate(at):
        size, chance = float(x[first + i]), max(fit.chance([first + i]), _LEAST_CHANCE)
        jumps.append(
            Jump(
                at=k,
                time=float(days[k]) * DAY,
                size=size,
                sigma=fit.sigma(first + i),
                test=float(np.copysign(norm.isf(chance / 2), size)),
                limit=float(norm.isf(level / 2 / places)),
            )
        )
    return SeriesFit(
        axis=axis,
        rate=float(x[1]),
        rate_sigma=fit.sigma(1),
        trend=float(days[-1] - days[0]) > 0 and fit.chance([1]) < level,
        amplitude=amplitude,
        amplitude_sigma=float(np.hypot(fit.sigma(2), fit.sigma(3)) / np.sqrt(2)) if daily else 0.0,
        phase=float(np.arctan2(x[3], x[2]) / (2 * np.pi) % 1) if daily else 0.0,
        period=daily and fit.chance([2, 3]) < level,
        jumps=tuple(j for j in jumps if abs(j.test) > j.limit),
        outliers=tuple((days[~used] * DAY).tolist()),
        scatter=float(np.sqrt(white @ white / dof)),
        correlation=_correlation(white),
        noise=fit.noise,
        rate_sigma_range=_range(fit),
        detectable=fit.detectable(1, level, _POWER),
        fitted=design @ x,
        likely=fit.likely,
    )


def _range(fit: ColouredFit) -> tuple[float, float]:
    """Least and largest sigma of the rate over the kinds of noise that are not excluded."""
    sigmas = [fit.sigma_of(1, kind) for kind in NOISES if fit.noise[kind] > _EXCLUDED]
    return min(sigmas), max(sigmas)


def _has_period(days: Array) -> bool:
    """Are there days enough, and several values a day?"""
    span = float(days[-1] - days[0])
    hours = np.unique(np.round(days % 1 * 24 / 3) % 8)
    return span >= 3 and len(hours) >= 4


def _design(days: Array, at: Sequence[int]) -> Array:
    """Columns of offset, trend, daily period and jumps."""
    columns = [np.ones(len(days)), days - days.mean()]
    if _has_period(days):
        columns += [np.cos(2 * np.pi * days), np.sin(2 * np.pi * days)]
    columns += [(np.arange(len(days)) >= k).astype(float) for k in at]
    return np.column_stack(columns)


def _solve(
    days: Array, values: Array, weights: Array, used: Array, at: Sequence[int]
) -> tuple[Array, Array, Array]:
    """Parameters, residuals (n,) and design of a plain fit to the values in use."""
    design = _design(days, at)
    a = (design * weights[:, None])[used]
    x = np.linalg.pinv(a) @ (values * weights)[used]
    return x, values - design @ x, design


def _correlation(white: Array) -> float:
    """Correlation of neighbouring residuals, between 0 and 0.95."""
    total = float(white @ white)
    if total <= 0 or len(white) < 3:
        return 0.0
    return float(np.clip(white[1:] @ white[:-1] / total, 0.0, 0.95))


def _jumps(
    days: Array, values: Array, weights: Array, used: Array, level: float, prior: Array | None
) -> list[int]:
    """Places of jumps, one after the other where chance explains them least."""
    n = len(days)
    at: list[int] = []
    while len(at) < _MOST_JUMPS:
        tried = [k for k in range(_SIDE, n - _SIDE) if all(abs(k - j) >= _SIDE for j in at)]
        design = _design(days, at)[used]
        if not tried or len(design) - design.shape[1] < 5:
            break
        fit = coloured_fit(days[used], values[used], 1 / weights[used], design, prior)
        steps = (np.arange(n)[:, None] >= np.array(tried)).astype(float)
        chances = fit.chances(steps[used])
        best = int(np.argmin(chances))
        if chances[best] * max(n - 2 * _SIDE, 1) >= level:
            break
        at = sorted([*at, tried[best]])
    return at
