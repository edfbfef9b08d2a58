"""Where the centre of a printed disc is, and how sure that is, from the points near its edge.

As with the edges of checkerboards each point's light says how far its beam was from the edge, or
only on which side of it. The posterior of the centre is summed over a grid that closes in on it,
for several blurs and radii, so that scans much coarser than the beam, where any circle between two
rings of points fits and least squares has no slope, are treated like dense ones.
"""

from __future__ import annotations

from math import erfc, exp, log, sqrt

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tribrach.targets.board_edges import ASTRAY, BLUR_SHARE, BLURS, messages
from tribrach.targets.disc_edge import PATCH, DiscShape, EdgeFit

__all__ = ["posterior"]

Array = NDArray[np.float64]

#: nodes of the grid in each direction, most rounds of closing in, sigmas that the grid reaches
_NODES, _ROUNDS, _REACH = 15, 6, 4.0
#: radii that are tried, in sigmas of the radius: mean and variance are right
_RADII = np.sqrt(1.5) * np.array([-1.0, 0.0, 1.0])
#: what the beams' unknown profile moves the edge by, in all directions alike, over the blur
_PROFILE = 0.1
#: blurs foretold no better than this (logarithm) are guesses
_GUESSED = 0.9
#: points that tell where the edge is, about
_PLENTY = 600


def posterior(flat: Array, light: Array, fit: EdgeFit, shape: DiscShape) -> tuple[Array, Array]:
    """Mean (2,) and covariance (2, 2) of the centre [m] over all that points allow.

    flat (n, 2) [m], light (n,) : of the points of the plane; fit : by least squares, with the
    radius known to what ``shape`` says.
    """
    d = flat - fit.p[:2]
    away = np.maximum(np.hypot(d[:, 0], d[:, 1]), 1e-9)
    stretch = np.sqrt(1 + (d @ shape.slope / away) ** 2)
    spread = np.sqrt(np.diag(fit.covariance)[:2])
    reach = np.minimum(np.maximum(5 * spread, 0.7 * shape.pitch), 0.6 * shape.radius)
    # a blur that is hardly foretold is the one that was found; it holds the jitter of places too
    blur = shape.blur if shape.blur_share < _GUESSED else float(np.exp(fit.p[4]))
    beam = float(np.sqrt(max(blur**2 - 0.25 * shape.jitter**2, 0.25 * blur**2)))
    jitter = max(shape.jitter, fit.jitter)
    tail = 3 * float(np.hypot(beam, jitter)) * stretch
    near = np.abs(away - fit.p[5]) < tail + 2 * float(reach.max())
    use = np.flatnonzero(near & (away < PATCH * shape.radius))
    use = use[:: max(1, len(use) // _PLENTY)]
    level, noise = _levels(away, light, fit, float(np.median(tail)))
    level = level[use]
    told = [
        messages(level, noise, beam * share * stretch[use], jitter * stretch[use])
        for share in BLURS
    ]
    sigma = float(np.hypot(shape.radius_sigma, _PROFILE * beam))
    radii = [fit.p[5] + sigma * k - (beam * stretch[use]) ** 2 / (2 * shape.radius) for k in _RADII]
    return _closed_in(flat[use], told, radii, fit.p[:2], reach)


def _levels(away: Array, light: Array, fit: EdgeFit, clear: float) -> tuple[Array, float]:
    """Light (n,) as -1 outside and 1 inside, from the plain parts, and its noise."""
    clear = min(clear, 0.3 * fit.p[5])
    low, high = fit.p[2], fit.p[2] + fit.p[3]
    inner, outer = light[away < fit.p[5] - clear], light[away > fit.p[5] + clear]
    if min(len(inner), len(outer)) >= 6:
        low, high = float(np.median(outer)), float(np.median(inner))
    half = (high - low) / 2
    return (light - low) / half - 1, max(fit.noise / abs(half), 0.005)


def _closed_in(
    flat: Array,
    told: list[tuple[Array, Array, NDArray[np.int8]]],
    radii: list[Array],
    mean: Array,
    reach: Array,
) -> tuple[Array, Array]:
    """Mean (2,) and covariance (2, 2) over a grid around ``mean`` that closes in."""
    covariance = np.diag(reach**2)
    for _ in range(_ROUNDS):
        nodes = [m + np.linspace(-1, 1, _NODES) * r for m, r in zip(mean, reach, strict=True)]
        score = np.empty((len(told), len(radii), _NODES, _NODES))
        for k, (place, sigma, kind) in enumerate(told):
            share = np.log(BLURS[k])
            # a density of light is one of places times the blur
            prior = (kind == 0).sum() * share - 0.5 * (share / BLUR_SHARE) ** 2
            for m, radius in enumerate(radii):
                _score(flat, radius, place, sigma, kind, nodes[0], nodes[1], score[k, m])
            score[k] += prior
        weight = np.exp(score - score.max()).sum(axis=(0, 1))
        weight /= weight.sum()
        mean = np.array([weight.sum(axis=1) @ nodes[0], weight.sum(axis=0) @ nodes[1]])
        a, b = nodes[0] - mean[0], nodes[1] - mean[1]
        cross = a @ weight @ b
        covariance = np.array(
            [[weight.sum(axis=1) @ a**2, cross], [cross, weight.sum(axis=0) @ b**2]]
        )
        step, before = 2 * reach / (_NODES - 1), reach
        reach = np.maximum(_REACH * np.sqrt(np.diag(covariance)), 1.5 * step)
        if (reach > 0.6 * before).all():
            break
    return mean, covariance


@njit(cache=True, nogil=True, parallel=True)
def _score(flat, radius, place, sigma, kind, xs, ys, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of every centre."""
    for i in prange(len(xs)):
        for j in range(len(ys)):
            total = 0.0
            for n in range(len(flat)):
                dx, dy = flat[n, 0] - xs[i], flat[n, 1] - ys[j]
                z = (radius[n] - sqrt(dx * dx + dy * dy) - place[n]) / sigma[n]
                if kind[n] == 0:
                    total += log(exp(-0.5 * z * z) + ASTRAY)
                else:
                    y = kind[n] * z
                    # a side that is right beyond doubt costs nothing
                    total += log(0.5 * erfc(-y / sqrt(2.0)) + ASTRAY) if y < 6 else log(1 + ASTRAY)
            out[i, j] = total
