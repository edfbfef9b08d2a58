"""Gathers what of a cloud lies in projection cylinders: counts, sums, sorted distances.

A cylinder of diameter d about the normal through each core point reaches the depth to both sides
(Lague, Brodu and Leroux 2013). Distances along the normal are relative to the core point. Sums add
up over the parts of a cloud; medians take the distances themselves, in blocks of core points that
fit into memory. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.comparison.cloud_parts import Source, centred
from tribrach.comparison.point_cells import PointCells, cylinder_ranges
from tribrach.kernels import in_threads, njit

Box = tuple[Array, Array]

#: distances that are kept at the same time for medians
MOST_KEPT = 20_000_000
#: interquartile range of a normal distribution, in standard deviations
_QUARTILES = 1.3489795003921634


@dataclass(frozen=True)
class Cylinders:
    """Cylinders about the normals at core points."""

    origin: Array  #: (3,), what coordinates are relative to [m]
    #: (m, 3), core points and unit normals
    core: Array
    normal: Array
    #: half the diameter, and the reach to each side [m]
    radius: float
    depth: float

    @classmethod
    def around(cls, core: Array, normal: Array, diameter: float, depth: float) -> Cylinders:
        """About core points and normals (m, 3) in any frame; coordinates are centred first."""
        origin = core.mean(axis=0)
        return cls(origin, core - origin, np.ascontiguousarray(normal), diameter / 2, depth)

    @property
    def box(self) -> Box:
        """Corners (3,) of the box that holds all cylinders."""
        reach = np.hypot(self.radius, self.depth)
        return self.core.min(axis=0) - reach, self.core.max(axis=0) + reach

    def some(self, chosen: Index) -> Cylinders:
        """The cylinders of some core points."""
        return Cylinders(
            self.origin, self.core[chosen], self.normal[chosen], self.radius, self.depth
        )


@dataclass(frozen=True)
class Positions:
    """A cloud in each of m cylinders."""

    count: Index  #: (m,), points
    position: Array  #: (m,), mean or median along the normal [m]
    spread: Array  #: (m,), standard deviation, or scaled interquartile range [m]


def means(cloud: Source, cylinders: Cylinders) -> Positions:
    """Mean and standard deviation (n - 1) of the distances; NaN without points, or with one."""
    sums = np.zeros((len(cylinders.core), 3))
    for part in centred(cloud, cylinders.origin, *cylinders.box):
        cells = PointCells.of(part.xyz, cylinders.radius).arrays
        given = cylinders.core, cylinders.normal, cylinders.radius, cylinders.depth, cells
        in_threads(_sums, len(sums), *given, sums, least=256)
    n, first, second = sums.T
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = first / n
        variance = np.maximum(second - n * mean**2, 0.0) / (n - 1)
    return Positions(n.astype(np.int64), mean, np.sqrt(np.where(n > 1, variance, np.nan)))


def medians(cloud: Source, cylinders: Cylinders, most: int = MOST_KEPT) -> Positions:
    """Medians of the distances, and interquartile ranges over 1.349: sigma for normal noise."""
    count = means(cloud, cylinders).count
    position, spread = np.full(len(count), np.nan), np.full(len(count), np.nan)
    for begin, end in _blocks(count, most):
        some = cylinders.some(np.arange(begin, end))
        first = np.concatenate([[0], np.cumsum(count[begin:end])])
        kept, filled = np.empty(first[-1]), first[:-1].copy()
        for part in centred(cloud, some.origin, *some.box):
            cells = PointCells.of(part.xyz, some.radius).arrays
            given = some.core, some.normal, some.radius, some.depth, cells
            in_threads(_gather, end - begin, *given, kept, filled, least=256)
        found = position[begin:end], spread[begin:end]
        in_threads(_quartiles, end - begin, kept, first, *found, least=256)
    return Positions(count, position, spread)


def _blocks(count: Index, most: int) -> list[tuple[int, int]]:
    """Runs of core points whose points together are at most so many, or one core point."""
    out, begin, total = [], 0, 0
    ends = np.cumsum(count)
    while begin < len(count):
        end = max(int(np.searchsorted(ends, total + most, side="right")), begin + 1)
        out.append((begin, end))
        begin, total = end, int(ends[end - 1])
    return out


@njit(cache=True, inline="always")
def _along(xyz, k, core, normal, radius, depth):  # type: ignore[no-untyped-def]
    """Distance of a point along the normal, NaN outside the cylinder."""
    x, y, z = xyz[k, 0] - core[0], xyz[k, 1] - core[1], xyz[k, 2] - core[2]
    d = x * normal[0] + y * normal[1] + z * normal[2]
    across = x * x + y * y + z * z - d * d
    return d if across <= radius * radius and abs(d) <= depth else np.nan


@njit(cache=True, nogil=True)
def _sums(first, last, core, normal, radius, depth, cells, sums):  # type: ignore[no-untyped-def]
    """Add count, sum and sum of squares of the distances."""
    xyz = cells[0]
    for c in range(first, last):
        if np.isnan(normal[c, 0]):
            continue
        n, total, squares = 0, 0.0, 0.0
        for begin, end in cylinder_ranges(core[c], normal[c], radius, depth, cells):
            for k in range(begin, end):
                d = _along(xyz, k, core[c], normal[c], radius, depth)
                if not np.isnan(d):
                    n += 1
                    total += d
                    squares += d * d
        sums[c, 0] += n
        sums[c, 1] += total
        sums[c, 2] += squares


@njit(cache=True, nogil=True)
def _gather(first, last, core, normal, radius, depth, cells, kept, filled):  # type: ignore[no-untyped-def]
    """Write the distances behind those already there; ``filled`` (m,) : the next free places."""
    xyz = cells[0]
    for c in range(first, last):
        if np.isnan(normal[c, 0]):
            continue
        for begin, end in cylinder_ranges(core[c], normal[c], radius, depth, cells):
            for k in range(begin, end):
                d = _along(xyz, k, core[c], normal[c], radius, depth)
                if not np.isnan(d):
                    kept[filled[c]] = d
                    filled[c] += 1


@njit(cache=True, nogil=True)
def _quartiles(first, last, kept, start, position, spread):  # type: ignore[no-untyped-def]
    """Median and scaled interquartile range of each run of distances."""
    for c in range(first, last):
        some = np.sort(kept[start[c] : start[c + 1]])
        if len(some) > 0:
            position[c] = _quantile(some, 0.5)
        if len(some) > 1:
            spread[c] = (_quantile(some, 0.75) - _quantile(some, 0.25)) / _QUARTILES


@njit(cache=True, inline="always")
def _quantile(ordered, share):  # type: ignore[no-untyped-def]
    """Quantile of sorted values, linear between them."""
    place = share * (len(ordered) - 1)
    low = int(place)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (place - low) * (ordered[high] - ordered[low])
