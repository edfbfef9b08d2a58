"""Closed forms of the tests: critical values, non-centrality, significance of many tests.

Method section 3.4; Baarda (1968) for data snooping, Pope (1976) for tau, Šidák (1967).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln

from tribrach.statistics import chi2, f, norm

#: statistics beyond this have a tail probability near the smallest floating point number
FAR = 500.0


def w_critical(alpha0: float = 0.001) -> float:
    """Two-sided limit of w at significance ``alpha0``: 3.2905 for 0.1 %."""
    return float(norm.ppf(1 - alpha0 / 2))


def noncentrality(alpha0: float = 0.001, power: float = 0.8) -> float:
    """``delta0``: shift of w found with the given power at significance ``alpha0``; 4.132."""
    return float(norm.ppf(1 - alpha0 / 2) + norm.ppf(power))


def block_noncentrality(dof: int, alpha0: float = 0.001, power: float = 0.8) -> float:
    """The same for a block of ``dof`` values: root of the non-centrality of its chi-square."""
    critical = chi2.ppf(1 - alpha0, dof)
    return float(np.sqrt(chi2.noncentrality(critical, dof, power)))


def tau_critical(dof: int, alpha: float) -> float:
    """Two-sided critical value of Pope's tau."""
    return float(np.sqrt(block_tau_critical(1, dof, alpha)))


def block_tau_critical(freedom: ArrayLike, dof: int, alpha: float) -> NDArray[np.float64]:
    """Critical values of blocks whose statistic is divided by the a-posteriori variance factor.

    ``dof``: redundancy r of the adjustment that the blocks are a part of. Returns ``r k F / (r - k
    + k F)`` with F of k and r - k degrees of freedom, the square of tau for one; r is its bound,
    and all there is where nothing but the block is redundant.
    """
    k = np.asarray(freedom, dtype=float)
    rest = np.maximum(dof - k, 0.0)
    quantile = k * f.ppf(1 - alpha, k, np.where(rest > 0, rest, 1.0))
    limit = dof * quantile / (rest + quantile)
    return np.where(rest > 0, limit, float(max(dof, 0)))


def block_tau_significance(
    statistic: ArrayLike, freedom: ArrayLike, dof: int
) -> NDArray[np.float64]:
    """Probability of a larger statistic than one that was divided by the a-posteriori factor.

    ``statistic``: of each block, at most the redundancy; NaN counts as nothing at all. Returns
    the probability of ``F = (T / k) / ((r - T) / (r - k))``; 1 where the block is all the
    redundancy.
    """
    k = np.asarray(freedom, dtype=float)
    rest = np.maximum(dof - k, 0.0)
    x = np.nan_to_num(np.asarray(statistic, dtype=float))
    left = np.maximum(dof - x, 0.0)
    alone = rest <= 0
    ratio = x * np.where(alone, 1.0, rest) / (k * np.where(left > 0, left, 1e-300))
    return np.where(alone, 1.0, f.sf(ratio, k, np.where(alone, 1.0, rest)))


def sidak(alpha: float, count: int) -> float:
    """Significance of one of ``count`` tests so that all together have ``alpha``."""
    return float(1 - (1 - alpha) ** (1 / max(count, 1)))


def log_significance(statistic: ArrayLike, dof: ArrayLike) -> NDArray[np.float64]:
    """Logarithm of the chi-square tail probability, also where that underflows.

    Compares tests of different degrees of freedom: the lower the more suspicious. The far tail
    follows the leading term of its expansion.

    Returns logarithm of the probability of as much by chance.
    """
    x, k = np.broadcast_arrays(np.asarray(statistic, dtype=float), np.asarray(dof, dtype=float))
    x = np.nan_to_num(x)
    out = np.zeros(x.shape)
    near = (k > 0) & (x <= FAR)
    out[near] = np.log(chi2.sf(x[near], k[near]))
    far = (k > 0) & (x > FAR)
    half = x[far] / 2
    out[far] = -half + (k[far] / 2 - 1) * np.log(half) - gammaln(k[far] / 2)
    return out
