"""Finds the points in a ball or a cylinder: points sorted into upright columns of cubic cells.

Every column has its own table of layers, from its lowest point to its highest, so that empty space
costs little and a search reads where the cells of a column begin and end without looking at points.
One counting sort builds it. Metres, in a frame whose origin is near the points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.comparison.nearest import corners
from tribrach.kernels import njit

Short = NDArray[np.int32]

#: most columns; beyond it, or with more than four cells a point, the cells become larger
_MOST_COLUMNS = 1 << 24
_CELLS_PER_POINT, _FREE_CELLS = 4, 1 << 20
#: layers are numbered in 32 bits
_MOST_LAYERS = 1 << 30
#: bounds of heights are wider by this, so that rounding hides no point [m]
_ROUNDING = 1e-9


class PointCells(NamedTuple):
    """Points in the order of their cells."""

    xyz: Array  #: (n, 3): the points [m]
    order: Index  #: (n,): where each point was before
    corner: Array  #: (3,): corner of the first cell [m]
    size: float  #: side of a cell [m]
    shape: tuple[int, int]  #: columns along x and y
    base: Index  #: (columns + 1,): where the table of each column, x-major, begins
    lowest: Short  #: (columns,): first layer of each column
    start: Index  #: (cells + 1,): first point of each cell

    @classmethod
    def of(cls, xyz: Array, size: float) -> PointCells:
        """Sort points, all finite, into cells."""
        corner, top = corners(xyz) if len(xyz) else np.zeros((2, 3))
        while True:
            # the same arithmetic as in the sort, so that the topmost point has the last cell
            nx, ny, nz = (float(np.floor(x)) + 1 for x in (top - corner) / size)
            if nx * ny <= _MOST_COLUMNS and nz <= _MOST_LAYERS:
                columns = _columns(xyz, corner, size, int(nx), int(ny))
                base = columns[2]
                if base[-1] <= _CELLS_PER_POINT * len(xyz) + _FREE_CELLS:
                    break
            size *= 2
        column, layer, base, lowest = columns
        order, start = _sort(column, layer, base, lowest)
        return cls(
            xyz=xyz[order],
            order=order,
            corner=corner,
            size=size,
            shape=(int(nx), int(ny)),
            base=base,
            lowest=lowest,
            start=start,
        )

    @property
    def arrays(self) -> tuple[Array, Array, float, int, int, Index, Short, Index]:
        """The arrays that compiled searches take."""
        nx, ny = self.shape
        return self.xyz, self.corner, self.size, nx, ny, self.base, self.lowest, self.start


@njit(cache=True)
def _columns(xyz, corner, size, nx, ny):  # type: ignore[no-untyped-def]
    """Column and layer of every point; where the table of each column begins; lowest layers."""
    n = len(xyz)
    column, layer = np.empty(n, np.int32), np.empty(n, np.int32)
    lowest = np.full(nx * ny, 2**31 - 1, np.int32)
    highest = np.full(nx * ny, -1, np.int32)
    for k in range(n):
        i, j = int((xyz[k, 0] - corner[0]) / size), int((xyz[k, 1] - corner[1]) / size)
        c, z = i * ny + j, np.int32((xyz[k, 2] - corner[2]) / size)
        column[k], layer[k] = c, z
        lowest[c], highest[c] = min(lowest[c], z), max(highest[c], z)
    base = np.zeros(nx * ny + 1, np.int64)
    for c in range(nx * ny):
        base[c + 1] = base[c]
        if highest[c] >= 0:
            base[c + 1] += np.int64(highest[c]) - lowest[c] + 1
    return column, layer, base, lowest


@njit(cache=True)
def _sort(column, layer, base, lowest):  # type: ignore[no-untyped-def]
    """Order of the points by their cells, and the first point of each cell."""
    n = len(column)
    start = np.zeros(base[-1] + 1, np.int64)
    for k in range(n):
        start[base[column[k]] + layer[k] - lowest[column[k]] + 1] += 1
    for c in range(base[-1]):
        start[c + 1] += start[c]
    order, free = np.empty(n, np.int64), start[:-1].copy()
    for k in range(n):
        c = base[column[k]] + layer[k] - lowest[column[k]]
        order[free[c]] = k
        free[c] += 1
    return order, start


@njit(cache=True)
def cylinder_ranges(centre, normal, radius, depth, cells):  # type: ignore[no-untyped-def]
    """Ranges (k, 2) of points that may lie in a cylinder of half length ``depth`` about a normal.

    Every point of the cylinder is in one of them, many others are not.
    """
    _, corner, size, nx, ny, base, lowest, start = cells
    ex = depth * abs(normal[0]) + radius * np.sqrt(max(1 - normal[0] * normal[0], 0.0))
    ey = depth * abs(normal[1]) + radius * np.sqrt(max(1 - normal[1] * normal[1], 0.0))
    i0, i1 = _window(centre[0] - ex, centre[0] + ex, corner[0], size, nx)
    j0, j1 = _window(centre[1] - ey, centre[1] + ey, corner[1], size, ny)
    out, count = np.empty((max(i1 - i0, 0) * max(j1 - j0, 0), 2), np.int64), 0
    for i in range(i0, i1):
        dx = corner[0] + (i + 0.5) * size - centre[0]
        for j in range(j0, j1):
            if base[i * ny + j] == base[i * ny + j + 1]:
                continue
            dy = corner[1] + (j + 0.5) * size - centre[1]
            low, high = _heights(dx, dy, normal, radius, depth, size)
            if low <= high:
                low, high = centre[2] - corner[2] + low, centre[2] - corner[2] + high
                first, last = _layers(low, high, i * ny + j, size, base, lowest, start)
                if first < last:
                    out[count, 0], out[count, 1] = first, last
                    count += 1
    return out[:count]


@njit(cache=True)
def ball_ranges(centre, radius, cells):  # type: ignore[no-untyped-def]
    """Ranges (k, 2) of points that may lie in a ball: all of its points and some others."""
    _, corner, size, nx, ny, base, lowest, start = cells
    i0, i1 = _window(centre[0] - radius, centre[0] + radius, corner[0], size, nx)
    j0, j1 = _window(centre[1] - radius, centre[1] + radius, corner[1], size, ny)
    out, count = np.empty((max(i1 - i0, 0) * max(j1 - j0, 0), 2), np.int64), 0
    for i in range(i0, i1):
        dx = max(abs(corner[0] + (i + 0.5) * size - centre[0]) - 0.5 * size, 0.0)
        for j in range(j0, j1):
            dy = max(abs(corner[1] + (j + 0.5) * size - centre[1]) - 0.5 * size, 0.0)
            left = radius * radius - dx * dx - dy * dy
            if left < 0.0 or base[i * ny + j] == base[i * ny + j + 1]:
                continue
            high = np.sqrt(left) + _ROUNDING
            low, high = centre[2] - corner[2] - high, centre[2] - corner[2] + high
            first, last = _layers(low, high, i * ny + j, size, base, lowest, start)
            if first < last:
                out[count, 0], out[count, 1] = first, last
                count += 1
    return out[:count]


@njit(cache=True, inline="always")
def _window(low, high, corner, size, count):  # type: ignore[no-untyped-def]
    """First cell and the one after the last that an interval touches, within ``0 .. count``."""
    first = max(int(np.floor((low - corner) / size)), 0)
    last = min(int(np.floor((high - corner) / size)), count - 1)
    return first, last + 1


@njit(cache=True, inline="always")
def _layers(low, high, column, size, base, lowest, start):  # type: ignore[no-untyped-def]
    """Range of points of a column that is not empty, between two heights above the corner."""
    begin, count = base[column], base[column + 1] - base[column]
    first = max(np.floor(low / size) - lowest[column], 0.0)
    last = min(np.floor(high / size) - lowest[column], count - 1.0)
    if first > last:
        return np.int64(0), np.int64(0)
    return start[begin + int(first)], start[begin + int(last) + 1]


@njit(cache=True, inline="always")
def _heights(dx, dy, normal, radius, depth, size):  # type: ignore[no-untyped-def]
    """Heights relative to a cylinder's centre that it can have within a column; low > high: none.

    A point of the cylinder is ``t n + w`` with ``|t| <= depth``, ``|w| <= radius`` and w across n,
    so that w reaches at most ``radius |n_z|`` along the shadow of n and ``radius |n_xy|`` upwards.
    """
    half = 0.7071068 * size
    flat = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1])
    low, high = -depth, depth
    if flat > 1e-6:
        ux, uy = normal[0] / flat, normal[1] / flat
        if abs(ux * dy - uy * dx) > radius + half:
            return 1.0, 0.0
        along, slack = ux * dx + uy * dy, half + radius * abs(normal[2])
        low = max(low, (along - slack) / flat)
        high = min(high, (along + slack) / flat)
        if low > high:
            return 1.0, 0.0
    a, b = normal[2] * low, normal[2] * high
    rise = radius * flat + _ROUNDING
    return min(a, b) - rise, max(a, b) + rise
