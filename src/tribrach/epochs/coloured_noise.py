"""Fits of time series whose noise may be white, correlated, flicker or a walk, nobody knows which.

``V = s^2 [(1 - f) W + f A_phi + q F + r R]``: white noise W with the stated sigmas, an
autoregressive part of correlation ``phi`` from value to value, flicker noise F and a random walk R.
What a series itself says of f, phi, q and r is its restricted likelihood, with s^2 integrated over;
parameters and tests are averages over all of these laws, so that a sigma knows how badly a short
series knows its noise. Series of one site say together how often each law is met, and that is what
each of them starts from (method section 12.6).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from tribrach._types import Array, Index
from tribrach.statistics import f, t

#: share of the autoregressive part, and its correlation from one value to the next
_SHARES, _CORRELATIONS = (0.5, 1.0), (0.5, 0.7, 0.88, 0.94)
#: variance of the random walk over the whole span, and of flicker noise, of that of a value
_WALKS, _FLICKERS = (0.1, 0.3, 1.0, 4.0, 20.0, 100.0, 1000.0), (0.2, 0.7, 2.5, 10.0, 100.0)
#: probability beforehand that there is no autoregressive part, that there is no walk, and that what
#: comes to white noise is flicker noise
_PLAIN, _STANDING, _FLICKERING = 0.5, 0.25, 0.3
#: probability beyond one sigma of a normal distribution
_BEYOND = 0.31731
#: share of the stated sigmas below which scatter is rounding: values that are all alike
_RESOLVED = 1e-3
#: values that are fitted; longer series are averaged in blocks
_MOST = 128
#: share of white noise beside a part that takes all, so that matrices can be inverted
_NUGGET = 1e-6
#: what is known beforehand counts as many series, and rounds in which the others are counted
_KNOWN, _ROUNDS = 2.0, 100
#: halvings of intervals that hold a quantile
_HALVINGS = 40
#: kinds of noise, in the order of how long they remember
NOISES = ("white", "correlated", "flicker", "walk")


def _laws() -> tuple[Array, Array, Index]:
    """Laws (k, 4) of share, correlation, walk, flicker; their prior (k,) and number in NOISES."""
    laws, prior, kind = [], [], []
    parts = [(0.0, 0.0), *((a, b) for a in _SHARES for b in _CORRELATIONS)]
    for share, correlation in parts:
        base = (1 - _PLAIN) / (len(parts) - 1) if share else _PLAIN
        for walk in (0.0, *_WALKS):
            laws.append((share, correlation, walk, 0.0))
            of_walk = (1 - _STANDING) / len(_WALKS) if walk else _STANDING
            prior.append(base * of_walk * (1.0 if share else 1 - _FLICKERING))
            kind.append(3 if walk else 1 if share else 0)
    for flicker in _FLICKERS:
        laws.append((0.0, 0.0, 0.0, flicker))
        prior.append(_PLAIN * _FLICKERING / len(_FLICKERS))
        kind.append(2)
    return np.array(laws), np.array(prior), np.array(kind)


_LAWS, BEFOREHAND, _KIND = _laws()


@dataclass(frozen=True, eq=False)
class _Whitening:
    """What whitens the values of certain times under each law."""

    blocks: Array  #: (n, m), means of the values in blocks
    #: (k, n, n), inverse factors, and (k,) the logarithms of their determinants
    factors: Array
    determinants: Array


@dataclass(frozen=True, eq=False)
class ColouredFit:
    """A linear fit averaged over k laws of noise."""

    #: (k, p), estimates under each, and (k, p, p) their covariance with the scale of the residuals
    estimates: Array
    covariances: Array
    likely: Array  #: (k,), logarithm of how likely the residuals are under each law
    prior: Array  #: (k,), probabilities of the laws beforehand
    dof: int  #: of the residuals
    #: (k, n, p) and (k, n), whitened design and values
    _design: Array
    _values: Array
    _whitening: _Whitening
    _constant: Array  #: (k,), logarithms of what does not depend on the residuals
    _least: float  #: sum of squares below which residuals are taken for no smaller

    @cached_property
    def weights(self) -> Array:
        """Probabilities (k,) of the laws."""
        return _normed(np.log(self.prior) + self.likely)

    @cached_property
    def estimate(self) -> Array:
        """Means (p,) over the laws of noise."""
        out: Array = self.weights @ self.estimates
        return out

    @cached_property
    def noise(self) -> dict[str, float]:
        """Probability of each kind of noise; a walk may have other noise beside it."""
        return _by_kind(self.weights)

    def sigma(self, row: int) -> float:
        """Standard deviation of a parameter: what it is within with the probability of one sigma.

        The average over the noise has longer tails than a normal distribution.
        """
        scale = np.sqrt(self.covariances[:, row, row])
        apart = self.estimates[:, row] - self.estimate[row]
        low, high = 1e-3 * float(scale.min()), 1e3 * float(scale.max() + np.abs(apart).max())
        for _ in range(_HALVINGS):
            middle = np.sqrt(low * high)
            ends = np.maximum(np.stack([middle - apart, middle + apart]), 0.0) / scale
            beyond = float(self.weights @ f.sf(ends**2, 1, self.dof).mean(axis=0))
            low, high = (middle, high) if beyond > _BEYOND else (low, middle)
        return float(middle)

    def sigma_of(self, row: int, kind: str) -> float:
        """The same if noise were of one kind; NaN if nothing speaks for it."""
        chosen = NOISES.index(kind) == _KIND
        weight = self.weights[chosen]
        if weight.sum() <= 0:
            return float("nan")
        variance = weight @ self.covariances[chosen, row, row] / weight.sum()
        return float(np.sqrt(variance))

    def chance(self, rows: Index | list[int]) -> float:
        """Probability of parameters at least as large if the true ones were zero.

        One parameter by Student's distribution, several by Fisher's, averaged over the noise.
        """
        rows = np.asarray(rows)
        x = self.estimates[:, rows]
        square = self.covariances[:, rows[:, None], rows]
        statistic = np.einsum("ki,ki->k", x, np.linalg.solve(square, x[:, :, None])[:, :, 0])
        tail = f.sf(statistic / len(rows), len(rows), self.dof)
        return float(self.weights @ tail)

    def detectable(self, row: int, level: float, power: float) -> float:
        """Size of a parameter that a test at this level would find with this probability."""
        scale = np.sqrt(self.covariances[:, row, row])

        def excess(size: float) -> float:
            """Probability of as much by chance, beyond the level."""
            return float(self.weights @ f.sf((size / scale) ** 2, 1, self.dof)) - level

        limit = _root(scale, excess)

        def lack(size: float) -> float:
            """Difference from the wanted power."""
            return power - float(self.weights @ t.sf((limit - size) / scale, self.dof))

        return _root(scale, lack)

    def chances(self, columns: Array) -> Array:
        """Chances (m,) of further columns (n, m) of the design, each added by itself.

        The laws are weighed anew with each: what a jump explains is no random walk.
        """
        columns = self._whitening.blocks @ columns
        white = self._whitening.factors @ columns
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
        likely = np.log(self.prior)[:, None] + self._constant[:, None]
        likely = likely - 0.5 * np.log(np.where(seen, length, 1.0)) - 0.5 * dof * np.log(after)
        out: Array = (_normed(likely) * f.sf(gain / (after / dof), 1, dof)).sum(axis=0)
        return out


def coloured_fit(
    days: Array, values: Array, sigma: Array, design: Array, prior: Array | None = None
) -> ColouredFit:
    """Fit a design (n, p) to values (n,) at times (n,) [days], whatever their noise.

    Of stated sigmas the ratios count; the design has a column for the offset; the prior of the laws
    of noise comes from ``learned_prior``.

    Method section 12.6.
    """
    whitening = _whitening(days.tobytes(), sigma.tobytes())
    inverse = whitening.factors
    x, y = whitening.blocks @ design, whitening.blocks @ values
    n, p = x.shape
    wx, wy = inverse @ x, inverse @ y
    normal = np.swapaxes(wx, 1, 2) @ wx
    cofactor = np.linalg.inv(normal)
    estimates = (cofactor @ (np.swapaxes(wx, 1, 2) @ wy[:, :, None]))[:, :, 0]
    left = wy - (wx @ estimates[:, :, None])[:, :, 0]
    dof = n - p
    least = dof * (_RESOLVED * float(np.median(sigma))) ** 2
    rss = np.maximum((left**2).sum(axis=1), least)
    constant = whitening.determinants - 0.5 * np.linalg.slogdet(normal)[1]
    return ColouredFit(
        estimates=estimates,
        covariances=cofactor * (rss / dof)[:, None, None],
        likely=constant - 0.5 * dof * np.log(rss),
        prior=BEFOREHAND if prior is None else prior,
        dof=dof,
        _design=wx,
        _values=wy,
        _whitening=whitening,
        _constant=constant,
        _least=least,
    )


def learned_prior(likely: Sequence[Array]) -> Array:
    """How often each law is met (k,), from the likelihoods (k,) of series of one site.

    Series need not have one law. By expectation and maximisation; what is known beforehand counts
    as some series more.

    Method section 12.6.
    """
    prior = BEFOREHAND
    for _ in range(_ROUNDS if len(likely) else 0):
        met = _normed(np.log(prior)[:, None] + np.stack(likely, axis=1)).sum(axis=1)
        prior = (_KNOWN * BEFOREHAND + met) / (_KNOWN + len(likely))
    return prior


@lru_cache(maxsize=2)
def _whitening(days: bytes, sigma: bytes) -> _Whitening:
    """Of times and stated sigmas; a series is fitted several times with other designs."""
    at, stated = np.frombuffer(days), np.frombuffer(sigma)
    blocks = _blocks(stated)
    white = blocks @ np.diag(stated**2) @ blocks.T
    white /= np.mean(np.diag(white))
    times = blocks @ at
    step = max(float(np.median(np.diff(times))), 1e-9)
    lag = np.abs(times[:, None] - times) / step
    since = np.minimum(times[:, None], times) - times[0]
    walk = since / max(float(since.max()), 1e-9)
    # relaxation times in octaves, alike in variance, are noise of 1/f between the ends
    octaves = 2.0 ** np.arange(np.log2(8 * len(times)) + 1)
    flicker = np.exp(-lag[None] / octaves[:, None, None]).mean(axis=0)
    pairs, which = np.unique(_LAWS[:, :2], axis=0, return_inverse=True)
    share, correlation = pairs.T[:, :, None, None]
    base = (1 - share + _NUGGET) * white + share * np.maximum(correlation, 1e-3) ** lag
    r, q = _LAWS.T[2:, :, None, None]
    parts = base[which.ravel()] + r * walk + q * flicker
    factors = np.linalg.inv(np.linalg.cholesky(parts))
    return _Whitening(blocks, factors, np.log(np.einsum("knn->kn", factors)).sum(axis=1))


def _blocks(sigma: Array) -> Array:
    """Means (m, n) of neighbouring values, weighted; each value by itself in short series."""
    n = len(sigma)
    size = -(-n // _MOST)
    if size == 1:
        return np.eye(n)
    number = np.arange(n) // size
    out = np.zeros((int(number[-1]) + 1, n))
    out[number, np.arange(n)] = 1 / sigma**2
    return np.asarray(out / out.sum(axis=1, keepdims=True))


def _normed(logarithms: Array) -> Array:
    """Probabilities along the first axis."""
    out = np.exp(logarithms - logarithms.max(axis=0))
    return np.asarray(out / out.sum(axis=0))


def _by_kind(weights: Array) -> dict[str, float]:
    """Sums over the laws of each kind."""
    return {name: float(weights[k == _KIND].sum()) for k, name in enumerate(NOISES)}


def _root(scale: Array, falling: Callable[[float], float]) -> float:
    """Where a falling function is zero, far below the smallest scale to far above the largest."""
    low, high = 1e-3 * float(scale.min()), 1e6 * float(scale.max())
    for _ in range(2 * _HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if falling(middle) > 0 else (low, middle)
    return middle
