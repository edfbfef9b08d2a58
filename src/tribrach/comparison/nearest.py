"""Finds the nearest points of a cloud.

Trees of pykdtree in float64 on coordinates about the middle of the reference, so that those of a
projection lose nothing. Neighbouring queries walk the same branches: points in scan order are taken
as they come, scattered ones along a curve that fills space (Morton order) first. Metres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pykdtree.kdtree import KDTree

from tribrach._types import Array
from tribrach.kernels import njit

Indices = NDArray[np.uint32]

#: points in a leaf of the tree: the fastest for scans
_LEAF = 24
#: queries at a time
_BLOCK = 1_000_000
#: consecutive points further apart than this share of the cloud's diagonal are in no order
_SCATTERED = 0.03
#: fewer points are quick in any order
_FEW = 10_000
#: cells of the curve along each axis, as a power of two
_BITS = 16


class Neighbours:
    """The tree of a reference, whose coordinates must be finite."""

    def __init__(self, reference: Array) -> None:
        self.count = len(reference)
        self.points = np.empty((0, 3))
        self.origin = np.zeros(3)
        self._order: Indices | None = None
        if self.count == 0:
            return
        bounds = _checked_bounds(reference)
        self.origin = bounds.mean(axis=0)
        self.points = np.ascontiguousarray(reference - self.origin)
        order = _order(self.points, bounds - self.origin)
        if order is not None:
            self.points = self.points[order]
            # what no point was found for has the number m, before and after
            self._order = np.append(order, self.count).astype(np.uint32)
        self._tree = KDTree(self.points, leafsize=_LEAF)

    def query(self, points: Array, limit: float = np.inf, k: int = 1) -> tuple[Array, Indices]:
        """Nearest points of the reference; beyond the limit distances are infinite, indices m."""
        distances, indices = self.local_query(points, limit, k)
        return distances, indices if self._order is None else self._order[indices]

    def local_query(
        self, points: Array, limit: float = np.inf, k: int = 1
    ) -> tuple[Array, Indices]:
        """The same with indices into :attr:`points`, which is centred and may be reordered."""
        shape = (len(points),) if k == 1 else (len(points), k)
        distances = np.full(shape, np.inf)
        indices = np.full(shape, self.count, dtype=np.uint32)
        if self.count == 0 or len(points) == 0:
            return distances, indices
        order = _order(points, _checked_bounds(points))
        bound = None if np.isinf(limit) else limit
        for first in range(0, len(points), _BLOCK):
            here = slice(first, first + _BLOCK) if order is None else order[first : first + _BLOCK]
            block = np.ascontiguousarray(points[here] - self.origin)
            if k == 1:
                distances[here], indices[here] = self._tree.query(block, distance_upper_bound=bound)
                continue
            # the tree has no answer beyond its number of points
            known = min(k, self.count)
            some, where = self._tree.query(block, k=known, distance_upper_bound=bound)
            distances[here, :known] = some.reshape(len(block), known)
            indices[here, :known] = where.reshape(len(block), known)
        return distances, indices


def nearest(query: Array, reference: Array, limit: float = np.inf) -> tuple[Array, Indices]:
    """Find the nearest point of a reference; beyond the limit the distance is infinite, index m."""
    return Neighbours(reference).query(query, limit)


def corners(points: Array) -> Array:
    """Corners of the box of points: infinite without points, NaN along axes that are not finite."""
    if len(points) == 0:
        return np.array([[np.inf] * 3, [-np.inf] * 3])
    return _bounds(np.asarray(points, dtype=np.float64))


def _checked_bounds(points: Array) -> Array:
    """Smallest and largest coordinates (2, 3); a tree searched at NaN does not come back."""
    bounds = _bounds(np.asarray(points, dtype=np.float64))
    if not np.isfinite(bounds).all():
        raise ValueError("coordinates must be finite")
    return bounds


def _order(points: Array, bounds: Array) -> NDArray[np.int64] | None:
    """The order along the curve (n,), None for points that already follow each other."""
    if len(points) < _FEW:
        return None
    extent = bounds[1] - bounds[0]
    step = max(1, len(points) // 4096)
    first = points[:-1:step]
    steps = np.linalg.norm(points[1::step][: len(first)] - first, axis=1)
    if np.median(steps) <= _SCATTERED * np.linalg.norm(extent):
        return None
    scale = (2**_BITS - 1) / max(float(extent.max()), 1e-9)
    return np.argsort(_morton(points, bounds[0], scale), kind="stable")


def _bounds(points: Array) -> Array:
    """Smallest and largest coordinates (2, 3), NaN along an axis where one is not finite."""
    # column by column numpy is as quick as a compiled loop, which takes seconds to compile
    extremes = np.array([(column.min(), column.max()) for column in points.T]).T
    extremes[:, ~np.isfinite(extremes).all(axis=0)] = np.nan
    return extremes


@njit(cache=True, nogil=True)
def _morton(points, low, scale):  # type: ignore[no-untyped-def]
    """Codes (n,): the bits of the three cells of each point by turns."""
    out = np.empty(len(points), dtype=np.uint64)
    for n in range(len(points)):
        code = np.uint64(0)
        for axis in range(3):
            cell = np.uint64((points[n, axis] - low[axis]) * scale)
            for bit in range(_BITS):
                code |= ((cell >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
        out[n] = code
    return out
