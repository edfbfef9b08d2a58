"""The distribution of sums of squares whose terms are correlated or have different variances.

With the covariance ``C`` of n normal values of mean zero, their sum of squares is the sum of
squares of independent normal variables with the eigenvalues of C as weights; it is a chi-square
only if all eigenvalues other than zero are equal. A ratio of two such sums is beyond c where the
first less c times the second, weights of either sign, is beyond zero.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from tribrach._types import Array

#: terms of the series at most
_TERMS = 20_000
#: logarithm of what a term may have beside the first ones before the series ends
_NEGLIGIBLE = -28.0


def exceedance(x: float, weights: Array) -> float:
    """Probability that a weighted sum of squares of standard normal variables exceeds x.

    The characteristic function is inverted by the trapezoidal rule (Davies 1973, equation 9), to
    six digits or better.
    """
    unit = float(np.abs(weights).max(initial=0.0))
    if unit == 0:
        return float(x < 0)
    w, value = np.asarray(weights) / unit, x / unit
    # the rule takes values for each other that differ by this, of which one never happens
    span = abs(value - w.sum()) + 60 + 10 * np.sqrt(2 * (w @ w))
    half = np.arange(_TERMS) + 0.5
    at = half * (2 * np.pi / span)
    probe = np.unique(np.geomspace(1, _TERMS, 60).astype(np.int64)) - 1
    small = _log_modulus(w, at[probe]) < _NEGLIGIBLE
    terms = int(probe[np.argmax(small)]) + 1 if small.any() else _TERMS
    half, at = half[:terms], at[:terms]
    phase = np.arctan(2 * np.outer(at, w)).sum(axis=1) / 2
    series = np.exp(_log_modulus(w, at)) * np.sin(phase - at * value) / half
    return float(np.clip(0.5 + series.sum() / np.pi, 0.0, 1.0))


def _log_modulus(weights: Array, at: Array) -> Array:
    """Logarithm of the modulus of the characteristic function."""
    out: Array = -np.log1p(np.square(2 * np.outer(at, weights))).sum(axis=1) / 4
    return out


def quantile(p: float, weights: Array) -> float:
    """Quantile of a weighted sum of squares of standard normal variables."""
    w = np.asarray(weights, dtype=float)
    high = w.sum() + 20 * np.sqrt(2 * (w @ w)) + 40 * w.max()
    return float(brentq(lambda x: exceedance(x, w) - (1 - p), 0.0, high, xtol=1e-10 * high))


def ratio_quantile(p: float, numerator: Array, denominator: Array) -> float:
    """Quantile of the ratio of two independent weighted sums of squares."""

    def beyond(log_c: float) -> float:
        weights = np.concatenate([numerator, -np.exp(log_c) * np.asarray(denominator)])
        return exceedance(0.0, weights) - (1 - p)

    middle = float(np.log(np.sum(numerator) / np.sum(denominator)))
    return float(np.exp(brentq(beyond, middle - 20, middle + 20, xtol=1e-8)))


def equivalent_dof(weights: Array) -> float:
    """Degrees of freedom of the chi-square with the same relative variance (Satterthwaite 1946)."""
    w = np.asarray(weights, dtype=float)
    return float(w.sum() ** 2 / (w @ w))
