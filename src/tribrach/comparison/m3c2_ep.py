"""M3C2 with the uncertainty of every point and of the stations.

``s_L^2 = n^T (S_1 + S_2 + C_reg(X)) n`` (Winiwarter, Anders and Höfle 2021; method section 9.3):
S_1, S_2 of the mean positions from the random part of the points, divided by how many of them are
independent; C_reg from the joint covariance of the two stations and of what their scanners do to
all points alike, with what systematic angles add, common to all points and never divided. Each
point weighs ``w = 1 / (n^T C n)`` by its own random covariance C, so that the mean along the normal
has ``Sigma w d / Sigma w`` and the covariance ``S = Sigma w^2 C / (Sigma w)^2``.
What the station contributes is not in C: it is common to all points and never averages out. Levels
of detection, of which verdicts use the first:

* quadratic: ``1.96 s_L``, five false alarms in a hundred;
* additive: ``1.96 (s_noise + s_reg)``, in the manner of plain M3C2, too wide;
* spatial: ``sqrt(chi2_3 / (n^T C^-1 n))``, as published and as py4dgeo has it, with
  ``C = S_1 + S_2 + C_reg``. It is no level at 95 %: the distance is one number, whose variance is
  ``n^T C n``. For round covariances it is 2.80 s_L (0.5 % of false alarms), for long ones on
  slanted surfaces it is below s_L (36 % of them).

Metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.comparison.cloud_parts import Source, centred
from tribrach.comparison.core_points import Normals, core_normals
from tribrach.comparison.m3c2 import (
    FEWEST,
    M3C2,
    NORMAL_95,
    M3C2Settings,
    additive_level,
    checked_core,
)
from tribrach.comparison.point_cells import PointCells, cylinder_ranges
from tribrach.comparison.projection_cylinders import Cylinders
from tribrach.comparison.station_pair import StationPair
from tribrach.errors import InputError
from tribrach.instruments.neighbours import effective_number
from tribrach.kernels import in_threads, njit
from tribrach.statistics import chi2

#: no point is taken as better known than this along the normal [m^2]: a thousandth of a micrometre
_SMALLEST = 1e-18
#: chi-square of three degrees of freedom, 95 %
_SPATIAL_95 = float(chi2.ppf(0.95, 3))


@dataclass(frozen=True)
class M3C2EP:
    """Distances at core points (m, 3) with propagated uncertainty; all in metres."""

    core: Array  #: (m, 3), core points
    normals: Normals  #: their normals
    #: weighted positions in each cloud
    first: WeightedPositions
    second: WeightedPositions
    independent: Array  #: (m, 2), effective numbers of points
    registration: Array  #: (m, 3, 3), C_reg at the core points, with systematic angles

    @cached_property
    def usable(self) -> Mask:
        """Which core points (m,) have at least five points of both clouds."""
        flags: Mask = np.minimum(self.first.count, self.second.count) >= FEWEST
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
        """``sqrt(chi2_3 / (n^T C^-1 n))`` (m,), as published; NaN where C cannot be inverted."""
        out = np.full(len(self.core), np.nan)
        total = self.random + self.registration
        good = self.usable & np.isfinite(total).all(axis=(1, 2))
        good[good] &= np.linalg.cond(total[good]) < 1e12
        n = self.normals.vectors[good]
        weight = np.einsum("mi,mi->m", n, np.linalg.solve(total[good], n[:, :, None])[:, :, 0])
        out[good] = np.sqrt(_SPATIAL_95 / weight)
        return out

    @cached_property
    def significant(self) -> Mask:
        """Where (m,) the distance exceeds the quadratic level."""
        flags: Mask = np.abs(self.distance) > self.lod95_quadratic
        return flags

    def _along(self, covariance: Array) -> Array:
        """Sigma (m,) along the normals of covariances (m, 3, 3)."""
        n = self.normals.vectors
        variance = np.einsum("mi,mij,mj->m", n, covariance, n)
        return np.where(self.usable, np.sqrt(np.maximum(variance, 0.0)), np.nan)


def m3c2_ep(
    first: Source,
    second: Source,
    core: Array,
    settings: M3C2Settings,
    stations: StationPair,
    *,
    normals: Normals | None = None,
    footprints: tuple[Array, Array] | None = None,
    shares: tuple[float, float] = (1.0, 1.0),
) -> M3C2EP:
    """Distances with propagated uncertainty; settings but registration and median as in M3C2."""
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
        sides = [effective_number(counts[:, k], area, footprints[k], shares[k]) for k in (0, 1)]
        counts = np.stack(sides, axis=1)
    common = stations.registration(core) + stations.angles(core)
    return M3C2EP(core, normals, one, two, counts, common)


def by_scatter(found: M3C2, stations: StationPair) -> M3C2EP:
    """Distances of clouds of which nothing but how they lie is known: their points scatter.

    What scatters twice as much as half of the cylinders counts as edge or plant.
    """
    normals = found.normals.vectors
    plane = np.einsum("mi,mj->mij", normals, normals)
    sides = []
    for one in (found.first, found.second):
        with np.errstate(invalid="ignore", divide="ignore"):
            covariance = (one.spread**2 / one.count)[:, None, None] * plane
        usual = np.full(
            len(plane), np.median(one.spread[found.usable]) if found.usable.any() else 0
        )
        place = found.core + normals * one.position[:, None]
        sides.append(
            WeightedPositions(one.count, one.position, one.spread, usual, covariance, place)
        )
    first, second = sides
    counts = np.stack([first.count, second.count], axis=1).astype(float)
    registration = stations.registration(found.core)
    return M3C2EP(found.core, found.normals, first, second, counts, registration)


@dataclass(frozen=True)
class WeightedPositions:
    """A cloud in each of m cylinders."""

    count: Index  #: (m,), points
    position: Array  #: (m,), weighted mean along the normal [m]
    spread: Array  #: (m,), weighted standard deviation [m]
    #: (m,), what the covariances of the points foretell of the spread on a plane [m]
    expected: Array
    covariance: Array  #: (m, 3, 3), of the mean, all points independent [m^2]
    #: (m, 3), weighted mean of the points [m]; beside the core point where a cylinder is not full
    place: Array


def weighted_means(cloud: Source, cylinders: Cylinders) -> WeightedPositions:
    """Compute weighted means of a cloud in cylinders; NaN without points."""
    sums = np.zeros((len(cylinders.core), 13))
    for part in centred(cloud, cylinders.origin, *cylinders.box):
        if part.random is None:
            raise InputError(
                "the points of a cloud have no covariances to propagate",
                cure="compare with plain M3C2",
            )
        cells = PointCells.of(part.xyz, cylinders.radius)
        in_threads(
            _add,
            len(sums),
            cylinders.core,
            cylinders.normal,
            cylinders.radius,
            cylinders.depth,
            cells.arrays,
            part.random,
            cells.order,
            sums,
            least=256,
        )
    return _concluded(sums, cylinders.core + cylinders.origin)


def _concluded(sums: Array, core: Array) -> WeightedPositions:
    """Figures from counts, sums of weights and the rest; core (m, 3) [m]."""
    n, weight, first, second = sums[:, :4].T
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = first / weight
        variance = np.maximum(second / weight - mean**2, 0.0) * n / (n - 1)
        flat = sums[:, 4:10] / weight[:, None] ** 2
        place = core + sums[:, 10:] / weight[:, None]
        # sum w (n^T C n) / sum w, and every w (n^T C n) is one
        expected = np.sqrt(n / weight)
    covariance = flat[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    spread = np.sqrt(np.where(n > 1, variance, np.nan))
    return WeightedPositions(n.astype(np.int64), mean, spread, expected, covariance, place)


@njit(cache=True, nogil=True)
def _add(first, last, core, normal, radius, depth, cells, random, order, sums):  # type: ignore[no-untyped-def]
    """Add count, weight, weighted distances and squares, and ``w^2 C`` of the points within."""
    xyz = cells[0]
    for c in range(first, last):
        n0, n1, n2 = normal[c, 0], normal[c, 1], normal[c, 2]
        if np.isnan(n0):
            continue
        out = sums[c]
        for begin, end in cylinder_ranges(core[c], normal[c], radius, depth, cells):
            for k in range(begin, end):
                x, y, z = xyz[k, 0] - core[c, 0], xyz[k, 1] - core[c, 1], xyz[k, 2] - core[c, 2]
                d = x * n0 + y * n1 + z * n2
                if abs(d) > depth or x * x + y * y + z * z - d * d > radius * radius:
                    continue
                s = random[order[k]]
                variance = n0 * n0 * s[0] + n1 * n1 * s[1] + n2 * n2 * s[2]
                variance += 2 * (n0 * n1 * s[3] + n0 * n2 * s[4] + n1 * n2 * s[5])
                w = 1.0 / max(variance, _SMALLEST)
                out[0] += 1
                out[1] += w
                out[2] += w * d
                out[3] += w * d * d
                for e in range(6):
                    out[4 + e] += w * w * s[e]
                out[10] += w * x
                out[11] += w * y
                out[12] += w * z
