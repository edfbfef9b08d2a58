"""Fits the edge of a printed disc to the intensities of the points of its plane, by least squares.

``I = I1 + g Phi((R - s^2/(2R) - |x - c|) / s)``: two levels of intensity and the circular edge
between them, blurred by the footprint. Seen under the incidence angle i the footprint is longer by
1/cos i along the slope, and so is s for edges across it. The shift of s^2/(2R) keeps the area of
the disc. Points near the edge are uncertain also by their angles; by how much is estimated from the
points themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tribrach._types import Array
from tribrach.kernels import in_threads, njit
from tribrach.targets.prints.edges import BLURS, LightOfDistance, at_distance, noise_of_colours
from tribrach.targets.prints.edges import GATES as LIGHT

#: a thread for each so many points at one node of a row of the grid
_EACH = 50_000


@dataclass(frozen=True)
class CircleEdgeGates:
    """How the edge of a disc is fitted and how its centre follows from it (by hand: test_discs)."""

    patch_radii: float = 1.5  #: points up to this many radii from the centre take part
    #: blur of the first steps over the radius, from wide to narrow: a far start finds its way
    first_blurs_radii: tuple[float, ...] = (
        0.5, 0.4, 0.3, 0.24, 0.2, 0.16, 0.12, 0.1, 0.08, 0.06, 0.05, 0.04,
    )  # fmt: skip
    most_steps: int = 40  #: steps at most, those of the first blurs included
    settling_steps: int = 6  #: steps after the first blurs before a small move may end the fit
    settled_radii: float = 1e-6  #: a smaller move of the centre ends the fit, over the radius
    #: largest move in a step: of centre and radius over the radius, of the logarithm of the blur
    centre_step_radii: float = 0.25
    radius_step_radii: float = 0.1
    blur_step_log: float = 0.5
    #: a fitted radius below this share of the given one went astray
    least_radius_share: float = 0.2
    fewest_points: int = 8  #: fewest points of a step
    #: a blur below this share of the distance of points has no slope that least squares could find
    least_blur_pitches: float = 0.35
    #: where points are farther apart than this many blurs few of them see a slope
    coarse_pitch_blurs: float = 2.0
    #: sigma of the mean radius that points far apart leave open, over their distance, for one point
    coarse_radius_pitches: float = 0.3
    #: error of the model of light over the gain: profiles of beams are not quite normal ...
    misfit_share: float = 0.03
    #: ... and grows by this where the blur had to be taken wider than the true one
    widened_misfit_share: float = 0.35
    trim_sigmas: float = 4.0  #: residuals of light beyond this many sigmas take no part ...
    #: ... but in the first steps only those beyond this share of the gain
    first_trim_gain: float = 0.8
    #: noise of light is not believed to be below this share of the gain
    least_noise_gain: float = 0.002
    #: plain print begins this many blurs from the edge, or this share of the distance of points,
    #: but not beyond this share of the radius
    plain_blurs: float = 3.0
    plain_pitches: float = 0.5
    plain_radii: float = 0.3
    #: multiples of the predicted jitter that are tried
    jitter_multiples: tuple[float, ...] = tuple(np.exp(np.linspace(-3.0, 1.0, 13)).tolist())
    jitter_log_sigma: float = 0.7  #: how well the jitter is predicted, sigma of its logarithm
    #: points tell of the jitter where it moves their light by this share of the noise or more
    jitter_telling_noise: float = 0.3
    #: the wave around the edge that exceeds this many of its sigmas by most is its departure
    departure_sigmas: float = 3.0
    #: nodes of the grid of the posterior in each direction, and most rounds of closing in
    grid_nodes: int = 15
    grid_rounds: int = 6
    grid_reach_sigmas: float = 4.0  #: the grid reaches out to this many sigmas
    #: closing in ends when the grid shrinks to no less than this share
    grid_shrinks_share: float = 0.6
    #: the first grid: sigmas of the fit, distances of points, at most this many radii
    first_reach_sigmas: float = 5.0
    first_reach_pitches: float = 0.7
    first_reach_radii: float = 0.6
    #: radii that are tried, in sigmas of the radius: their mean and variance are right
    radius_sigmas: tuple[float, ...] = tuple((np.sqrt(1.5) * np.array([-1.0, 0.0, 1.0])).tolist())
    #: what the unknown profile of the beam moves the edge by, alike all around, over the blur
    profile_blurs: float = 0.1
    #: a blur predicted no better (sigma of its logarithm) is a guess: the fitted one is better
    guessed_blur_log_sigma: float = 0.9
    #: points that tell where the edge is, about; more say no more and take time
    telling_points: int = 600
    #: light of plain print is taken from so many points of either colour, or from the fit
    plain_points: int = 6
    posterior_noise: float = 0.005  #: least noise of light in the posterior, over half the gain


GATES = CircleEdgeGates()


@dataclass(frozen=True)
class DiscShape:
    """Prior knowledge of a disc and its points."""

    radius: float  #: radius [m]
    radius_sigma: float  #: its sigma [m]
    #: (2,), direction in the plane along which the beam falls off; its length is the tangent of
    #: the incidence angle
    slope: Array
    blur: float  #: sigma of the edge seen straight [m]
    blur_share: float  #: sigma of the logarithm of the predicted blur
    jitter: float  #: sigma of a point's place [m]
    pitch: float  #: distance between points [m]

    @property
    def coarse(self) -> bool:
        """True if points are so far apart that few of them see the slope of the edge."""
        return self.pitch > GATES.coarse_pitch_blurs * self.blur

    @property
    def narrow(self) -> float:
        """Smallest blur with which least squares still see a slope [m]."""
        return max(self.blur, GATES.least_blur_pitches * self.pitch)

    @property
    def misfit(self) -> float:
        """Error of the edge's model over the gain, for the shape of beams and too wide a blur."""
        return GATES.misfit_share + GATES.widened_misfit_share * (1 - self.blur / self.narrow)

    @property
    def step(self) -> float:
        """Sigma of the mean radius that points far apart leave open [m]."""
        if not self.coarse:
            return 0.0
        return (
            GATES.coarse_radius_pitches
            * self.pitch
            / float(np.sqrt(2 * np.pi * self.radius / self.pitch))
        )


@dataclass(frozen=True)
class EdgeFit:
    """The edge of a disc, fitted by least squares."""

    p: Array  #: (6,), centre x, y [m], level outside, gain, ln s, radius R [m]
    covariance: Array  #: (6, 6), covariance of the parameters
    noise: Array  #: (2,), noise of the intensities outside and inside
    jitter: float  #: sigma of a point's place [m]
    use: NDArray[np.bool_]  #: (n,), points used


def light_of(flat: Array, p: Array, slope: Array) -> tuple[Array, Array]:
    """Light of a disc at (n, 2) and derivatives by :class:`EdgeFit`; ``slope`` of the beam."""
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
    """Fit an edge from x, y [m], level outside, gain, the blur going from wide to free."""
    narrow = shape.narrow
    p = np.array([*start, np.log(narrow), shape.radius])
    jitter, noise, use, n = shape.jitter, np.zeros(2), np.ones(len(light), dtype=bool), np.eye(6)
    blurs = GATES.first_blurs_radii
    centre, radius = GATES.centre_step_radii, GATES.radius_step_radii
    limit = np.array(
        [
            centre * shape.radius,
            centre * shape.radius,
            np.inf,
            np.inf,
            GATES.blur_step_log,
            radius * shape.radius,
        ]
    )
    for step in range(GATES.most_steps):
        fixed = step < len(blurs)
        if fixed:
            p[4] = np.log(max(narrow, blurs[step] * shape.radius))
        value, j = light_of(flat, p, shape.slope)
        v, edge, model = light - value, np.abs(j[:, 5]), _model_error(j, p, shape.misfit)
        noise = np.maximum(_noise(flat, v, p, shape.pitch), GATES.least_noise_gain * abs(p[3]))
        own = _noise_at(j, noise)
        near = np.hypot(*(flat - p[:2]).T) < GATES.patch_radii * shape.radius
        if not fixed and step % 3 == 0:
            known = np.hypot(own, model)[use & near]
            jitter = _jitter(v[use & near], edge[use & near], known, shape.jitter)
        total = np.sqrt(own**2 + model**2 + (jitter * edge) ** 2)
        use = near & (
            np.abs(v)
            < np.maximum(
                GATES.trim_sigmas * total, GATES.first_trim_gain * abs(p[3]) if fixed else 0
            )
        )
        if use.sum() < GATES.fewest_points or not noise.min() > 0:
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
        if (
            not np.hypot(*(p[:2] - start[:2])) < shape.radius
            or not p[5] > GATES.least_radius_share * shape.radius
        ):
            return None
        if (
            step > len(blurs) + GATES.settling_steps
            and np.abs(move[:2]).max() < GATES.settled_radii * shape.radius
        ):
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


def _noise(flat: Array, v: Array, p: Array, pitch: float) -> Array:
    """Noise (2,) of light on plain print, outside and inside of the edge."""
    away = np.hypot(*(flat - p[:2]).T)
    gap = min(
        max(GATES.plain_blurs * np.exp(p[4]), GATES.plain_pitches * pitch), GATES.plain_radii * p[5]
    )
    plain = (np.abs(away - p[5]) > gap) & (away < GATES.patch_radii * p[5])
    inside = away < p[5]
    left = v.copy()
    for side in (plain & inside, plain & ~inside):
        left[side] -= np.median(v[side]) if side.any() else 0.0
    plain = plain if plain.any() else np.ones_like(plain)
    return noise_of_colours(left[plain], inside[plain])


def _noise_at(j: Array, noise: Array) -> Array:
    """Noise (n,) of light between outside and inside; j (n, 6) as of :func:`light_of`."""
    return np.asarray(noise[0] + (noise[1] - noise[0]) * j[:, 3])


def _jitter(v: Array, edge: Array, noise: Array, foretold: float) -> float:
    """Likeliest sigma [m] of a point's place, from residuals (n,) and slopes (n,) at the edge."""
    on = edge * foretold > GATES.jitter_telling_noise * noise
    if not on.any():
        return foretold
    multiples = np.array(GATES.jitter_multiples)
    sizes = foretold * multiples
    variance = noise[on] ** 2 + (sizes[:, None] * edge[on]) ** 2
    square = np.minimum(v[on] ** 2, (GATES.trim_sigmas**2) * variance)
    cost = (np.log(variance) + square / variance).sum(axis=1)
    return float(sizes[np.argmin(cost + (np.log(multiples) / GATES.jitter_log_sigma) ** 2)])


def departure(flat: Array, light: Array, fit: EdgeFit, shape: DiscShape) -> tuple[float, float]:
    """Largest departure of the edge from a circle [m], with its sigma.

    It is the amplitude of a wave around the edge: of those with two to four periods, the one that
    exceeds three times its sigma by most.
    """
    value, j = light_of(flat, fit.p, shape.slope)
    d = flat - fit.p[:2]
    turn = np.arctan2(d[:, 1], d[:, 0])
    waves = [f(k * turn) for k in (2, 3, 4) for f in (np.cos, np.sin)]
    a = np.column_stack([j[:, :4], *[j[:, 5] * wave for wave in waves]])
    use = np.hypot(d[:, 0], d[:, 1]) < GATES.patch_radii * shape.radius
    model = _model_error(j, fit.p, shape.misfit)
    w = 1 / (_noise_at(j, fit.noise) ** 2 + model**2 + (fit.jitter * j[:, 5]) ** 2)
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
    worst = int(np.argmax(size - GATES.departure_sigmas * error))
    return float(size[worst]), float(error[worst])


def posterior(flat: Array, light: Array, fit: EdgeFit, shape: DiscShape) -> tuple[Array, Array]:
    """Mean and covariance of the disc's centre over all positions that the points allow.

    As with the edges of checkerboards, the intensity of each point says how far its beam was from
    the edge, or only on which side of it. The posterior of the centre is summed over a grid that
    closes in on it, for several blurs and radii. Scans much coarser than the beam, where any circle
    between two rings of points fits and least squares have no slope, are so treated like dense
    ones.
    """
    d = flat - fit.p[:2]
    away = np.maximum(np.hypot(d[:, 0], d[:, 1]), 1e-9)
    stretch = np.sqrt(1 + (d @ shape.slope / away) ** 2)
    spread = np.sqrt(np.diag(fit.covariance)[:2])
    reach = np.minimum(
        np.maximum(GATES.first_reach_sigmas * spread, GATES.first_reach_pitches * shape.pitch),
        GATES.first_reach_radii * shape.radius,
    )
    # a blur that is hardly predicted is the one that was found; it holds the jitter of places too
    blur = (
        shape.blur if shape.blur_share < GATES.guessed_blur_log_sigma else float(np.exp(fit.p[4]))
    )
    beam = float(np.sqrt(max(blur**2 - 0.25 * shape.jitter**2, 0.25 * blur**2)))
    jitter = max(shape.jitter, fit.jitter)
    tail = GATES.plain_blurs * float(np.hypot(beam, jitter)) * stretch
    near = np.abs(away - fit.p[5]) < tail + 2 * float(reach.max())
    use = np.flatnonzero(near & (away < GATES.patch_radii * shape.radius))
    use = use[:: max(1, len(use) // GATES.telling_points)]
    level, noise = _levels(away, light, fit, float(np.median(tail)))
    level = level[use]
    blurs = [beam * share * stretch[use] for share in BLURS]
    told = [
        LightOfDistance.of(level, np.tile(noise, (len(use), 1)), jitter / (beam * share))
        for share in BLURS
    ]
    sigma = float(np.hypot(shape.radius_sigma, GATES.profile_blurs * beam))
    radii = [
        fit.p[5] + sigma * k - (beam * stretch[use]) ** 2 / (2 * shape.radius)
        for k in GATES.radius_sigmas
    ]
    return _closed_in(flat[use], told, blurs, radii, fit.p[:2], reach)


def _levels(away: Array, light: Array, fit: EdgeFit, clear: float) -> tuple[Array, Array]:
    """Light (n,) as -1 outside and 1 inside, from the plain parts, and its noise (2,) on both."""
    clear = min(clear, GATES.plain_radii * fit.p[5])
    low, high = fit.p[2], fit.p[2] + fit.p[3]
    inner, outer = light[away < fit.p[5] - clear], light[away > fit.p[5] + clear]
    if min(len(inner), len(outer)) >= GATES.plain_points:
        low, high = float(np.median(outer)), float(np.median(inner))
    half = (high - low) / 2
    return (light - low) / half - 1, np.maximum(fit.noise / abs(half), GATES.posterior_noise)


def _closed_in(
    flat: Array,
    told: list[LightOfDistance],
    blurs: list[Array],
    radii: list[Array],
    mean: Array,
    reach: Array,
) -> tuple[Array, Array]:
    """Mean (2,) and covariance (2, 2) over a grid around ``mean`` that closes in."""
    covariance = np.diag(reach**2)
    for _ in range(GATES.grid_rounds):
        nodes = [
            m + np.linspace(-1, 1, GATES.grid_nodes) * r for m, r in zip(mean, reach, strict=True)
        ]
        score = np.empty((len(told), len(radii), GATES.grid_nodes, GATES.grid_nodes))
        for k, table in enumerate(told):
            scale = 1 / (table.step * blurs[k])
            for m, radius in enumerate(radii):
                given = flat, radius, table.log, scale, nodes[0], nodes[1], score[k, m]
                in_threads(_score, len(nodes[0]), *given, least=1 + _EACH // flat.size)
            score[k] -= 0.5 * (np.log(BLURS[k]) / LIGHT.blur_log_sigma) ** 2
        weight = np.exp(score - score.max()).sum(axis=(0, 1))
        weight /= weight.sum()
        mean = np.array([weight.sum(axis=1) @ nodes[0], weight.sum(axis=0) @ nodes[1]])
        a, b = nodes[0] - mean[0], nodes[1] - mean[1]
        cross = a @ weight @ b
        covariance = np.array(
            [[weight.sum(axis=1) @ a**2, cross], [cross, weight.sum(axis=0) @ b**2]]
        )
        step, before = 2 * reach / (GATES.grid_nodes - 1), reach
        reach = np.maximum(GATES.grid_reach_sigmas * np.sqrt(np.diag(covariance)), 1.5 * step)
        if (reach > GATES.grid_shrinks_share * before).all():
            break
    return mean, covariance


@njit(cache=True, nogil=True)
def _score(first, last, flat, radius, log, scale, xs, ys, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of every centre; ``scale`` are steps of the tables in a metre."""
    for i in range(first, last):
        for j in range(len(ys)):
            total = 0.0
            for n in range(len(flat)):
                dx, dy = flat[n, 0] - xs[i], flat[n, 1] - ys[j]
                away = radius[n] - sqrt(dx * dx + dy * dy)
                total += at_distance(log, n, away * scale[n])
            out[i, j] = total
