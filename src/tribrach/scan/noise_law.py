"""Laws of the noise of a scanner, estimated from the planar patches of its scans.

Method section 5.9. Each patch gives a variance with its degrees of freedom. Their parts are told
apart by what they depend on: noise of the range by the intensity (``a I^b + c``; Wujanz et al.
2018, Schmitz et al. 2019) or by the range, noise across the beam by the slope of the surface.
Patches of rough or bent surfaces have more than noise and are set aside, from the smooth ones
upwards. Where even the smoothest patches of a class contradict the law, the law is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.answers import Number, Result
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.observed_noise import ObservedNoise
from tribrach.statistics import chi2, norm

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
#: share of the patches that edges and rough surfaces are in a scan at most
_MANY = 0.2
#: fewer patches do not tell how much they scatter
_FEW_PATCHES = 10
#: steepest law that is looked for
_STEEPEST = -8.0
#: share of the points beyond each end of the intensities of a law
_ENDS = 0.005
#: a variance of ranges that is never undercut [m^2]
_LEAST = 1e-14
#: the quantile of the variances of a class that is held against the law whatever is rough there,
#: the factor of sigmas beyond which it contradicts, and the fewest patches that tell
_SMOOTHEST, _BEYOND, _TELLING = 0.1, 1.2, 40
#: the factor of sigmas beyond which smooth patches contradict, and the probability of all limits
_APART, _ALL = 1.1, 0.95
#: knots of the term that a power law is multiplied with, and limits of its factors
_KNOTS, _FACTORS = 16, (0.05, 50.0)
#: largest power of the cosine of the incidence that is looked for
_SLANTED = 2.0
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
    weighted: float  #: the same of what is stated, each variance weighted with its own inverse [m]
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
class ContradictedClass(Result):
    """Patches of a class whose noise is another one than a law says."""

    by: By
    #: limits of the class, in the file's unit of intensity, metres or radians
    low: Number
    high: Number
    #: in it, and those whose variance is beyond all that the law would make of noise
    patches: int
    beyond: int
    #: sigma over that of the law, with its limits for all classes together at 95 %
    factor: Number
    factor_low: Number
    factor_high: Number
    #: true if this is of the smoothest tenth of all patches of the class, which roughness of some
    #: does not explain; false if it is of the patches that the law was taken from
    smoothest: bool


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

    observed: ObservedNoise  #: what it was estimated from, all patches
    #: (patches,), patches that the laws were taken from; the others are rough, bent or of several
    #: materials
    kept: NDArray[np.bool_]
    #: of the intensity; None where it is unknown, takes one value, or does not matter
    law: RangeLaw | None
    #: (3, 3), of a [m], b and c [m]; of the factors at its knots where the law has a term; NaN
    #: where a figure is at its limit
    law_covariance: Array
    #: law of the range, [m] and [m/m], divided by the cosine of the incidence
    range: float
    range_scale: float
    range_covariance: Array  #: (2, 2), of these; NaN where a figure is at its limit
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
    why: str = ""  #: why there is no law of the intensity, "" with one
    #: whose footprint was held; place and angles are then what is left beside it
    held: Beam | None = None
    #: power of the cosine of the incidence that the law of the range is divided by
    incidence: float = 1.0
    #: classes of patches that contradict the law, the one that contradicts most first
    contradicted: tuple[ContradictedClass, ...] = ()

    @property
    def patches(self) -> int:
        """Patches kept."""
        return int(self.kept.sum())

    @property
    def points(self) -> int:
        """Points on patches kept."""
        return int(self.kept[self.observed.patch].sum())

    @property
    def noisier(self) -> float:
        """Median sigma of the patches left out over that of the law, where many are left out.

        Without intensities nothing tells rough surfaces from noise that depends on the intensity.
        0 with intensities, or where few are left out.
        """
        observed = self.observed
        if not _lit(observed)[1] or self.kept.mean() > 1 - _MANY:
            return 0.0
        square = observed.residual**2 / observed.stated(self.noise())
        ratio = np.bincount(observed.patch, square) / observed.redundancies
        return float(np.sqrt(np.median(ratio[~self.kept])))

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
        if self.law.knots:
            shares = _shares(np.log(light), np.log(self.law.knots))
            rows = (self.law.a * power + self.law.c)[:, None] * shares
        else:
            rows = np.stack(
                [power, self.law.a * power * np.log(light), np.ones_like(power)], axis=1
            )
        known = np.isfinite(np.diag(self.law_covariance))
        inner = self.law_covariance[np.ix_(known, known)]
        part = rows[:, known]
        variance: Array = np.einsum("ni,ij,nj->n", part, inner, part)
        return np.sqrt(np.maximum(variance, 0.0))

    def noise(self) -> ScanNoise:
        """The noise of single points that the scans show, with the footprint held or seen."""
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
            incidence=self.incidence,
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

    ``stated`` are variances along the beam [m^2]. Classes have about as many patches each, but for
    the incidence, whose classes end at 15, 30, 45, 60 and 75 degrees.
    """
    if not len(observed) or (by == "intensity" and not np.isfinite(observed.intensity).all()):
        return []
    key, number = _numbered(observed, by, most)
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


def _numbered(observed: ObservedNoise, by: By, most: int) -> tuple[Array, Index]:
    """What patches (k,) are put into classes by, and the class (k,) of each."""
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
    return key, np.clip(np.searchsorted(ends, key, side="right") - 1, 0, max(len(ends) - 2, 0))


def contradicted_classes(
    observed: ObservedNoise, stated: Array, kept: NDArray[np.bool_], most: int = 8
) -> tuple[ContradictedClass, ...]:
    """Find classes of patches that contradict a law, the one that contradicts most first.

    ``stated`` are variances along the beam by the law [m^2], ``kept`` the patches that count as
    smooth.

    Two tests (method section 5.9). The smooth patches of a class scatter by another factor than
    0.9 to 1.1. Or even the smoothest tenth of *all* patches of a class has 1.2 times the noise:
    roughness of some of them does not explain that.
    """
    causes: list[By] = ["range", "incidence"]
    if np.isfinite(observed.intensity).all() and observed.intense:
        causes.insert(0, "intensity")
    smooth = observed.of_patches(kept)
    mine = kept[observed.patch]
    of_smooth = {by: noise_classes(smooth, stated[mine], by, most) for by in causes}
    level = 1 - (1 - _ALL) / max(2 * sum(map(len, of_smooth.values())), 1)
    out = []
    for by in causes:
        for one in of_smooth[by]:
            ends = one.interval(level)
            if ends is not None and (ends[0] > _APART or ends[1] < 1 / _APART):
                figures = (one.patches, 0, one.factor, *ends)
                out.append(ContradictedClass(by, one.low, one.high, *figures, False))
        out += _smoothest(observed, stated, by, most, level)
    return tuple(sorted(out, key=lambda one: -abs(np.log(one.factor))))


def _smoothest(
    observed: ObservedNoise, stated: Array, by: By, most: int, level: float
) -> Iterator[ContradictedClass]:
    """Classes of which even the smoothest patches have more noise than a law says."""
    key, number = _numbered(observed, by, most)
    free = observed.redundancies
    ratio = np.bincount(observed.patch, observed.residual**2 / stated) / free
    # the least quantile of noise alone is one then, and the rough are far above
    scaled = ratio * free / chi2.ppf(_SMOOTHEST, free)
    beyond = ratio * free > chi2.ppf(_ROUGH, free)
    for k in np.unique(number):
        mine = number == k
        count = int(mine.sum())
        if count < _TELLING:
            continue
        width = float(norm.ppf((1 + level) / 2)) * np.sqrt(_SMOOTHEST * (1 - _SMOOTHEST) / count)
        at = np.clip([_SMOOTHEST - width, _SMOOTHEST, _SMOOTHEST + width], 0, 1)
        low, factor, high = np.sqrt(np.quantile(scaled[mine], at)).tolist()
        if low > _BEYOND:
            ends, off = (float(key[mine].min()), float(key[mine].max())), int(beyond[mine].sum())
            yield ContradictedClass(by, *ends, count, off, factor, low, high, True)


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
    across: Array  #: (k, 3), what a variance of the place [m^2] and of both angles [rad^2] add
    known: Array  #: variance that is known, of rounding [m^2]
    limit: Array  #: variance over that of a law from which on a patch is rough
    below: Array  #: mean of the variances up to there, over that of the law

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
        light = observed.mean(observed.intensity)
        if (light == 0).any() and (light > 0).any():
            light = np.where(light == 0, light[light > 0].min(), light)
        return cls(
            np.maximum(observed.variances, 1e-18),
            free,
            light,
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
    lit, why = _lit(observed)
    if not why:
        even = lit & _one_material(observed, patches)
        middle = float(np.exp(np.median(np.log(patches.light[even]))))
        lawful = [_of_intensity(scale, middle, start) for start in _STARTS]
        fit = _trimmed(patches, lawful, even, patches.light, scale)
        found = _lawful(observed, patches, fit, even, middle, None)
        if any(one.by == "intensity" for one in found.contradicted):
            base = _with_term(patches, found, even)
            with_term = _trimmed(patches, [_term(base)], even, patches.light, scale)
            better = _lawful(observed, patches, with_term, even, middle, base)
            if not better.contradicted:
                return better
        if _matters(patches, fit, _constant(scale), 2):
            return found
        why = "the noise does not change with the intensity"
    even = np.ones(len(patches.variance), dtype=bool)
    fit = _trimmed(patches, [plain], even, patches.range, scale)
    slanted = _trimmed(
        patches, [_of_range(scale, patches.middle, None)], even, patches.range, scale
    )
    if _matters(patches, slanted, plain, 1):
        fit = slanted
    return _held_against(_fitted(observed, patches, fit, fit, None, why), even)


def _matters(patches: _Patches, fit: _Solved, less: _Model, more: int) -> bool:
    """True if a law is better than one with fewer parameters, by the likelihood."""
    other = _solve(patches, less, fit.kept, patches.scale)
    return bool(chi2.sf(2 * (other.cost - fit.cost) / fit.spread, more) < _MATTERS)


def _lawful(
    observed: ObservedNoise,
    patches: _Patches,
    fit: _Solved,
    even: NDArray[np.bool_],
    middle: float,
    base: RangeLaw | None,
) -> FittedNoise:
    """A law of the intensity held against all patches of one material."""
    by_range = _solve(patches, _of_range(patches.scale, patches.middle), fit.kept, patches.scale)
    law = _law(observed, patches, fit, middle, base)
    return _held_against(_fitted(observed, patches, fit, by_range, law), even)


def _held_against(found: FittedNoise, even: NDArray[np.bool_]) -> FittedNoise:
    """The same with the classes of patches that contradict it."""
    some = found.observed.of_patches(even)
    off = contradicted_classes(some, some.stated(found.noise()), found.kept[even])
    return replace(found, contradicted=off)


def held_noise(fitted: FittedNoise, beam: Beam, angle: float | None = None) -> FittedNoise:
    """Estimate the laws again with a beam's footprint and noise of angles held, same patches."""
    observed, model = fitted.observed, fitted.law
    plain = _Patches.of(observed)
    scale, middle = plain.scale, plain.middle
    spot = (beam.diameter(observed.range) / 4) ** 2 * (observed.slope**2).sum(axis=1)
    angles = 0.0 if angle is None else angle**2 * plain.across[:, 1:].sum(axis=1)
    patches = replace(plain, known=plain.known + observed.mean(spot) + angles)
    estimated = (False, angle is None, angle is None)
    of_range = _solve(
        patches, _of_range(scale, middle, fitted.incidence), fitted.kept, scale, estimated
    )
    if model is None:
        found = _fitted(observed, patches, of_range, of_range, None, fitted.why)
    else:
        light = float(np.exp(np.median(np.log(patches.light[fitted.kept]))))
        starts = [_of_intensity(scale, light, start) for start in (model.b, *_STARTS)]
        if model.knots:
            starts = [_term(model)]
        fit = min(
            (_solve(patches, start, fitted.kept, scale, estimated) for start in starts),
            key=lambda one: one.cost,
        )
        law = _law(observed, patches, fit, light, model if model.knots else None)
        found = _fitted(observed, patches, fit, of_range, law)
    if angle is not None:
        found = replace(found, horizontal=angle, vertical=angle)
    return replace(found, held=beam, contradicted=fitted.contradicted)


def _lit(observed: ObservedNoise) -> tuple[NDArray[np.bool_], str]:
    """Patches (k,) whose points all have an intensity, and why there can be no law, "" if it can.

    Zeros are points that a program left without intensity, or whose light was too weak for its
    steps.
    """
    lit = observed.mean((observed.intensity == 0).astype(float)) == 0
    if not np.isfinite(observed.intensity).all():
        return lit, "the scans have no intensities"
    if not observed.intense:
        return lit, "all intensities are the same"
    if observed.intensity.min() < 0:
        return lit, "there are intensities below zero, which have no power: decibels, or an offset"
    if lit.sum() < max(_FEWEST, len(lit) / 2):
        return lit, "half of the patches or more have intensities of zero, which have no power"
    return lit, ""


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
    covariance: Array  #: of the parameters, NaN where one is at its bound
    least: Array  #: (3,), variances of place and angles that would not be noticed, one sigma each
    across: Array  #: (3, 3), covariance of these variances with nothing at its bound
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


def _of_range(scale: float, middle: float, power: float | None = 1.0) -> _Model:
    """``(s_0 + s_ppm rho)/cos^k I`` in units of ``scale``, the second at the middle range.

    The power k is the third parameter where it is None.
    """

    def along(patches: _Patches, x: Array) -> tuple[Array, Array]:
        share = patches.range / middle
        slant = patches.cosine ** (x[2] if power is None else power)
        sigma = (x[0] + x[1] * share) * scale / slant
        twice = 2 * scale * sigma / slant
        rows = [twice, twice * share]
        if power is None:
            rows.append(-2 * sigma**2 * np.log(patches.cosine))
        return sigma**2, np.array(rows)

    if power is None:
        return _Model(along, np.array([0.6, 0.2, 0.3]), ((0, 1e3), (0, 1e3), (0, _SLANTED)))
    return _Model(along, np.array([0.6, 0.2]), ((0, 1e3), (0, 1e3)))


def _shares(log: Array, knots: Array) -> Array:
    """Shares (n, k) that logarithms (n,) of intensities have of knots (k,): linear between them."""
    at = np.clip(log, knots[0], knots[-1])
    right = np.clip(np.searchsorted(knots, at, side="right"), 1, len(knots) - 1)
    share = (at - knots[right - 1]) / (knots[right] - knots[right - 1])
    out = np.zeros((len(at), len(knots)))
    rows = np.arange(len(at))
    out[rows, right - 1], out[rows, right] = 1 - share, share
    return out


def _term(base: RangeLaw) -> _Model:
    """A power law multiplied by factors at knots of the intensity, which are estimated."""
    knots = np.log(base.knots)

    def along(patches: _Patches, x: Array) -> tuple[Array, Array]:
        power = base.a * patches.light**base.b + base.c
        rows = power[:, None] * _shares(np.log(patches.light), knots)
        sigma = rows @ x
        return sigma**2, 2 * (sigma[:, None] * rows).T

    return _Model(along, np.clip(base.factors, *_FACTORS), (_FACTORS,) * len(knots))


def _with_term(patches: _Patches, found: FittedNoise, even: NDArray[np.bool_]) -> RangeLaw:
    """A law with a term that begins with what the smooth patches around each knot show."""
    assert found.law is not None
    log = np.log(patches.light[even])
    knots = np.unique(np.quantile(log, np.linspace(0, 1, _KNOTS)))
    level = _smooth_level(patches, patches.light, even)
    plain = (found.law.a * patches.light[even] ** found.law.b + found.law.c) ** 2
    near = np.abs(log[:, None] - knots).argmin(axis=1)
    ratio = level[even] / plain
    start = [
        float(np.sqrt(np.median(ratio[near == k]))) if (near == k).any() else 1.0
        for k in range(len(knots))
    ]
    return replace(found.law, knots=tuple(np.exp(knots).tolist()), factors=tuple(start))


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
        # an exponent tells nothing while its factor is zero
        free &= relative.any(axis=1)
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
    inside = (x > low) & (x < high) & relative.any(axis=1)
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
    observed: ObservedNoise,
    patches: _Patches,
    fit: _Solved,
    middle: float,
    base: RangeLaw | None,
) -> tuple[RangeLaw, Array]:
    """The law of the intensity and the covariance of its figures, NaN at their limits.

    Of a, b, c (3, 3), or of the factors (k, k) with which a ``base`` is multiplied.
    """
    seen = observed.of_patches(fit.kept)
    low, high = (float(q) for q in np.quantile(seen.intensity, [_ENDS, 1 - _ENDS]))
    if base is not None:
        factors = tuple(fit.model.start[:-3].tolist())
        return replace(base, low=low, high=high, factors=factors), fit.covariance[:-3, :-3]
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
    power = by_range.model.start[2] if len(by_range.model.bounds) > 2 else 1.0
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
        incidence=float(power),
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
