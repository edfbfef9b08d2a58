"""Tests of differences that hold a bounded systematic part besides their random one.

A bound is no sigma: what a calibration, the air or a surface may have done to a difference lies
somewhere between two limits and does not average out. The statistic is then an interval, and a test
has three answers (method section 12.5).
"""

from __future__ import annotations

from itertools import product
from typing import Literal

import numpy as np
from scipy.special import chndtr

from tribrach._types import Array
from tribrach.errors import InputError

#: what a test with bounded systematics says
Answer = Literal["moved", "not moved", "cannot tell"]

#: bounded effects whose corners are all looked at
_MOST = 12


def quadratic_range(values: Array, covariance: Array, bounds: Array) -> tuple[float, float]:
    """Range of ``T = (d + s)^T C^-1 (d + s)`` for all ``|s_i| <= b_i``, method section 12.5."""
    bounds = np.asarray(bounds, dtype=float)
    if (bounds < 0).any() or not np.isfinite(bounds).all():
        raise InputError("a bound is negative or no number", cure="give half of the width")
    free = np.flatnonzero(bounds > 0)
    root = np.linalg.cholesky(covariance)
    white = np.linalg.solve(root, values)
    if not len(free):
        single = float(white @ white)
        return single, single
    if len(free) > _MOST:
        raise InputError(f"{len(free)} bounded effects are more than {_MOST}")
    effect = np.linalg.solve(root, np.eye(len(values))[:, free] * bounds[free])
    # a convex function over a box is largest in a corner
    corners = np.array(list(product((-1.0, 1.0), repeat=len(free))))
    largest = float(((white + corners @ effect.T) ** 2).sum(axis=1).max())
    return _least(white, effect), largest


def _least(white: Array, effect: Array) -> float:
    """``min |w + E s|^2`` for ``|s_i| <= 1``, by coordinates in turn: convex, so it converges."""
    s = np.zeros(effect.shape[1])
    left = white.copy()
    length = (effect**2).sum(axis=0)
    # what is too small to be seen beside the random part explains nothing
    seen = np.flatnonzero(length > np.finfo(float).tiny / np.finfo(float).eps)
    for _ in range(500):
        before = s.copy()
        for k in seen:
            new = float(np.clip(s[k] - effect[:, k] @ left / length[k], -1.0, 1.0))
            left += effect[:, k] * (new - s[k])
            s[k] = new
        if np.abs(s - before).max() < 1e-13:
            break
    return float(left @ left)


def answer(least: float, largest: float, limit: float) -> Answer:
    """What the interval of a statistic says against its limit."""
    if least >= limit:
        return "moved"
    return "not moved" if largest <= limit else "cannot tell"


def power(noncentrality: float, dof: int, limit: float) -> float:
    """Probability that a non-central chi-square exceeds a limit."""
    return 1.0 - float(chndtr(limit, dof, noncentrality))
