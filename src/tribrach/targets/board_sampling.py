"""The centre of a board that is scanned more coarsely than the beam is wide.

Then few points lie on an edge, light is a step between them and least squares has no slope to go
by: any place of an edge between two points fits as well. The posterior of the edges is sampled
instead (adaptive importance sampling with a Student proposal, Cappe et al. 2008); its mean is the
centre and its spread the covariance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

__all__ = ["sample_edges"]

Array = NDArray[np.float64]

#: draws in a round, rounds, degrees of freedom of the proposal
_DRAWS, _ROUNDS, _FREEDOM = 1200, 5, 4
#: squared residuals count no more than this
_CAP = 12.0
#: the blur is foretold to within this share of itself
_BLUR_SHARE = 0.3


def sample_edges(
    flat: Array, light: Array, start: Array, spread: Array, scale: tuple[float, float, float]
) -> tuple[Array, Array]:
    """Mean (5,) and covariance (5, 5) of x0, y0, t1, t2, ln s.

    flat (n, 2), light (n,) : points within the board; start (5,) and spread (5, 5) : where the
    search begins; scale : foretold blur [m], sigma of a point's place [m], noise of light.
    """
    rng = np.random.default_rng(len(flat))
    mean, covariance = start.copy(), spread.copy()
    for turn in range(_ROUNDS):
        root = np.linalg.cholesky(covariance + 1e-18 * np.eye(5))
        z = rng.standard_normal((_DRAWS, 5))
        tail = np.sqrt(_FREEDOM / rng.chisquare(_FREEDOM, _DRAWS))[:, None]
        draws = mean + (z * tail) @ root.T
        proposal = -0.5 * (_FREEDOM + 5) * np.log1p((z * tail) ** 2 @ np.ones(5) / _FREEDOM)
        # the first rounds are tempered, so that a far start is found its way
        heat = (0.2, 0.5, 1.0, 1.0, 1.0)[turn]
        log_weight = heat * _log_posterior(flat, light, draws, scale) - proposal
        weight = np.exp(log_weight - log_weight.max())
        weight /= weight.sum()
        mean = weight @ draws
        d = draws - mean
        covariance = (d * weight[:, None]).T @ d
        # too few draws carry the weight: keep some width for the next round
        effective = 1 / float(weight @ weight)
        if turn < _ROUNDS - 1:
            covariance = 1.5 * covariance + spread * (0.02 if effective > 30 else 0.1)
    return mean, covariance


def _log_posterior(
    flat: Array, light: Array, draws: Array, scale: tuple[float, float, float]
) -> Array:
    """Of each draw (k,), light levels solved for, up to a constant."""
    blur, jitter, noise = scale
    s = np.exp(draws[:, 4])[:, None]
    x = flat[None, :, 0] - draws[:, 0:1]
    y = flat[None, :, 1] - draws[:, 1:2]
    shape, slope = np.ones((len(draws), len(flat))), np.zeros((len(draws), len(flat)))
    edges = []
    for k in (2, 3):
        a = (x * np.cos(draws[:, k : k + 1]) + y * np.sin(draws[:, k : k + 1])) / s
        edges.append((erf(a / np.sqrt(2)), np.exp(-0.5 * a * a) * np.sqrt(2 / np.pi) / s))
    shape = edges[0][0] * edges[1][0]
    slope = np.hypot(edges[0][1] * edges[1][0], edges[0][0] * edges[1][1])
    contrast = float(np.ptp(np.quantile(light, [0.15, 0.85]))) / 2
    variance = noise**2 + (contrast * jitter * slope) ** 2
    w = 1 / variance
    total, first = w.sum(axis=1), (w * shape).sum(axis=1)
    second = (w * shape**2).sum(axis=1)
    right, right_shape = w @ light, (w * shape) @ light
    determinant = np.maximum(total * second - first**2, 1e-12)
    level = (second * right - first * right_shape) / determinant
    swing = (total * right_shape - first * right) / determinant
    residual = light - level[:, None] - swing[:, None] * shape
    square = np.minimum(residual**2 * w, _CAP)
    out: Array = -0.5 * (square + np.log(variance)).sum(axis=1)
    out -= 0.5 * ((draws[:, 4] - np.log(blur)) / _BLUR_SHARE) ** 2
    skew = draws[:, 3] - draws[:, 2] - np.pi / 2
    return out - 0.5 * (skew / np.radians(3.0)) ** 2
