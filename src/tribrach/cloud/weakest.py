"""Along which direction is the place of a whole cloud known least?

What the station leaves uncertain moves all of its points together: the mean of
``J_geo C_geo J_geo^T`` over them, its longest axis (method section 5.1). Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.geometry.rotation import skew

__all__ = ["Weakest", "weakest_direction"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Weakest:
    """Sigma [m] along the weakest direction; its azimuth and elevation [rad] in E, N, U."""

    sigma: float
    azimuth: float
    elevation: float


def weakest_direction(points: Array, covariance: Array) -> Weakest:
    """Points (n, 3) : relative to the station, along E, N, U; covariance (6, 6) of its pose."""
    geo = np.concatenate([np.broadcast_to(np.eye(3), (len(points), 3, 3)), -skew(points)], axis=2)
    mean = (geo @ covariance @ geo.transpose(0, 2, 1)).mean(axis=0)
    values, vectors = np.linalg.eigh(mean)
    east, north, up = vectors[:, -1] if vectors[2, -1] >= 0 else -vectors[:, -1]
    azimuth = float(np.arctan2(east, north) % np.pi)
    elevation = float(np.arctan2(up, np.hypot(east, north)))
    return Weakest(float(np.sqrt(max(values[-1], 0.0))), azimuth, elevation)
