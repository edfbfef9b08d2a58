"""The covariance of one station relative to another, in which what both share cancels.

A point X that both stations see is displaced by ``d = (dt_2 + d_2 x (X - t_2)) - (dt_1 + d_1 x (X -
t_1))`` between their clouds; with the joint covariance of the two poses, errors of the control that
move both alike vanish. The same displacement is ``d = q_t + q_r x (X - X_0)`` of a relative pose q
about any reference X_0, so that six numbers carry it (method sections 5.1 and 9.5). Metres and
radians; increments are left, about the axes of the world.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geometry.rotation import skew
from tribrach.network.adjustment import Adjustment

__all__ = ["StationPair", "along_normals"]


#: a covariance may have eigenvalues below zero by this share of its largest
_ROUNDING = 1e-9


@dataclass(frozen=True)
class StationPair:
    """Two stations with one covariance.

    Attributes
    ----------
    first, second : array (3,)
        Their places [m].
    covariance : array (12, 12)
        Of translation [m] and left rotation increment [rad] of the first, then of the second.

    Raises
    ------
    InputError
        The matrix is not a covariance of twelve unknowns.
    """

    first: Array
    second: Array
    covariance: Array

    def __post_init__(self) -> None:
        c = self.covariance
        if c.shape != (12, 12) or not np.isfinite(c).all():
            raise InputError("the joint covariance of two stations has 12 rows and columns")
        scale = np.sqrt(np.maximum(np.diag(c), np.finfo(float).tiny))
        values = np.linalg.eigvalsh(0.5 * (c + c.T) / np.outer(scale, scale))
        if values[0] < -_ROUNDING * max(values[-1], 1.0):
            raise InputError("the joint covariance of two stations has a negative variance")

    @classmethod
    def from_adjustment(
        cls, adjustment: Adjustment, first: str, second: str, factor: float = 1.0
    ) -> StationPair:
        """Two stations of one adjustment; covariances times a factor (a posteriori variance)."""
        state = adjustment.state
        places = [state.pose_t[state.layout.index("pose", name)] for name in (first, second)]
        blocks = [[adjustment.covariance(a, b) for b in (first, second)] for a in (first, second)]
        return cls(places[0], places[1], factor * np.block(blocks))

    @classmethod
    def independent(cls, first: Placement, second: Placement) -> StationPair:
        """Two stations that share nothing, of two surveys for instance: nothing cancels."""
        joint = np.zeros((12, 12))
        joint[:6, :6], joint[6:, 6:] = first.covariance, second.covariance
        return cls(first.pose.translation, second.pose.translation, joint)

    def relative(self, reference: Array) -> Array:
        """Covariance (6, 6) of the relative pose q = (q_t, q_r) about a reference (3,)."""
        motion = np.zeros((6, 12))
        for half, place, sign in ((0, self.first, -1.0), (6, self.second, 1.0)):
            motion[:3, half : half + 3] = sign * np.eye(3)
            motion[:3, half + 3 : half + 6] = -sign * skew(reference - place)
            motion[3:, half + 3 : half + 6] = sign * np.eye(3)
        covariance: Array = motion @ self.covariance @ motion.T
        return 0.5 * (covariance + covariance.T)

    def registration(self, points: Array) -> Array:
        """``C_reg(X)`` (m, 3, 3) [m^2]: covariance of the displacement between the clouds at X."""
        reference = points.mean(axis=0)
        covariance = self.relative(reference)
        lever = -skew(points - reference)
        mixed = lever @ covariance[3:, :3]
        out: Array = covariance[:3, :3] + mixed + mixed.transpose(0, 2, 1)
        return out + lever @ covariance[3:, 3:] @ lever.transpose(0, 2, 1)


def along_normals(points: Array, normals: Array, reference: Array) -> Array:
    """Rows ``a = [n ; (X - X_0) x n]`` (m, 6): what a relative pose does along the normals."""
    return np.concatenate([normals, np.cross(points - reference, normals)], axis=1)
