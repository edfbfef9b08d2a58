"""The nearest primitive along each of many rays from one place.

Directions are sorted into the cells of a cube around the place; a cell knows the primitives whose
boxes reach into its pyramid, and a ray looks at these only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tribrach.simulate.intersections import FAR, meet, reflectance_at
from tribrach.simulate.scene import Scene

__all__ = ["Hits", "View"]

Array = NDArray[np.float64]

#: cells along an edge of the cube
_CELLS = 24


@dataclass(frozen=True, eq=False)
class Hits:
    """What rays (n,) met.

    range [m], infinite where nothing; cosine of the incidence angle; reflectance; primitive :
    its number, -1 where nothing.
    """

    range: Array
    cosine: Array
    reflectance: Array
    primitive: NDArray[np.int64]


class View:
    """A scene as seen from one place (3,) of the world."""

    def __init__(self, scene: Scene, origin: Array) -> None:
        self.scene, self.origin = scene, np.asarray(origin, dtype=float)
        self._local = np.einsum("nij,nj->ni", scene.axes, self.origin - scene.center)
        self._start, self._items = _candidates(scene.corners() - self.origin)

    def cast(self, directions: Array) -> Hits:
        """The nearest hits of unit vectors (n, 3), world."""
        return self._hits(directions, None)

    def again(self, directions: Array, primitive: NDArray[np.int64]) -> Hits:
        """Hits of unit vectors (n, 3) with one primitive each (n,), and with no other."""
        return self._hits(directions, primitive)

    def _hits(self, directions: Array, only: NDArray[np.int64] | None) -> Hits:
        n, s = len(directions), self.scene
        hits = Hits(np.empty(n), np.empty(n), np.empty(n), np.empty(n, dtype=np.int64))
        shapes = (s.kind, s.axes, s.half, s.reflectance, s.pattern, self._local)
        out = (hits.range, hits.cosine, hits.reflectance, hits.primitive)
        rays = np.ascontiguousarray(directions)
        if only is None:
            _cast(rays, *shapes, self._start, self._items, *out)
        else:
            _again(rays, *shapes, only, *out)
        return hits


def _candidates(corners: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Primitives by cell: start (cells + 1,) into items."""
    count = np.zeros(6 * _CELLS * _CELLS + 1, dtype=np.int64)
    _reach(corners, count, np.empty(0, dtype=np.int64))
    start = np.cumsum(count)
    items = np.empty(int(start[-1]), dtype=np.int64)
    _reach(corners, start.copy(), items)
    return start, items


@njit(cache=True, nogil=True, inline="always")
def _face(x, y, z):  # type: ignore[no-untyped-def]
    """Face of the cube and the place u, v in (-1, 1) on it."""
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        return (0 if x > 0 else 1), y / ax, z / ax
    if ay >= az:
        return (2 if y > 0 else 3), x / ay, z / ay
    return (4 if z > 0 else 5), x / az, y / az


@njit(cache=True, nogil=True, inline="always")
def _on_face(face, p):  # type: ignore[no-untyped-def]
    """Depth w along a face's axis, and u, v, of a vector: it lies in direction u / w, v / w."""
    axis = face // 2
    w = p[axis] if face % 2 == 0 else -p[axis]
    u = p[1] if axis == 0 else p[0]
    v = p[1] if axis == 2 else p[2]
    return w, u, v


@njit(cache=True, nogil=True)
def _reach(corners, start, items):  # type: ignore[no-untyped-def]
    """Count (items empty) or list the primitives whose corners lie on no outer side of a cell.

    When counting, ``start[c + 1]`` is the number of cell c; when listing, ``start[c]`` moves on.
    """
    width = 2.0 / _CELLS
    for n in range(len(corners)):
        for face in range(6):
            for i in range(_CELLS):
                for j in range(_CELLS):
                    # a rim of rounding keeps rays on the border of a cell
                    u0, v0 = -1 + i * width - 1e-9, -1 + j * width - 1e-9
                    if _outside(corners[n], face, u0, v0, width + 2e-9):
                        continue
                    cell = (face * _CELLS + i) * _CELLS + j
                    if len(items) == 0:
                        start[cell + 1] += 1
                    else:
                        items[start[cell]] = n
                        start[cell] += 1


@njit(cache=True, nogil=True)
def _outside(corners, face, u0, v0, width):  # type: ignore[no-untyped-def]
    """Do all corners lie beyond one side of the cell's pyramid?"""
    behind, left, right, below, above = True, True, True, True, True
    for k in range(8):
        w, u, v = _on_face(face, corners[k])
        behind &= w <= 0.0
        left &= u < u0 * w
        right &= u > (u0 + width) * w
        below &= v < v0 * w
        above &= v > (v0 + width) * w
    return behind or left or right or below or above


@njit(cache=True, parallel=True, nogil=True)
def _cast(rays, kind, axes, half, reflect, pattern, local, start, items, r, c, a, p):  # type: ignore[no-untyped-def]
    for n in prange(len(rays)):
        x, y, z = rays[n, 0], rays[n, 1], rays[n, 2]
        face, u, v = _face(x, y, z)
        i = min(int((u + 1) * (_CELLS / 2)), _CELLS - 1)
        j = min(int((v + 1) * (_CELLS / 2)), _CELLS - 1)
        cell = (face * _CELLS + i) * _CELLS + j
        best, cosine, found = FAR, 0.0, -1
        d = np.empty(3)
        for k in range(start[cell], start[cell + 1]):
            m = items[k]
            length, along = meet(kind[m], axes[m], half[m], local[m], x, y, z, d)
            if length < best:
                best, cosine, found = length, along, m
        r[n], c[n], p[n], a[n] = np.inf, cosine, found, 0.0
        if found >= 0:
            r[n] = best
            a[n] = _reflectance(found, best, x, y, z, kind, axes, reflect, pattern, local)


@njit(cache=True, parallel=True, nogil=True)
def _again(rays, kind, axes, half, reflect, pattern, local, only, r, c, a, p):  # type: ignore[no-untyped-def]
    for n in prange(len(rays)):
        x, y, z, m = rays[n, 0], rays[n, 1], rays[n, 2], only[n]
        r[n], c[n], p[n], a[n] = np.inf, 0.0, -1, 0.0
        if m < 0:
            continue
        length, along = meet(kind[m], axes[m], half[m], local[m], x, y, z, np.empty(3))
        if length < FAR:
            r[n], c[n], p[n] = length, along, m
            a[n] = _reflectance(m, length, x, y, z, kind, axes, reflect, pattern, local)


@njit(cache=True, nogil=True, inline="always")
def _reflectance(m, length, x, y, z, kind, axes, reflect, pattern, local):  # type: ignore[no-untyped-def]
    """Reflectance where a ray met primitive m."""
    t = axes[m]
    u = local[m, 0] + length * (t[0, 0] * x + t[0, 1] * y + t[0, 2] * z)
    v = local[m, 1] + length * (t[1, 0] * x + t[1, 1] * y + t[1, 2] * z)
    return reflectance_at(kind[m], reflect[m], pattern[m], u, v)
