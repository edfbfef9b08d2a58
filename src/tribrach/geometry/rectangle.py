"""Rectangles that hold places in a plane: upright on walls, the smallest ones on floors."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from tribrach._types import Array

#: a plane that leans less than this from the horizontal has no side that is up [rad]
_FLAT = np.radians(10.0)


def held_rectangle(normal: Array, places: Array) -> tuple[Array, Array, Array]:
    """Make the rectangle in a plane that holds the feet of places: its middle, axes, half widths.

    The middle is as far from the plane as the places are in the mean. On a plane that stands or
    leans the first axis is horizontal and the second goes up; on a flat one the rectangle is the
    smallest (one of its sides lies on the convex hull of the places), the first axis along its
    longer side.
    """
    up = np.array([0.0, 0.0, 1.0])
    across = np.cross(up, normal)
    lean = float(np.linalg.norm(across))
    if lean > np.sin(_FLAT):
        axes = np.array([across / lean, np.cross(normal, across / lean)])
    else:
        east = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
        east /= np.linalg.norm(east)
        basis = np.array([east, np.cross(normal, east)])
        axes = _smallest(places @ basis.T) @ basis
    low, high = (places @ axes.T).min(axis=0), (places @ axes.T).max(axis=0)
    middle = (low + high) / 2 @ axes + float(np.mean(places @ normal)) * normal
    return middle, axes, (high - low) / 2


def _smallest(flat: Array) -> Array:
    """Axes (2, 2) of the smallest rectangle around places (n, 2), the longer side first."""
    try:
        hull = flat[ConvexHull(flat).vertices]
    except (QhullError, ValueError):
        # fewer than three places, or all on one line, which is the longer side
        _, _, axes = np.linalg.svd(flat - flat.mean(axis=0))
        return np.asarray(axes)
    sides = np.roll(hull, -1, axis=0) - hull
    along = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    turned = np.stack([along, np.stack([-along[:, 1], along[:, 0]], axis=1)], axis=1)
    widths = np.ptp(np.einsum("kij,nj->kin", turned, hull), axis=2)
    best = int(np.argmin(widths.prod(axis=1)))
    return np.asarray(turned[best][np.argsort(-widths[best], kind="stable")])
