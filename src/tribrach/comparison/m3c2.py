"""Compares two clouds along the normals of the surface (M3C2), with levels of detection.

M3C2 (Lague, Brodu and Leroux 2013): at every core point the points of both clouds in a cylinder
about the normal have mean (or median) positions; their difference is the distance, positive where
the second cloud lies on the side that the normal looks to. Beside the published level of detection
there is the one whose means count only independent points (method sections 5.7 and 9.2).

A change beyond the level of detection is no longer explained by uncertainty, with 95 %. With
``s_noise^2 = s_1^2 / n_1 + s_2^2 / n_2`` of the mean positions and ``reg`` of the registration

* additive: ``1.96 (s_noise + reg)``, as published (eq. 1 there); standard deviations are added, so
  it is wider than 95 %;
* quadratic: ``1.96 sqrt(s_noise^2 + reg^2)``: variances of independent errors add, five false
  alarms in a hundred.

Metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Mask
from tribrach.comparison.cloud_parts import Source
from tribrach.comparison.core_points import Normals, core_normals
from tribrach.comparison.projection_cylinders import Cylinders, Positions, means, medians
from tribrach.errors import InputError
from tribrach.instruments.neighbours import effective_number

#: two-sided 95 % of the normal distribution, as the paper rounds it
NORMAL_95 = 1.96
#: with fewer points in either cylinder there is no distance; with fewer than enough, a warning
FEWEST, ENOUGH = 5, 20
#: variance of a median over that of a mean, for many normal values
_MEDIAN_COST = np.pi / 2


@dataclass(frozen=True)
class M3C2Settings:
    """Settings of M3C2."""

    #: diameters D of the neighbourhoods for normals [m]; the most planar one is taken
    scales: Sequence[float]
    #: diameter d of the cylinder, and its depth to each side [m]
    diameter: float
    depth: float
    registration: float = 0.0  #: sigma of the registration along the normal [m]
    median: bool = False  #: are medians taken instead of means?
    scanner: Array | None = None  #: (3,), normals look towards it
    #: (3,), without a scanner normals look along it, upwards if neither is given
    direction: Array | None = None

    def __post_init__(self) -> None:
        for name, value in (("diameter", self.diameter), ("depth", self.depth)):
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"the {name} of the cylinder is not a positive length")
        if not self.registration >= 0:
            raise InputError("the sigma of the registration is negative or not a number")


@dataclass(frozen=True)
class M3C2:
    """Distances at core points (m, 3) with normals, and what they rest on; all in metres."""

    core: Array  #: (m, 3), core points
    normals: Normals  #: their normals
    settings: M3C2Settings  #: how they were compared
    #: points, position along the normal and spread in each cloud
    first: Positions
    second: Positions
    #: (m, 2), effective numbers of points, None where the beams are not known
    independent: Array | None

    @cached_property
    def usable(self) -> Mask:
        """True (m,) for core points with at least five points of both clouds."""
        flags: Mask = np.minimum(self.first.count, self.second.count) >= FEWEST
        return flags

    @cached_property
    def distance(self) -> Array:
        """Distances (m,) along the normal, second minus first; NaN where not usable."""
        return np.where(self.usable, self.second.position - self.first.position, np.nan)

    @cached_property
    def noise(self) -> Array:
        """Sigma (m,) of the distance from the spreads, all points independent, as published."""
        return self._noise(self.first.count, self.second.count)

    @cached_property
    def noise_independent(self) -> Array | None:
        """The same with only the independent points, None where the beams are not known."""
        return None if self.independent is None else self._noise(*self.independent.T)

    def _noise(self, n_1: Array | NDArray[np.int64], n_2: Array | NDArray[np.int64]) -> Array:
        """Sigma (m,) of the distance with so many points in each cloud."""
        cost = np.sqrt(_MEDIAN_COST) if self.settings.median else 1.0
        sigma = cost * mean_sigma(
            self.first.spread, np.asarray(n_1, float), self.second.spread, np.asarray(n_2, float)
        )
        return np.where(self.usable, sigma, np.nan)

    @cached_property
    def lod95(self) -> Array:
        """Level of detection (m,) as published: additive, all points independent."""
        return additive_level(self.noise, self.settings.registration)

    @cached_property
    def lod95_quadratic(self) -> Array:
        """Level of detection (m,) with variances added; of independent points where known."""
        noise = self.noise if self.noise_independent is None else self.noise_independent
        return quadratic_level(noise, self.settings.registration)

    @property
    def few(self) -> int:
        """Distances that rest on fewer than twenty points in either cloud."""
        fewest = np.minimum(self.first.count, self.second.count)
        return int((self.usable & (fewest < ENOUGH)).sum())

    @property
    def warnings(self) -> list[str]:
        """Warnings for the reader, one sentence each."""
        out = []
        without = int((~np.isfinite(self.normals.vectors[:, 0])).sum())
        bare = int((~self.usable).sum()) - without
        if without:
            out.append(f"{without} core points have no normal: too few points around them.")
        if bare > 0:
            out.append(f"{bare} core points have fewer than {FEWEST} points of one cloud.")
        if self.few:
            out.append(f"{self.few} distances rest on fewer than {ENOUGH} points of one cloud.")
        return out


def m3c2(
    first: Source,
    second: Source,
    core: Array,
    settings: M3C2Settings,
    *,
    normals: Normals | None = None,
    footprints: tuple[Array, Array] | None = None,
    shares: tuple[float, float] = (1.0, 1.0),
) -> M3C2:
    """Compute distances of the second cloud from the first at core points.

    Normals come from the first cloud if None. ``footprints`` are areas of the beams of both clouds
    on the surface [m^2], ``shares`` what points of one footprint share of their variance.
    """
    checked_core(core)
    if normals is None:
        normals = core_normals(
            first, core, settings.scales, scanner=settings.scanner, direction=settings.direction
        )
    cylinders = Cylinders.around(core, normals.vectors, settings.diameter, settings.depth)
    measure = medians if settings.median else means
    one, two = measure(first, cylinders), measure(second, cylinders)
    independent = None
    if footprints is not None:
        area = np.pi / 4 * settings.diameter**2
        sides = zip((one, two), footprints, shares, strict=True)
        numbers = [effective_number(p.count.astype(float), area, a, s) for p, a, s in sides]
        independent = np.stack(numbers, axis=1)
    return M3C2(core, normals, settings, one, two, independent)


def checked_core(core: Array) -> None:
    """Refuse core points (m, 3) that nothing can be compared at."""
    if len(core) == 0:
        raise InputError("there are no core points to compare at")
    if not np.isfinite(core).all():
        raise InputError("a core point has a coordinate that is not a number")


def mean_sigma(spread_1: Array, n_1: Array, spread_2: Array, n_2: Array) -> Array:
    """Sigma of the difference of two mean positions from spreads [m] and numbers of points."""
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma: Array = np.sqrt(spread_1**2 / n_1 + spread_2**2 / n_2)
    return sigma


def additive_level(noise: Array, registration: Array | float) -> Array:
    """The additive level of detection ``1.96 (s_noise + reg)``."""
    level: Array = NORMAL_95 * (noise + registration)
    return level


def quadratic_level(noise: Array, registration: Array | float) -> Array:
    """The quadratic level of detection ``1.96 sqrt(s_noise^2 + reg^2)``."""
    level: Array = NORMAL_95 * np.hypot(noise, registration)
    return level
