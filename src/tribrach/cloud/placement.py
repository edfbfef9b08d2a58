"""The placement of a scan: its pose with its covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.correction import Correction
from tribrach.instruments.scan_noise import ScanNoise


@dataclass(frozen=True, eq=False)
class CalibrationShare:
    """Contribution of uncertain calibration and other scanner effects to points."""

    #: model, parameters and faces; effects that nothing was corrected by have the value zero
    correction: Correction
    own: Array  #: (k, k): covariance of the parameters
    #: (6, k): covariance of translation and left rotation increments of the station, in the axes of
    #: the world, with the parameters
    cross: Array

    def turned(self, both: Array) -> CalibrationShare:
        """The same in other axes of the world; both (6, 6) turns translation and rotation."""
        return CalibrationShare(self.correction, self.own, both @ self.cross)


@dataclass(frozen=True)
class Placement:
    """Pose and covariance of one scan: from a point to its 3x3 matrix."""

    station: str  #: its name
    pose: Pose  #: world from scanner
    #: (6, 6): of translation [m] and left rotation increments [rad] about the axes of the world
    covariance: Array
    #: noise of single points, None where the scanner's origin is not known, so that points have no
    #: covariance
    noise: ScanNoise | None
    calibration: CalibrationShare | None = None  #: of the scanner, if its points were corrected

    def turned(self, frame: Array) -> Placement:
        """The same with the axes of the world turned by a rotation (3, 3), about its origin."""
        both = np.zeros((6, 6))
        both[:3, :3] = both[3:, 3:] = frame
        pose = Pose(frame @ self.pose.rotation, frame @ self.pose.translation)
        share = None if self.calibration is None else self.calibration.turned(both)
        return Placement(self.station, pose, both @ self.covariance @ both.T, self.noise, share)

    def delivered(self, frame: OutputFrame) -> Placement:
        """Bring the station into the frame of the clouds: exact at its place, rigid around it."""
        at = self.pose.translation
        turned = self.turned(frame.rotation(at))
        pose = Pose(turned.pose.rotation, frame.from_work(at[None])[0])
        return Placement(self.station, pose, turned.covariance, self.noise, turned.calibration)
