"""Circles in metres on the surface of a range image: ellipses of pixels that follow its slope."""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["on_circle", "shortening", "slope"]


@njit(cache=True, nogil=True, inline="always")
def slope(ranges, i, j, rx, ry, steps, wraps):  # type: ignore[no-untyped-def]
    """Change of range per metre across the beam, along columns and along rows; infinite if open.

    rx, ry : size of the surface that counts, a radius in columns and in rows of pixel (i, j);
    steps (rows, 2) [rad] : angular steps of a row in V and, across the beam, in H.
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
    """What ``on_circle`` takes of the slopes p and q, once for a circle."""
    square = p * p + q * q
    # a vector across the beam is shortened along the slope by the cosine of incidence
    return (1 - 1 / np.sqrt(1 + square)) / square if square > 1e-12 else 0.0


@njit(cache=True, nogil=True, inline="always")
def on_circle(cosine, sine, size, p, q, short):  # type: ignore[no-untyped-def]
    """Place [m] across the beam, along columns and along rows, of a direction on a circle."""
    along = short * (p * cosine + q * sine)
    return size * (cosine - along * p), size * (sine - along * q)
