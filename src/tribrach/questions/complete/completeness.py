"""Finds surfaces that no, one or several stations saw, and where the sigma is not reached.

Surfaces are the cells of a grid that hold points: of a model, or of all clouds together. Cells in a
row across the surface, as noise fills them where it lies on a border of cells, are one patch of it:
its area is that of a face of the grid over the cosine of its slope. A station sees a patch if it
has points in it or in the next cell across, so that noise across the border hides nothing; or if it
sees most of the patches around it, so that the few points of a thin cloud hide nothing either. At
the edge of what it sees, the share of a patch that it sees is that of the points which patches
farther inside have; what fewer stations see is part of what more see, as along a shadow. The sigma
of a patch is the root mean square of the three-dimensional sigmas of its points from the station
that is best there: errors of a station do not average out.

Points are counted chunk by chunk: memory grows with surface, not points. A cell is one number:
three signed indices of 21 bits from an origin near the points. Metres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Array, Index, Mask
from tribrach.answers import Result
from tribrach.errors import InputError

#: most cells of one cloud in memory: 24 bytes each
MOST = 60_000_000
#: bits of each index of a cell, and what is added so that it is not negative
_BITS, _HALF = 21, 1 << 20
#: cells waiting to be merged
_WAITING = 2_000_000
#: half of the 26 neighbours: each pair once
_FORWARD = tuple(
    (i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if (i, j, k) > (0, 0, 0)
)
#: of the eight patches around one, so many make it seen
_MOST_AROUND = 5
#: steps along the surface to them
_AROUND = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))
#: classes of cells by the number of stations that see them
SEEN_BY = ("no station", "one station", "two stations", "three and more")
#: a cell of the union with fewer points in all is stray
_STRAY = 3


@dataclass(frozen=True)
class Gap(Result):
    """Neighbouring cells that lack something."""

    #: middle and extents along the axes [m]
    middle: tuple[float, float, float]
    extent: tuple[float, float, float]
    cells: int  #: their number
    area: float = math.nan  #: of the surface in them [m^2]


@dataclass(frozen=True)
class Gaps(Result):
    """The largest gaps of every kind."""

    no_station: tuple[Gap, ...]
    one_station: tuple[Gap, ...]
    sigma_not_reached: tuple[Gap, ...]  #: with a larger sigma than required


@dataclass(frozen=True)
class Completeness(
    Result,
    without=("modelled", "centres", "seen", "sigmas", "areas", "covered"),
    also=("surface", "cells", "area", "seen_by", "area_seen_by", "sigma", "area_of_sigma"),
):
    """Cells of the surface and what the stations know of them."""

    cell: float  #: side of a cell [m]
    modelled: bool  #: is the surface that of a model, or of all clouds?
    centres: Array  #: middles of the cells (n, 3) [m]
    seen: NDArray[np.int64]  #: number of stations that see each (n,)
    sigmas: Array  #: of the best station in each (n,) [m], NaN where none is known
    areas: Array  #: of the surface in each (n,) [m^2]
    covered: Array  #: share of each that one station, two and three see at least (n, 3)
    required_sigma: float | None  #: the sigma that was asked for [m]
    #: share of the area that each sees
    stations: dict[str, float]
    gaps: Gaps

    @property
    def surface(self) -> str:
        """What the cells are of."""
        return "model" if self.modelled else "union of the clouds"

    @property
    def cells(self) -> int:
        """Their number."""
        return len(self.seen)

    @property
    def area(self) -> float:
        """Of the whole surface [m^2]."""
        return float(sum(self.area_seen_by.values()))

    @property
    def seen_by(self) -> dict[str, int]:
        """Cells by the number of stations that see them."""
        count = np.bincount(np.minimum(self.seen, 3), minlength=4).tolist()
        return dict(zip(SEEN_BY, count, strict=True))

    @property
    def area_seen_by(self) -> dict[str, float]:
        """Area by the number of stations that see it [m^2]."""
        least = [float(self.areas.sum()), *(self.areas @ self.covered).tolist(), 0.0]
        if not self.modelled:  # what nobody saw is no surface
            least[0] = least[1]
        return {
            name: max(one - more, 0.0)
            for name, one, more in zip(SEEN_BY, least[:-1], least[1:], strict=True)
        }

    @property
    def sigma(self) -> dict[str, int] | None:
        """Cells that are seen by whether the required sigma is reached; null if none is asked."""
        if self.required_sigma is None:
            return None
        return {name: int(np.count_nonzero(some)) for name, some in self._by_sigma().items()}

    @property
    def area_of_sigma(self) -> dict[str, float] | None:
        """Seen area by whether the required sigma is reached [m^2]; null if none is asked."""
        if self.required_sigma is None:
            return None
        seen = self.areas * self.covered[:, 0]
        return {name: float(seen[some].sum()) for name, some in self._by_sigma().items()}

    def _by_sigma(self) -> dict[str, Mask]:
        """Which cells reach the required sigma, do not, or cannot tell."""
        there, known = self.seen > 0, np.isfinite(self.sigmas)
        reached = known & (np.where(known, self.sigmas, np.inf) <= (self.required_sigma or 0.0))
        return {
            "reached": there & reached,
            "not reached": there & known & ~reached,
            "unknown": there & ~known,
        }


def assess_completeness(
    grid: PatchGrid,
    stations: Mapping[str, SurfacePatches],
    *,
    model: SurfacePatches | None = None,
    required: float | None = None,
    gaps: int = 10,
) -> Completeness:
    """Assess what stations saw of a surface.

    Without a model the surface is the union of the stations. ``required`` is the sigma to be
    reached [m], ``gaps`` how many of the largest to name of each sort.
    """
    cells = _union(stations) if model is None else model.keys
    surface = _Patches.of(cells, grid.size)
    if model is not None and model.sums.any():
        surface = replace(surface, areas=model.sums)
    seen = np.zeros(len(cells), dtype=np.int64)
    covered = np.zeros((len(cells), 3))
    best = np.full(len(cells), np.inf)
    seen_areas = {}
    for name, patches in stations.items():
        share, count, total = _around(patches, cells, surface.axis)
        share = surface.most(share)
        there = share > 0
        seen += there
        covered = -np.sort(-np.column_stack([covered, share]), axis=1)[:, :3]
        count, total = surface.sum(count), surface.sum(total)
        variance = np.divide(total, count, out=np.full(len(cells), np.inf), where=count > 0)
        known = there & (total > 0)
        best[known] = np.minimum(best[known], variance[known])
        seen_areas[name] = float(surface.areas @ share)
    sigma = np.sqrt(np.where(np.isfinite(best), best, np.nan))
    weak = np.zeros(len(cells), dtype=bool)
    if required is not None:
        weak = (seen > 0) & (np.nan_to_num(sigma, nan=0.0) > required)
    areas = surface.areas
    lacking = (
        (seen == 0, areas * (1 - covered[:, 0])),
        (seen == 1, areas * (covered[:, 0] - covered[:, 1])),
        (weak, areas * covered[:, 0]),
    )
    found = Completeness(
        cell=grid.size,
        modelled=model is not None,
        centres=grid.centres(cells),
        seen=seen,
        sigmas=sigma,
        areas=areas,
        covered=covered,
        required_sigma=required,
        stations={},
        gaps=Gaps(*(_gaps(grid, cells[lack], area[lack], gaps) for lack, area in lacking)),
    )
    whole = found.area or 1.0
    return replace(found, stations={name: area / whole for name, area in seen_areas.items()})


@dataclass(frozen=True)
class _Patches:
    """Cells in a row across the surface, which are one patch of it."""

    axis: Index  #: the axis that the surface is most square to, of each cell (n,)
    number: Index  #: the patch of each cell (n,)
    areas: Array  #: share of each cell in the area of its patch (n,) [m^2]

    @classmethod
    def of(cls, cells: Index, size: float) -> _Patches:
        """The patches of sorted cells."""
        square = _squareness(cells)
        axis = np.argmax(square, axis=1)
        number = _rows(PatchGrid.signed(cells), axis)
        many = np.bincount(number)[number]
        return cls(axis, number, size**2 / square[np.arange(len(cells)), axis] / many)

    def most(self, values: Array) -> Array:
        """The largest value of the patch of each cell (n,)."""
        out = np.zeros(len(values))
        np.maximum.at(out, self.number, values)
        return out[self.number]

    def sum(self, values: Array) -> Array:
        """The sum over the patch of each cell (n,)."""
        total = np.bincount(self.number, weights=values).astype(np.float64)
        return total[self.number]


def _squareness(cells: Index) -> Array:
    """Cosines (n, 3) between the axes and the normal of the surface about each of sorted cells.

    A surface fills as many rows of cells along each axis as its projection along it has faces of
    the grid; a cell has its share of the rows that it is part of.
    """
    index = PatchGrid.signed(cells)
    rows = np.empty((len(cells), 3))
    for k in range(3):
        number = _rows(index, np.full(len(cells), k))
        rows[:, k] = 1 / np.bincount(number)[number]
    around = rows.copy()
    for step in _FORWARD:
        place = found_in(cells, PatchGrid.shifted(cells, step))
        there = np.flatnonzero(place >= 0)
        around[there] += rows[place[there]]
        around[place[there]] += rows[there]
    cosines: Array = around / np.linalg.norm(around, axis=1, keepdims=True)
    return cosines


def _rows(index: Index, axis: Index) -> Index:
    """The number (n,) of the row of cells (n, 3) without a gap, each along its own axis."""
    along = np.take_along_axis(index, axis[:, None], axis=1)[:, 0]
    others = np.where(np.arange(3) == axis[:, None], 0, index)
    order = np.lexsort((along, *others.T, axis))
    keys = np.column_stack([axis, others, along])[order]
    step = np.diff(keys, axis=0)
    begins = np.ones(len(index), dtype=bool)
    begins[1:] = step[:, :4].any(axis=1) | (step[:, 4] > 1)
    number = np.empty(len(index), dtype=np.int64)
    number[order] = np.cumsum(begins) - 1
    return number


def _union(stations: Mapping[str, SurfacePatches]) -> Index:
    """Cells with enough points of all stations together, or with others on many sides."""
    empty = np.zeros(0, dtype=np.int64)
    keys = np.concatenate([empty, *(p.keys for p in stations.values())])
    counts = np.concatenate([empty, *(p.counts for p in stations.values())])
    cells, where = np.unique(keys, return_inverse=True)
    enough = np.bincount(where, weights=counts, minlength=len(cells)) >= _STRAY
    beside = np.zeros(len(cells), dtype=np.int64)
    for step in _FORWARD:
        place = found_in(cells, PatchGrid.shifted(cells, step))
        there = np.flatnonzero(place >= 0)
        beside[there] += 1
        beside[place[there]] += 1
    chosen: Index = cells[enough | (beside >= _MOST_AROUND)]
    return chosen


def _around(patches: SurfacePatches, cells: Index, axis: Index) -> tuple[Array, Array, Array]:
    """Share of each cell (n,) that a station sees; its points and variances there or around."""
    share, count, total = (np.zeros(len(cells)) for _ in range(3))
    for k in range(3):
        mine = np.flatnonzero(axis == k)
        own, sums = _column(patches, cells[mine], k, 0, 0)
        around = [_column(patches, cells[mine], k, i, j) for i, j in _AROUND]
        points = np.sort([n for n, _ in around], axis=0)
        there = (points > 0).sum(axis=0)
        # half of the patches around that are seen have as many points or more
        usual = points[np.minimum(8 - there + there // 2, 7), np.arange(len(mine))]
        inside = (there >= 7) | (usual == 0)
        partly = np.where(inside, 1.0, np.minimum(own / np.maximum(usual, 1), 1.0))
        empty = own == 0
        share[mine] = np.where(empty, there >= _MOST_AROUND, partly)
        count[mine] = np.where(empty, points.sum(axis=0), own)
        total[mine] = np.where(empty, np.sum([square for _, square in around], axis=0), sums)
    return share, count, total


def _column(
    patches: SurfacePatches, cells: Index, axis: int, i: int, j: int
) -> tuple[Array, Array]:
    """Points and variances in three cells across the surface, beside cells by i and j."""
    count, total = np.zeros(len(cells)), np.zeros(len(cells))
    for along in (-1, 0, 1):
        step = [i, j]
        step.insert(axis, along)
        place = found_in(patches.keys, PatchGrid.shifted(cells, (step[0], step[1], step[2])))
        hit = place >= 0
        count[hit] += patches.counts[place[hit]]
        total[hit] += patches.sums[place[hit]]
    return count, total


def _gaps(grid: PatchGrid, cells: Index, areas: Array, most: int) -> tuple[Gap, ...]:
    """The groups of neighbouring cells (n,) with the largest areas (n,)."""
    if len(cells) == 0:
        return ()
    rows, columns = [], []
    for step in _FORWARD:
        place = found_in(cells, PatchGrid.shifted(cells, step))
        hit = np.flatnonzero(place >= 0)
        rows.append(hit)
        columns.append(place[hit])
    row, column = np.concatenate(rows), np.concatenate(columns)
    graph = coo_array((np.ones(len(row), dtype=np.int8), (row, column)), shape=(len(cells),) * 2)
    _, label = connected_components(graph, directed=False)
    size, area = np.bincount(label), np.bincount(label, weights=areas)
    centres = grid.centres(cells)
    out = []
    for group in np.argsort(-np.round(area, 9), kind="stable")[:most]:
        members = centres[label == group]
        low, high = members.min(axis=0), members.max(axis=0)
        extent = high - low + grid.size
        middle, cells_there = _triple((low + high) / 2), int(size[group])
        out.append(Gap(middle, _triple(extent), cells_there, float(area[group])))
    return tuple(out)


def _triple(x: Array) -> tuple[float, float, float]:
    """Three coordinates as plain numbers."""
    return float(x[0]), float(x[1]), float(x[2])


@dataclass(frozen=True)
class PatchGrid:
    """Cubic cells around an origin."""

    origin: Array  #: corner of the cell (0, 0, 0) (3,) [m]
    size: float  #: side of a cell [m]

    @classmethod
    def around(cls, xyz: Array, size: float) -> PatchGrid:
        """The grid for points like these (n, 3), its cells at multiples of the size."""
        return cls(np.floor(np.median(xyz, axis=0) / size) * size, size)

    def keys(self, xyz: Array) -> Index:
        """Cells (n,) of points (n, 3) [m]."""
        index = np.floor((xyz - self.origin) / self.size)
        if len(index) and np.abs(index).max() >= _HALF - 1:
            raise InputError(
                f"points lie more than {_HALF * self.size / 1000:.0f} km apart, too far for cells "
                f"of {self.size:g} m",
                cure="clean the clouds, put all into one frame, or take larger cells",
            )
        whole = index.astype(np.int64) + _HALF
        return (whole[:, 0] << (2 * _BITS)) | (whole[:, 1] << _BITS) | whole[:, 2]

    @staticmethod
    def signed(keys: Index) -> Index:
        """Signed indices (n, 3) of cells (n,)."""
        mask = (1 << _BITS) - 1
        parts = (keys >> (2 * _BITS), (keys >> _BITS) & mask, keys & mask)
        return np.stack(parts, axis=1) - _HALF

    def centres(self, keys: Index) -> Array:
        """Middles (n, 3) [m] of cells (n,)."""
        middle: Array = self.origin + (self.signed(keys) + 0.5) * self.size
        return middle

    @staticmethod
    def shifted(keys: Index, step: tuple[int, int, int]) -> Index:
        """The neighbours (n,) of cells (n,) at a step of cells."""
        return keys + (step[0] * (1 << (2 * _BITS)) + step[1] * (1 << _BITS) + step[2])


@dataclass
class SurfacePatches:
    """Cells of one cloud, sorted."""

    #: numbers of the cells (n,)
    keys: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    #: points in each (n,)
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    #: sums of their variances (n,) [m^2]
    sums: Array = field(default_factory=lambda: np.zeros(0))
    _waiting: list[tuple[Index, NDArray[np.int64], Array]] = field(default_factory=list)
    _size: int = 0

    def add(self, keys: Index, variance: Array | None = None) -> None:
        """Count points by their cells."""
        cells, where, counts = np.unique(keys, return_inverse=True, return_counts=True)
        sums: Array = np.zeros(len(cells))
        if variance is not None:
            sums = np.bincount(where, weights=variance, minlength=len(cells)).astype(np.float64)
        self._waiting.append((cells, counts.astype(np.int64), sums))
        self._size += len(cells)
        # merging only what is as large as what is there keeps the work in proportion
        if self._size > max(_WAITING, len(self.keys)):
            self.merge()

    def merge(self) -> None:
        """Bring everything that waits into the sorted cells."""
        if not self._waiting:
            return
        parts = [(self.keys, self.counts, self.sums), *self._waiting]
        keys, counts, sums = (np.concatenate(column) for column in zip(*parts, strict=True))
        self.keys, where = np.unique(keys, return_inverse=True)
        if len(self.keys) > MOST:
            raise InputError(
                f"the clouds fill more than {MOST / 1e6:.0f} million cells", cure="take larger ones"
            )
        total = np.bincount(where, weights=counts, minlength=len(self.keys))
        self.counts = np.round(total).astype(np.int64)
        merged = np.bincount(where, weights=sums, minlength=len(self.keys))
        self.sums = merged.astype(np.float64)
        self._waiting, self._size = [], 0


def found_in(keys: Index, wanted: Index) -> Index:
    """Places (n,) of wanted cells in sorted ones, -1 where they are not."""
    if len(keys) == 0:
        return np.full(len(wanted), -1, dtype=np.int64)
    place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[place] == wanted, place, -1)
