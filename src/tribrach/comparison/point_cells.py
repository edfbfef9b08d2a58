"""Which points lie in a ball or a cylinder? Points sorted into upright columns, then by height.

A counting sort, height first and column second, leaves every column of square cells in layers of
the same size; a search visits the columns that the body's shadow touches and finds its layers by
bisection. Building costs two passes over the points, empty space costs nothing. Metres, in a frame
whose origin is near the points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Cells", "ball_ranges", "cylinder_ranges"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: most columns and most layers of one set of cells; beyond it the cells become larger
_MOST_COLUMNS, _MOST_LAYERS = 1 << 24, 1 << 20
#: bounds of heights are wider by this, so that rounding hides no point [m]
_ROUNDING = 1e-9


class Cells(NamedTuple):
    """Points (n, 3) in the order of their columns and layers.

    order (n,) : where each point was before; start (columns + 1,) : first point of each column,
    x-major; corner (3,) : of the first cell; size : of a cell [m]; shape : columns along x and y.
    """

    xyz: Array
    order: Index
    start: Index
    corner: Array
    size: float
    shape: tuple[int, int]

    @classmethod
    def of(cls, xyz: Array, size: float) -> Cells:
        """Sort points (n, 3), all finite, into cells of about this size [m], larger if too many."""
        if len(xyz) == 0:
            return cls(
                np.empty((0, 3)),
                np.zeros(0, np.int64),
                np.zeros(2, np.int64),
                np.zeros(3),
                size,
                (1, 1),
            )
        corner = xyz.min(axis=0)
        top = xyz.max(axis=0)
        while True:
            # the same arithmetic as in the sort, so that the topmost point has the last cell
            nx, ny, nz = (float(np.floor(x)) + 1 for x in (top - corner) / size)
            if nx * ny <= _MOST_COLUMNS and nz <= _MOST_LAYERS:
                break
            size *= 2
        order, start = _sort(xyz, corner, size, int(nx), int(ny), int(nz))
        return cls(xyz[order], order, start, corner, size, (int(nx), int(ny)))

    @property
    def arrays(self) -> tuple[Array, Index, Array, float, int, int]:
        """What compiled searches take: points, starts, corner, size, columns along x and y."""
        return self.xyz, self.start, self.corner, self.size, self.shape[0], self.shape[1]


@njit(cache=True)
def _sort(xyz, corner, size, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Order of the points and first point of each column: two stable counting sorts."""
    n = len(xyz)
    layer, column = np.empty(n, np.int32), np.empty(n, np.int32)
    layers, start = np.zeros(nz + 1, np.int64), np.zeros(nx * ny + 1, np.int64)
    for k in range(n):
        i, j = int((xyz[k, 0] - corner[0]) / size), int((xyz[k, 1] - corner[1]) / size)
        layer[k] = int((xyz[k, 2] - corner[2]) / size)
        column[k] = i * ny + j
        layers[layer[k] + 1] += 1
        start[column[k] + 1] += 1
    for k in range(nz):
        layers[k + 1] += layers[k]
    for k in range(nx * ny):
        start[k + 1] += start[k]
    raised = np.empty(n, np.int64)
    for k in range(n):
        raised[layers[layer[k]]] = k
        layers[layer[k]] += 1
    order, free = np.empty(n, np.int64), start[:-1].copy()
    for place in range(n):
        k = raised[place]
        order[free[column[k]]] = k
        free[column[k]] += 1
    return order, start


@njit(cache=True)
def cylinder_ranges(centre, normal, radius, depth, cells):  # type: ignore[no-untyped-def]
    """Ranges (k, 2) of points that may lie in a cylinder of half length ``depth`` about a normal.

    Every point of the cylinder is in one of them, many others are not.
    """
    xyz, start, corner, size, nx, ny = cells
    ex = depth * abs(normal[0]) + radius * np.sqrt(max(1 - normal[0] * normal[0], 0.0))
    ey = depth * abs(normal[1]) + radius * np.sqrt(max(1 - normal[1] * normal[1], 0.0))
    i0, i1 = _window(centre[0] - ex, centre[0] + ex, corner[0], size, nx)
    j0, j1 = _window(centre[1] - ey, centre[1] + ey, corner[1], size, ny)
    out, count = np.empty((max(i1 - i0, 0) * max(j1 - j0, 0), 2), np.int64), 0
    for i in range(i0, i1):
        dx = corner[0] + (i + 0.5) * size - centre[0]
        for j in range(j0, j1):
            if start[i * ny + j] == start[i * ny + j + 1]:
                continue
            dy = corner[1] + (j + 0.5) * size - centre[1]
            low, high = _heights(dx, dy, normal, radius, depth, size)
            if low <= high:
                first, last = _layers(
                    centre[2] + low, centre[2] + high, i * ny + j, xyz, start, corner[2], size
                )
                if first < last:
                    out[count, 0], out[count, 1] = first, last
                    count += 1
    return out[:count]


@njit(cache=True)
def ball_ranges(centre, radius, cells):  # type: ignore[no-untyped-def]
    """Ranges (k, 2) of points that may lie in a ball: all of its points and some others."""
    xyz, start, corner, size, nx, ny = cells
    i0, i1 = _window(centre[0] - radius, centre[0] + radius, corner[0], size, nx)
    j0, j1 = _window(centre[1] - radius, centre[1] + radius, corner[1], size, ny)
    out, count = np.empty((max(i1 - i0, 0) * max(j1 - j0, 0), 2), np.int64), 0
    for i in range(i0, i1):
        dx = max(abs(corner[0] + (i + 0.5) * size - centre[0]) - 0.5 * size, 0.0)
        for j in range(j0, j1):
            dy = max(abs(corner[1] + (j + 0.5) * size - centre[1]) - 0.5 * size, 0.0)
            left = radius * radius - dx * dx - dy * dy
            if left < 0.0 or start[i * ny + j] == start[i * ny + j + 1]:
                continue
            high = np.sqrt(left) + _ROUNDING
            first, last = _layers(
                centre[2] - high, centre[2] + high, i * ny + j, xyz, start, corner[2], size
            )
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
def _first_not_below(xyz, begin, end, layer, bottom, size):  # type: ignore[no-untyped-def]
    """First point of ``begin .. end`` of one column whose layer is at least this one."""
    while begin < end:
        middle = (begin + end) // 2
        if int((xyz[middle, 2] - bottom) / size) < layer:
            begin = middle + 1
        else:
            end = middle
    return begin


@njit(cache=True, inline="always")
def _layers(low, high, column, xyz, start, bottom, size):  # type: ignore[no-untyped-def]
    """Range of points of a column in the layers between two heights."""
    begin, end = start[column], start[column + 1]
    if begin == end:
        return begin, begin
    # layers are cut off towards zero in the sort: nothing is below the corner
    lowest = int(np.floor((low - bottom) / size))
    highest = int(np.floor((high - bottom) / size))
    first = _first_not_below(xyz, begin, end, lowest, bottom, size)
    return first, _first_not_below(xyz, first, end, highest + 1, bottom, size)


@njit(cache=True, inline="always")
def _heights(dx, dy, normal, radius, depth, size):  # type: ignore[no-untyped-def]
    """Heights relative to a cylinder's centre that it can have within a column; low > high: none.

    dx, dy : from the cylinder's centre to the middle of the column. A point of the cylinder is
    ``t n + w`` with ``|t| <= depth``, ``|w| <= radius`` and w across n, so that w reaches at most
    ``radius |n_z|`` along the shadow of n and ``radius |n_xy|`` upwards.
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
