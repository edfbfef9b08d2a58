"""Laws of the noise of a scanner, estimated from the planar patches of its scans.

Method section 5.9. Each patch gives a variance with its degrees of freedom. Their parts are told
apart by what they depend on: noise of the range by the intensity (``a I^b + c``; Wujanz et al.
2018, Schmitz et al. 2019) or by the range, noise across the beam by the slope of the surface.
Patches of rough or bent surfaces have more than noise and are set aside, from the smooth ones
upwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.answers import Number, Result
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.observed_noise import ObservedNoise
from tribrach.statistics import chi2

__all__ = [
    "FittedNoise",
    "LastingEffect",
    "NoiseClass",
    "fit_noise",
    "held_noise",
    "noise_classes",
]

#: fewer patches tell no law
_FEWEST = 30
#: patches whose variance is beyond this probability of the law's are rough
_ROUGH = 0.995
#: the quantile of the variances of a class that the search for the smooth ones begins with, ...
_SMOOTH = 0.3
#: ... and patches of a class of intensity or range, which is parted by incidence
_CLASS, _SLANTS = 100, 2
#: classes of intensity that tell how much it spreads over a patch of one material
_CLASSES = 8
#: rounds in which patches are taken or set aside, and share of them that ends it
_ROUNDS, _SETTLED = 25, 5e-4
#: steps of the search and halvings of a step, and the gain in the logarithm of the likelihood
#: that ends it
_STEPS, _HALVINGS, _DONE = 60, 12, 1e-5
#: squared tangents of the incidence of surfaces that count as seen straight and slantwise: 27 and
#: 35 degrees
_FLAT, _STEEP = 0.25, 0.5
#: patches that tell which start is the best
_GLANCE = 1500
#: a patch is of one material where its intensity spreads less than so many times the usual
_PATTERN = 3.0
#: the intensity matters where a law of it is better at this level
_MATTERS = 1e-3
#: fewer patches do not tell how much they scatter
_FEW_PATCHES = 10
#: steepest law that is looked for
_STEEPEST = -8.0
#: share of the points beyond each end of the intensities of a law
_ENDS = 0.005
#: a variance of ranges that is never undercut [m^2]
_LEAST = 1e-14
#: exponents that the search starts from
_STARTS = (-0.4, -1.0, -2.5)

By = Literal["intensity", "range", "incidence"]


@dataclass(frozen=True)
class NoiseClass:
    """Points of one class: noise that they show, and that is stated for them."""

    #: of the class, in the file's unit of intensity, metres or radians
    low: float
    high: float
    #: in it
    patches: int
    points: int
    #: standard deviations along the beam [m]: roots of the mean squares
    observed: float
    stated: float
    #: the same of what is stated, each variance weighted with its own inverse [m]
    weighted: float
    #: squared residuals over stated variances, by the degrees of freedom: 1 where both agree
    chi2_dof: float
    #: degrees of freedom that this figure is worth by its scatter from patch to patch, never more
    #: than there are: fewer where points of overlapping beams share errors, or where the patches
    #: of a class are not alike. Zero with fewer than ten patches, whose scatter nobody knows.
    effective: float = 0.0

    @property
    def factor(self) -> float:
        """Standard deviations observed over those stated, in means of the same weights."""
        return float(np.sqrt(self.chi2_dof))

    @property
    def weighted_observed(self) -> float:
        """Root of the mean square of the residuals in the weights of ``weighted`` [m].

        Over ``weighted`` it is the factor (method section 5.9).
        """
        return self.factor * self.weighted

    def interval(self, level: float = 0.95) -> tuple[float, float] | None:
        """Where the factor lies with this probability, by chi-square; None if nobody knows."""
        if not self.effective > 0:
            return None
        ends = chi2.ppf([(1 + level) / 2, (1 - level) / 2], self.effective)
        low, high = np.sqrt(self.chi2_dof * self.effective / np.asarray(ends, dtype=float))
        return float(low), float(high)


@dataclass(frozen=True)
class LastingEffect(Result):
    """What a cause still does after the law: share by which sigma grows, and its sigma."""

    #: at twice the range, or at 60 degrees of incidence rather than straight on
    change: Number
    sigma: Number

    @property
    def t(self) -> float:
        """Change over its standard deviation."""
        return self.change / self.sigma if self.sigma > 0 else 0.0


@dataclass(frozen=True, eq=False)
class FittedNoise:
    """The noise of a scanner by its own scans."""

    #: what it was estimated from, all patches
    observed: ObservedNoise
    #: (patches,), patches that the laws were taken from; the others are rough, bent or of several
    #: materials
    kept: NDArray[np.bool_]
    #: of the intensity; None where it is unknown, takes one value, or does not matter
    law: RangeLaw | None
    #: (3, 3), of a [m], b and c [m]; NaN where a figure is at its limit
    law_covariance: Array
    #: law of the range, [m] and [m/m], divided by the cosine of the incidence
    range: float
    range_scale: float
    #: (2, 2), of these; NaN where a figure is at its limit
    range_covariance: Array
    #: noise of the angles [rad] that slanted surfaces show
    horizontal: float
    vertical: float
    #: (2,), of these [rad]; infinite where surfaces are not seen both straight and slantwise, so
    #: that all noise is taken for that of the range
    angle_sigmas: Array
    #: what the beam's place is uncertain by at any range [m], as a footprint is, and its sigma
    place: float
    place_sigma: float
    #: (3, 3), of the variances of place [m^2], horizontal and vertical angle [rad^2], with what
    #: the noise of ranges may take of them; infinite where nothing parts these
    across_covariance: Array
    #: negative logarithm of the likelihood, for comparison with other laws of these patches
    cost: float
    #: how much wider than chance the variances of the patches kept scatter about the law: the
    #: variance factor of their logarithms, 1 where there is nothing but noise
    spread: float
    #: what is left of both after the law
    by_range: LastingEffect
    by_incidence: LastingEffect
    #: why there is no law of the intensity, "" with one
    why: str = ""
    #: whose footprint was held; place and angles are then what is left beside it
    held: Beam | None = None

    @property
    def patches(self) -> int:
        """Patches kept."""
        return int(self.kept.sum())

    @property
    def points(self) -> int:
        """Points on patches kept."""
        return int(self.kept[self.observed.patch].sum())

    @property
    def smooth(self) -> ObservedNoise:
        """The patches kept."""
        return self.observed.of_patches(self.kept)

    def law_sigma(self, intensity: Array) -> Array:
        """Standard deviations (n,) [m] of the law's values at intensities (n,)."""
        if self.law is None:
            return np.full(np.shape(intensity), np.nan)
        light = np.clip(intensity, self.law.weakest, self.law.high)
        power = light**self.law.b
        rows = np.stack([power, self.law.a * power * np.log(light), np.ones_like(power)], axis=1)
        known = np.isfinite(np.diag(self.law_covariance))
        inner = self.law_covariance[np.ix_(known, known)]
        part = rows[:, known]
        variance: Array = np.einsum("ni,ij,nj->n", part, inner, part)
        return np.sqrt(np.maximum(variance, 0.0))

    def noise(self) -> ScanNoise:
        """The noise of single points that the scans show.

        With the footprint that was held, else with one of the size seen, which stays the same at
        any range: the divergence is in the angles then.
        """
        beam = Beam(4 * self.place) if self.held is None else self.held
        return ScanNoise(
            self.range,
            self.range_scale,
            self.horizontal,
            self.vertical,
            beam.exit,
            beam.divergence,
            beam_cone=beam.cone,
            law=self.law,
        )

    @property
    def typical_range(self) -> float:
        """Range [m] at which the scans tell most of the noise across the beam."""
        seen = self.smooth
        weight = ((seen.slope * seen.range[:, None]) ** 2).sum(axis=1)
        if not weight.sum() > 0:
            return float(np.median(seen.range))
        return float(np.average(seen.range, weights=weight))

    def across_error(self, length: Array) -> Array:
        """Relative standard deviations (n,) of the noise across the beam at ranges (n,) [m].

        Of ``s_p^2 + (s_H^2 + s_V^2)/2 rho^2``, halved, since that is a variance.
        """
        rho = np.asarray(length, dtype=float)
        if not np.isfinite(self.across_covariance).all():
            return np.full(rho.shape, np.inf)
        rows = np.stack([np.ones_like(rho), rho**2 / 2, rho**2 / 2], axis=1)
        size = rows @ np.array([self.place, self.horizontal, self.vertical]) ** 2
        variance = np.einsum("ni,ij,nj->n", rows, self.across_covariance, rows)
        error: Array = np.sqrt(np.maximum(variance, 0.0)) / (2 * np.maximum(size, 1e-18))
        return error

    @property
    def angle(self) -> tuple[float, float]:
        """Noise of an angle [rad], the root mean square of both, and its sigma [rad]."""
        square = (self.horizontal**2 + self.vertical**2) / 2
        half = np.array([0.0, 0.5, 0.5])
        if not np.isfinite(self.across_covariance).all():
            return float(np.sqrt(square)), np.inf
        error = float(np.sqrt(max(half @ self.across_covariance @ half, 0.0)))
        size = float(np.sqrt(square))
        return size, error / (2 * size) if size > 0 else float(np.sqrt(error))

    @property
    def across(self) -> float:
        """Standard deviation [rad] across the beam at the typical range: angles and footprint."""
        angles = (self.horizontal**2 + self.vertical**2) / 2
        return float(np.sqrt(angles + (self.place / self.typical_range) ** 2))


def noise_classes(
    observed: ObservedNoise, stated: Array, by: By, most: int = 8
) -> list[NoiseClass]:
    """Compare noise stated and observed, class by class.

    Parameters
    ----------
    observed
        Points on planes.
    stated : array (m,)
        Variances along the beam [m^2] that are stated for these points.
    by
        What the points are put into classes by: of about as many patches each, but for the
        incidence, whose classes end at 15, 30, 45, 60 and 75 degrees.
    most
        Number of classes at most.
    """
    if not len(observed) or (by == "intensity" and not np.isfinite(observed.intensity).all()):
        return []
    values = {
        "intensity": observed.intensity,
        "range": observed.range,
        "incidence": np.arccos(np.minimum(observed.cosine, 1.0)),
    }[by]
    key = observed.mean(values)
    if by == "incidence":
        ends = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 90.0])
    else:
        ends = np.unique(np.quantile(key, np.linspace(0, 1, most + 1)))
    number = np.clip(np.searchsorted(ends, key, side="right") - 1, 0, max(len(ends) - 2, 0))
    out = []
    free, sums = observed.redundancies, np.bincount(observed.patch, observed.residual**2)
    reduced = np.bincount(observed.patch, observed.residual**2 / stated)
    expected = np.bincount(observed.patch, stated * observed.redundancy)
    weights = np.bincount(observed.patch, observed.redundancy / stated)
    sizes = np.bincount(observed.patch)
    for k in np.unique(number):
        mine = number == k
        dof = float(free[mine].sum())
        out.append(
            NoiseClass(
                low=float(key[mine].min()),
                high=float(key[mine].max()),
                patches=int(mine.sum()),
                points=int(sizes[mine].sum()),
                observed=float(np.sqrt(sums[mine].sum() / dof)),
                stated=float(np.sqrt(expected[mine].sum() / dof)),
                weighted=float(np.sqrt(dof / weights[mine].sum())),
                chi2_dof=float(reduced[mine].sum() / dof),
                effective=_effective(reduced[mine], free[mine]),
            )
        )
    return out


def _effective(squares: Array, free: Array) -> float:
    """Degrees of freedom of the mean of squares (k,) of patches that have so many (k,) each."""
    if len(squares) < _FEW_PATCHES:
        return 0.0
    mean = squares.sum() / free.sum()
    scatter = ((squares - mean * free) ** 2).sum() * len(free) / (len(free) - 1)
    variance = scatter / free.sum() ** 2
    return float(min(free.sum(), 2 * mean**2 / variance)) if variance > 0 else float(free.sum())


@dataclass(frozen=True, eq=False)
class _Patches:
    """Variances of patches (k,) and what they may depend on."""

    #: along the beam [m^2], with degrees of freedom
    variance: Array
    free: Array
    #: means over the patch
    light: Array
    range: Array
    cosine: Array
    #: (k, 3), what a variance of the place [m^2] and of both angles [rad^2] add
    across: Array
    #: variance that is known, of rounding [m^2]
    known: Array
    #: variance over that of a law from which on a patch is rough
    limit: Array
    #: mean of the variances up to there, over that of the law
    below: Array

    @classmethod
    def of(cls, observed: ObservedNoise) -> _Patches:
        """Means over the points of each patch."""
        slanted = (observed.slope * observed.range[:, None]) ** 2
        across = [
            observed.mean((observed.slope**2).sum(axis=1)),
            observed.mean(slanted[:, 0]),
            observed.mean(slanted[:, 1]),
        ]
        free = observed.redundancies
        limit = chi2.ppf(_ROUGH, free)
        return cls(
            np.maximum(observed.variances, 1e-18),
            free,
            observed.mean(observed.intensity),
            observed.mean(observed.range),
            observed.mean(observed.cosine),
            np.stack(across, axis=1),
            observed.mean(observed.rounding),
            limit / free,
            (1 - chi2.sf(limit, free + 2)) / _ROUGH,
        )

    @property
    def slanted(self) -> bool:
        """True if there are surfaces seen straight and slantwise: range and angles part there."""
        tangent = self.across[:, 0]
        flat, steep = np.count_nonzero(tangent < _FLAT), np.count_nonzero(tangent > _STEEP)
        return bool(min(flat, steep) >= _FEWEST / 2)

    @property
    def scale(self) -> float:
        """A typical standard deviation [m]."""
        return float(np.sqrt(np.median(self.variance)))

    @property
    def middle(self) -> float:
        """A typical range [m]."""
        return float(np.median(self.range))

    def part(self, at: NDArray[np.bool_]) -> _Patches:
        """Some of them, by a mask (k,)."""
        return _Patches(*(getattr(self, item.name)[at] for item in fields(self)))


#: variances (k,) of the range and their derivatives (u, k) for patches at parameters (u,)
Along = Callable[[_Patches, Array], tuple[Array, Array]]


def fit_noise(observed: ObservedNoise) -> FittedNoise:
    """Estimate the laws of the noise of a scanner.

    Notes
    -----
    Maximum likelihood of variances that are chi-square distributed, trimmed on the side of the
    rough ones; the trimmed mean of a chi-square variable is known and taken into account (method
    section 5.9).
    """
    if observed.patches < _FEWEST:
        raise InputError(
            f"the scans show {observed.patches} planar patches, too few for the noise of a scanner",
            cure=f"it takes {_FEWEST} at least, of walls, floors or facades at different ranges",
        )
    patches = _Patches.of(observed)
    scale = patches.scale
    plain = _of_range(scale, patches.middle)
    why = _no_law(observed, patches)
    if not why:
        even = _one_material(observed, patches)
        middle = float(np.exp(np.median(np.log(patches.light[even]))))
        lawful = [_of_intensity(scale, middle, start) for start in _STARTS]
        fit = _trimmed(patches, lawful, even, patches.light, scale)
        flat = _solve(patches, _constant(scale), fit.kept, scale)
        if chi2.sf(2 * (flat.cost - fit.cost) / fit.spread, 2) < _MATTERS:
            by_range = _solve(patches, plain, fit.kept, scale)
            return _fitted(observed, patches, fit, by_range, _law(observed, patches, fit, middle))
        why = "the noise does not change with the intensity"
    even = np.ones(len(patches.variance), dtype=bool)
    fit = _trimmed(patches, [plain], even, patches.range, scale)
    return _fitted(observed, patches, fit, fit, None, why)


def held_noise(fitted: FittedNoise, beam: Beam, angle: float | None = None) -> FittedNoise:
    """Estimate the laws again with the footprint of a beam, from the patches kept before.

    Parameters
    ----------
    fitted
        Laws without it.
    beam
        Whose footprint, ``d(rho)/4`` across the beam, is held.
    angle
        Noise of both angles [rad] that is held as well, estimated if None.
    """
    observed, model = fitted.observed, fitted.law
    plain = _Patches.of(observed)
    scale, middle = plain.scale, plain.middle
    spot = (beam.diameter(observed.range) / 4) ** 2 * (observed.slope**2).sum(axis=1)
    angles = 0.0 if angle is None else angle**2 * plain.across[:, 1:].sum(axis=1)
    patches = replace(plain, known=plain.known + observed.mean(spot) + angles)
    estimated = (False, angle is None, angle is None)
    of_range = _solve(patches, _of_range(scale, middle), fitted.kept, scale, estimated)
    if model is None:
        found = _fitted(observed, patches, of_range, of_range, None, fitted.why)
    else:
        light = float(np.exp(np.median(np.log(patches.light[fitted.kept]))))
        starts = [_of_intensity(scale, light, start) for start in (model.b, *_STARTS)]
        fit = min(
            (_solve(patches, start, fitted.kept, scale, estimated) for start in starts),
            key=lambda one: one.cost,
        )
        found = _fitted(observed, patches, fit, of_range, _law(observed, patches, fit, light))
    if angle is not None:
        found = replace(found, horizontal=angle, vertical=angle)
    return replace(found, held=beam)


def _no_law(observed: ObservedNoise, patches: _Patches) -> str:
    """Why there can be no law of the intensity, "" if there can."""
    if not np.isfinite(observed.intensity).all():
        return "the scans have no intensities"
    if not observed.intense:
        return "all intensities are the same"
    if observed.intensity.min() <= 0:
        return (
            "there are intensities of zero or below, which have no power: decibels, or a scale "
            "with an offset"
        )
    return ""


def _one_material(observed: ObservedNoise, patches: _Patches) -> NDArray[np.bool_]:
    """Patches (k,) over which the intensity spreads no more than it does on others of its size."""
    departure = observed.intensity - patches.light[observed.patch]
    spread = np.sqrt(observed.mean(departure**2))
    order = np.argsort(patches.light, kind="stable")
    usual = np.empty(len(order))
    for part in np.array_split(order, min(_CLASSES, len(order))):
        usual[part] = np.median(spread[part])
    return np.asarray(spread <= _PATTERN * usual)


@dataclass(frozen=True, eq=False)
class _Model:
    """A law of the range's noise with parameters (u,): how it is computed, start, bounds.

    The start may be followed by the three of the noise across the beam.
    """

    along: Along
    start: Array
    bounds: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class _Solved:
    """A law that was fitted."""

    #: of the range, and after them the variances of place and angles
    model: _Model
    parameters: Array
    #: of the parameters, NaN where one is at its bound
    covariance: Array
    #: (3,), variances of place and angles that would not be noticed, one sigma each
    least: Array
    #: (3, 3), covariance of these variances with nothing at its bound
    across: Array
    #: of the patches by the law, the negative logarithm of the likelihood, the variance factor,
    #: and the patches that were used
    variance: Array
    cost: float
    spread: float
    kept: NDArray[np.bool_]


def _of_intensity(scale: float, middle: float, start: float) -> _Model:
    """``a I^b + c`` in units of ``scale``, with the intensity over its middle."""

    def along(patches: _Patches, x: Array) -> tuple[Array, Array]:
        log = np.log(patches.light / middle)
        power = np.exp(np.clip(x[1] * log, -50, 50))
        sigma = (x[0] * power + x[2]) * scale
        twice = 2 * scale * sigma
        return sigma**2, np.array([twice * power, twice * x[0] * power * log, twice])

    return _Model(along, np.array([0.5, start, 0.3]), ((0, 1e3), (_STEEPEST, 0), (0, 1e3)))


def _constant(scale: float) -> _Model:
    """One sigma for all."""

    def along(patches: _Patches, x: Array) -> tuple[Array, Array]:
        ones = np.ones((1, len(patches.range)))
        return (x[0] * scale) ** 2 * ones[0], 2 * x[0] * scale**2 * ones

    return _Model(along, np.array([0.8]), ((1e-6, 1e3),))


def _of_range(scale: float, middle: float) -> _Model:
    """``(s_0 + s_ppm rho)/cos I`` in units of ``scale``, the second at the middle range."""

    def along(patches: _Patches, x: Array) -> tuple[Array, Array]:
        share = patches.range / middle
        sigma = (x[0] + x[1] * share) * scale / patches.cosine
        twice = 2 * scale * sigma / patches.cosine
        return sigma**2, np.array([twice, twice * share])

    return _Model(along, np.array([0.6, 0.2]), ((0, 1e3), (0, 1e3)))


def _trimmed(
    patches: _Patches, models: list[_Model], even: NDArray[np.bool_], key: Array, scale: float
) -> _Solved:
    """Fit to the smooth patches: from the smoothest of each class on, as long as others join."""
    reference = _smooth_level(patches, key, even)
    kept = even & (patches.variance <= patches.limit * reference)
    some = np.zeros_like(kept)
    at = np.flatnonzero(kept)
    some[at[:: max(1, len(at) // _GLANCE)]] = True
    fit = _solve(patches, _best(patches, models, some, scale).model, kept, scale)
    for _ in range(_ROUNDS):
        now = even & (patches.variance <= patches.limit * fit.variance)
        if now.sum() < _FEWEST or (now != fit.kept).mean() < _SETTLED:
            break
        fit = _solve(patches, fit.model, now, scale)
    return fit


def _smooth_level(patches: _Patches, key: Array, even: NDArray[np.bool_]) -> Array:
    """Variances (k,) of the smooth patches in the class of each, by a low quantile."""
    out = np.full(len(key), np.nan)
    at = np.flatnonzero(even)
    ordered = at[np.argsort(key[at], kind="stable")]
    for part in np.array_split(ordered, max(1, len(at) // _CLASS)):
        halves = _SLANTS if len(part) >= _CLASS // 2 else 1
        slanted = part[np.argsort(-patches.cosine[part], kind="stable")]
        for some in np.array_split(slanted, halves):
            expected = chi2.ppf(_SMOOTH, patches.free[some]) / patches.free[some]
            out[some] = np.quantile(patches.variance[some] / expected, _SMOOTH)
    return out


def _best(
    patches: _Patches, models: list[_Model], kept: NDArray[np.bool_], scale: float
) -> _Solved:
    """The likeliest of some starts."""
    return min((_solve(patches, m, kept, scale) for m in models), key=lambda fit: fit.cost)


def _solve(
    patches: _Patches,
    model: _Model,
    kept: NDArray[np.bool_],
    scale: float,
    estimated: tuple[bool, bool, bool] = (True, True, True),
) -> _Solved:
    """Maximum likelihood of variances with chi-square distribution, trimmed above.

    By Fisher's scoring within the bounds: the likelihood is a valley along which a, b and c go
    together, and searches by gradients stop on its slopes. Of place and angles only those that are
    ``estimated`` may be other than zero.
    """
    mine, u = patches.part(kept), len(model.bounds)
    seen, weight = mine.variance / mine.below, mine.free / 2
    unit = scale**2 / np.maximum(np.mean(mine.across, axis=0), 1e-12)
    most = 1e4 if mine.slanted else 0.0
    low, high = np.array([*model.bounds, *[(0.0, most * one) for one in estimated]]).T
    across = (mine.across * unit).T

    def split(some: _Patches, slanted: Array, x: Array) -> tuple[Array, Array]:
        along, rows = model.along(some, x[:u])
        return along + x[u:] @ slanted + some.known + _LEAST, np.concatenate([rows, slanted])

    def cost(x: Array) -> tuple[float, Array, Array]:
        whole, rows = split(mine, across, x)
        return float(weight @ (np.log(whole / scale**2) + seen / whole)), whole, rows / whole

    x = model.start if len(model.start) > u else np.append(model.start, [0.05] * 3)
    x = np.clip(x, low, high)
    value, whole, relative = cost(x)
    for _ in range(_STEPS):
        downhill = relative @ (weight * (seen / whole - 1))
        free = ((x > low) | (downhill > 0)) & ((x < high) | (downhill < 0))
        step = np.zeros(len(x))
        step[free] = _inverse(relative[free], weight) @ downhill[free]
        before = value
        for halved in 0.5 ** np.arange(_HALVINGS):
            tried = np.clip(x + halved * step, low, high)
            value, whole, relative = cost(tried)
            if value <= before:
                x = tried
                break
        else:
            value, whole, relative = cost(x)
        if before - value < _DONE:
            break
    off = max(len(whole) - len(x), 1)
    spread = max(1.0, float(weight @ (seen / whole - 1) ** 2) / off)
    inside = (x > low) & (x < high)
    covariance = np.full((len(x), len(x)), np.nan)
    covariance[np.ix_(inside, inside)] = spread * _inverse(relative[inside], weight)
    back = np.append(np.ones(u), unit)
    some = np.append(np.ones(u, dtype=bool), estimated)
    whole_inverse = np.zeros((len(x), len(x)))
    whole_inverse[np.ix_(some, some)] = spread * _inverse(relative[some], weight)
    sizes = np.outer(unit, unit)
    told = relative[u:] ** 2 @ weight
    return _Solved(
        model=replace(model, start=x),
        parameters=x * back,
        covariance=covariance * np.outer(back, back),
        least=np.sqrt(spread / np.maximum(told, 1e-12)) * unit if mine.slanted else unit * np.inf,
        across=whole_inverse[u:, u:] * sizes if mine.slanted else np.full((3, 3), np.inf),
        variance=split(patches, (patches.across * unit).T, x)[0],
        cost=value,
        spread=spread,
        kept=kept,
    )


def _inverse(rows: Array, weight: Array) -> Array:
    """Inverse (u, u) of the information of rows (u, k)."""
    normal = (rows * weight) @ rows.T
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    inverse = np.linalg.pinv(normal / np.outer(size, size), rcond=1e-12, hermitian=True)
    out: Array = inverse / np.outer(size, size)
    return out


def _law(
    observed: ObservedNoise, patches: _Patches, fit: _Solved, middle: float
) -> tuple[RangeLaw, Array]:
    """The law of the intensity and the covariance (3, 3) of its figures, NaN at their limits."""
    seen = observed.of_patches(fit.kept)
    low, high = (float(q) for q in np.quantile(seen.intensity, [_ENDS, 1 - _ENDS]))
    share, b, rest = (float(x) for x in fit.model.start[:3])
    known = fit.covariance[:3, :3]
    scale = patches.scale
    unit = scale * middle**-b
    jacobian = np.array([[unit, -share * unit * np.log(middle), 0], [0, 1, 0], [0, 0, scale]])
    covariance = jacobian @ np.nan_to_num(known) @ jacobian.T
    limit = np.isnan(np.diag(known))
    covariance[limit] = covariance[:, limit] = np.nan
    return RangeLaw(share * unit, b, rest * scale, low, high), covariance


def _fitted(
    observed: ObservedNoise,
    patches: _Patches,
    fit: _Solved,
    by_range: _Solved,
    lawful: tuple[RangeLaw, Array] | None,
    why: str = "",
) -> FittedNoise:
    """All of it in metres and radians."""
    unit = patches.scale * np.array([1.0, 1 / patches.middle])
    place, *angles = (float(np.sqrt(x)) for x in fit.parameters[-3:])
    sigmas = []
    for size, variance, least in zip(
        (place, *angles), np.diag(fit.covariance)[-3:], fit.least, strict=True
    ):
        free = size > 0 and np.isfinite(variance)
        sigmas.append(float(np.sqrt(variance) / (2 * size)) if free else float(np.sqrt(least)))
    away, flat = _effects(patches, fit)
    law, covariance = lawful or (None, np.full((3, 3), np.nan))
    return FittedNoise(
        observed=observed,
        kept=fit.kept,
        law=law,
        law_covariance=covariance,
        range=float(by_range.model.start[0] * unit[0]),
        range_scale=float(by_range.model.start[1] * unit[1]),
        range_covariance=by_range.covariance[:2, :2] * np.outer(unit, unit),
        horizontal=angles[0],
        vertical=angles[1],
        angle_sigmas=np.array(sigmas[1:]),
        place=place,
        place_sigma=sigmas[0],
        across_covariance=fit.across,
        cost=fit.cost,
        spread=fit.spread,
        by_range=away,
        by_incidence=flat,
        why=why,
    )


def _effects(patches: _Patches, fit: _Solved) -> tuple[LastingEffect, LastingEffect]:
    """What the logarithm of the variance still does with range and incidence, both at once."""
    kept = fit.kept
    ratio = patches.variance[kept] / fit.variance[kept] - 1
    weight = patches.free[kept] / 2
    # both columns are 1 at twice the range and at 60 degrees
    causes = np.log2(np.stack([patches.range[kept], 1 / patches.cosine[kept]], axis=1))
    table = np.column_stack([np.ones(len(ratio)), causes])
    normal = table.T @ (weight[:, None] * table)
    inverse = np.linalg.pinv(normal, hermitian=True)
    slope = inverse @ (table.T @ (weight * ratio)) / 2
    sigma = np.sqrt(np.maximum(fit.spread * np.diag(inverse), 0)) / 2
    return (
        LastingEffect(float(slope[1]), float(sigma[1])),
        LastingEffect(float(slope[2]), float(sigma[2])),
    )
