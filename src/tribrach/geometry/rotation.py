"""How rotations are written, incremented and differentiated.

A rotation is a 3x3 matrix ``R`` with ``x_world = R @ x_scanner``; increments are left
(world-side) rotation vectors ``d``: ``R <- exp(d) @ R``. All functions take any leading shape.
Matrices and vectors pass through unit quaternions, which are exact at all angles (Shepperd 1978).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["exp", "from_quaternion", "log", "right_jacobian_inverse", "skew", "to_quaternion"]

Array = NDArray[np.float64]


def skew(a: Array) -> Array:
    """Matrix ``[a]x`` with ``[a]x @ b = a x b``; (..., 3) -> (..., 3, 3)."""
    out = np.zeros((*a.shape, 3))
    out[..., 0, 1], out[..., 0, 2] = -a[..., 2], a[..., 1]
    out[..., 1, 0], out[..., 1, 2] = a[..., 2], -a[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -a[..., 1], a[..., 0]
    return out


def exp(vector: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) in radians."""
    r = np.asarray(vector, dtype=float)
    half = np.linalg.norm(r, axis=-1, keepdims=True) / 2
    # sin(a/2) / a, which is 1/2 at zero
    return from_quaternion(np.concatenate([np.sinc(half / np.pi) / 2 * r, np.cos(half)], axis=-1))


def log(matrix: Array) -> Array:
    """Rotation vectors (..., 3) in radians, length at most pi, of rotation matrices (..., 3, 3)."""
    q = to_quaternion(matrix)
    sine = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., 3:])
    out: Array = q[..., :3] / (np.sinc(angle / 2 / np.pi) / 2)
    return out


def from_quaternion(quaternion: Array) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4) in the order x, y, z, w, of any length.

    Raises
    ------
    ValueError : a quaternion without length, or not finite.
    """
    q = np.asarray(quaternion, dtype=float)
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    if not (np.isfinite(length) & (length > 0)).all():
        raise ValueError("a quaternion without length is no rotation")
    x, y, z, w = np.moveaxis(q / length, -1, 0)
    out = np.empty((*q.shape[:-1], 3, 3))
    out[..., 0, 0] = x * x - y * y - z * z + w * w
    out[..., 1, 1] = y * y - z * z - x * x + w * w
    out[..., 2, 2] = z * z - x * x - y * y + w * w
    for (i, j), product, turn in (((0, 1), x * y, z * w), ((1, 2), y * z, x * w)):
        out[..., i, j], out[..., j, i] = 2 * (product - turn), 2 * (product + turn)
    out[..., 2, 0], out[..., 0, 2] = 2 * (z * x - y * w), 2 * (z * x + y * w)
    return out


def to_quaternion(matrix: Array) -> Array:
    """Unit quaternions (..., 4) in the order x, y, z, w, w not negative, of rotation matrices.

    Each is taken from its largest component, which loses no digits anywhere.
    """
    m = np.asarray(matrix, dtype=float)
    trace = np.trace(m, axis1=-2, axis2=-1)
    squares = np.concatenate([np.diagonal(m, axis1=-2, axis2=-1), trace[..., None]], axis=-1)
    # row k is four times the quaternion times its component k
    rows = m + np.swapaxes(m, -1, -2) + (1 - trace)[..., None, None] * np.eye(3)
    turn = np.stack([m[..., k, j] - m[..., j, k] for j, k in ((1, 2), (2, 0), (0, 1))], axis=-1)
    upper = np.concatenate([rows, turn[..., None]], axis=-1)
    lower = np.concatenate([turn, 1 + trace[..., None]], axis=-1)
    every = np.concatenate([upper, lower[..., None, :]], axis=-2)
    largest = np.argmax(squares, axis=-1)[..., None, None]
    q = np.take_along_axis(every, largest, axis=-2)[..., 0, :]
    out: Array = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(out[..., 3:] < 0, -out, out)


def right_jacobian_inverse(r: Array) -> Array:
    """Derivative of ``log(exp(r) @ exp(e))`` by ``e`` at ``e = 0``; (..., 3) -> (..., 3, 3).

    ``Jr^-1(r) = I + [r]x/2 + (1/|r|^2 - (1 + cos|r|)/(2 |r| sin|r|)) [r]x^2``; the bracket tends
    to 1/12 at zero. Its transpose is the inverse left Jacobian.
    """
    angle = np.linalg.norm(r, axis=-1)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    # cot(a/2)/(2a) is the same as (1 + cos a)/(2 a sin a) without the cancellation near pi
    exact = 1 / safe**2 - 1 / (2 * safe * np.tan(safe / 2))
    factor = np.where(small, 1 / 12 + angle**2 / 720, exact)
    cross = skew(r)
    return np.eye(3) + 0.5 * cross + factor[..., None, None] * (cross @ cross)
