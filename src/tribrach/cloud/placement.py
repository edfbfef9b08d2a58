"""Where a scan stands and how well that is known: what the points of its cloud inherit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise

__all__ = ["Placement"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Placement:
    """An adjusted station, for its cloud.

    pose : world from scanner; covariance (6, 6) of translation [m] and left rotation increments
    [rad] about the axes of the world; noise : of single points, None where the scanner's origin
    is not known, so that points have no covariance.
    """

    station: str
    pose: Pose
    covariance: Array
    noise: ScanNoise | None

    def turned(self, frame: Array) -> Placement:
        """The same with the axes of the world turned by a rotation (3, 3), about its origin."""
        both = np.zeros((6, 6))
        both[:3, :3] = both[3:, 3:] = frame
        pose = Pose(frame @ self.pose.rotation, frame @ self.pose.translation)
        return Placement(self.station, pose, both @ self.covariance @ both.T, self.noise)
