"""Tests whether the points of a fit are those of a sphere of the radius (method section 6.5).

A body of another size or form leaves residuals that are no noise. Radius, forms of low degree and
the likeness of neighbours are tested against the noise of the points on the body itself, and
against what the spheres may depart from a sphere as they were made.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.sentences import Sentence
from tribrach.statistics import chi2
from tribrach.targets.spheres.fit import GATES as FIT
from tribrach.targets.spheres.fit import SphereFit, fit_sphere, noise_doubt
from tribrach.targets.spheres.forms import second_degree, third_degree


@dataclass(frozen=True)
class ShapeGates:
    """How radius and form of a sphere are tested.

    The levels follow from how many spheres may be lost; the other numbers were chosen on simulated
    bodies (tests/targets/test_sphere_bodies uses other seeds); where a number has a source, it is
    named.
    """

    false_alarm: float = 1e-4  #: probability of refusing a sphere by each of the tests
    #: the radius is known at least to this share, at the level of one in a hundred: flat and bent
    #: things that are seen in small pieces are no spheres
    radius_share: float = 0.1
    one_in_hundred: float = 2.326
    #: a ball of a radius that differs by this share should have been told; the fit says if not
    told_share: float = 0.05
    #: probability of the same where few points do not tell such a ball: they do not tell other
    #: bodies either, and a sphere has to look like one (test_sphere_bodies)
    untold_alarm: float = 5e-3
    #: share of bodies with points like those of a sphere that are balls of another radius, any up
    #: to ``told_share``, before their points turn the odds
    others: float = 0.1
    #: incidence up to which radius and form are looked at [rad]: the rim tells the radius best
    mask_rad: float = float(np.radians(72.0))
    #: the rim is left out as far as the footprint reaches over the outline, in its diameters
    rim_beams: float = 1.0
    #: where neighbours are alike, noise may be more than stated by so many sigmas only (5 %): both
    #: together happen to about one sphere in 10,000 and to most crowns of leaves
    patchy_sigmas: float = 1.645
    #: forms that the points tell worse than this share of the best are left out
    weakest_form: float = 1e-9
    most_lag: int = 6  #: neighbours up to this distance [pixels] are compared
    fewest_pairs: int = 20  #: pairs of neighbours that tell something
    #: likeness of nearest neighbours that counts, in its standard deviations if there were none
    like_sigmas: float = 3.0
    #: where the scanner's own neighbours are known to be alike, what the surface adds is told
    #: beyond this multiple of that
    surface_likeness: float = 2.0


GATES = ShapeGates()


@dataclass(frozen=True)
class Shape:
    """Radius and form of a body by its own points."""

    #: free radius and its sigma [m]
    radius: float
    sigma_radius: float
    #: root mean square of the departure of second and third degree, and what noise alone makes of
    #: it [m]
    form: float
    sigma_form: float
    probability: float  #: of so much form if the body is a sphere
    #: sigma of what the radius may be wrong by if the body is a ball of another one, by the odds
    #: that its points leave [m]
    other_radius: float
    like: float  #: what likeness of neighbours multiplies the variances of means with
    reason: str  #: why the body is none of the wanted spheres; empty if nothing says so
    sentence: str  #: what its points do not tell; empty if they tell enough


def shape_of(
    points: Array,
    pixel: tuple[NDArray[np.int64], NDArray[np.int64]],
    fit: SphereFit,
    *,
    sigma_range: float,
    sigma_angle: float,
    beam: float,
    tolerance: float,
) -> Shape:
    """Test radius and form of a sphere by fitted points and those around, with pixels."""
    rim = np.arcsin(max(1 - GATES.rim_beams * beam / fit.radius, 0.5))
    try:
        free = fit_sphere(
            points,
            fit.center,
            fit.radius,
            sigma_range=sigma_range,
            sigma_angle=sigma_angle,
            free_radius=True,
            mask=float(np.clip(rim, FIT.mask_rad, GATES.mask_rad)),
        )
    except InputError:
        return Shape(
            fit.radius, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, "its points do not tell its radius", ""
        )
    on = free.inliers
    departure = _Departure(points[on], free)
    seen = likeness(departure.rest, pixel[0][on], pixel[1][on])
    like = max(seen, fit.alike)
    sigma = free.sigma_radius * like**0.5
    off = free.radius - fit.radius
    form, sigma_form, probability = departure.tested(tolerance, like)
    known = float(np.hypot(sigma, tolerance))
    limit = float(chi2.ppf(1 - GATES.false_alarm, 1)) ** 0.5 * known
    unsure = GATES.one_in_hundred * sigma
    level, untold = GATES.false_alarm, limit + unsure > GATES.told_share * fit.radius
    if untold and on.sum() < FIT.few_points:
        level = GATES.untold_alarm
        limit = float(chi2.ppf(1 - level, 1)) ** 0.5 * known
    reason, sentence = "", ""
    if unsure > GATES.radius_share * fit.radius:
        reason = Sentence(
            "its points tell its radius to {sigma:mm1} only: too few or too noisy for "
            "telling it from other bodies",
            sigma=sigma,
        )
    elif abs(off) > min(limit, GATES.radius_share * fit.radius):
        reason = Sentence(
            "its own radius is {free.radius:mm1}, known to {sigma:mm2}, not {fit.radius:mm1}",
            free=free,
            sigma=sigma,
            fit=fit,
        )
    elif probability < level:
        reason = Sentence(
            "its surface departs from a sphere by {form:mm1} (root mean square) where noise makes "
            "{sigma:mm1}, beyond a limit of {limit} for the probability of as much by chance",
            form=form,
            sigma=sigma_form,
            limit=f"{level:.0e}",
        )
    elif seen > _surface(fit.alike) and fit.s0 > (
        most := np.exp(GATES.patchy_sigmas * noise_doubt(int(on.sum())) / 2)
    ):
        reason = Sentence(
            "residuals of {fit.rms:mm1} (root mean square) are {fit.s0:1} times the noise, "
            "limit {most:1} times, and alike among neighbours: a rough surface or leaves",
            fit=fit,
            most=most,
        )
    elif untold:
        sentence = Sentence(
            "its points tell its radius to {sigma:mm1}: a ball with one {limit:mm0} off "
            "could pass for it",
            sigma=sigma,
            limit=limit + unsure,
        )
    other = _other_radius(off, sigma, tolerance, fit.radius)
    return Shape(free.radius, sigma, form, sigma_form, probability, other, like, reason, sentence)


def _other_radius(off: float, sigma: float, tolerance: float, radius: float) -> float:
    """RMS error [m] of the radius, with the odds of another ball.

    The free radius is off by ``off`` with ``sigma``. Odds of another ball are the ratio of the
    probability densities of that, times the odds before.
    """
    known = float(np.hypot(sigma, tolerance))
    flat = 1 / (2 * GATES.told_share * radius)
    own = float(np.exp(-((off / known) ** 2) / 2)) / (known * (2 * np.pi) ** 0.5)
    share = GATES.others * flat / (GATES.others * flat + (1 - GATES.others) * own)
    return float(np.sqrt(share * (off**2 + sigma**2)))


def _surface(known: float) -> float:
    """Likeness beyond which neighbours are more alike than the scanner makes them."""
    return 1.0 if known <= 1 else GATES.surface_likeness * known


class _Departure:
    """What the residuals of a free fit show of forms of degrees two and three.

    With whitened residuals r, columns X of centre and radius, Z of the forms and the projector P
    that takes X out, P Z spans k directions in which r is noise of variance one. A departure of the
    root mean square t over the points adds ``t^2 sum(1/s_i^2)/k`` to each, with the sigmas s of the
    points along the normal.
    """

    def __init__(self, points: Array, free: SphereFit) -> None:
        on = free.inliers
        # where the beams meet the sphere: with measured points forms would follow their noise
        beams = points / np.linalg.norm(points, axis=1, keepdims=True)
        n = (points - beams * free.residuals[on][:, None] - free.center) / free.radius
        n = n / np.linalg.norm(n, axis=1, keepdims=True)
        tangent = np.tan(free.incidence[on])
        sigma = np.hypot(free.noise[0], free.noise[1] * tangent)
        # a surface that stands out is met earlier, by more where the beam is oblique
        self._scale = np.cos(free.incidence[on]) * sigma
        q, _ = np.linalg.qr(np.column_stack([np.ones(len(n)), n]) / self._scale[:, None])
        z = np.column_stack([second_degree(n), third_degree(n)]) / self._scale[:, None]
        z = z - q @ (q.T @ z)
        residuals = -free.residuals[on] / sigma
        residuals = residuals - q @ (q.T @ residuals)
        values, axes = np.linalg.eigh(z.T @ z)
        strong = values > GATES.weakest_form * max(values[-1], 1e-300)
        self._u = z @ axes[:, strong] / np.sqrt(values[strong])
        self._along = self._u.T @ residuals
        #: residuals over their sigmas without centre, radius and forms
        self.rest = residuals - self._u @ self._along

    def tested(self, tolerance: float, like: float) -> tuple[float, float, float]:
        """Root mean square [m] of the forms, what noise makes of it [m], and its probability."""
        allowed = tolerance**2 * float(np.sum(self._scale**-2)) / self._u.shape[1]
        total = float(np.sum(self._along**2)) / (like + allowed)
        shift = (self._u @ self._along) * self._scale
        noise = np.sqrt(like * np.mean(np.sum((self._u * self._scale[:, None]) ** 2, axis=1)))
        rms = float(np.sqrt(np.mean(shift**2)))
        return rms, float(noise), float(chi2.sf(total, self._u.shape[1]))


def likeness(residuals: Array, row: NDArray[np.int64], column: NDArray[np.int64]) -> float:
    """How alike residuals of neighbouring pixels are, as far as means of them go.

    Correlations are summed up to the first that is below its standard deviation.
    """
    image = np.full((int(np.ptp(row)) + 1, int(np.ptp(column)) + 1), np.nan)
    image[row - row.min(), column - column.min()] = residuals / max(float(np.std(residuals)), 1e-12)
    factor = 1.0
    for grid in (image, image.T):
        total = 1.0
        for lag in range(1, min(GATES.most_lag, grid.shape[1] - 1) + 1):
            pairs = grid[:, lag:] * grid[:, :-lag]
            pairs = pairs[np.isfinite(pairs)]
            if len(pairs) < GATES.fewest_pairs:
                break
            correlation, sigma = float(pairs.mean()), len(pairs) ** -0.5
            if correlation < (GATES.like_sigmas if lag == 1 else 1.0) * sigma:
                break
            total += 2 * correlation
        factor *= total
    return factor
