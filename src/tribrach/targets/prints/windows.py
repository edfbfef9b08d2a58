"""Collects the points around a pixel of a range image and lays circles on the surface there.

A circle in metres on a surface is an ellipse of pixels that follows the slope of the surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.kernels import njit
from tribrach.scan.range_image import RangeImage

#: points that are returned at most, about: bounds the time of a fit
_MOST_POINTS = 20_000


def points_around(
    image: RangeImage, row: int, column: int, reach: float
) -> tuple[NDArray[np.int32], Array | None]:
    """Collect the points of the pixels around one pixel.

    ``reach`` is half the window at the range of the pixel [m]; very many points are thinned. The
    place of a hole is that of its neighbours; None, without points, where there are none or they
    are nearer than the reach.
    """
    near = _range(image, row, column)
    if not near > reach:
        return np.empty(0, dtype=np.int32), None
    sine = max(abs(float(np.sin(image.first_v + row * image.step_v))), 0.05)
    high = int(np.ceil(reach / near / image.step_v)) + 1
    wide = min(int(np.ceil(reach / near / image.step_h / sine)) + 1, image.shape[1] // 2)
    rows = np.arange(max(0, row - high), min(image.shape[0], row + high + 1))
    columns = np.arange(column - wide, column + wide + 1)
    if image.wraps:
        columns = np.unique(columns % image.shape[1])
    else:
        columns = columns[(columns >= 0) & (columns < image.shape[1])]
    index = image.index[np.ix_(rows, columns)].ravel()
    index = index[index >= 0]
    h, v = image.first_h + column * image.step_h, image.first_v + row * image.step_v
    place = near * np.array([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)])
    return index[:: max(1, len(index) // _MOST_POINTS)], place


def _range(image: RangeImage, row: int, column: int) -> float:
    """Range [m] of a pixel, of a hole the median of those next to it, 0 if they are holes too."""
    if image.index[row, column] >= 0:
        return float(image.range[row, column])
    rows = np.clip(np.arange(row - 1, row + 2), 0, image.shape[0] - 1)
    columns = np.arange(column - 1, column + 2)
    columns = columns % image.shape[1] if image.wraps else columns.clip(0, image.shape[1] - 1)
    ranges = image.range[np.ix_(rows, columns)]
    seen = ranges[np.isfinite(ranges)]
    return float(np.median(seen)) if len(seen) else 0.0


@njit(cache=True, nogil=True, inline="always")
def slope(ranges, i, j, rx, ry, steps, wraps):  # type: ignore[no-untyped-def]
    """Change of range per metre across the beam, along columns and along rows.

    The surface counts within rx columns and ry rows of pixel (i, j); ``steps`` (rows, 2) [rad] are
    the angular steps of a row in V and, across the beam, in H. The slope is infinite where the
    surface has gaps.
    """
    rows, columns = ranges.shape
    a, b = max(1, int(0.5 * ry + 0.5)), max(1, int(0.5 * rx + 0.5))
    left, right = j - b, j + b
    if wraps:
        left, right = left % columns, right % columns
    if i < a or i + a >= rows or left < 0 or right >= columns:
        return np.inf, np.inf
    r = ranges[i, j]
    p = (ranges[i, right] - ranges[i, left]) / (2 * b * r * steps[i, 1])
    q = (ranges[i + a, j] - ranges[i - a, j]) / (2 * a * r * steps[i, 0])
    if np.isnan(p + q):
        return np.inf, np.inf
    return p, q


@njit(cache=True, nogil=True, inline="always")
def shortening(p, q):  # type: ignore[no-untyped-def]
    """Factors that ``on_circle`` takes from the slopes p and q, computed once for a circle."""
    square = p * p + q * q
    # a vector across the beam is shortened along the slope by the cosine of incidence
    return (1 - 1 / np.sqrt(1 + square)) / square if square > 1e-12 else 0.0


@njit(cache=True, nogil=True, inline="always")
def on_circle(cosine, sine, size, p, q, short):  # type: ignore[no-untyped-def]
    """Place of a direction on a circle, across the beam along columns and along rows [m]."""
    along = short * (p * cosine + q * sine)
    return size * (cosine - along * p), size * (sine - along * q)
