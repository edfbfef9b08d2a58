"""A scan as surfels: small pieces of surface, each the mean and the plane of a cube of points.

The normal is the direction of least spread of the points in the cube, towards the scanner. Cubes
with too few points for a plane, or rough ones, count in one of twice the size, up to 8 or 16 times;
what is no plane then (edges, leaves) is left out. All points of a scan take part, so that its noise
is averaged; what remains is shared by neighbours and is counted elsewhere. Scanner frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tribrach.geometry.pose import Pose
from tribrach.registration.clouds.cells import Cells, coarser

__all__ = ["Surfels", "surfels_of"]

Array = NDArray[np.float64]

#: points that make a plane
FEWEST = 6
#: times that cubes with too few points are merged
_MERGES = 3
#: thickness over the lesser width of points that are still a plane
_THIN = 0.2
#: lesser over greater width of points that are no line
_WIDE = 0.12


@dataclass(frozen=True, eq=False)
class Surfels:
    """Pieces of surface.

    center, normal (n, 3) [m]; count (n,) of points; thickness (n,) : their standard deviation along
    the normal; width (n, 2) : along the surface, the lesser first; size (n,) : edges of the cubes;
    stands_for : how many surfels each stands for, where they were thinned.
    """

    center: Array
    normal: Array
    count: Array
    thickness: Array
    width: Array
    size: Array
    stands_for: float = 1.0

    def __len__(self) -> int:
        return len(self.center)

    @property
    def area(self) -> Array:
        """About how much surface (n,) each stands for [m^2]."""
        area: Array = self.stands_for * self.size**2
        return area

    @property
    def sigma_offset(self) -> Array:
        """Sigma (n,) of the mean along the normal, from the scatter of the points [m]."""
        sigma: Array = self.thickness / np.sqrt(self.count)
        return sigma

    @property
    def sigma_normal(self) -> Array:
        """Sigma (n,) of the normal about its weaker axis [rad]."""
        sigma: Array = self.sigma_offset / self.width[:, 0]
        return sigma

    def placed(self, pose: Pose) -> Surfels:
        """In the frame that the pose leads to."""
        return Surfels(
            pose @ self.center,
            self.normal @ pose.rotation.T,
            self.count,
            self.thickness,
            self.width,
            self.size,
            self.stands_for,
        )

    def subset(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Surfels:
        """Some of them, by a mask or indices."""
        return Surfels(
            self.center[chosen],
            self.normal[chosen],
            self.count[chosen],
            self.thickness[chosen],
            self.width[chosen],
            self.size[chosen],
            self.stands_for,
        )

    def thinned(self, most: int) -> Surfels:
        """At most so many: evenly in the order of the scan, each standing for several."""
        if len(self) <= most:
            return self
        some = self.subset(np.linspace(0, len(self) - 1, most).astype(np.int64))
        return replace(some, stands_for=self.stands_for * len(self) / most)


def surfels_of(cells: Cells, merges: int = _MERGES, viewpoint: Array | None = None) -> Surfels:
    """Surfels of the cubes of a scan.

    viewpoint (3,) : where the normals look, the origin if None.
    """
    parts = []
    eye = np.zeros(3) if viewpoint is None else viewpoint
    for level in range(merges + 1):
        enough = np.flatnonzero(cells.moments[:, 0] >= FEWEST)
        columns, flat = _planes(cells.subset(enough), eye)
        parts.append([column[flat] for column in columns])
        if level < merges:
            rest = np.ones(len(cells), dtype=bool)
            rest[enough[flat]] = False
            cells = coarser(cells.subset(rest))
    center, normal, count, thickness, width, size = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    return Surfels(center, normal, count, thickness, width, size)


def _planes(cells: Cells, eye: Array) -> tuple[tuple[Array, ...], NDArray[np.bool_]]:
    """Columns of the surfels of cubes with enough points, and which of them are flat."""
    table = _fitted(cells.moments)
    center = cells.middles + table[:, :3]
    normal = table[:, 3:6]
    away = np.einsum("ni,ni->n", normal, eye - center) < 0
    normal = np.where(away[:, None], -normal, normal)
    thickness, width = table[:, 6], table[:, 7:9]
    flat = (thickness < _THIN * width[:, 0]) & (width[:, 0] > _WIDE * width[:, 1])
    size = np.full(len(cells), cells.size)
    return (center, normal, cells.moments[:, 0], thickness, width, size), flat


@njit(cache=True, parallel=True, nogil=True)
def _fitted(moments):  # type: ignore[no-untyped-def]
    """Mean from the middle, normal, thickness and widths (m, 9) of cubes."""
    out = np.empty((len(moments), 9))
    for n in prange(len(moments)):
        m = moments[n]
        count = m[0]
        mean = m[1:4] / count
        spread = np.empty((3, 3))
        k = 4
        for i in range(3):
            for j in range(i, 3):
                spread[i, j] = m[k] / count - mean[i] * mean[j]
                spread[j, i] = spread[i, j]
                k += 1
        values, vectors = np.linalg.eigh(spread)
        out[n, :3] = mean
        out[n, 3:6] = vectors[:, 0]
        # three parameters of the plane are estimated from the same points
        out[n, 6] = np.sqrt(max(values[0], 1e-12) * count / max(count - 3.0, 1.0))
        out[n, 7] = np.sqrt(max(values[1], 1e-12))
        out[n, 8] = np.sqrt(max(values[2], 1e-12))
    return out
