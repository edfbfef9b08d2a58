"""How far did a scanner see in every direction? What lies nearer there was not in its way.

A coarse image of the smallest range in every half degree of H and V, or in every degree of a scan
with few points. A surface that another scan places
clearly nearer than anything in that direction contradicts the pose: the beams went through it.
Directions without points (sky, glass) say nothing. Scanner frame, metres.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["AT_SURFACE", "BEHIND", "SEEN_THROUGH", "UNSEEN", "View"]

Array = NDArray[np.float64]

#: rows and columns of the finest image
_ROWS, _COLUMNS = 360, 720
#: points in a seen pixel, on the average, that let no gaps appear
_ENOUGH = 6.0
#: what a scanner says of a place: it never looked there, something is before it, it is no more
#: than the margin from what was seen, the beams went through it
UNSEEN, BEHIND, AT_SURFACE, SEEN_THROUGH = 0, 1, 2, 3


class View:
    """Ranges that are filled with chunks of points: ``nearest`` and ``farthest`` (r, 2 r) [m]."""

    def __init__(self) -> None:
        self.nearest = np.full((_ROWS, _COLUMNS), np.inf)
        self.farthest = np.zeros((_ROWS, _COLUMNS))
        self._points = 0

    def add(self, xyz: Array) -> None:
        """Add points (n, 3) [m], before :meth:`settle`."""
        self._points += len(xyz)
        _fill(np.ascontiguousarray(xyz), self.nearest, self.farthest)

    def settle(self) -> None:
        """Join pixels until they hold enough points each."""
        while len(self.nearest) > 45:
            if self._points >= _ENOUGH * np.isfinite(self.nearest).sum():
                return
            rows = len(self.nearest) // 2
            self.nearest = self.nearest.reshape(rows, 2, 2 * rows, 2).min(axis=(1, 3))
            self.farthest = self.farthest.reshape(rows, 2, 2 * rows, 2).max(axis=(1, 3))

    def judge(self, points: Array, margin: Array) -> NDArray[np.int8]:
        """What the scanner says of places (n, 3) [m], with margins (n,) [m]."""
        return np.asarray(_judged(points, margin, self.nearest, self.farthest))


@njit(cache=True, nogil=True)
def _pixel(x, y, z, rows):  # type: ignore[no-untyped-def]
    """Row, column and range of a place in an image of so many rows."""
    flat = np.hypot(x, y)
    step = np.pi / rows
    row = min(int(np.arctan2(flat, z) / step), rows - 1)
    column = int((np.arctan2(y, x) + np.pi) / step) % (2 * rows)
    return row, column, np.hypot(flat, z)


@njit(cache=True, nogil=True)
def _fill(xyz, nearest, farthest):  # type: ignore[no-untyped-def]
    for n in range(len(xyz)):
        if not np.isfinite(xyz[n, 0] + xyz[n, 1] + xyz[n, 2]):
            continue
        row, column, far = _pixel(xyz[n, 0], xyz[n, 1], xyz[n, 2], len(nearest))
        if far < nearest[row, column]:
            nearest[row, column] = far
        if far > farthest[row, column]:
            farthest[row, column] = far


@njit(cache=True, nogil=True)
def _judged(points, margin, nearest, farthest):  # type: ignore[no-untyped-def]
    """The verdicts (n,), by the pixel and its eight neighbours."""
    out = np.empty(len(points), dtype=np.int8)
    rows, columns = nearest.shape
    for n in range(len(points)):
        row, column, far = _pixel(points[n, 0], points[n, 1], points[n, 2], rows)
        low, high, here = np.inf, 0.0, nearest[row, column]
        for i in range(max(row - 1, 0), min(row + 2, rows)):
            for j in range(column - 1, column + 2):
                low = min(low, nearest[i, j % columns])
                high = max(high, farthest[i, j % columns])
        if not np.isfinite(here):
            out[n] = UNSEEN
        elif far < low - margin[n]:
            out[n] = SEEN_THROUGH
        elif far > high + margin[n]:
            out[n] = BEHIND
        else:
            out[n] = AT_SURFACE
    return out
