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
from tribrach.epochs.differences import Epoch, laid_on, motion_columns
from tribrach.errors import AdjustmentError
from tribrach.statistics import chi2, norm, robust_sigma, t

__all__ = ["DAY", "Jump", "SeriesFit", "baseline", "fit_series"]

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


def baseline(cycles: Sequence[Epoch], label: str, align_by: Sequence[str] = ()) -> Epoch:
    """The coordinates of several cycles together, each free to lie where it does.

    ``x_i = x + G t_i + e_i``: the normal matrix is the sum of the weights of the cycles without
    their motions, and what it leaves open are the motions again.

    References
    ----------
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
            "the cycles of the baseline do not hang together",
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
    #: size over sigma, and its limit, which counts how many places were tried
    test: float
    limit: float


@dataclass(frozen=True, eq=False)
class SeriesFit(Result, without=("fitted",)):
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
    #: of the largest value, as a part of a day after midnight UTC
    phase: float
    #: in the order of time
    jumps: tuple[Jump, ...]
    #: times of values that took no part
    outliers: tuple[Instant, ...]
    #: of the residuals over the sigmas of the values
    scatter: float
    #: of neighbouring residuals; sigmas count it
    correlation: float
    #: the fitted values (n,)
    fitted: Array

    @property
    def month(self) -> float:
        """What the trend makes in 30 days [m]."""
        return 30 * self.rate

    @property
    def month_sigma(self) -> float:
        """Its standard deviation [m]."""
        return 30 * self.rate_sigma


def fit_series(
    days: Array,
    values: Array,
    sigma: Array,
    axis: Literal["E", "N", "U"],
    *,
    confidence: float = 0.99,
) -> SeriesFit | None:
    """Trend, daily period, jumps and outliers of a series; None if it is too short.

    Sigmas of the parameters rest on the scatter of the residuals and on how they hang together.

    Parameters
    ----------
    days : array (n,)
        Times, ascending [days since 1970].
    values, sigma : array (n,)
        Displacements and their standard deviations [m].
    axis
        Along which they are.
    confidence
        Of the tests of trend, period and jumps.

    References
    ----------
    Method section 12.6.
    """
    n = len(days)
    if n < _LEAST:
        return None
    weights = 1 / np.maximum(sigma, 1e-9)
    used = np.ones(n, dtype=bool)
    at: list[int] = []
    for _ in range(3):
        at = _jumps(days, values, weights, used, confidence)
        left = _solve(days, values, weights, used, at)[2] * weights
        spread = max(robust_sigma(left[used], about=0.0), 1e-12)
        now = np.abs(left) <= _OUTLIER * spread
        if (now == used).all() or now.sum() < _LEAST:
            break
        used = now
    x, q, left, design = _solve(days, values, weights, used, at)
    dof = int(used.sum()) - len(x)
    if dof < 2:
        return None
    white = (left * weights)[used]
    scatter = float(np.sqrt(white @ white / dof))
    correlation = _correlation(white)
    # a series of correlated residuals has fewer independent values
    inflation = scatter**2 * (1 + correlation) / (1 - correlation)
    covariance = q * inflation
    free = max(dof * (1 - correlation) / (1 + correlation), 1.0)
    limit = float(t.ppf((1 + confidence) / 2, free))
    span = float(days[-1] - days[0])
    rate, rate_sigma = float(x[1]), float(np.sqrt(covariance[1, 1]))
    daily = _has_period(days)
    amplitude = float(np.hypot(x[2], x[3])) if daily else 0.0
    test = float(x[2:4] @ np.linalg.solve(covariance[2:4, 2:4], x[2:4])) if daily else 0.0
    first = 4 if daily else 2
    count = max(n - 2 * _SIDE, 1)
    jump_limit = float(norm.isf((1 - confidence) / 2 / count))
    jumps = tuple(
        Jump(
            k,
            float(days[k]) * DAY,
            float(x[first + i]),
            float(np.sqrt(covariance[first + i, first + i])),
            float(x[first + i] / np.sqrt(covariance[first + i, first + i])),
            jump_limit,
        )
        for i, k in enumerate(at)
    )
    return SeriesFit(
        axis=axis,
        rate=rate,
        rate_sigma=rate_sigma,
        trend=span > 0 and abs(rate) > limit * rate_sigma,
        amplitude=amplitude,
        amplitude_sigma=float(np.sqrt(np.trace(covariance[2:4, 2:4]) / 2)) if daily else 0.0,
        phase=float(np.arctan2(x[3], x[2]) / (2 * np.pi) % 1) if daily else 0.0,
        period=daily and test > float(chi2.ppf(confidence, 2)),
        jumps=tuple(j for j in jumps if abs(j.test) > j.limit),
        outliers=tuple((days[~used] * DAY).tolist()),
        scatter=scatter,
        correlation=correlation,
        fitted=design @ x,
    )


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
) -> tuple[Array, Array, Array, Array]:
    """Parameters, their cofactors, residuals (n,) and design of a fit to the values in use."""
    design = _design(days, at)
    a = (design * weights[:, None])[used]
    q = np.linalg.pinv(a.T @ a, hermitian=True)
    x = q @ (a.T @ (values * weights)[used])
    return x, q, values - design @ x, design


def _correlation(white: Array) -> float:
    """Of neighbouring residuals, between 0 and 0.95."""
    total = float(white @ white)
    if total <= 0 or len(white) < 3:
        return 0.0
    return float(np.clip(white[1:] @ white[:-1] / total, 0.0, 0.95))


def _jumps(days: Array, values: Array, weights: Array, used: Array, confidence: float) -> list[int]:
    """Places of jumps, one after the other where the sum of squares falls most."""
    n = len(days)
    at: list[int] = []
    limit = float(norm.isf((1 - confidence) / 2 / max(n - 2 * _SIDE, 1))) ** 2
    while len(at) < _MOST_JUMPS:
        _, _, left, design = _solve(days, values, weights, used, at)
        a = (design * weights[:, None])[used]
        r = (left * weights)[used]
        dof = int(used.sum()) - a.shape[1]
        if dof < 5:
            break
        tried = [k for k in range(_SIDE, n - _SIDE) if all(abs(k - j) >= _SIDE for j in at)]
        if not tried:
            break
        steps = np.arange(n)[:, None] >= np.array(tried)
        b = (steps * weights[:, None])[used]
        basis = np.linalg.qr(a)[0]
        b = b - basis @ (basis.T @ b)
        length = (b**2).sum(axis=0)
        good = length > 1e-9 * np.maximum((weights[used] ** 2).sum(), 1e-300)
        gain = np.where(good, (b.T @ r) ** 2 / np.where(good, length, 1.0), 0.0)
        best = int(np.argmax(gain))
        after = max(float(r @ r) - float(gain[best]), 1e-300)
        # what the residuals behind a jump look like says how much it is worth
        rest = r - b[:, best] * float(b[:, best] @ r) / max(float(length[best]), 1e-300)
        hang = _correlation(rest)
        inflation = after / max(dof - 1, 1) * (1 + hang) / (1 - hang)
        if gain[best] / inflation <= limit:
            break
        at = sorted([*at, tried[best]])
    return at
