"""What the uncertainty of a calibration adds to the covariance of corrected points.

``J_c C_c J_c^T + J_geo C_gc J_c^T + (J_geo C_gc J_c^T)^T`` with ``J_c`` the derivative of a placed
point by the parameters and ``J_geo`` that by the station (method sections 4 and 5.1): parameters
and poses of one network are correlated, so the sum may be smaller than either part.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.cloud.placement import Placement
from tribrach.geometry.rotation import skew

__all__ = ["share_of"]

Array = NDArray[np.float64]

#: points whose derivatives are in memory at a time
_BLOCK = 50_000
_ELEMENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def share_of(xyz: Array, placement: Placement) -> Array:
    """Covariances (n, 6) [m^2] as xx, yy, zz, xy, xz, yz in the axes of the world.

    xyz : corrected points (n, 3) of the scanner frame.

    Raises
    ------
    ValueError : the placement has no calibration.
    """
    share = placement.calibration
    if share is None:
        raise ValueError("the scan was not corrected")
    turn = placement.pose.rotation
    out = np.empty((len(xyz), 6))
    for first in range(0, len(xyz), _BLOCK):
        part = xyz[first : first + _BLOCK]
        by_c = turn @ share.correction.jacobian(part)
        # J_geo C_gc without forming [I | -[R x]x]
        geo = share.cross[:3] - skew(part @ turn.T) @ share.cross[3:]
        left = by_c @ (share.own / 2) + geo
        for k, (i, j) in enumerate(_ELEMENTS):
            one = np.einsum("nk,nk->n", left[:, i], by_c[:, j])
            other = np.einsum("nk,nk->n", left[:, j], by_c[:, i])
            out[first : first + _BLOCK, k] = one + other
    return out
