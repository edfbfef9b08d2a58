"""The placement of a scan: its pose, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.correction import Correction
from tribrach.instruments.scan_noise import ScanNoise

__all__ = ["CalibrationShare", "Placement"]


@dataclass(frozen=True, eq=False)
class CalibrationShare:
    """What the uncertainty of a calibration and of other effects of a scanner adds to its points.

    Attributes
    ----------
    correction
        Model, parameters and faces; effects that nothing was corrected by have the value zero.
    own : array (k, k)
        Covariance of the parameters.
    cross : array (6, k)
        Covariance of translation and left rotation increments of the station, in the axes of
        the world, with the parameters.
    """

    correction: Correction
    own: Array
    cross: Array

    def turned(self, both: Array) -> CalibrationShare:
        """The same in other axes of the world; both (6, 6) turns translation and rotation."""
        return CalibrationShare(self.correction, self.own, both @ self.cross)


@dataclass(frozen=True)
class Placement:
    """An adjusted station, for its cloud.

    Attributes
    ----------
    station
        Its name.
    pose
        World from scanner.
    covariance : array (6, 6)
        Of translation [m] and left rotation increments [rad] about the axes of the world.
    noise
        Noise of single points, None where the scanner's origin is not known, so that points
        have no covariance.
    calibration
        Of the scanner, if its points were corrected.
    """

    station: str
    pose: Pose
    covariance: Array
    noise: ScanNoise | None
    calibration: CalibrationShare | None = None

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
