"""Finds surfaces that no, one or several stations saw, and where the sigma is not reached.

Surfaces are the cells of a grid that hold points: of a model, or of all clouds together. A station
sees a cell if it has points in it or in one that shares a face with it, so that noise across the
border of cells does not hide a surface. The sigma of a cell is the root mean square of the
three-dimensional sigmas of its points from the station that is best there: errors of a station do
not average out.

Points are counted chunk by chunk: memory grows with surface, not points. A cell is one number:
three signed indices of 21 bits from an origin near the points. Metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Array, Index
from tribrach.answers import Result
from tribrach.errors import InputError

__all__ = [
    "Completeness",
    "Gap",
    "Gaps",
    "PatchGrid",
    "SurfacePatches",
    "assess_completeness",
    "found_in",
]

#: most cells of one cloud in memory: 24 bytes each
MOST = 60_000_000
#: bits of each index of a cell, and what is added so that it is not negative
_BITS, _HALF = 21, 1 << 20
#: cells waiting to be merged
_WAITING = 2_000_000
#: steps to the neighbours that share a face
_FACES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
#: half of the 26 neighbours: each pair once
_FORWARD = tuple(
    (i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if (i, j, k) > (0, 0, 0)
)
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
    #: their number
    cells: int


@dataclass(frozen=True)
class Gaps(Result):
    """The largest gaps of every kind."""

    no_station: tuple[Gap, ...]
    one_station: tuple[Gap, ...]
    #: with a larger sigma than required
    sigma_not_reached: tuple[Gap, ...]


@dataclass(frozen=True)
class Completeness(
    Result,
    without=("modelled", "centres", "seen", "sigmas"),
    also=("surface", "cells", "seen_by", "sigma"),
):
    """Cells of the surface and what the stations know of them."""

    #: side of a cell [m]
    cell: float
    #: is the surface that of a model, or of all clouds?
    modelled: bool
    #: middles of the cells (n, 3) [m]
    centres: Array
    #: number of stations that see each (n,)
    seen: NDArray[np.int64]
    #: of the best station in each (n,) [m], NaN where none is known
    sigmas: Array
    #: the sigma that was asked for [m]
    required_sigma: float | None
    #: share of the cells that each sees
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
    def seen_by(self) -> dict[str, int]:
        """Cells by the number of stations that see them."""
        count = np.bincount(np.minimum(self.seen, 3), minlength=4).tolist()
        return dict(zip(SEEN_BY, count, strict=True))

    @property
    def sigma(self) -> dict[str, int] | None:
        """Cells that are seen by whether the required sigma is reached; null if none is asked."""
        if self.required_sigma is None:
            return None
        there, known = self.seen > 0, np.isfinite(self.sigmas)
        reached = known & (np.where(known, self.sigmas, np.inf) <= self.required_sigma)
        return {
            "reached": int(np.count_nonzero(there & reached)),
            "not reached": int(np.count_nonzero(there & known & ~reached)),
            "unknown": int(np.count_nonzero(there & ~known)),
        }


def assess_completeness(
    grid: PatchGrid,
    stations: Mapping[str, SurfacePatches],
    *,
    model: Index | None = None,
    required: float | None = None,
    gaps: int = 10,
) -> Completeness:
    """Assess what stations saw of a surface.

    Parameters
    ----------
    grid
        The cells.
    stations
        Merged patches of each station, by name.
    model : array (n,)
        Cells of the surface; the union of the stations if None.
    required
        Sigma to be reached [m].
    gaps
        How many of the largest to name of each sort.
    """
    cells = _union(stations) if model is None else np.unique(model)
    seen = np.zeros(len(cells), dtype=np.int64)
    best = np.full(len(cells), np.inf)
    shares = {}
    for name, patches in stations.items():
        count, total = _around(patches, cells)
        there = count > 0
        seen += there
        variance = np.divide(total, count, out=np.full(len(cells), np.inf), where=there)
        known = there & (total > 0)
        best[known] = np.minimum(best[known], variance[known])
        shares[name] = float(there.mean()) if len(cells) else 0.0
    sigma = np.sqrt(np.where(np.isfinite(best), best, np.nan))
    weak = np.zeros(len(cells), dtype=bool)
    if required is not None:
        weak = (seen > 0) & (np.nan_to_num(sigma, nan=0.0) > required)
    return Completeness(
        cell=grid.size,
        modelled=model is not None,
        centres=grid.centres(cells),
        seen=seen,
        sigmas=sigma,
        required_sigma=required,
        stations=shares,
        gaps=Gaps(*(_gaps(grid, cells[lack], gaps) for lack in (seen == 0, seen == 1, weak))),
    )


def _union(stations: Mapping[str, SurfacePatches]) -> Index:
    """Cells with enough points of all stations together."""
    empty = np.zeros(0, dtype=np.int64)
    keys = np.concatenate([empty, *(p.keys for p in stations.values())])
    counts = np.concatenate([empty, *(p.counts for p in stations.values())])
    cells, where = np.unique(keys, return_inverse=True)
    chosen: Index = cells[np.bincount(where, weights=counts, minlength=len(cells)) >= _STRAY]
    return chosen


def _around(patches: SurfacePatches, cells: Index) -> tuple[NDArray[np.int64], Array]:
    """Points (n,) and variances (n,) of a station in cells and those that share a face."""
    count, total = np.zeros(len(cells), dtype=np.int64), np.zeros(len(cells))
    for step in ((0, 0, 0), *_FACES):
        place = found_in(patches.keys, PatchGrid.shifted(cells, step))
        hit = place >= 0
        count[hit] += patches.counts[place[hit]]
        total[hit] += patches.sums[place[hit]]
    return count, total


def _gaps(grid: PatchGrid, cells: Index, most: int) -> tuple[Gap, ...]:
    """The largest groups of neighbouring cells (n,), sorted."""
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
    size = np.bincount(label)
    centres = grid.centres(cells)
    out = []
    for group in np.argsort(-size, kind="stable")[:most]:
        members = centres[label == group]
        low, high = members.min(axis=0), members.max(axis=0)
        extent = high - low + grid.size
        out.append(Gap(_triple((low + high) / 2), _triple(extent), int(size[group])))
    return tuple(out)


def _triple(x: Array) -> tuple[float, float, float]:
    """Three coordinates as plain numbers."""
    return float(x[0]), float(x[1]), float(x[2])


@dataclass(frozen=True)
class PatchGrid:
    """Cubic cells around an origin."""

    #: corner of the cell (0, 0, 0) (3,) [m]
    origin: Array
    #: side of a cell [m]
    size: float

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

    def indices(self, keys: Index) -> Index:
        """Signed indices (n, 3) of cells (n,)."""
        mask = (1 << _BITS) - 1
        parts = (keys >> (2 * _BITS), (keys >> _BITS) & mask, keys & mask)
        return np.stack(parts, axis=1) - _HALF

    def centres(self, keys: Index) -> Array:
        """Middles (n, 3) [m] of cells (n,)."""
        middle: Array = self.origin + (self.indices(keys) + 0.5) * self.size
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
        """Count points by their cells.

        Parameters
        ----------
        keys : array (n,)
            Cells of the points.
        variance : array (n,)
            Of the points [m^2], None where it is not known.
        """
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
