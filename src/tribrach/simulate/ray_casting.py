"""The nearest primitive along each of many rays from one place.

Directions are sorted into the cells of a cube around the place; a cell knows the primitives whose
boxes reach into its pyramid, and a ray is intersected with these only. A ray is ``o + r d`` with
unit ``d``; each intersection is computed in the primitive's own frame. Boxes, cylinders, spheres
and ellipsoids are hit from outside or from inside, flat primitives from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.kernels import in_threads, njit
from tribrach.simulate.scene import (
    BOX,
    CHECKERBOARD,
    CYLINDER,
    DISC,
    ELLIPSOID,
    SPHERE,
    Scene,
)

#: the range of rays that hit nothing [m]
FAR = 1e30
#: nearer than this is the instrument itself [m]
_NEAR = 1e-6
#: cells along an edge of the cube
_CELLS = 24


@njit(cache=True, nogil=True, inline="always")
def _flat(o, d, half):  # type: ignore[no-untyped-def]
    """Range and cosine of a rectangle in z = 0."""
    if d[2] == 0.0:
        return FAR, 0.0
    r = -o[2] / d[2]
    if r < _NEAR:
        return FAR, 0.0
    if abs(o[0] + r * d[0]) > half[0] or abs(o[1] + r * d[1]) > half[1]:
        return FAR, 0.0
    return r, abs(d[2])


@njit(cache=True, nogil=True, inline="always")
def _box(o, d, half):  # type: ignore[no-untyped-def]
    """Range and cosine of a box by its slabs."""
    enter, leave, first, last = -FAR, FAR, 0, 0
    for k in range(3):
        if d[k] == 0.0:
            if abs(o[k]) > half[k]:
                return FAR, 0.0
            continue
        a, b = (-half[k] - o[k]) / d[k], (half[k] - o[k]) / d[k]
        low, high = min(a, b), max(a, b)
        if low > enter:
            enter, first = low, k
        if high < leave:
            leave, last = high, k
    if enter > leave or leave < _NEAR:
        return FAR, 0.0
    if enter >= _NEAR:
        return enter, abs(d[first])
    return leave, abs(d[last])


@njit(cache=True, nogil=True, inline="always")
def _sphere(o, d, radius):  # type: ignore[no-untyped-def]
    """Range and cosine of a sphere."""
    b = o[0] * d[0] + o[1] * d[1] + o[2] * d[2]
    # the foot of the perpendicular keeps digits that c - b b would lose
    x, y, z = o[0] - b * d[0], o[1] - b * d[1], o[2] - b * d[2]
    square = radius * radius - (x * x + y * y + z * z)
    if square < 0.0:
        return FAR, 0.0
    root = np.sqrt(square)
    r = -b - root
    if r < _NEAR:
        r = -b + root
    if r < _NEAR:
        return FAR, 0.0
    return r, root / radius


@njit(cache=True, nogil=True, inline="always")
def _ellipsoid(o, d, half):  # type: ignore[no-untyped-def]
    """Range and cosine of an ellipsoid: the unit sphere in a frame stretched by its axes."""
    u, e = np.empty(3), np.empty(3)
    for k in range(3):
        u[k], e[k] = o[k] / half[k], d[k] / half[k]
    stretch = np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    for k in range(3):
        e[k] /= stretch
    r, _ = _sphere(u, e, 1.0)
    if r >= FAR:
        return FAR, 0.0
    r /= stretch
    along, size = 0.0, 0.0
    for k in range(3):
        slope = (o[k] + r * d[k]) / half[k] ** 2
        along += slope * d[k]
        size += slope * slope
    return r, abs(along) / np.sqrt(size)


@njit(cache=True, nogil=True, inline="always")
def _cylinder(o, d, radius, top):  # type: ignore[no-untyped-def]
    """Range and cosine of a cylinder around z, its mantle first, then its caps."""
    best, cosine = FAR, 0.0
    a = d[0] * d[0] + d[1] * d[1]
    if a > 0.0:
        b = (o[0] * d[0] + o[1] * d[1]) / a
        x, y = o[0] - b * d[0], o[1] - b * d[1]
        square = radius * radius - x * x - y * y
        if square < 0.0:
            return FAR, 0.0
        root = np.sqrt(square / a)
        for r in (-b - root, -b + root):
            if r >= _NEAR and r < best and abs(o[2] + r * d[2]) <= top:
                best, cosine = r, np.sqrt(square * a) / radius
    if d[2] != 0.0:
        for side in (-top, top):
            r = (side - o[2]) / d[2]
            if r >= _NEAR and r < best:
                x, y = o[0] + r * d[0], o[1] + r * d[1]
                if x * x + y * y <= radius * radius:
                    best, cosine = r, abs(d[2])
    return best, cosine


@njit(cache=True, nogil=True, inline="always")
def meet(kind, axes, half, o, dx, dy, dz, d):  # type: ignore[no-untyped-def]
    """Range [m] (FAR if none) and cosine of a ray with a primitive; fills ``d`` with its way."""
    for k in range(3):
        d[k] = axes[k, 0] * dx + axes[k, 1] * dy + axes[k, 2] * dz
    if kind == SPHERE:
        return _sphere(o, d, half[0])
    if kind == BOX:
        return _box(o, d, half)
    if kind == CYLINDER:
        return _cylinder(o, d, half[0], half[2])
    if kind == ELLIPSOID:
        return _ellipsoid(o, d, half)
    return _flat(o, d, half)


@njit(cache=True, nogil=True, inline="always")
def reflectance_at(kind, reflectance, pattern, x, y):  # type: ignore[no-untyped-def]
    """Reflectance at a place x, y of a primitive's own plane."""
    if kind == CHECKERBOARD:
        if abs(x) > pattern or abs(y) > pattern:
            return reflectance[0]
        return reflectance[1] if x * y > 0.0 else reflectance[2]
    if kind == DISC and x * x + y * y <= pattern * pattern:
        return reflectance[1]
    return reflectance[0]


@dataclass(frozen=True, eq=False)
class Hits:
    """Hits of n rays."""

    range: Array  #: (n,), in metres, infinite where nothing was hit
    cosine: Array  #: (n,), of the incidence angle
    reflectance: Array  #: (n,), at the place that was hit
    primitive: NDArray[np.int64]  #: (n,), its number, -1 where nothing was hit


class SceneView:
    """A scene as seen from one place."""

    def __init__(self, scene: Scene, origin: Array) -> None:
        self.scene, self.origin = scene, np.asarray(origin, dtype=float)
        self._local = np.einsum("nij,nj->ni", scene.axes, self.origin - scene.center)
        self._start, self._items = _candidates(scene.corners() - self.origin)

    def cast(self, directions: Array) -> Hits:
        """The nearest hits of rays (n, 3), unit vectors in the world."""
        return self._hits(directions, None)

    def again(self, directions: Array, primitive: NDArray[np.int64]) -> Hits:
        """Hits of rays with one primitive each and with no other."""
        return self._hits(directions, primitive)

    def _hits(self, directions: Array, only: NDArray[np.int64] | None) -> Hits:
        n, s = len(directions), self.scene
        hits = Hits(np.empty(n), np.empty(n), np.empty(n), np.empty(n, dtype=np.int64))
        shapes = (s.kind, s.axes, s.half, s.reflectance, s.pattern, self._local)
        out = (hits.range, hits.cosine, hits.reflectance, hits.primitive)
        rays = np.ascontiguousarray(directions)
        if only is None:
            in_threads(_cast, n, rays, *shapes, self._start, self._items, False, *out)
        else:
            # one kernel for both: the candidates of a ray instead of those of a cell
            start = np.concatenate([[0], np.cumsum(only >= 0)])
            in_threads(_cast, n, rays, *shapes, start, only[only >= 0], True, *out)
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
    """Count (``items`` empty) or list the primitives whose corners lie on no outer side of a cell.

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
    """True if all corners lie beyond one side of the cell's pyramid."""
    behind, left, right, below, above = True, True, True, True, True
    for k in range(8):
        w, u, v = _on_face(face, corners[k])
        behind &= w <= 0.0
        left &= u < u0 * w
        right &= u > (u0 + width) * w
        below &= v < v0 * w
        above &= v > (v0 + width) * w
    return behind or left or right or below or above


@njit(cache=True, nogil=True)
def _cast(  # type: ignore[no-untyped-def]
    first, last, rays, kind, axes, half, reflect, pattern, local, start, items, own, r, c, a, p
):
    """Nearest hits; candidates are those of the cell of a ray, or its ``own``."""
    d = np.empty(3)
    for n in range(first, last):
        x, y, z = rays[n, 0], rays[n, 1], rays[n, 2]
        cell = np.int64(n)
        if not own:
            face, u, v = _face(x, y, z)
            i = min(int((u + 1) * (_CELLS / 2)), _CELLS - 1)
            j = min(int((v + 1) * (_CELLS / 2)), _CELLS - 1)
            cell = (face * _CELLS + i) * _CELLS + j
        best, cosine, number = FAR, 0.0, -1
        for k in range(start[cell], start[cell + 1]):
            m = items[k]
            length, along = meet(kind[m], axes[m], half[m], local[m], x, y, z, d)
            if length < best:
                best, cosine, number = length, along, m
        r[n], c[n], p[n], a[n] = np.inf, cosine, number, 0.0
        if number >= 0:
            r[n] = best
            a[n] = _reflectance(number, best, x, y, z, kind, axes, reflect, pattern, local)


@njit(cache=True, nogil=True, inline="always")
def _reflectance(m, length, x, y, z, kind, axes, reflect, pattern, local):  # type: ignore[no-untyped-def]
    """Reflectance where a ray met primitive m."""
    t = axes[m]
    u = local[m, 0] + length * (t[0, 0] * x + t[0, 1] * y + t[0, 2] * z)
    v = local[m, 1] + length * (t[1, 0] * x + t[1, 1] * y + t[1, 2] * z)
    return reflectance_at(kind[m], reflect[m], pattern[m], u, v)
