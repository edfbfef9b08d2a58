"""What the uncertainty of a calibration adds to the covariance of corrected points.

``J_c C_c J_c^T + J_geo C_gc J_c^T + (J_geo C_gc J_c^T)^T`` with ``J_c`` the derivative of a placed
point by the parameters and ``J_geo`` that by the station (method sections 4 and 5.1): parameters
and poses of one network are correlated, so the sum may be smaller than either part.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array
from tribrach.cloud.placement import Placement
from tribrach.kernels import in_threads, njit

#: points whose derivatives are in memory at a time
_BLOCK = 50_000


def share_of(xyz: Array, placement: Placement) -> Array:
    """Compute what a calibration adds to the covariance of points: xx, yy, zz, xy, xz, yz."""
    share = placement.calibration
    if share is None:
        raise ValueError("the scan was not corrected")
    turn = np.ascontiguousarray(placement.pose.rotation)
    half = np.ascontiguousarray(share.own / 2)
    cross = np.ascontiguousarray(share.cross)
    out = np.empty((len(xyz), 6))
    for first in range(0, len(xyz), _BLOCK):
        part = slice(first, first + _BLOCK)
        by_polar, columns = share.correction.factors(xyz[part])
        arm = xyz[part] @ turn.T
        in_threads(_add_up, len(arm), by_polar, columns, arm, turn, half, cross, out[part])
    return out


@njit(cache=True, fastmath=True, nogil=True)
def _add_up(first, last, by_polar, columns, arm, turn, half, cross, out):  # type: ignore[no-untyped-def]
    """``A B^T + B A^T``: ``B = R by_polar columns``, ``A = B half + [I | -[arm]x] cross``."""
    k = columns.shape[2]
    for n in range(first, last):
        b = np.zeros((3, k))
        a = np.empty((3, k))
        for i in range(3):
            for j in range(3):
                whole = 0.0
                for q in range(3):
                    whole += turn[i, q] * by_polar[n, q, j]
                for m in range(k):
                    b[i, m] += whole * columns[n, j, m]
        for i in range(3):
            i1, i2 = (i + 1) % 3, (i + 2) % 3
            for m in range(k):
                # row i of -[p]x has p[i2] at column i1 and -p[i1] at column i2
                value = cross[i, m] + arm[n, i2] * cross[3 + i1, m] - arm[n, i1] * cross[3 + i2, m]
                for q in range(k):
                    value += b[i, q] * half[q, m]
                a[i, m] = value
        for e in range(6):
            i = e if e < 3 else (0 if e < 5 else 1)
            j = e if e < 3 else (1 if e == 3 else 2)
            total = 0.0
            for m in range(k):
                total += a[i, m] * b[j, m] + a[j, m] * b[i, m]
            out[n, e] = total
