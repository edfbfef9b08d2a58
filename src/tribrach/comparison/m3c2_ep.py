"""M3C2 with the uncertainty of every point and of the stations: is a change significant?

``s_L^2 = n^T (S_1 + S_2 + C_reg(X)) n`` (Winiwarter, Anders and Höfle 2021; method section 9.3):
S_1, S_2 of the mean positions from the random part of the points, divided by how many of them are
independent; C_reg from the joint covariance of the two stations, common to all points and never
divided. Three levels of detection at 95 %:

- quadratic : ``1.96 s_L``, five false alarms in a hundred;
- additive : ``1.96 (s_noise + s_reg)``, in the manner of plain M3C2, too wide;
- spatial : ``sqrt(chi2_3 / (n^T C^-1 n))``, as py4dgeo has it: the displacement ``L n``
  tested in three dimensions with ``C = S_1 + S_2 + C_reg``. For round covariances that is 2.80 s_L.

Metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tribrach.comparison.cloud_parts import Source
from tribrach.comparison.core_normals import Normals, core_normals
from tribrach.comparison.detection_level import NORMAL_95, additive_level
from tribrach.comparison.effective_points import effective_number
from tribrach.comparison.m3c2 import FEWEST, Settings, checked_core
from tribrach.comparison.projection_cylinders import Cylinders
from tribrach.comparison.station_pair import StationPair
from tribrach.comparison.weighted_positions import WeightedPositions, weighted_means
from tribrach.distributions import chi2

__all__ = ["M3C2EP", "m3c2_ep"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_SPATIAL_95 = float(chi2.ppf(0.95, 3))


@dataclass(frozen=True)
class M3C2EP:
    """Distances at core points (m, 3) with propagated uncertainty; all in metres.

    first, second : weighted positions in each cloud; independent (m, 2) : effective numbers of
    points; registration (m, 3, 3) : C_reg at the core points.
    """

    core: Array
    normals: Normals
    first: WeightedPositions
    second: WeightedPositions
    independent: Array
    registration: Array

    @cached_property
    def usable(self) -> Flags:
        """Which core points (m,) have at least five points of both clouds."""
        flags: Flags = np.minimum(self.first.count, self.second.count) >= FEWEST
        return flags

    @cached_property
    def distance(self) -> Array:
        """Distances (m,), second minus first along the normal, NaN where not usable."""
        return np.where(self.usable, self.second.position - self.first.position, np.nan)

    @cached_property
    def random(self) -> Array:
        """``S_1 + S_2`` (m, 3, 3) [m^2] with only the independent points counted."""
        with np.errstate(invalid="ignore", divide="ignore"):
            one = self.first.count / self.independent[:, 0]
            two = self.second.count / self.independent[:, 1]
        total: Array = one[:, None, None] * self.first.covariance
        total = total + two[:, None, None] * self.second.covariance
        return total

    @cached_property
    def sigma_random(self) -> Array:
        """Sigma (m,) of the distance from the points."""
        return self._along(self.random)

    @cached_property
    def sigma_registration(self) -> Array:
        """Sigma (m,) of the distance from the two stations, common to neighbours."""
        return self._along(self.registration)

    @cached_property
    def sigma(self) -> Array:
        """``s_L`` (m,)."""
        return np.hypot(self.sigma_random, self.sigma_registration)

    @cached_property
    def lod95_quadratic(self) -> Array:
        """``1.96 s_L`` (m,)."""
        return NORMAL_95 * self.sigma

    @cached_property
    def lod95_additive(self) -> Array:
        """``1.96 (s_noise + s_reg)`` (m,)."""
        return additive_level(self.sigma_random, self.sigma_registration)

    @cached_property
    def lod95_spatial(self) -> Array:
        """``sqrt(chi2_3 / (n^T C^-1 n))`` (m,); NaN where C cannot be inverted."""
        out = np.full(len(self.core), np.nan)
        total = self.random + self.registration
        good = self.usable & np.isfinite(total).all(axis=(1, 2))
        good[good] &= np.linalg.cond(total[good]) < 1e12
        n = self.normals.vectors[good]
        weight = np.einsum("mi,mi->m", n, np.linalg.solve(total[good], n[:, :, None])[:, :, 0])
        out[good] = np.sqrt(_SPATIAL_95 / weight)
        return out

    @cached_property
    def significant(self) -> Flags:
        """Where (m,) the distance exceeds the quadratic level."""
        flags: Flags = np.abs(self.distance) > self.lod95_quadratic
        return flags

    def _along(self, covariance: Array) -> Array:
        n = self.normals.vectors
        variance = np.einsum("mi,mij,mj->m", n, covariance, n)
        return np.where(self.usable, np.sqrt(np.maximum(variance, 0.0)), np.nan)


def m3c2_ep(
    first: Source,
    second: Source,
    core: Array,
    settings: Settings,
    stations: StationPair,
    *,
    normals: Normals | None = None,
    footprints: tuple[Array, Array] | None = None,
) -> M3C2EP:
    """Distances of the second cloud from the first at core points (m, 3) [m], with their sigmas.

    first, second : with the random covariance of every point; settings : its registration and
    median are not used; normals and footprints as in plain M3C2.

    Raises
    ------
    InputError : points without covariances, no core points, coordinates that are not numbers.
    """
    checked_core(core)
    if normals is None:
        normals = core_normals(
            first, core, settings.scales, scanner=settings.scanner, direction=settings.direction
        )
    cylinders = Cylinders.around(core, normals.vectors, settings.diameter, settings.depth)
    one, two = weighted_means(first, cylinders), weighted_means(second, cylinders)
    counts = np.stack([one.count, two.count], axis=1).astype(float)
    if footprints is not None:
        area = np.pi / 4 * settings.diameter**2
        sides = [effective_number(counts[:, k], area, footprints[k]) for k in (0, 1)]
        counts = np.stack(sides, axis=1)
    return M3C2EP(core, normals, one, two, counts, stations.registration(core))
