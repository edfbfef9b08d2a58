"""The edge of a printed disc in the light of points of its plane, by least squares.

``I = I1 + g Phi((R - s^2/(2R) - |x - c|) / s)``: two levels of light and the circular edge between
them, blurred by the footprint. Seen under the incidence angle i the footprint is longer by 1/cos i
along the slope, and so is s for edges across it. The shift of s^2/(2R) keeps the area of the disc.
Points near the edge are uncertain by their angles as well, by how much they tell themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tribrach._types import Array

__all__ = ["PATCH", "DiscShape", "EdgeFit", "departure", "light_of", "solve"]


#: points up to this many radii from the centre take part
PATCH = 1.5


#: blur of the first steps over the radius, so that a far start finds its way
_WIDTHS = (0.5, 0.4, 0.3, 0.24, 0.2, 0.16, 0.12, 0.1, 0.08, 0.06, 0.05, 0.04)


#: a blur below this share of the pitch has no slope
_COARSE = 0.35


#: beyond this pitch over the blur few points see a slope
_DENSE = 2.0


#: error of the model over the gain: beams are not quite normal; blurs wider than the true one
_MISFIT, _WIDENED = 0.03, 0.35


#: residuals beyond this many sigmas take no part
_TRIM = 4.0


#: jitters tried over the foretold one, and how well that is foretold (logarithm)
_JITTERS, _JITTER_SHARE = np.exp(np.linspace(-3.0, 1.0, 13)), 0.7


@dataclass(frozen=True)
class DiscShape:
    """What is known of a disc and its points before the fit.

    radius [m], radius_sigma [m]; slope (2,) : in the plane, along it the beam falls off, its length
    the tangent of incidence; blur [m] : sigma of the edge seen straight; blur_share : how well that
    is foretold (logarithm); jitter [m] : sigma of a point's place; pitch [m] : between points.
    """

    radius: float
    radius_sigma: float
    slope: Array
    blur: float
    blur_share: float
    jitter: float
    pitch: float

    @property
    def coarse(self) -> bool:
        """Are points so far apart that few see the slope of the edge?"""
        return self.pitch > _DENSE * self.blur

    @property
    def narrow(self) -> float:
        """Least blur [m] that least squares find a slope with."""
        return max(self.blur, _COARSE * self.pitch)

    @property
    def misfit(self) -> float:
        """Error of the edge's model over the gain: shape of beams, and a blur that is too wide."""
        return _MISFIT + _WIDENED * (1 - self.blur / self.narrow)

    @property
    def step(self) -> float:
        """Sigma [m] of the mean radius that points far apart leave open."""
        if not self.coarse:
            return 0.0
        return 0.3 * self.pitch / float(np.sqrt(2 * np.pi * self.radius / self.pitch))


@dataclass(frozen=True)
class EdgeFit:
    """Parameters (6,) x, y, level outside, gain, ln s, R; covariance; noise; jitter; use (n,)."""

    p: Array
    covariance: Array
    noise: float
    jitter: float
    use: NDArray[np.bool_]


def light_of(flat: Array, p: Array, slope: Array) -> tuple[Array, Array]:
    """Light (n,) of places (n, 2) [m] and its derivatives (n, 6) by the parameters."""
    d = flat - p[:2]
    away = np.maximum(np.hypot(d[:, 0], d[:, 1]), 1e-9)
    n = d / away[:, None]
    s = np.exp(p[4]) * np.sqrt(1 + (n @ slope) ** 2)
    u = (p[5] - np.minimum(s**2 / (2 * p[5]), 0.25 * p[5]) - away) / s
    inside = ndtr(u)
    steep = p[3] * np.exp(-0.5 * u**2) / (np.sqrt(2 * np.pi) * s)
    j = np.empty((len(flat), 6))
    j[:, :2] = steep[:, None] * n
    j[:, 2], j[:, 3] = 1.0, inside
    j[:, 4] = -steep * s * u
    j[:, 5] = steep
    return p[2] + p[3] * inside, j


def solve(flat: Array, light: Array, start: Array, shape: DiscShape) -> EdgeFit | None:
    """Damped Gauss-Newton from x, y, level, gain (4,), the blur from wide to narrow, then free."""
    narrow = shape.narrow
    p = np.array([*start, np.log(narrow), shape.radius])
    jitter, noise, use, n = shape.jitter, 0.0, np.ones(len(light), dtype=bool), np.eye(6)
    limit = np.array([*[0.25 * shape.radius] * 2, np.inf, np.inf, 0.5, 0.1 * shape.radius])
    for step in range(40):
        fixed = step < len(_WIDTHS)
        if fixed:
            p[4] = np.log(max(narrow, _WIDTHS[step] * shape.radius))
        value, j = light_of(flat, p, shape.slope)
        v, edge, model = light - value, np.abs(j[:, 5]), _model_error(j, p, shape.misfit)
        noise = max(_noise(flat, v, p, shape.pitch), 0.002 * abs(p[3]))
        near = np.hypot(*(flat - p[:2]).T) < PATCH * shape.radius
        if not fixed and step % 3 == 0:
            known = np.hypot(noise, model)[use & near]
            jitter = _jitter(v[use & near], edge[use & near], known, shape.jitter)
        total = np.sqrt(noise**2 + model**2 + (jitter * edge) ** 2)
        use = near & (np.abs(v) < np.maximum(_TRIM * total, 0.8 * abs(p[3]) if fixed else 0))
        if use.sum() < 8 or noise <= 0:
            return None
        w = 1 / total[use] ** 2
        n = j[use].T @ (j[use] * w[:, None])
        right = j[use].T @ (w * v[use])
        for k, prior, sigma in (
            (4, np.log(narrow), 1e-4 if fixed else shape.blur_share),
            (5, shape.radius, 1e-4 * shape.radius if fixed else shape.radius_sigma),
        ):
            n[k, k] += 1 / sigma**2
            right[k] += (prior - p[k]) / sigma**2 * (not fixed)
        move = _step(n, right)
        if not np.isfinite(move).all():
            return None
        p = p + np.clip(move, -limit, limit)
        if not np.hypot(*(p[:2] - start[:2])) < shape.radius or not p[5] > 0.2 * shape.radius:
            return None
        if step > len(_WIDTHS) + 6 and np.abs(move[:2]).max() < 1e-6 * shape.radius:
            break
    chi = float(np.mean(v[use] ** 2 * w))
    covariance = _inverse(n)
    return (
        None if covariance is None else EdgeFit(p, covariance * max(1.0, chi), noise, jitter, use)
    )


def _model_error(j: Array, p: Array, share: float) -> Array:
    """Sigma (n,) of the model's light, largest on the edge; j (n, 6) as of :func:`light_of`."""
    return np.asarray(share * abs(p[3]) * 2 * np.sqrt(np.maximum(j[:, 3] * (1 - j[:, 3]), 0)))


def _step(n: Array, right: Array) -> Array:
    """The move of a step, scaled so that light of any unit does."""
    scale = 1 / np.sqrt(np.maximum(np.diag(n), 1e-300))
    return np.asarray(scale * np.linalg.lstsq(n * np.outer(scale, scale), scale * right)[0])


def _inverse(n: Array) -> Array | None:
    """Inverse of a normal matrix, None if it has none."""
    scale = 1 / np.sqrt(np.maximum(np.diag(n), 1e-300))
    try:
        return np.asarray(np.linalg.inv(n * np.outer(scale, scale)) * np.outer(scale, scale))
    except np.linalg.LinAlgError:
        return None


def _noise(flat: Array, v: Array, p: Array, pitch: float) -> float:
    """Noise of light on plain print, on both sides of the edge together."""
    away = np.hypot(*(flat - p[:2]).T)
    gap = min(max(3 * np.exp(p[4]), 0.5 * pitch), 0.3 * p[5])
    plain = (np.abs(away - p[5]) > gap) & (away < PATCH * p[5])
    inside = away < p[5]
    parts = [v[plain & side] for side in (inside, ~inside)]
    left = np.concatenate([part - np.median(part) for part in parts if len(part)] or [v])
    return float(1.4826 * np.median(np.abs(left)))


def _jitter(v: Array, edge: Array, noise: Array, foretold: float) -> float:
    """Likeliest sigma [m] of a point's place, from residuals (n,) and slopes (n,) at the edge."""
    on = edge * foretold > 0.3 * noise
    if not on.any():
        return foretold
    sizes = foretold * _JITTERS
    variance = noise[on] ** 2 + (sizes[:, None] * edge[on]) ** 2
    square = np.minimum(v[on] ** 2, (_TRIM**2) * variance)
    cost = (np.log(variance) + square / variance).sum(axis=1)
    return float(sizes[np.argmin(cost + (np.log(_JITTERS) / _JITTER_SHARE) ** 2)])


def departure(flat: Array, light: Array, fit: EdgeFit, shape: DiscShape) -> tuple[float, float]:
    """By how much the edge departs from a circle [m], and the sigma of that [m].

    Of the waves of two to four periods around it the one that exceeds its sigma by most.
    """
    value, j = light_of(flat, fit.p, shape.slope)
    d = flat - fit.p[:2]
    turn = np.arctan2(d[:, 1], d[:, 0])
    waves = [f(k * turn) for k in (2, 3, 4) for f in (np.cos, np.sin)]
    a = np.column_stack([j[:, :4], *[j[:, 5] * wave for wave in waves]])
    use = np.hypot(d[:, 0], d[:, 1]) < PATCH * shape.radius
    model = _model_error(j, fit.p, shape.misfit)
    w = 1 / (fit.noise**2 + model**2 + (fit.jitter * j[:, 5]) ** 2)
    scale = 1 / np.maximum(np.sqrt((a[use] ** 2 * w[use, None]).sum(axis=0)), 1e-300)
    a = a[use] * scale
    n = a.T @ (a * w[use, None]) + 1e-9 * np.eye(a.shape[1])
    cover = np.linalg.inv(n)
    v = light[use] - value[use]
    x = cover @ (a.T @ (w[use] * v)) * scale
    left = v - (a / scale) @ x
    chi = max(1.0, float(np.mean(left**2 * w[use])))
    sigma = np.sqrt(np.diag(cover) * chi) * scale
    size = np.hypot(x[4::2], x[5::2])
    error = np.hypot(sigma[4::2], sigma[5::2])
    worst = int(np.argmax(size - 3 * error))
    return float(size[worst]), float(error[worst])
