"""Where the scanner's rows and columns lie in directions, whatever way they are numbered.

Columns are planes through the standing axis, H linear in the column and V linear in the row. A
mirror that turns full circle writes the back face into the same column: there H is opposite and V
runs the other way. Both faces are fitted and laid on one grid of H and V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Layout", "lay_out"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: points looked at to fit the layout
_SAMPLE = 400_000
#: directions this close to a pole [rad] do not tell H
_POLE = 0.1
#: a grid follows H and V if it deviates by less than this many steps at nine of ten points
_STRAIGHT = 0.75
#: an image that covers this share of the circle is closed to the full circle
_FULL_CIRCLE = 0.98


@dataclass(frozen=True, eq=False)
class Layout:
    """Pixel number (n,) int32 of every point (-1: none) in an image of H and V that increase."""

    pixel: NDArray[np.int32]
    rows: int
    columns: int
    first_h: float
    first_v: float
    step_h: float
    step_v: float
    wraps: bool


def lay_out(xyz: Array, row: Integers, column: Integers) -> Layout | None:
    """The layout of points (n, 3) with grid numbers (n,); None if these do not follow H and V."""
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


def _fit(h: Array, v: Array, row: Integers, column: Integers) -> _Fit | None:
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


def _axis_of_columns(h: Array, column: Integers) -> tuple[float, float] | None:
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


def _line(row: Integers, v: Array) -> tuple[float, float] | None:
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
        keep = off <= max(3 * 1.4826 * float(np.median(off)), 1e-9)
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


def _place(xyz: Array, row: Integers, column: Integers, fit: _Fit) -> Layout:
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
    return Layout(pixel, rows, columns, first_h, float(first_v), step_h, step_v, wraps)


@njit(cache=True, nogil=True)
def _numbers(
    xyz: Array,
    row: Integers,
    column: Integers,
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
