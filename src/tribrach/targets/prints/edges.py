"""Locates a straight edge of print, with its covariance, from the intensities of points near it.

A point's intensity says how far its beam was from the edge where the footprint lay on both colours,
and on which side of it where not. How sure it is follows from the noise of light, which grows with
light where it is speckle: white print has its own noise and black its own. The place of a point is
known to the jitter of the angles, the profile of the footprint to a share of its width. The
posterior of an edge's shift and turn is summed over a grid that closes in on it. Scans much coarser
than the beam, where any line between two rows of points fits and least squares have no slope, are
so treated like dense ones (method section 8.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf, ndtr

from tribrach._types import Array
from tribrach.kernels import in_threads, njit
from tribrach.statistics import robust_sigma

#: a thread for each so many points at one node of a row of the grid
_EACH = 50_000


@dataclass(frozen=True)
class EdgePosteriorGates:
    """What intensities say of an edge, and the grid over which its posterior is summed.

    Chosen by hand with test_checkerboards, test_discs.
    """

    #: nodes of the grid in each direction, and most rounds of closing in
    grid_nodes: int = 17
    grid_rounds: int = 8
    grid_reach_sigmas: float = 4.0  #: the grid reaches out to this many sigmas
    #: closing in ends when the grid shrinks to no less than this share
    grid_shrinks_share: float = 0.6
    #: print is as even as this, sigma over half the swing: plain print is not taken for an edge
    uneven_swing: float = 0.02
    #: share of points that obey nothing of this (dirt, damaged print): their light is anything
    #: within so many half swings
    astray_share: float = 0.01
    astray_swings: float = 3.0
    #: the profile is followed to so many blurs from the edge, in steps of so many
    profile_reach_blurs: float = 3.5
    profile_step_blurs: float = 0.03
    #: likelihoods are tabulated in these shares of the error of a place, out to so many of it
    table_step_sigmas: float = 0.4
    table_reach_sigmas: float = 4.0
    colour_points: int = 6  #: a colour on fewer points gets the noise of the other
    blur_log_sigma: float = 0.3  #: how well the blur is predicted, sigma of its logarithm
    blur_sigmas: tuple[float, ...] = (-1.2, 0.0, 1.2)  #: blurs that are tried, in these sigmas
    #: beams are between a Gaussian and a uniform disc of the same variance; what both differ by at
    #: the same level of light, in sigmas of the footprint, is half of that difference, common to a
    #: row (computed from both profiles)
    profile_blurs: float = 0.06


GATES = EdgePosteriorGates()

#: multiples of the predicted blur that are tried
BLURS = np.exp(GATES.blur_log_sigma * np.array(GATES.blur_sigmas))


_PLACES = np.linspace(-4, 4, 1601)


_DISC = np.clip(_PLACES / 2, -1, 1)


_LEVELS = (
    0.5 * erf(_PLACES / np.sqrt(2)) + (_DISC * np.sqrt(1 - _DISC**2) + np.arcsin(_DISC)) / np.pi
)


@dataclass(frozen=True)
class EdgePoints:
    """Points near one edge."""

    #: (n,), coordinates along the edge and across it, from its presumed place [m]
    along: Array
    across: Array
    #: (n,), intensity scaled to -1 on the negative side of the edge and 1 on the positive side
    level: Array
    noise: Array  #: (n, 2), noise of the level on plain print, of level -1 and of level 1
    blur: float  #: sigma of the footprint across the edge [m]
    jitter: float  #: sigma of a point's place across the edge [m]


def locate_edge(points: EdgePoints, shift: float, turn: float) -> tuple[Array, Array]:
    """Posterior mean and covariance of an edge's shift across itself [m] and turn [rad].

    ``shift`` and ``turn`` are how far from the presumed place and direction it is searched.
    """
    mean, reach = np.zeros(2), np.array([shift, turn])
    told = [
        LightOfDistance.of(points.level, points.noise, points.jitter / (points.blur * share))
        for share in BLURS
    ]
    for _ in range(GATES.grid_rounds):
        nodes = [
            m + np.linspace(-1, 1, GATES.grid_nodes) * r for m, r in zip(mean, reach, strict=True)
        ]
        score = np.empty((len(BLURS), GATES.grid_nodes, GATES.grid_nodes))
        for k, table in enumerate(told):
            scale = 1 / (points.blur * BLURS[k])
            lot = points.along, points.across, table.log, table.step, scale
            given = *lot, nodes[0], nodes[1], score[k]
            in_threads(_score, len(nodes[0]), *given, least=1 + _EACH // points.along.size)
            score[k] -= 0.5 * (np.log(BLURS[k]) / GATES.blur_log_sigma) ** 2
        weight = np.exp(score - score.max()).sum(axis=0)
        mean, covariance = _moments(weight / weight.sum(), nodes[0], nodes[1])
        step, before = 2 * reach / (GATES.grid_nodes - 1), reach
        reach = np.maximum(GATES.grid_reach_sigmas * np.sqrt(np.diag(covariance)), 1.5 * step)
        if (reach > GATES.grid_shrinks_share * before).all():
            break
    common = GATES.profile_blurs * points.blur * _one_sided(points)
    covariance[0, 0] += common**2
    return mean, covariance


def _one_sided(points: EdgePoints) -> float:
    """Share of the information on the edge that lies on one side of it, 0 to 1.

    Profiles of beams are symmetric, so a wrong one moves the places of points on both sides apart
    or together; it moves an edge that a single row of points tells of.
    """
    telling = np.maximum(1 - points.level**2, 0.0) ** 2
    total = float(telling.sum())
    return abs(float(telling @ np.sign(points.level))) / total if total > 0 else 1.0


def noise_of_colours(residual: Array, bright: NDArray[np.bool_]) -> Array:
    """Robust noise of light on plain print of either colour, the dark one first.

    A colour with few points gets that of the other, both 0 if both have few.

    Speckle is a share of the light, so white print is several times as noisy as black. A sigma of
    both together is too small for the white and makes plain white points pass for points on an edge
    (method section 8.2).
    """
    own = [residual[bright == colour] for colour in (False, True)]
    known = [len(part) >= GATES.colour_points for part in own]
    noise = np.array(
        [robust_sigma(part, about=0.0) if k else 0.0 for part, k in zip(own, known, strict=True)]
    )
    return noise if all(known) else np.full(2, noise.max())


def usual_noise(noise: Array) -> float:
    """One noise for both colours of a print, to compare its contrast with."""
    return float(np.sqrt(np.mean(noise**2)))


@dataclass(frozen=True)
class LightOfDistance:
    """How likely the light of each point is at every distance from the edge."""

    #: (n, m), log-likelihoods at distances from ``-(m - 1)/2`` to ``(m - 1)/2`` steps, alike
    #: beyond
    log: Array
    step: float  #: from one distance to the next, over the blur

    @classmethod
    def of(cls, level: Array, noise: Array, jitter: float) -> LightOfDistance:
        """Tabulate likelihoods for levels as in :class:`EdgePoints` (method section 8.2).

        ``noise`` (n, 2) is that of level -1 and of level 1; between them it grows with the level.
        ``jitter`` is the sigma of a point's place across the edge, over the blur.
        """
        width, reach = float(np.hypot(jitter, GATES.profile_blurs)), GATES.profile_reach_blurs
        step = GATES.table_step_sigmas * width
        half = int(np.ceil((reach + GATES.table_reach_sigmas * width) / step))
        distance = np.arange(-half, half + 1) * step
        # where beams may have been, plain print on either side as one place each
        nodes = int(reach / GATES.profile_step_blurs)
        borders = np.linspace(-reach, reach, 2 * nodes + 2)
        place = np.concatenate([[-np.inf], (borders[:-1] + borders[1:]) / 2, [np.inf]])
        light = np.interp(place, _PLACES, _LEVELS)
        below = ndtr((borders[:, None] - distance) / width)
        share = np.diff(below, axis=0, prepend=0.0, append=1.0)
        grown = noise[:, :1] + (noise[:, 1:] - noise[:, :1]) * (light + 1) / 2
        sigma = np.hypot(grown, GATES.uneven_swing)
        density = np.exp(-0.5 * ((level[:, None] - light) / sigma) ** 2) / sigma
        astray = GATES.astray_share / GATES.astray_swings
        usual = (1 - GATES.astray_share) / np.sqrt(2 * np.pi)
        return cls(np.log(usual * (density @ share) + astray), step)


@njit(cache=True, nogil=True)
def at_distance(log, n, distance):  # type: ignore[no-untyped-def]
    """Log-likelihood of point ``n`` at a distance in steps of its table."""
    last = log.shape[1] - 1
    place = min(max(distance + 0.5 * last, 0.0), last - 1e-9)
    k = int(place)
    return log[n, k] + (place - k) * (log[n, k + 1] - log[n, k])


@njit(cache=True, nogil=True)
def _score(first, last, along, across, log, step, scale, shifts, turns, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of every shift and turn; ``scale`` is one over the blur."""
    for i in range(first, last):
        for j in range(len(turns)):
            total = 0.0
            for n in range(len(along)):
                distance = across[n] - shifts[i] - turns[j] * along[n]
                total += at_distance(log, n, distance * scale / step)
            out[i, j] = total


def _moments(weight: Array, first: Array, second: Array) -> tuple[Array, Array]:
    """Mean and covariance over the grid; half a step's width is left to what is narrower."""
    mean = np.array([weight.sum(axis=1) @ first, weight.sum(axis=0) @ second])
    a, b = first - mean[0], second - mean[1]
    cross = a @ weight @ b
    covariance = np.array([[weight.sum(axis=1) @ a**2, cross], [cross, weight.sum(axis=0) @ b**2]])
    return mean, covariance
