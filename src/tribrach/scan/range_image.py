"""Lays a scan out as an image of ranges: neighbours in the image are neighbours in space.

Pixel (row, column) looks along ``H = first_h + column step_h``, ``V = first_v + row step_v``
(scanner frame, geometry.polar), whatever order the scanner wrote. Scans with a grid of rows and
columns keep it, turned so that H and V increase, its back face laid beside the front face; other
clouds are binned by direction. Where several points share a pixel the nearest return counts.

In a scanner's grid columns are planes through the standing axis, H linear in the column and V
linear in the row, whatever way they are numbered. A mirror that turns full circle writes the back
face into the same column: there H is opposite and V runs the other way. Both faces are fitted and
laid on one grid of H and V.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index, Single
from tribrach.errors import InputError
from tribrach.kernels import njit
from tribrach.scan.angular_step import angular_step
from tribrach.statistics import robust_sigma

#: points looked at to fit the layout
_SAMPLE = 400_000
#: directions this close to a pole [rad] do not tell H
_POLE = 0.1
#: a grid follows H and V if it deviates by less than this many steps at nine of ten points
_STRAIGHT = 0.75
#: numbers of points over pixels
Indices = NDArray[np.int32]
#: an image has at most this many pixels for every point, and never fewer than the second number
_PIXELS_PER_POINT, _PIXELS = 4, 4_000_000
#: directions that tell where a grid lies between the pixels
_SOME = 50_000
#: an image that covers this share of the circle is closed to the full circle
_FULL_CIRCLE = 0.98


@dataclass(frozen=True, eq=False)
class RangeImage:
    """Ranges over directions, and the point behind every pixel."""

    index: Indices  #: (rows, columns), number of the point (int32), -1 where there is none
    range: Single  #: (rows, columns), range [m] (float32), NaN where there is none
    #: directions of pixel centres [rad]
    first_h: float
    first_v: float
    step_h: float
    step_v: float
    wraps: bool  #: true if the last column is the neighbour of the first
    gridded: bool  #: true if the layout comes from the scanner's rows and columns

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.index.shape[0], self.index.shape[1]

    def h(self, column: NDArray[Any] | None = None) -> Array:
        """H [rad] of columns, of all of them by default."""
        columns = np.arange(self.shape[1]) if column is None else column
        return np.asarray(self.first_h + columns * self.step_h, dtype=float)

    def v(self, row: NDArray[Any] | None = None) -> Array:
        """V [rad] of rows, of all of them by default."""
        rows = np.arange(self.shape[0]) if row is None else row
        return np.asarray(self.first_v + rows * self.step_v, dtype=float)

    def pixel(self, h: float, v: float) -> tuple[float, float]:
        """Row and column, with fractions, of a direction [rad]; they may lie outside the image."""
        turn = (h - self.first_h) % (2 * np.pi)
        return (v - self.first_v) / self.step_v, turn / self.step_h

    def filled(self, gap: int = 1) -> Single:
        """Close holes of the ranges of up to ``gap`` pixels.

        A hole is closed where the points on both sides of it, in its row or its column, differ by
        less than 5 cm or 1 % of the range; it gets their mean. ``index`` still tells the holes.
        """
        return np.asarray(_closed(self.range, gap, self.wraps), dtype=np.float32)


def organise(
    xyz: Array,
    rows: NDArray[Any] | None = None,
    columns: NDArray[Any] | None = None,
    *,
    step: tuple[float, float] | None = None,
) -> RangeImage:
    """Lay points out as a range image; a grid off H and V is not used, None steps are estimated."""
    if len(xyz) < 2 or not np.any(xyz[1:] != xyz[0]):
        raise InputError("a range image takes two points with different directions")
    if rows is not None and columns is not None:
        layout = lay_out(xyz, np.asarray(rows), np.asarray(columns))
        if layout is not None and _affordable(layout.rows, layout.columns, len(xyz)):
            index, ranges = _scatter(xyz, layout.pixel, layout.rows, layout.columns)
            corner = (layout.first_h, layout.first_v, layout.step_h, layout.step_v)
            return RangeImage(index, ranges, *corner, layout.wraps, True)
    return _binned(xyz, angular_step(xyz) if step is None else step)


def _affordable(rows: int, columns: int, points: int) -> bool:
    """True if the image is in proportion to the points: row numbers of a file may be wild."""
    return rows * columns <= max(_PIXELS, _PIXELS_PER_POINT * points)


def _binned(xyz: Array, step: tuple[float, float]) -> RangeImage:
    """Points by direction, pixels grown until the image is in proportion to the points."""
    hv = _directions(xyz)
    h_low, h_span = _arc(hv[:, 0])
    v_low, v_high = float(np.nanmin(hv[:, 1])), float(np.nanmax(hv[:, 1]))
    step_h, step_v = step
    while not _affordable(int((v_high - v_low) / step_v) + 1, int(h_span / step_h) + 1, len(xyz)):
        step_h, step_v = 1.25 * step_h, 1.25 * step_v
    wraps = h_span > _FULL_CIRCLE * 2 * np.pi
    columns, h_high = round(2 * np.pi / step_h), h_low + h_span
    if wraps:
        step_h = 2 * np.pi / columns
    h_low, v_low = h_low + _phase(hv[:, 0], h_low, step_h), v_low + _phase(hv[:, 1], v_low, step_v)
    columns = columns if wraps else int((h_high - h_low) / step_h + 0.5) + 1
    rows = int((v_high - v_low) / step_v + 0.5) + 1
    pixel = _pixels(hv, (h_low, v_low, step_h, step_v), rows, columns)
    index, ranges = _scatter(xyz, pixel, rows, columns)
    return RangeImage(
        index=index,
        range=ranges,
        first_h=h_low,
        first_v=v_low,
        step_h=step_h,
        step_v=step_v,
        wraps=wraps,
        gridded=False,
    )


def _phase(angle: NDArray[np.float32], low: float, step: float) -> float:
    """By how much [rad] pixels start before ``low`` so that a scanner's grid meets their centres.

    Points between two pixels fall into either by chance, and leave holes. Between -step and 0.
    """
    some = angle[:: max(1, len(angle) // _SOME)].astype(float)
    turn = (some[np.isfinite(some)] - low) * (2 * np.pi / step)
    ahead = float(np.arctan2(np.sin(turn).mean(), np.cos(turn).mean())) / (2 * np.pi)
    return step * (ahead - 1 if ahead > 0 else ahead)


def _arc(h: NDArray[np.float32]) -> tuple[float, float]:
    """Start and length of the arc that holds all H: the complement of the widest gap."""
    taken = _taken(h, 3600)
    bins = len(taken)
    used = np.flatnonzero(taken)
    if len(used) == 0:
        raise InputError("no point of the cloud has a direction: all are at the origin or invalid")
    gaps = np.diff(np.append(used, used[0] + bins))
    widest = int(np.argmax(gaps))
    if gaps[widest] <= bins // 60:
        return float(-np.pi), 2 * np.pi
    cut = -np.pi + (used[widest] + gaps[widest]) % bins * (2 * np.pi / bins)
    clean = h[np.isfinite(h)]
    turned = (clean - cut + 1e-3) % (2 * np.pi)
    low = float(turned.min())
    return float(cut - 1e-3 + low), float(turned.max()) - low


@njit(cache=True, nogil=True)
def _taken(h: NDArray[np.float32], bins: int) -> NDArray[np.bool_]:
    """Parts (bins,) of the circle that hold directions."""
    out = np.zeros(bins, dtype=np.bool_)
    for value in h:
        if not np.isnan(value):
            out[int((value + np.pi) * (bins / (2 * np.pi))) % bins] = True
    return out


@njit(cache=True, nogil=True)
def _directions(xyz: Array) -> NDArray[np.float32]:
    """H and V (n, 2) [rad] of points, NaN where they have none; float32 errs by 0.2 microrad."""
    out = np.empty((len(xyz), 2), dtype=np.float32)
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        flat = np.sqrt(x * x + y * y)
        if not np.isfinite(flat + z) or flat + abs(z) == 0:
            out[i, 0] = out[i, 1] = np.nan
        else:
            out[i, 0], out[i, 1] = np.arctan2(y, x), np.arctan2(flat, z)
    return out


@njit(cache=True, nogil=True)
def _pixels(
    hv: NDArray[np.float32], corner: tuple[float, float, float, float], rows: int, columns: int
) -> NDArray[np.int32]:
    """Pixel number (n,) of directions, -1 for none."""
    h0, v0, step_h, step_v = corner
    out = np.full(len(hv), -1, dtype=np.int32)
    for i in range(len(hv)):
        if np.isnan(hv[i, 0]):
            continue
        turn = hv[i, 0] - h0
        if turn < -0.5 * step_h:
            turn += 2 * np.pi
        column = int(turn / step_h + 0.5) % columns
        row = min(max(int((hv[i, 1] - v0) / step_v + 0.5), 0), rows - 1)
        out[i] = row * columns + column
    return out


def _scatter(xyz: Array, pixel: Indices, rows: int, columns: int) -> tuple[Indices, Single]:
    """Index and range images (rows, columns) of points by pixel number (n,)."""
    index = np.full(rows * columns, -1, dtype=np.int32)
    ranges = np.full(rows * columns, np.nan, dtype=np.float32)
    _nearest(xyz, pixel, index, ranges)
    return index.reshape(rows, columns), ranges.reshape(rows, columns)


@njit(cache=True, nogil=True)
def _nearest(xyz: Array, pixel: Indices, index: Indices, ranges: Single) -> None:
    """Write every point into its pixel unless a nearer one is there."""
    for i in range(len(xyz)):
        at = pixel[i]
        if at < 0:
            continue
        r = np.float32(np.sqrt(xyz[i, 0] ** 2 + xyz[i, 1] ** 2 + xyz[i, 2] ** 2))
        if np.isfinite(r) and r > 0 and (index[at] < 0 or r < ranges[at]):
            index[at], ranges[at] = i, r


@njit(cache=True, nogil=True)
def _closed(ranges: Single, gap: int, wraps: bool) -> Single:
    """Ranges with small holes closed between neighbours that agree."""
    rows, columns = ranges.shape
    out = ranges.copy()
    for i in range(rows):
        for j in range(columns):
            if np.isnan(ranges[i, j]):
                across = _bridge(ranges, i, j, 0, 1, gap, wraps)
                out[i, j] = (
                    across if not np.isnan(across) else _bridge(ranges, i, j, 1, 0, gap, wraps)
                )
    return out


@njit(cache=True, nogil=True)
def _bridge(ranges: Single, i: int, j: int, di: int, dj: int, gap: int, wraps: bool) -> float:
    """Mean of the first ranges on both sides of a hole not wider than ``gap``, else NaN."""
    rows, columns = ranges.shape
    sides = np.full(2, np.nan)
    steps = np.zeros(2, dtype=np.int64)
    for side in range(2):
        sign = 2 * side - 1
        for k in range(1, gap + 1):
            a, b = i + sign * k * di, j + sign * k * dj
            if wraps:
                b %= columns
            if a < 0 or a >= rows or b < 0 or b >= columns:
                break
            if not np.isnan(ranges[a, b]):
                sides[side], steps[side] = ranges[a, b], k
                break
    if np.isnan(sides[0] + sides[1]) or steps[0] + steps[1] > gap + 1:
        return np.nan
    if abs(sides[0] - sides[1]) > max(0.05, 0.01 * sides[0]):
        return np.nan
    mean: float = 0.5 * (sides[0] + sides[1])
    return mean


@dataclass(frozen=True, eq=False)
class PixelNumbers:
    """Pixels of points in an image whose H and V increase."""

    pixel: NDArray[np.int32]  #: (n,), number of the pixel of each point, -1 for none
    #: size of the image
    rows: int
    columns: int
    #: directions of pixel centres [rad]
    first_h: float
    first_v: float
    step_h: float
    step_v: float
    wraps: bool  #: true if the last column is the neighbour of the first


def lay_out(xyz: Array, row: Index, column: Index) -> PixelNumbers | None:
    """Fit the scanner's rows and columns to directions."""
    some = slice(None, None, max(1, len(xyz) // _SAMPLE))
    part, r, c = xyz[some], row[some].astype(np.int64), column[some].astype(np.int64)
    flat = np.hypot(part[:, 0], part[:, 1])
    v = np.arctan2(flat, part[:, 2])
    use = np.isfinite(v) & (np.abs(v - np.pi / 2) < np.pi / 2 - _POLE)
    h = np.arctan2(part[:, 1], part[:, 0])
    if use.sum() < 10 or np.ptp(r) == 0 or np.ptp(c) == 0:
        return None
    for swapped in (False, True):
        a, b = (c, r) if swapped else (r, c)
        fit = _fit(h[use], v[use], a[use], b[use])
        if fit is not None:
            return _place(xyz, column if swapped else row, row if swapped else column, fit)
    return None


@dataclass(frozen=True)
class _Fit:
    """H = h0 + h1 column of the front face (back face opposite), V = v0 + v1 row of each face."""

    h0: float
    h1: float
    front: tuple[float, float]
    back: tuple[float, float] | None


def _fit(h: Array, v: Array, row: Index, column: Index) -> _Fit | None:
    """Lines through H and V; None if rows or columns are not straight."""
    axis = _axis_of_columns(h, column)
    if axis is None:
        return None
    h0, h1 = axis
    if np.cos(h - h0 - h1 * column).sum() < 0:
        h0 += np.pi
    off = np.angle(np.exp(1j * (h - h0 - h1 * column)))
    behind = np.abs(off) > np.pi / 2
    straight = np.abs(np.where(behind, np.pi - np.abs(off), off))
    if np.quantile(straight, 0.9) > max(_STRAIGHT * abs(h1), 1e-5):
        return None
    front = _line(row[~behind], v[~behind])
    back = _line(row[behind], v[behind]) if behind.mean() > 0.02 else None
    if front is None or (behind.mean() > 0.02 and back is None):
        return None
    return _Fit(h0, h1, front, back)


def _axis_of_columns(h: Array, column: Index) -> tuple[float, float] | None:
    """H of columns as a line, from directions that may be opposite (angles doubled)."""
    low = int(column.min())
    number, inverse = np.unique(column - low, return_inverse=True)
    twice = np.zeros(len(number), dtype=complex)
    np.add.at(twice, inverse, np.exp(2j * h))
    if len(number) < 3:
        return None
    step = np.diff(np.unwrap(np.angle(twice))) / 2 / np.diff(number)
    h1 = float(np.median(step))
    if h1 == 0:
        return None
    for _ in range(3):
        rest = np.unwrap(np.angle(twice * np.exp(-2j * h1 * number))) / 2
        slope, _ = np.polyfit(number, rest, 1)
        h1 += float(slope)
    rest = np.angle(np.sum(twice * np.exp(-2j * h1 * number))) / 2
    return float(rest - h1 * low), h1


def _line(row: Index, v: Array) -> tuple[float, float] | None:
    """V = v0 + v1 row with outliers trimmed; None if not straight."""
    if len(row) < 3 or np.ptp(row) == 0:
        return None
    keep = np.ones(len(row), dtype=bool)
    v1, v0 = 0.0, 0.0
    for _ in range(4):
        if np.ptp(row[keep]) == 0:
            return None
        v1, v0 = np.polyfit(row[keep], v[keep], 1)
        off = np.abs(v - v0 - v1 * row)
        keep = off <= max(3 * robust_sigma(off, about=0.0), 1e-9)
    off = np.abs(v - v0 - v1 * row)
    if v1 == 0 or np.quantile(off, 0.9) > max(_STRAIGHT * abs(v1), 1e-5):
        return None
    return float(v0), float(v1)


def _front_rows(low: int, high: int, fit: _Fit) -> tuple[int, int]:
    """First and last row; of a grid with two faces only those whose front face has V in (0, pi)."""
    if fit.back is None:
        return low, high
    ends = sorted(((0 - fit.front[0]) / fit.front[1], (np.pi - fit.front[0]) / fit.front[1]))
    return max(low, int(np.ceil(ends[0]))), min(high, int(np.floor(ends[1])))


def _place(xyz: Array, row: Index, column: Index, fit: _Fit) -> PixelNumbers:
    """Pixels of all points, both faces on one grid."""
    step_h, step_v = abs(fit.h1), abs(fit.front[1])
    r_low, r_high = _front_rows(int(row.min()), int(row.max()), fit)
    first_v = min(fit.front[0] + fit.front[1] * k for k in (r_low, r_high))
    rows = r_high - r_low + 1
    c_low, c_high = int(column.min()), int(column.max())
    period = max(round(2 * np.pi / step_h), 1)
    wide = c_high - c_low + 1 + (round(np.pi / step_h) if fit.back is not None else 0)
    wraps = wide >= _FULL_CIRCLE * period
    first_h = fit.h0 + fit.h1 * (c_low if fit.h1 > 0 else c_high)
    back = fit.back or (0.0, 0.0)
    first_h = float(np.angle(np.exp(1j * first_h)))
    columns = period if wraps else wide
    frame = np.array([fit.h0, fit.h1, *fit.front, *back, first_h, float(first_v)])
    pixel = _numbers(xyz, row, column, frame, (rows, columns, period), wraps, fit.back is not None)
    return PixelNumbers(
        pixel=pixel,
        rows=rows,
        columns=columns,
        first_h=first_h,
        first_v=float(first_v),
        step_h=step_h,
        step_v=step_v,
        wraps=wraps,
    )


@njit(cache=True, nogil=True)
def _numbers(
    xyz: Array,
    row: Index,
    column: Index,
    frame: Array,
    size: tuple[int, int, int],
    wraps: bool,
    two_faces: bool,
) -> NDArray[np.int32]:
    """Pixel number of every point from its row, its column and its face."""
    h0, h1, f0, f1, b0, b1, first_h, first_v = frame
    rows, columns, period = size
    step_h, step_v = abs(h1), abs(f1)
    out = np.full(len(xyz), -1, dtype=np.int32)
    for i in range(len(xyz)):
        h = h0 + h1 * column[i]
        v = f0 + f1 * row[i]
        if two_faces and xyz[i, 0] * np.cos(h) + xyz[i, 1] * np.sin(h) < 0:
            h += np.pi
            v = b0 + b1 * row[i]
        a = int(np.round((v - first_v) / step_v))
        b = int(np.round((h - first_h) / step_h)) % period
        if b >= columns and wraps:
            b -= columns
        if 0 <= a < rows and 0 <= b < columns:
            out[i] = a * columns + b
    return out
