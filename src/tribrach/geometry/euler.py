"""Omega, phi and kappa of a rotation, for reports and for files of other programs.

``M = R3(kappa) R2(phi) R1(omega)`` is the passive matrix of photogrammetry: ``x_s = M (X - t)``
takes the world to the scanner, so that ``world_from_scanner = M^T``. For a publication that uses M
itself from scanner to world, pass the transposed matrix. Angles are never unknowns. All functions
take any leading shape; radians. Method section 1.3, equations S1 (5) and S2 (5).
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array

#: cosine of phi below which omega and kappa turn about the same axis
GIMBAL_LOCK = 1e-8


def opk_from_world_from_scanner(world_from_scanner: Array) -> Array:
    """Omega, phi, kappa (..., 3) [rad] of rotations (..., 3, 3) scanner to world.

    phi is in [-pi/2, pi/2]. Where it is a right angle only kappa +- omega is defined, and omega is
    set to zero.
    """
    m = np.swapaxes(world_from_scanner, -1, -2)
    cos_phi = np.hypot(m[..., 2, 1], m[..., 2, 2])
    locked = cos_phi < GIMBAL_LOCK
    omega = np.where(locked, 0.0, np.arctan2(-m[..., 2, 1], m[..., 2, 2]))
    level = np.arctan2(-m[..., 1, 0], m[..., 0, 0])
    kappa = np.where(locked, np.arctan2(m[..., 0, 1], m[..., 1, 1]), level)
    return np.stack([omega, np.arctan2(m[..., 2, 0], cos_phi), kappa], axis=-1)


def opk_by_increment(world_from_scanner: Array) -> Array:
    """Derivative (..., 3, 3) of omega, phi, kappa by the left increments of world_from_scanner.

    It propagates a station's rotation covariance to the angles: ``J C J^T``. It has no meaning
    where phi is a right angle.
    """
    opk = opk_from_world_from_scanner(world_from_scanner)
    sw, cw = np.sin(opk[..., 0]), np.cos(opk[..., 0])
    cp, tp = np.cos(opk[..., 1]), np.tan(opk[..., 1])
    zero, one = np.zeros_like(sw), np.ones_like(sw)
    rows = [[one, tp * sw, -tp * cw], [zero, cw, sw], [zero, -sw / cp, cw / cp]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
