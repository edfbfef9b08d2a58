"""Fits of time series whose noise may be white, correlated and wandering, nobody knows how much.

Noise is white with the stated sigmas, and may have an autoregressive part (variance ``f`` of the
whole, correlation ``phi`` from value to value) and a random walk (variance ``r`` over the whole
span): ``V = s^2 [(1 - f) W + f A_phi + r R]``. Flicker noise lies between these. What the series
itself says of f, phi and r is their restricted likelihood, with s^2 integrated over; parameters and
tests are averages over all of them, so that a sigma knows how badly a short series knows its noise
(method section 12.6).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tribrach._types import Array, Index
from tribrach.statistics import f

__all__ = ["ColouredFit", "coloured_fit"]

#: share of the autoregressive part, and its correlation from one value to the next
_SHARES, _CORRELATIONS = (0.35, 0.7, 1.0), (0.3, 0.55, 0.75, 0.88, 0.95, 0.98)
#: variance of the random walk over the whole span, of that of a value
_WALKS = (0.0, 0.3, 3.0, 30.0, 300.0)
#: share of the stated sigmas below which scatter is rounding: values that are all alike
_RESOLVED = 1e-3
#: probability beforehand that there is no autoregressive part, and that there is no walk
_PLAIN = 2 / 3
#: probability beyond one sigma of a normal distribution
_BEYOND = 0.31731
#: values that are fitted; longer series are averaged in blocks
_MOST = 128
#: share of white noise beside a part that takes all, so that matrices can be inverted
_NUGGET = 1e-6


@dataclass(frozen=True, eq=False)
class ColouredFit:
    """A linear fit averaged over k kinds of noise."""

    #: (k, p), estimates under each, and (k, p, p) their covariance with the scale of the residuals
    estimates: Array
    covariances: Array
    #: (k,), how likely each kind of noise is
    weights: Array
    #: of the residuals
    dof: int
    #: (k, n, p) and (k, n), whitened design and values
    _design: Array
    _values: Array
    #: (k, n, n), inverse factors
    _factors: Array
    #: (k,), logarithms of the prior and of what does not depend on the residuals
    _constant: Array
    #: (n, m), means of the values in blocks
    _blocks: Array
    #: sum of squares below which residuals are taken for no smaller
    _least: float

    @cached_property
    def estimate(self) -> Array:
        """Means (p,) over the kinds of noise."""
        out: Array = self.weights @ self.estimates
        return out

    def sigma(self, row: int) -> float:
        """Standard deviation of a parameter: what it is within with the probability of one sigma.

        The average over the noise has longer tails than a normal distribution.
        """
        scale = np.sqrt(self.covariances[:, row, row])
        apart = self.estimates[:, row] - self.estimate[row]
        low, high = 1e-3 * float(scale.min()), 1e3 * float(scale.max() + np.abs(apart).max())
        for _ in range(40):
            middle = np.sqrt(low * high)
            ends = np.maximum(np.stack([middle - apart, middle + apart]), 0.0) / scale
            beyond = float(self.weights @ f.sf(ends**2, 1, self.dof).mean(axis=0))
            low, high = (middle, high) if beyond > _BEYOND else (low, middle)
        return float(middle)

    def chance(self, rows: Index | list[int]) -> float:
        """Probability of what the parameters show, or more, if they were zero.

        One parameter by Student's distribution, several by Fisher's, averaged over the noise.
        """
        rows = np.asarray(rows)
        x = self.estimates[:, rows]
        square = self.covariances[:, rows[:, None], rows]
        statistic = np.einsum("ki,ki->k", x, np.linalg.solve(square, x[:, :, None])[:, :, 0])
        tail = f.sf(statistic / len(rows), len(rows), self.dof)
        return float(self.weights @ tail)

    def chances(self, columns: Array) -> Array:
        """The same of further columns (n, m) of the design, each added by itself.

        The kinds of noise are weighed anew with each: what a jump explains is no random walk.
        """
        columns = self._blocks @ columns
        white = self._factors @ columns
        basis = np.linalg.qr(self._design)[0]
        white = white - basis @ (np.swapaxes(basis, 1, 2) @ white)
        values = self._values[:, :, None]
        left = (values - basis @ (np.swapaxes(basis, 1, 2) @ values))[:, :, 0]
        length = (white**2).sum(axis=1)
        seen = length > 1e-9 * np.maximum(length.max(axis=1, keepdims=True), 1e-300)
        rss = np.maximum((left**2).sum(axis=1), self._least)[:, None]
        gain = np.einsum("kn,knm->km", left, white) ** 2 / np.where(seen, length, 1.0)
        gain = np.where(seen, gain, 0.0)
        dof = self.dof - 1
        after = np.maximum(rss - gain, 1e-12 * rss)
        likely = self._constant[:, None] - 0.5 * np.log(np.where(seen, length, 1.0))
        likely = likely - 0.5 * dof * np.log(after)
        weights = np.exp(likely - likely.max(axis=0))
        weights /= weights.sum(axis=0)
        tail = f.sf(gain / (after / dof), 1, dof)
        out: Array = (weights * tail).sum(axis=0)
        return out


def coloured_fit(days: Array, values: Array, sigma: Array, design: Array) -> ColouredFit:
    """Fit a design (n, p) to values (n,) at times (n,) [days], whatever their noise.

    Parameters
    ----------
    days : array (n,)
        In their order.
    values, sigma : array (n,)
        With the sigmas that are stated, of which the ratios count.
    design : array (n, p)
        With a column for the offset.

    References
    ----------
    Method section 12.6.
    """
    blocks = _blocks(days, sigma)
    x, y = blocks @ design, blocks @ values
    white = blocks @ np.diag(sigma**2) @ blocks.T
    white /= np.mean(np.diag(white))
    times = blocks @ days
    n, p = x.shape
    step = max(float(np.median(np.diff(times))), 1e-9)
    lag = np.abs(times[:, None] - times) / step
    since = np.minimum(times[:, None], times) - times[0]
    walk = since / max(float(since.max()), 1e-9)
    parts, prior = [], []
    for share, correlation in [(0.0, 0.0), *((a, b) for a in _SHARES for b in _CORRELATIONS)]:
        base = (1 - share + _NUGGET) * white
        if share:
            base = base + share * correlation**lag
        for r in _WALKS:
            parts.append(base + r * walk)
            of_share = _PLAIN if not share else (1 - _PLAIN) / (len(_SHARES) * len(_CORRELATIONS))
            prior.append(of_share * (_PLAIN if not r else (1 - _PLAIN) / (len(_WALKS) - 1)))
    factors = np.linalg.cholesky(np.stack(parts))
    inverse = np.linalg.inv(factors)
    wx, wy = inverse @ x, inverse @ y
    normal = np.swapaxes(wx, 1, 2) @ wx
    cofactor = np.linalg.inv(normal)
    estimates = (cofactor @ (np.swapaxes(wx, 1, 2) @ wy[:, :, None]))[:, :, 0]
    left = wy - (wx @ estimates[:, :, None])[:, :, 0]
    dof = n - p
    least = dof * (_RESOLVED * float(np.median(sigma))) ** 2
    rss = np.maximum((left**2).sum(axis=1), least)
    logdet = np.log(np.einsum("knn->kn", factors)).sum(axis=1)
    constant = np.log(prior) - logdet - 0.5 * np.linalg.slogdet(normal)[1]
    likely = constant - 0.5 * dof * np.log(rss)
    weights = np.exp(likely - likely.max())
    return ColouredFit(
        estimates=estimates,
        covariances=cofactor * (rss / dof)[:, None, None],
        weights=weights / weights.sum(),
        dof=dof,
        _design=wx,
        _values=wy,
        _factors=inverse,
        _constant=constant,
        _blocks=blocks,
        _least=least,
    )


def _blocks(days: Array, sigma: Array) -> Array:
    """Means (m, n) of neighbouring values, weighted; each value by itself in short series."""
    n = len(days)
    size = -(-n // _MOST)
    if size == 1:
        return np.eye(n)
    number = np.arange(n) // size
    out = np.zeros((int(number[-1]) + 1, n))
    out[number, np.arange(n)] = 1 / sigma**2
    return np.asarray(out / out.sum(axis=1, keepdims=True))
