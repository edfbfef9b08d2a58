"""Rotation matrices, rotation vectors and the derivatives between them.

A rotation is a 3x3 matrix ``R`` with ``x_world = R @ x_scanner``; increments are left (world-side)
rotation vectors ``d``: ``R <- exp(d) @ R``. All functions take any leading shape.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


def skew(a: Array) -> Array:
    """Matrices ``[a]x`` (..., 3, 3) of vectors (..., 3), with ``[a]x @ b = a x b``."""
    out = np.zeros((*a.shape, 3))
    out[..., 0, 1], out[..., 0, 2] = -a[..., 2], a[..., 1]
    out[..., 1, 0], out[..., 1, 2] = a[..., 2], -a[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -a[..., 1], a[..., 0]
    return out


@cache
def _rotation() -> type[Rotation]:
    """The class of scipy, which networks without rotations need not wait for."""
    from scipy.spatial.transform import Rotation

    return Rotation


def exp(vector: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) in radians (Rodrigues)."""
    flat = np.asarray(vector, dtype=float).reshape(-1, 3)
    if len(flat) == 0:
        return np.zeros((*np.shape(vector), 3))
    return _rotation().from_rotvec(flat).as_matrix().reshape(*np.shape(vector), 3)


def log(matrix: Array) -> Array:
    """Rotation vectors (..., 3) in radians, length at most pi, of rotation matrices (..., 3, 3)."""
    flat = np.asarray(matrix, dtype=float).reshape(-1, 3, 3)
    if len(flat) == 0:
        return np.zeros(np.shape(matrix)[:-1])
    return _rotation().from_matrix(flat).as_rotvec().reshape(np.shape(matrix)[:-1])


def right_jacobian_inverse(r: Array) -> Array:
    """Derivative (..., 3, 3) of ``log(exp(r) @ exp(e))`` by ``e`` at ``e = 0``.

    ``Jr^-1(r) = I + [r]x/2 + (1/|r|^2 - (1 + cos|r|)/(2 |r| sin|r|)) [r]x^2``; the bracket tends to
    1/12 at zero. The transpose is the inverse left Jacobian.
    """
    angle = np.linalg.norm(r, axis=-1)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    # cot(a/2)/(2a) is the same as (1 + cos a)/(2 a sin a) without the cancellation near pi
    exact = 1 / safe**2 - 1 / (2 * safe * np.tan(safe / 2))
    factor = np.where(small, 1 / 12 + angle**2 / 720, exact)
    cross = skew(r)
    return np.eye(3) + 0.5 * cross + factor[..., None, None] * (cross @ cross)
