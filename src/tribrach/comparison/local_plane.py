"""Signed distances from the plane through the nearest points of the reference.

A plane has no gaps: this takes most of the sampling out of nearest-neighbour distances (method
section 9.1). What remains is the noise of both clouds, that of the plane reduced by its points.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tribrach.comparison.nearest import Neighbours

__all__ = ["plane_distances"]

Array = NDArray[np.float64]

#: points through which a plane is laid
NEIGHBOURS = 16
#: thickness over the lesser width of points that are still a plane
_THIN = 0.35


def plane_distances(
    cloud: Neighbours,
    points: Array,
    limit: float,
    viewpoint: Array | None = None,
    neighbours: int = NEIGHBOURS,
) -> Array:
    """Distances (n,) [m] of points (n, 3) from the local planes of a cloud; NaN without one.

    Positive towards a viewpoint (3,); without one, on the side of the largest coordinate of the
    normal. No plane is there where the neighbours are no plane, lie to one side of the point, or
    the nearest is beyond the limit.
    """
    out = np.full(len(points), np.nan)
    if cloud.count < neighbours:
        return out
    near, found = cloud.local_query(points, k=neighbours)
    rows = np.flatnonzero(near[:, 0] <= limit)
    towards = np.full(3, np.nan) if viewpoint is None else viewpoint - cloud.origin
    out[rows] = _distances(cloud.points, points[rows] - cloud.origin, found[rows], towards)
    out[np.abs(out) > limit] = np.nan
    return out


@njit(cache=True, parallel=True, nogil=True)
def _distances(points, places, found, towards):  # type: ignore[no-untyped-def]
    """One plane per place, by principal components."""
    out = np.full(len(places), np.nan)
    count = found.shape[1]
    for n in prange(len(places)):
        mean = np.zeros(3)
        for k in range(count):
            mean += points[found[n, k]] - places[n]
        mean /= count
        spread = np.zeros((3, 3))
        for k in range(count):
            d = points[found[n, k]] - places[n] - mean
            for i in range(3):
                for j in range(3):
                    spread[i, j] += d[i] * d[j]
        values, axes = np.linalg.eigh(spread)
        if values[0] > _THIN * _THIN * values[1]:
            continue
        normal = axes[:, 0]
        height = -(normal * mean).sum()
        # beyond a border the middle of the neighbours is further than their width
        if (mean * mean).sum() - height * height > values[2] / count:
            continue
        if np.isnan(towards[0]):
            side = normal[np.argmax(np.abs(normal))]
        else:
            side = (normal * (towards - places[n])).sum()
        out[n] = height if side > 0 else -height
    return out
