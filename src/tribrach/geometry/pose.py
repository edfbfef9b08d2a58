"""A rigid motion from one frame into another, written so that compositions read as algebra.

``world_from_scanner @ x_in_scanner`` carries points (..., 3) [m]; ``a_from_b @ b_from_c`` is a
Pose again. Increments of its covariance are left: translation, then a rotation vector about the
axes of the outer frame (method section 1.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self, overload

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError

#: rotation matrices may differ from orthonormal by this much before they are refused
_SKEWED = 1e-3


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid motion ``outer_from_inner``."""

    rotation: Array  #: (3, 3), proper and orthonormal
    translation: Array  #: (3,), in metres, the origin of the inner frame in the outer one

    @classmethod
    def identity(cls) -> Self:
        """The motion that moves nothing."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def from_matrix(cls, matrix: Array) -> Self:
        """The pose of a 4x4 matrix; its rotation is replaced by the nearest orthonormal one."""
        if not np.isfinite(matrix).all() or not np.allclose(matrix[3], [0, 0, 0, 1]):
            raise InputError("the 4x4 matrix is no rigid motion: its last row is not 0 0 0 1")
        u, s, vt = np.linalg.svd(matrix[:3, :3])
        if np.abs(s - 1).max() > _SKEWED:
            raise InputError("the 4x4 matrix is no rigid motion: it scales or shears")
        if np.linalg.det(u @ vt) < 0:
            raise InputError("the 4x4 matrix mirrors (its determinant is -1)")
        return cls(u @ vt, matrix[:3, 3].copy())

    @property
    def matrix(self) -> Array:
        """The motion as a homogeneous matrix (4, 4)."""
        out = np.eye(4)
        out[:3, :3], out[:3, 3] = self.rotation, self.translation
        return out

    @property
    def inverse(self) -> Pose:
        """The motion back, ``inner_from_outer``."""
        return Pose(self.rotation.T, -self.rotation.T @ self.translation)

    @overload
    def __matmul__(self, other: Pose) -> Pose: ...
    @overload
    def __matmul__(self, other: Array) -> Array: ...
    def __matmul__(self, other: Pose | Array) -> Pose | Array:
        """Compose with another motion, or carry points (..., 3) [m]."""
        if isinstance(other, Pose):
            return Pose(
                self.rotation @ other.rotation, self.rotation @ other.translation + self.translation
            )
        moved: Array = other @ self.rotation.T + self.translation
        return moved
