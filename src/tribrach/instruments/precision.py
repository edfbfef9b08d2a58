"""Standard deviations of an instrument's observations along sights of some length.

Readings have their own standard deviations; errors of centring and of heights turn into angles by
the length of the sight (method sections 2.3 and 2.14). Metres and radians; None where the
instrument says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.geometry.polar import POLE, polar_from_xyz, xyz_by_polar
from tribrach.instruments import centring
from tribrach.units import SEC

#: what stands over a mark with one error of centring
CentringPer = Literal["setup", "mark", "sight"]

#: pointing of a telescope of magnification one
_POINTING = 60 * SEC


@dataclass(frozen=True)
class Precision:
    """Standard deviations of an instrument's readings."""

    #: of one reading in one face [rad]; the mean of both faces is the mean of two
    direction: float | None = None
    zenith: float | None = None
    #: of a distance [m] and [m/m], added linearly
    distance: float | None = None
    scale: float = 0.0
    centring: float = 0.0  #: of either end in plan [m]
    height: float = 0.0  #: of the height of either end [m]
    #: what has one eccentricity: a set-up of an instrument, with each of its targets; a mark,
    #: whatever stands there on one tripod; or every sight by itself
    centring_per: CentringPer = "setup"
    levelling: float | None = None  #: of a height difference [m] per square root of a kilometre
    #: of a scanner's ranges [m] and [m/m]
    range: float | None = None
    range_scale: float = 0.0
    scan_angle: float | None = None  #: noise of a scanner's angles [rad], new with every point
    #: what its angles are wrong by for a whole neighbourhood [rad]; neither points of a target nor
    #: further scans make it smaller
    scan_angle_systematic: float = 0.0
    target: float = 0.0  #: floor of a target's centre in each coordinate [m]
    tilt: float | None = None  #: of the tilt of a levelled scanner [rad]
    compass: float | None = None  #: of a heading [rad]
    compass_common: float = 0.0  #: of what all headings of one compass share [rad]
    #: of GNSS coordinates in plan and height [m]
    gnss_plan: float | None = None
    gnss_up: float | None = None
    gnss_common: float = 0.5  #: share of their variance that a session has in common
    rod: float | None = None  #: of the length of the rod that carries a target over a mark [m]
    bubble: float | None = None  #: of the rod's bubble [rad]
    eccentricity: float = 0.0  #: of the target on its rod [m]
    refraction: float = 0.13  #: coefficient of the place, not a standard deviation
    #: of that coefficient at one set-up, for sights of a total station that are long
    refraction_sigma: float = 0.0

    def of_directions(
        self, length: Array, repetitions: Array, ends: Array | float = 2.0
    ) -> Array | None:
        """Standard deviations (n,) of directions [rad], None where the instrument says nothing.

        ``length`` (n,): lengths of the sights [m]; NaN leaves the errors of centring out;
        ``repetitions`` (n,): readings that a value is the mean of; ``ends`` (n,): how many of the
        two ends have an error of centring that is the sight's own.
        """
        return _angle(self.direction, self.centring, length, repetitions, ends)

    def of_zeniths(
        self, length: Array, repetitions: Array, ends: Array | float = 2.0
    ) -> Array | None:
        """Standard deviations (n,) of zenith angles [rad], None where the instrument says nothing.

        ``length`` (n,): lengths of the sights [m]; NaN leaves the errors of heights out;
        ``repetitions`` (n,): readings that a value is the mean of; ``ends`` (n,): how many of the
        two ends have an error of height that is the sight's own.
        """
        return _angle(self.zenith, self.height, length, repetitions, ends)

    def of_angles(self, repetitions: Array) -> Array | None:
        """Standard deviations (n,) of angles between two directions [rad], without centring."""
        return None if self.direction is None else np.sqrt(2 / repetitions) * self.direction

    def of_distances(
        self, length: Array, repetitions: Array, ends: Array | float = 2.0
    ) -> Array | None:
        """Standard deviations (n,) of distances [m] with both ends centred.

        ``length`` (n,): the distances [m]; ``repetitions`` (n,): readings that a value is the mean
        of; ``ends`` (n,): how many of the two ends have an error of centring that is the sight's
        own.
        """
        if self.distance is None:
            return None
        own = (self.distance + self.scale * length) / np.sqrt(repetitions)
        sigma: Array = np.hypot(own, np.sqrt(ends) * self.centring)
        return sigma

    def of_lines(self, length: Array) -> Array | None:
        """Standard deviations (n,) [m] of height differences levelled along lines (n,) [m]."""
        return None if self.levelling is None else self.levelling * np.sqrt(length / 1000)

    def of_ranges(self, length: Array) -> Array | None:
        """Standard deviations (n,) [m] of scanner ranges (n,) [m]."""
        return None if self.range is None else self.range + self.range_scale * length

    def of_scan_angle(self, repetitions: float = 1.0) -> float | None:
        """Standard deviation of a scanner's angles to a target [rad], noise and systematic part."""
        if self.scan_angle is None:
            return None
        noise = self.scan_angle / np.sqrt(repetitions)
        return float(np.hypot(noise, self.scan_angle_systematic))

    def of_polar(self, polar: Array, repetitions: float = 1.0) -> Array | None:
        """Standard deviations (n, 3) of range [m], horizontal and zenith angle [rad] of targets.

        Method section 2.1.

        ``polar`` (n, 3): range [m], horizontal and zenith angle [rad] in the scanner frame;
        ``repetitions``: readings that a value is the mean of. Returns (n, 3): None where the
        instrument says nothing of ranges or angles.
        """
        along, angle = self.of_ranges(polar[:, 0]), self.of_scan_angle(repetitions)
        if along is None or angle is None:
            return None
        angles = np.broadcast_to(angle, (2, len(polar)))
        return np.stack([along / np.sqrt(repetitions), *angles], axis=1)

    def with_floor(self, polar: Array, sigma: Array) -> Array:
        """Standard deviations (n, 3) of readings with the floor of the target's centre added.

        Method section 2.2.

        ``polar`` (n, 3): range [m], horizontal and zenith angle [rad] in the scanner frame;
        ``sigma`` (n, 3): standard deviations without it [m, rad, rad].
        """
        length, flat = polar[:, 0], polar[:, 0] * _off_pole(polar[:, 2])
        floor = self.target * np.stack([np.ones(len(polar)), 1 / flat, 1 / length], axis=1)
        out: Array = np.hypot(sigma, floor)
        return out

    def of_targets(self, xyz: Array) -> Array | None:
        """Covariances (n, 3, 3) [m^2] of targets (n, 3) [m] of the scanner frame.

        They are those of the readings that the coordinates were computed from, so that a target
        weighs the same however it is written down.

        Method section 2.2.

        ``xyz`` (n, 3): targets in the scanner frame [m]. Returns (n, 3, 3): None where the
        instrument says nothing of ranges or angles.
        """
        polar = polar_from_xyz(xyz)
        sigma = self.of_polar(polar)
        return None if sigma is None else covariance_of_readings(polar, sigma)


def covariance_of_readings(polar: Array, sigma: Array) -> Array:
    """Covariances (n, 3, 3) [m^2] of coordinates computed from polar readings.

    Method section 2.2.

    ``polar`` (n, 3): range [m], horizontal and zenith angle [rad]. Nearer to a pole than half a
    degree the lever of the horizontal angle stays what it is there, so that no coordinate is free
    of error; ``sigma`` (n, 3): their standard deviations [m, rad, rad].
    """
    slope = xyz_by_polar(polar)
    lever = polar[:, 0] * _off_pole(polar[:, 2])
    slope[:, 0, 1], slope[:, 1, 1] = -lever * np.sin(polar[:, 1]), lever * np.cos(polar[:, 1])
    covariance: Array = (slope * sigma[:, None, :] ** 2) @ slope.transpose(0, 2, 1)
    return covariance


def _off_pole(zenith: Array) -> Array:
    """Sines (n,) of zenith angles [rad], at least that of half a degree."""
    return np.maximum(np.abs(np.sin(zenith)), np.sin(POLE))


def beam_covariance(xyz: Array, along: Array, across: Array) -> Array:
    """Covariances (n, 3, 3) [m^2] of points from standard deviations along and across the beam.

    ``xyz`` (n, 3): points in the scanner frame [m]; ``along``, ``across`` (n,): standard deviations
    [m].
    """
    unit = xyz / np.linalg.norm(xyz, axis=1, keepdims=True)
    outer = unit[:, :, None] * unit[:, None, :]
    rest = np.eye(3) - outer
    covariance: Array = (along**2)[:, None, None] * outer + (across**2)[:, None, None] * rest
    return covariance


def _angle(
    reading: float | None,
    end: float,
    length: Array,
    repetitions: Array,
    count: Array | float,
) -> Array | None:
    """An angle's standard deviation from its reading and errors of its ends across the sight."""
    if reading is None:
        return None
    # the ends count alike, in plan and in height
    ends = centring.of_directions(np.where(length > 0, length, 1.0), np.sqrt(count) * end, 0.0)
    variance = np.where(np.isnan(length), 0.0, ends)
    sigma: Array = np.sqrt(reading**2 / repetitions + variance)
    return sigma


def pointing_sigma(magnification: float, pointings: int = 1) -> float:
    """Sigma [rad] of pointing with a telescope: 60 arc seconds over its magnification."""
    return float(_POINTING / magnification / np.sqrt(pointings))
