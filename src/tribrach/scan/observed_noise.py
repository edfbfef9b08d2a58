"""The noise of ranges as a scan shows it: residuals of points from the planes of small patches.

Method section 5.8. A patch is a window of directions, never a choice by distance, so that no point
is in it or out of it for its error. On a plane ``m . x = 1`` the reciprocal range is linear in the
direction, ``1/rho = m . u``: three unknowns by plain least squares, whose residuals are along the
beam as the noise of ranges is (Wujanz et al. 2018; Schmitz et al. 2019). What is no plane is left
out: windows that are not filled, that hold points far off, and that are significantly curved.
Roughness of the surface stays in; :mod:`tribrach.scan.noise_law` sets rough patches aside.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.angular_step import angular_step
from tribrach.scan.coordinate_step import coordinate_step
from tribrach.scan.scan import Chunk, Scan
from tribrach.statistics import f

#: variances are never less [m^2]
LEAST_VARIANCE = 1e-18


@dataclass(frozen=True)
class PatchGates:
    """What counts as a patch of a plane, chosen on simulated rooms (see test_noise_law)."""

    points: int = 24  #: points that a patch is made of at least: 21 degrees of freedom
    fewest: int = 3  #: rows and columns that a patch has at least, so that both slopes are known
    #: width that a patch grows to where points are closer [m]: several beams wide, and walls are
    #: flat to a tenth of a millimetre over it
    width: float = 0.10
    doublings: int = 4  #: doublings of the width in rows and columns at most
    widest: float = 1.0  #: patches of farther points may become so wide [m], then they are left out
    filled: float = 0.75  #: share of a window's pixels that hold a point
    flattest: float = 0.26  #: flattest incidence, as a cosine: 75 degrees
    #: points farther from the plane than so many standard deviations of the patch are no points of
    #: it; a patch with more than this share of such points is no plane
    outlier: float = 4.5
    outliers: float = 0.02
    #: a patch is curved if the three quadratic terms are significant at this level, and their mean
    #: square is this share of the variance
    curved: float = 1e-3
    curvature: float = 0.1
    noisiest: float = 0.1  #: no scanner has more noise than this [m]
    pole: float = 0.1  #: V of points that have H, from the standing axis [rad]
    patches: int = 10_000  #: patches that are worked with at most, spread over all


GATES = PatchGates()

#: records that are read at most, and blocks of consecutive ones that they are spread over
_RECORDS, _BLOCKS = 500_000, 5
#: rounds of leaving out points that are far off
_ROUNDS = 3
#: neighbours in the grid that tell its steps, at least
_FEW = 50
#: fewer points hold no patch
_FEWEST = 100
#: deviations below this are those of arithmetic [m]
_FINEST = 1e-7
#: a pixel number of an image is below this
_LARGE = 2**31


@dataclass(frozen=True, eq=False)
class ObservedNoise:
    """Points on planar patches and how far they are from their planes, along their beams."""

    residual: Array  #: (m,), range measured less range of the plane [m]
    #: (m,), share of a point's error that its residual shows: one less its leverage
    redundancy: Array
    intensity: Array  #: (m,), as in the file, NaN without
    range: Array  #: (m,), of the plane [m]
    cosine: Array  #: (m,), of the incidence angle
    #: (m, 2), change of the range with a movement across the beam, horizontally and vertically
    #: [m/m]; the sum of their squares is the squared tangent of the incidence
    slope: Array
    patch: Index  #: (m,), number of the patch, ascending from 0
    #: (m,), of the scanner's grid, or of a raster of directions where there is none
    row: Index
    column: Index
    pitch: Array  #: (patches, 2), angles from row to row and from column to column [rad]
    gridded: bool = False  #: true if they are the scanner's
    step: float = 0.0  #: step of the coordinates [m], 0 if they are fine
    #: windows that were filled, those of them that are curved, and those with too many points off
    windows: int = 0
    curved: int = 0
    uneven: int = 0

    def __len__(self) -> int:
        """Points."""
        return len(self.residual)

    @property
    def patches(self) -> int:
        """Number of patches."""
        return int(self.patch[-1]) + 1 if len(self) else 0

    @property
    def intense(self) -> bool:
        """True if there are intensities, and they differ."""
        known = self.intensity[np.isfinite(self.intensity)]
        return len(known) == len(self) > 0 and bool(np.ptp(known) > 0)

    def mean(self, values: Array) -> Array:
        """Means (patches,) of values (m,) over the points of each patch."""
        sums = np.bincount(self.patch, values).astype(float)
        return sums / np.maximum(np.bincount(self.patch), 1)

    @property
    def redundancies(self) -> Array:
        """Degrees of freedom (patches,)."""
        return np.bincount(self.patch, self.redundancy).astype(float)

    @property
    def variances(self) -> Array:
        """Variances (patches,) [m^2] of one range, by what the planes left free."""
        return np.bincount(self.patch, self.residual**2) / self.redundancies

    def stated(self, noise: ScanNoise, *, incidence: bool = True) -> Array:
        """Variances (m,) [m^2] along the beam that a noise states for these points.

        Noise of the range and, over the slope of the surface, of angles and footprint (method
        section 5.8), with the rounding of coordinates.
        """
        cosine = self.cosine if incidence else 1.0
        along = noise.range_sigma(self.range, cosine, self.intensity) ** 2
        spot = noise.beam_angle(self.range) ** 2
        across = np.array([noise.horizontal, noise.vertical]) ** 2
        slanted = ((self.slope * self.range[:, None]) ** 2 * (across + spot[:, None])).sum(axis=1)
        # a law of scans without noise states none, which no residual can be divided by
        return np.asarray(np.maximum(along + slanted + self.rounding, LEAST_VARIANCE))

    @property
    def rounding(self) -> Array:
        """Variances (m,) [m^2] along the beam of coordinates in steps: uniform errors."""
        return self.step**2 / 12 / self.cosine**2

    def of_patches(self, kept: NDArray[np.bool_]) -> ObservedNoise:
        """Take the points of some patches, by a mask (patches,)."""
        mine = kept[self.patch]
        number = np.cumsum(kept) - 1
        return replace(
            self,
            residual=self.residual[mine],
            redundancy=self.redundancy[mine],
            intensity=self.intensity[mine],
            range=self.range[mine],
            cosine=self.cosine[mine],
            slope=self.slope[mine],
            patch=number[self.patch[mine]],
            row=self.row[mine],
            column=self.column[mine],
            pitch=self.pitch[kept],
        )


def observed_noise(
    scan: Scan, *, records: int = _RECORDS, width: float = GATES.width
) -> ObservedNoise:
    """Find planar patches in a scan, and the residuals of their points.

    Of a larger scan blocks of consecutive records are read, so that the time does not grow with
    the scan.

    The scan is as it is used: scanner at zero, face chosen, calibrated. ``width`` is what patches
    grow to where points are close [m].
    """
    if scan.origin == "unknown":
        return _nothing()
    parts = [_of_block(block, width) for block in _blocks(scan, records)]
    found = joined(parts)
    if found.patches > GATES.patches:
        kept = np.zeros(found.patches, dtype=bool)
        kept[np.linspace(0, found.patches - 1, GATES.patches).astype(np.int64)] = True
        found = found.of_patches(kept)
    return found


def _blocks(scan: Scan, records: int) -> Iterator[Chunk]:
    """Blocks of consecutive points, the whole scan where it is small."""
    if scan.records is None or scan.records <= records:
        left, chunks = records, []
        for chunk in scan.chunks():
            chunks.append(chunk)
            left -= len(chunk) + chunk.dropped
            if left <= 0:
                break
        if chunks:
            yield _one(chunks)
        return
    size = records // _BLOCKS
    for start in np.linspace(0, scan.records - size, _BLOCKS).astype(int):
        yield from islice(scan.chunks(size, start=int(start)), 1)


def _one(chunks: Sequence[Chunk]) -> Chunk:
    """Chunks as one, with the fields that are looked at."""
    wanted = ("intensity", "row", "column", "number_of_returns")
    names = [n for n in wanted if all(n in chunk.values for chunk in chunks)]
    values = {n: np.concatenate([np.asarray(chunk.values[n]) for chunk in chunks]) for n in names}
    return Chunk(np.concatenate([chunk.xyz for chunk in chunks]), values)


def _of_block(chunk: Chunk, width: float) -> ObservedNoise:
    """Patches of consecutive points; echoes that share a beam are left out."""
    several = chunk.values.get("number_of_returns")
    alone = np.ones(len(chunk), bool) if several is None else np.asarray(several) <= 1

    def of(name: str) -> NDArray[Any] | None:
        values = chunk.values.get(name)
        return None if values is None else np.asarray(values)[alone]

    return patch_residuals(chunk.xyz[alone], of("intensity"), of("row"), of("column"), width=width)


def joined(parts: Sequence[ObservedNoise]) -> ObservedNoise:
    """The patches of several scans or blocks of one scanner, numbered through."""
    parts = [part for part in parts if len(part)] or list(parts[:1])
    if not parts:
        return _nothing()
    first = np.cumsum([0, *(part.patches for part in parts)])
    return ObservedNoise(
        **{
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in ("residual", "redundancy", "intensity", "range", "cosine", "slope")
        },
        patch=np.concatenate([part.patch + k for part, k in zip(parts, first, strict=False)]),
        row=np.concatenate([part.row for part in parts]),
        column=np.concatenate([part.column for part in parts]),
        pitch=np.concatenate([part.pitch for part in parts]),
        gridded=all(part.gridded for part in parts),
        step=max(part.step for part in parts),
        windows=sum(part.windows for part in parts),
        curved=sum(part.curved for part in parts),
        uneven=sum(part.uneven for part in parts),
    )


def _nothing() -> ObservedNoise:
    """No patches."""
    none, pairs, number = np.empty(0), np.empty((0, 2)), np.empty(0, dtype=np.int64)
    return ObservedNoise(none, none, none, none, none, pairs, number, number, number, pairs)


@dataclass(frozen=True, eq=False)
class _Raster:
    """Rows and columns (n,) of points, and the angles [rad] from one to the next."""

    row: Index
    column: Index
    step_row: float
    step_column: float
    gridded: bool


def patch_residuals(
    xyz: Array,
    intensity: NDArray[Any] | None = None,
    row: NDArray[Any] | None = None,
    column: NDArray[Any] | None = None,
    *,
    width: float = GATES.width,
) -> ObservedNoise:
    """Find planar patches among points, and the residuals along the beams.

    There is one point for each beam; rows and columns are those of the scanner's grid.

    Method section 5.8.
    """
    length = np.linalg.norm(xyz, axis=1)
    flat = np.hypot(xyz[:, 0], xyz[:, 1])
    good = np.isfinite(length) & (length > 0)
    good &= flat > np.sin(GATES.pole) * length
    if good.sum() < _FEWEST:
        return _nothing()
    if not good.all():
        xyz, length = xyz[good], length[good]
        intensity, row, column = (None if a is None else a[good] for a in (intensity, row, column))
    raster = _raster(xyz, length, row, column)
    if raster is None:
        return _nothing()
    order, patch = _windows(raster, length, width)
    if not len(order):
        return _nothing()
    light = np.full(len(order), np.nan) if intensity is None else intensity[order].astype(float)
    found = _Fit(xyz[order], length[order], patch).observed(
        light, raster.row[order], raster.column[order], raster.gridded
    )
    pitch = np.tile([raster.step_row, raster.step_column], (found.patches, 1))
    return replace(found, step=coordinate_step(xyz), pitch=pitch)


def _raster(
    xyz: Array, length: Array, row: NDArray[Any] | None, column: NDArray[Any] | None
) -> _Raster | None:
    """The scanner's grid, or one of directions; None where points do not tell their spacing."""
    if row is not None and column is not None:
        r, c = row.astype(np.int64), column.astype(np.int64)
        down, beside = _grid_step(xyz, length, c, r), _grid_step(xyz, length, r, c)
        if down > 0 and beside > 0:
            return _Raster(r - r.min(), c - c.min(), down, beside, True)
    try:
        step_h, step_v = angular_step(xyz)
    except InputError:
        return None
    h = np.arctan2(xyz[:, 1], xyz[:, 0])
    v = np.arccos(np.clip(xyz[:, 2] / length, -1, 1))
    if min(step_h, step_v) * _LARGE < 2 * np.pi:
        return None
    down = np.floor((v - v.min()) / step_v + 0.5).astype(np.int64)
    beside = np.floor((h - h.min()) / step_h + 0.5).astype(np.int64)
    return _Raster(down, beside, step_v, step_h, False)


def _grid_step(xyz: Array, length: Array, line: Index, place: Index) -> float:
    """Median angle [rad] between neighbours along the lines of a grid, 0 if there are too few."""
    order = np.lexsort((place, line))
    first, second = order[:-1], order[1:]
    beside = (line[first] == line[second]) & (place[second] - place[first] == 1)
    first, second = first[beside], second[beside]
    if len(first) < _FEW:
        return 0.0
    gap = xyz[first] / length[first, None] - xyz[second] / length[second, None]
    return float(np.median(np.linalg.norm(gap, axis=1)))


def _windows(raster: _Raster, length: Array, width: float) -> tuple[Index, Index]:
    """Points (m,) of filled windows, patch by patch, and the numbers (m,) of these.

    The least window has about as much height as breadth. It is doubled until it is as wide as
    asked for at the mean range of the points of the least one, which all go together: a choice by
    the range of single points would be one by their errors.
    """
    across = max(GATES.fewest, round(np.sqrt(GATES.points * raster.step_row / raster.step_column)))
    tall = max(GATES.fewest, -(-GATES.points // across))
    across = max(across, -(-GATES.points // tall))
    cell_row, cell_column = raster.row // tall, raster.column // across
    key = cell_row * (int(cell_column.max()) + 1) + cell_column
    _, cell, count = np.unique(key, return_inverse=True, return_counts=True)
    mean = np.bincount(cell, length) / count
    extent = mean * np.sqrt(tall * raster.step_row * across * raster.step_column)
    doubled = np.clip(np.floor(np.log2(width / extent) + 0.5), 0, GATES.doublings).astype(np.int64)
    near = np.maximum(tall * raster.step_row, across * raster.step_column) * mean < GATES.widest
    level = np.where(near, doubled, -1)[cell]
    orders, numbers, first = [], [], 0
    for size in range(GATES.doublings + 1):
        at = np.flatnonzero(level == size)
        if not len(at):
            continue
        window = (cell_row[at] >> size) * (int(cell_column.max()) + 1) + (cell_column[at] >> size)
        order = at[np.argsort(window, kind="stable")]
        _, number, count = np.unique(window, return_inverse=True, return_counts=True)
        full = count >= GATES.filled * (tall << size) * (across << size)
        number = np.sort(number)
        kept = full[number]
        orders.append(order[kept])
        numbers.append(first + (np.cumsum(full) - 1)[number[kept]])
        first += int(full.sum())
    if not orders:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    order, number = np.concatenate(orders), np.concatenate(numbers)
    if first > GATES.patches:
        chosen = np.zeros(first, dtype=bool)
        chosen[np.linspace(0, first - 1, GATES.patches).astype(np.int64)] = True
        order, number = order[chosen[number]], (np.cumsum(chosen) - 1)[number[chosen[number]]]
    return order, number


class _Fit:
    """Planes through all patches at once."""

    def __init__(self, xyz: Array, length: Array, patch: Index) -> None:
        """Directions in axes of each patch, in units of its size."""
        self._length, self._patch = length, patch
        self._count = int(patch[-1]) + 1
        direction = xyz / length[:, None]
        axis = np.stack([self._sum(direction[:, k]) for k in range(3)], axis=1)
        axis /= np.linalg.norm(axis, axis=1)[:, None]
        level = np.stack([-axis[:, 1], axis[:, 0], np.zeros(len(axis))], axis=1)
        level /= np.linalg.norm(level, axis=1)[:, None]
        steep = np.cross(axis, level)
        frame = np.stack([axis, level, steep], axis=1)
        local = np.einsum("nij,nj->ni", frame[patch], direction)
        size = np.sqrt(self._sum(local[:, 1] ** 2 + local[:, 2] ** 2) / self._sum())
        self._size = np.maximum(size, 1e-12)
        scaled = local[:, 1:] / self._size[patch, None]
        self._base = np.column_stack([local[:, 0], scaled])
        self._middle = self._sum(length) / self._sum()
        self._direction, self._frame = direction, frame

    def _sum(self, values: Array | None = None, kept: NDArray[np.bool_] | None = None) -> Array:
        """Sums (patches,) of values (m,), number of points by default, over points kept."""
        if kept is not None:
            values = kept.astype(float) if values is None else values * kept
        return np.bincount(self._patch, values, self._count).astype(float)

    def observed(self, light: Array, row: Index, column: Index, gridded: bool) -> ObservedNoise:
        """Fit, drop patches that are not planes, and return the rest."""
        patch, length = self._patch, self._length
        kept = np.ones(len(patch), dtype=bool)
        columns = self._base
        # an error of rho is one of 1/rho over -rho^2
        weight = (length / self._middle[patch]) ** 4
        all_points = self._sum()
        for _ in range(_ROUNDS):
            plane, inverse = self._solve(columns, 1 / length, weight, kept)
            reciprocal = np.einsum("ni,ni->n", columns, plane[patch])
            with np.errstate(divide="ignore", invalid="ignore"):
                residual = length - 1 / reciprocal
            free = np.maximum(self._sum(kept=kept) - 3, 1)
            sigma = np.sqrt(self._sum(residual**2, kept) / free)
            with np.errstate(invalid="ignore"):
                off = ~(np.abs(residual) <= GATES.outlier * sigma[patch] + _FINEST)
            if not (kept & off).any():
                break
            kept &= ~off
        leverage = np.einsum("ni,nij,nj->n", columns, inverse[patch], columns) * weight
        normal = self._normals(plane)
        cosine = np.abs(np.einsum("ni,ni->n", normal[patch], self._direction))
        slope = self._slopes(normal, cosine)
        even = self._sum(kept=kept) >= (1 - GATES.outliers) * all_points
        steep = ~(self._least(cosine) >= GATES.flattest) | ~(sigma < GATES.noisiest)
        curved = self._curved(columns, residual, kept) & ~steep & even
        good = even & ~steep & ~curved & (self._sum(kept=kept) >= 0.9 * GATES.filled * GATES.points)
        mine = kept & good[patch]
        number = np.cumsum(good) - 1
        return ObservedNoise(
            residual=residual[mine],
            redundancy=np.clip(1 - leverage[mine], 0.0, 1.0),
            intensity=light[mine],
            range=1 / reciprocal[mine],
            cosine=cosine[mine],
            slope=slope[mine],
            patch=number[patch[mine]],
            row=row[mine],
            column=column[mine],
            pitch=np.empty((0, 2)),
            gridded=gridded,
            windows=self._count,
            curved=int(curved.sum()),
            uneven=int((~even).sum()),
        )

    def _solve(
        self, columns: Array, right: Array, weight: Array, kept: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """Unknowns (patches, k) and inverses (patches, k, k) of weighted least squares."""
        k = columns.shape[1]
        normal = np.empty((self._count, k, k))
        side = np.empty((self._count, k))
        for i in range(k):
            side[:, i] = self._sum(columns[:, i] * right * weight, kept)
            for j in range(i, k):
                normal[:, i, j] = self._sum(columns[:, i] * columns[:, j] * weight, kept)
                normal[:, j, i] = normal[:, i, j]
        normal += 1e-12 * np.eye(k)
        inverse = np.asarray(np.linalg.inv(normal), dtype=float)
        unknown: Array = np.einsum("nij,nj->ni", inverse, side)
        return unknown, inverse

    def _normals(self, plane: Array) -> Array:
        """Unit normals (patches, 3), away from the scanner."""
        scale = np.stack([np.ones(self._count), 1 / self._size, 1 / self._size], axis=1)
        normal = np.einsum("ni,nij->nj", plane * scale, self._frame)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])

    def _slopes(self, normal: Array, cosine: Array) -> Array:
        """Change (m, 2) of the range with a movement across the beam, horizontal and vertical."""
        u = self._direction
        flat = np.hypot(u[:, 0], u[:, 1])
        n = normal[self._patch]
        with np.errstate(divide="ignore", invalid="ignore"):
            level = (n[:, 1] * u[:, 0] - n[:, 0] * u[:, 1]) / flat
            down = (n[:, 0] * u[:, 0] + n[:, 1] * u[:, 1]) * u[:, 2] / flat - n[:, 2] * flat
            return np.asarray(-np.stack([level, down], axis=1) / cosine[:, None])

    def _least(self, values: Array) -> Array:
        """Smallest (patches,) of values (m,), NaN where one is."""
        starts = np.searchsorted(self._patch, np.arange(self._count))
        return np.asarray(np.minimum.reduceat(values, starts))

    def _curved(
        self, columns: Array, residual: Array, kept: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Patches (patches,) whose residuals have significant quadratic terms."""
        a, b = columns[:, 1], columns[:, 2]
        six = np.column_stack([columns, a * a, a * b, b * b])
        finite = np.where(np.isfinite(residual), residual, 0.0)
        unknown, _ = self._solve(six, finite, np.ones(len(finite)), kept)
        shape = np.einsum("ni,ni->n", six, unknown[self._patch])
        whole, left = self._sum(finite**2, kept), self._sum((finite - shape) ** 2, kept)
        free = np.maximum(self._sum(kept=kept) - 6, 1)
        bent, variance = np.maximum(whole - left, 0), left / free + _FINEST**2
        significant = f.sf(bent / 3 / variance, 3, free) < GATES.curved
        return np.asarray(significant & (bent / free > GATES.curvature * variance))
