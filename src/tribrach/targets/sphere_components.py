"""Free-standing things of about a sphere's size in a range image (method section 6.4).

Rows are cut at jumps of range into runs. A run much narrower than the sphere (its pole or rod) or
much wider (walls) is dropped; the others are joined with those above them into components, whose
width and height must be those of the sphere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tribrach.scan.range_image import RangeImage

__all__ = ["Components", "find_components"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: runs are kept whose width is within these multiples of the diameter
_RUN = (0.25, 1.6)
#: widths and heights of spheres, as multiples of the diameter
_WIDTH, _HEIGHT = (0.5, 1.25), (0.5, 1.6)
#: things within these multiples of the diameter are reported when they are no sphere
_REPORTED = (0.33, 2.0)
#: jump of range [m] that parts a thing from its background, at most this and at most R
_JUMP = 0.05


@dataclass(frozen=True, eq=False)
class Components:
    """Components of about the sphere's size.

    center (n, 3) : [m], the radius behind the nearest points along the mean direction;
    width, height (n,) : multiples of the diameter; fits (n,) : do width and height pass?
    """

    center: Array
    width: Array
    height: Array
    fits: NDArray[np.bool_]


def find_components(image: RangeImage, radius: float) -> Components:
    """Components of the image that may be spheres of ``radius`` [m], and those nearly so."""
    ranges = image.filled(2)
    frame = (image.first_h, image.first_v, image.step_h, image.step_v)
    runs = _runs(ranges, frame, radius, min(_JUMP, radius))
    label = _joined(runs, ranges.shape[0], ranges.shape[1], image.wraps, min(_JUMP, radius))
    boxes = _boxes(runs, label, frame, ranges.shape[1], radius)
    width, height = boxes[:, 3], boxes[:, 4]
    low, high = _REPORTED
    near = (width > low) & (width < high) & (height > low) & (height < high)
    near &= boxes[:, 5] >= 3
    boxes, width, height = boxes[near], width[near], height[near]
    fits = (width > _WIDTH[0]) & (width < _WIDTH[1])
    fits &= (height > _HEIGHT[0]) & (height < _HEIGHT[1])
    return Components(boxes[:, :3], width, height, fits)


@njit(cache=True, nogil=True)
def _runs(
    ranges: NDArray[np.float32],
    frame: tuple[float, float, float, float],
    radius: float,
    jump: float,
) -> Array:
    """Runs (n, 6) of the rows: row, first and last column, mean and least range, width [m]."""
    rows, columns = ranges.shape
    _, v0, step_h, step_v = frame
    count = 0
    out = np.empty((1024, 6))
    for i in range(rows):
        pitch = step_h * abs(np.sin(v0 + i * step_v))
        start = 0
        total, least = 0.0, np.inf
        for j in range(columns + 1):
            here = ranges[i, j] if j < columns else np.float32(np.nan)
            if j > start and not abs(here - ranges[i, j - 1]) < jump:
                n = j - start
                mean = total / n
                width = n * pitch * mean
                if 2 * _RUN[0] * radius < width < 2 * _RUN[1] * radius and n >= 3:
                    if count == len(out):
                        grown = np.empty((2 * count, 6))
                        grown[:count] = out
                        out = grown
                    out[count] = np.array([i, start, j - 1, mean, least, width])
                    count += 1
                start, total, least = j, 0.0, np.inf
            if np.isnan(here):
                start = j + 1
                total, least = 0.0, np.inf
            else:
                total += float(here)
                least = min(least, float(here))
    return out[:count]


@njit(cache=True, nogil=True)
def _root(parent: Integers, k: int) -> int:
    """Representative of a set, its path shortened."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@njit(cache=True, nogil=True)
def _joined(runs: Array, rows: int, columns: int, wraps: bool, jump: float) -> Integers:
    """Number of the component (n,) of every run: overlapping runs of neighbouring rows."""
    n = len(runs)
    parent = np.arange(n)
    first = np.full(rows + 1, n, dtype=np.int64)
    for k in range(n - 1, -1, -1):
        first[int(runs[k, 0])] = k
    for i in range(rows - 1, -1, -1):
        first[i] = min(first[i], first[i + 1])
    for i in range(1, rows):
        a = first[i - 1]
        for b in range(first[i], first[i + 1]):
            while a < first[i] and runs[a, 2] < runs[b, 1]:
                a += 1
            k = a
            while k < first[i] and runs[k, 1] <= runs[b, 2]:
                if abs(runs[k, 3] - runs[b, 3]) < jump:
                    parent[_root(parent, b)] = _root(parent, k)
                k += 1
    if wraps:
        for i in range(rows):
            a, b = first[i], first[i + 1] - 1
            ends = a < b and runs[a, 1] == 0 and runs[b, 2] == columns - 1
            if ends and abs(runs[a, 3] - runs[b, 3]) < jump:
                parent[_root(parent, b)] = _root(parent, a)
    for k in range(n):
        parent[k] = _root(parent, k)
    return parent


@njit(cache=True, nogil=True)
def _boxes(
    runs: Array,
    label: Integers,
    frame: tuple[float, float, float, float],
    columns: int,
    radius: float,
) -> Array:
    """Centre, width and height in diameters, number of runs (k, 6) of every component."""
    h0, v0, step_h, step_v = frame
    n = len(runs)
    out = np.zeros((n, 6))
    low, high = np.full(n, np.inf), np.full(n, -np.inf)
    least, weight = np.full(n, np.inf), np.zeros(n)
    anchor = np.full(n, -1.0)
    for k in range(n):
        c = label[k]
        i = runs[k, 0]
        length = runs[k, 2] - runs[k, 1] + 1
        middle = 0.5 * (runs[k, 1] + runs[k, 2])
        if anchor[c] < 0:
            anchor[c] = middle
        middle -= columns * np.round((middle - anchor[c]) / columns)
        out[c, 0] += length * middle
        out[c, 1] += length * i
        weight[c] += length
        out[c, 3] = max(out[c, 3], runs[k, 5])
        out[c, 5] += 1
        low[c], high[c] = min(low[c], i), max(high[c], i)
        least[c] = min(least[c], runs[k, 4])
    count = 0
    for c in range(n):
        if weight[c] == 0:
            continue
        h = h0 + step_h * out[c, 0] / weight[c]
        v = v0 + step_v * out[c, 1] / weight[c]
        away = least[c] + radius
        out[count, 4] = (high[c] - low[c] + 1) * step_v * away / (2 * radius)
        out[count, 3] = out[c, 3] / (2 * radius)
        out[count, 5] = out[c, 5]
        out[count, 0] = away * np.sin(v) * np.cos(h)
        out[count, 1] = away * np.sin(v) * np.sin(h)
        out[count, 2] = away * np.cos(v)
        count += 1
    return out[:count]
