"""Where does a ray meet one primitive? Compiled, one ray at a time, in the primitive's own frame.

A ray is ``o + r d`` with unit ``d``. Boxes, cylinders and spheres are met from outside or from
inside; flat primitives from both sides.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tribrach.simulate.scene import BOX, CHECKERBOARD, CYLINDER, DISC, SPHERE

__all__ = ["FAR", "meet", "reflectance_at"]

#: a range that means that nothing was met [m]
FAR = 1e30
#: nearer than this is the instrument itself [m]
_NEAR = 1e-6


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
    """Range [m] (FAR if none) and cosine of incidence of a ray with one primitive.

    o (3,) : origin in the primitive's frame; d (3,) : room for the direction in that frame, left
    filled for :func:`reflectance_at`.
    """
    for k in range(3):
        d[k] = axes[k, 0] * dx + axes[k, 1] * dy + axes[k, 2] * dz
    if kind == SPHERE:
        return _sphere(o, d, half[0])
    if kind == BOX:
        return _box(o, d, half)
    if kind == CYLINDER:
        return _cylinder(o, d, half[0], half[2])
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
