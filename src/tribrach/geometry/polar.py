"""Cartesian and polar coordinates of the scanner frame.

``r = |u|``, ``H = atan2(y, x)`` counter-clockwise from the x axis, ``V = atan2(hypot(x, y), z)``
the zenith angle in (0, pi); metres and radians, arrays (n, 3). H is not defined at the poles and
loses its meaning close to the instrument, where targets are refused (method sections 1.2, 2.0,
2.1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError

#: nearer than this [m], or closer to a pole than this [rad], H is not defined well enough
NEAREST, POLE = 0.3, float(np.radians(0.5))


def polar_from_xyz(u: Array) -> Array:
    """Range [m], H in (-pi, pi], V in [0, pi] [rad] of scanner-frame vectors ``u`` (n, 3)."""
    flat = np.hypot(u[:, 0], u[:, 1])
    h, v = np.arctan2(u[:, 1], u[:, 0]), np.arctan2(flat, u[:, 2])
    return np.stack([np.hypot(flat, u[:, 2]), h, v], axis=1)


def xyz_from_polar(polar: Array) -> Array:
    """Vectors (n, 3) [m] in the scanner frame of r, H, V (n, 3)."""
    r, h, v = polar[:, 0], polar[:, 1], polar[:, 2]
    flat = r * np.sin(v)
    return np.stack([flat * np.cos(h), flat * np.sin(h), r * np.cos(v)], axis=1)


def polar_by_xyz(u: Array) -> Array:
    """Derivative ``d(r, H, V)/du`` (n, 3, 3) at vectors (n, 3) off the poles; section 2.0."""
    x, y, z = u[:, 0], u[:, 1], u[:, 2]
    h2 = x**2 + y**2
    h, r2 = np.sqrt(h2), h2 + z**2
    r, zero = np.sqrt(r2), np.zeros_like(x)
    rows = [
        [x / r, y / r, z / r],
        [-y / h2, x / h2, zero],
        [x * z / (h * r2), y * z / (h * r2), -h / r2],
    ]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def xyz_by_polar(polar: Array) -> Array:
    """Derivative ``du/d(r, H, V)`` (n, 3, 3) at r, H, V (n, 3); ``J_rho`` of method section 5.1."""
    r = polar[:, 0]
    sh, ch = np.sin(polar[:, 1]), np.cos(polar[:, 1])
    sv, cv = np.sin(polar[:, 2]), np.cos(polar[:, 2])
    rows = [
        [sv * ch, -r * sv * sh, r * cv * ch],
        [sv * sh, r * sv * ch, r * cv * sh],
        [cv, np.zeros_like(r), -r * sv],
    ]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def require_defined(polar: Array, source: Sequence[str] | NDArray[np.object_] = ()) -> None:
    """Refuse polar readings whose horizontal angle means nothing; V may be of the back face."""
    near = polar[:, 0] < NEAREST
    outside = (polar[:, 2] <= 0) | (polar[:, 2] >= 2 * np.pi)
    bad = np.flatnonzero(near | outside | (np.abs(np.sin(polar[:, 2])) < np.sin(POLE)))
    if len(bad) == 0:
        return
    first = int(bad[0])
    r, v = polar[first, 0], np.degrees(polar[first, 2])
    what = f"a zenith angle of {v:.4f} deg is within 0.5 deg of a pole or outside the circle"
    if near[first]:
        what = f"a range of {r:g} m is below {NEAREST} m"
    where = source[first] if len(source) else ""
    raise InputError(what, record=where or f"observation {first + 1}", cure="leave it out")
