"""Locates a straight edge of print, with its covariance, from the intensities of points near it.

A point's intensity says how far its beam was from the edge where the footprint lay on both colours,
and on which side of it where not. The place of a point is known to the jitter of the angles, the
profile of the footprint to a share of its width. The posterior of an edge's shift and turn is
summed over a grid that closes in on it. Scans much coarser than the beam, where any line between
two rows of points fits and least squares have no slope, are so treated like dense ones (method
section 8.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import erfc, exp, log, sqrt

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.special import erf

from tribrach._types import Array

__all__ = ["BLURS", "GATES", "EdgePoints", "EdgePosteriorGates", "locate_edge", "messages"]


@dataclass(frozen=True)
class EdgePosteriorGates:
    """What intensities say of an edge, and the grid over which its posterior is summed.

    Notes
    -----
    Chosen by hand on simulated boards and discs, so that the errors of their centres are as large
    as their covariances say (tests/targets/test_checkerboards, tests/targets/test_discs); where a
    number has a source, it is named.
    """

    #: nodes of the grid in each direction, and most rounds of closing in
    grid_nodes: int = 17
    grid_rounds: int = 8
    #: the grid reaches out to this many sigmas
    grid_reach_sigmas: float = 4.0
    #: closing in ends when the grid shrinks to no less than this share
    grid_shrinks_share: float = 0.6
    #: points that say only a side, and that the whole grid obeys by this many sigmas, are left out
    obeyed_sigmas: float = 5.0
    #: light nearer to plain white or black than this share of half the swing says only the side
    plain_swing: float = 0.06
    #: ... or nearer than this many sigmas of its noise
    plain_sigmas: float = 3.0
    #: share of points that obey nothing of this (dirt, damaged print)
    astray_share: float = 0.01
    #: how well the blur is predicted, sigma of its logarithm
    blur_log_sigma: float = 0.3
    #: blurs that are tried, in these sigmas
    blur_sigmas: tuple[float, ...] = (-1.2, 0.0, 1.2)
    #: beams are between a Gaussian and a uniform disc of the same variance; what both differ by at
    #: the same level of light, in sigmas of the footprint, is half of that difference, common to a
    #: row (computed from both profiles)
    profile_blurs: float = 0.06


GATES = EdgePosteriorGates()

# compiled code reads constants of the module, not attributes of an object
_ASTRAY_SHARE = GATES.astray_share


Kinds = NDArray[np.int8]


#: multiples of the predicted blur that are tried
BLURS = np.exp(GATES.blur_log_sigma * np.array(GATES.blur_sigmas))


_PLACES = np.linspace(-4, 4, 1601)


_DISC = np.clip(_PLACES / 2, -1, 1)


_LEVELS = (
    0.5 * erf(_PLACES / np.sqrt(2)) + (_DISC * np.sqrt(1 - _DISC**2) + np.arcsin(_DISC)) / np.pi
)


_SLOPES = np.gradient(_LEVELS, _PLACES)


@dataclass(frozen=True)
class EdgePoints:
    """Points near one edge.

    Attributes
    ----------
    along, across : array (n,)
        Coordinates along the edge and across it, from its presumed place [m].
    level : array (n,)
        Intensity scaled to -1 on the negative side of the edge and 1 on the positive side.
    noise : float
        Noise of the level.
    blur : float
        Sigma of the footprint across the edge [m].
    jitter : float
        Sigma of a point's place across the edge [m].
    """

    along: Array
    across: Array
    level: Array
    noise: float
    blur: float
    jitter: float


def locate_edge(points: EdgePoints, shift: float, turn: float) -> tuple[Array, Array]:
    """Posterior mean and covariance of an edge's shift across itself and turn.

    Parameters
    ----------
    points : EdgePoints
        The points near the edge.
    shift : float
        How far from the presumed place the edge is searched [m].
    turn : float
        How far from the presumed direction it is searched [rad].

    Returns
    -------
    mean : array (2,)
        Shift [m] and turn [rad].
    covariance : array (2, 2)
        Their covariance.
    """
    mean, reach = np.zeros(2), np.array([shift, turn])
    told = [
        messages(points.level, points.noise, points.blur * share, points.jitter) for share in BLURS
    ]
    for _ in range(GATES.grid_rounds):
        nodes = [
            m + np.linspace(-1, 1, GATES.grid_nodes) * r for m, r in zip(mean, reach, strict=True)
        ]
        score = np.empty((len(BLURS), GATES.grid_nodes, GATES.grid_nodes))
        for k, (place, sigma, kind) in enumerate(told):
            away = points.across - mean[0] - mean[1] * points.along
            margin = kind * (away - place) - reach[0] - reach[1] * np.abs(points.along)
            n = (kind == 0) | (margin < GATES.obeyed_sigmas * sigma)
            lot = points.along[n], points.across[n], place[n], sigma[n], kind[n]
            _score(*lot, nodes[0], nodes[1], score[k])
            # a density of light is one of places times the blur
            share = np.log(BLURS[k])
            score[k] += (kind == 0).sum() * share - 0.5 * (share / GATES.blur_log_sigma) ** 2
        weight = np.exp(score - score.max()).sum(axis=0)
        mean, covariance = _moments(weight / weight.sum(), nodes[0], nodes[1])
        step, before = 2 * reach / (GATES.grid_nodes - 1), reach
        reach = np.maximum(GATES.grid_reach_sigmas * np.sqrt(np.diag(covariance)), 1.5 * step)
        if (reach > GATES.grid_shrinks_share * before).all():
            break
    covariance[0, 0] += (GATES.profile_blurs * points.blur) ** 2
    return mean, covariance


def messages(
    level: Array, noise: float, blur: Array | float, jitter: Array | float
) -> tuple[Array, Array, Kinds]:
    """What each point says of its distance from the edge.

    Parameters
    ----------
    level : array (n,)
        Levels as in :class:`EdgePoints`.
    noise : float
        Noise of the level.
    blur : float or array (n,)
        Sigma of the footprint across the edge, common or for each point [m].
    jitter : float or array (n,)
        Sigma of a point's place across the edge, common or for each point [m].

    Returns
    -------
    place : array (n,)
        Distance from the edge [m].
    sigma : array (n,)
        Its sigma [m].
    kind : array of int (n,)
        0 where the distance is known; 1 or -1 where it is only known to be more, or less, than
        ``place``.
    """
    plain = max(GATES.plain_swing, GATES.plain_sigmas * noise)
    width = np.hypot(jitter, GATES.profile_blurs * blur)
    kind = np.where(level > 1 - plain, 1, np.where(level < plain - 1, -1, 0)).astype(np.int8)
    place = np.interp(np.clip(level, plain - 1, 1 - plain), _LEVELS, _PLACES)
    slope = np.interp(place, _PLACES, _SLOPES) / blur
    sigma = np.where(kind == 0, np.hypot(width, noise / slope), width)
    return place * blur, sigma, kind


@njit(cache=True, nogil=True, parallel=True)
def _score(along, across, place, sigma, kind, shifts, turns, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of every shift and turn."""
    for i in prange(len(shifts)):
        for j in range(len(turns)):
            total = 0.0
            for n in range(len(along)):
                distance = across[n] - shifts[i] - turns[j] * along[n]
                z = (distance - place[n]) / sigma[n]
                if kind[n] == 0:
                    total += log(exp(-0.5 * z * z) + _ASTRAY_SHARE)
                else:
                    total += log(0.5 * erfc(-kind[n] * z / sqrt(2.0)) + _ASTRAY_SHARE)
            out[i, j] = total


def _moments(weight: Array, first: Array, second: Array) -> tuple[Array, Array]:
    """Mean and covariance over the grid; half a step's width is left to what is narrower."""
    mean = np.array([weight.sum(axis=1) @ first, weight.sum(axis=0) @ second])
    a, b = first - mean[0], second - mean[1]
    cross = a @ weight @ b
    covariance = np.array([[weight.sum(axis=1) @ a**2, cross], [cross, weight.sum(axis=0) @ b**2]])
    return mean, covariance
