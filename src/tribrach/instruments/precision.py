"""Standard deviations of an instrument's observations along sights of some length.

Readings have their own standard deviations; errors of centring and of heights turn into angles by
the length of the sight (method sections 2.3 and 2.14). Metres and radians; None where the
instrument says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.units import SEC

__all__ = ["Precision", "pointing_sigma"]

#: pointing of a telescope of magnification one
_POINTING = 60 * SEC


@dataclass(frozen=True)
class Precision:
    """Standard deviations of an instrument.

    Attributes
    ----------
    direction, zenith
        Of one reading [rad].
    distance, scale
        Of a distance [m] and [m/m], added linearly.
    centring
        Of either end in plan [m].
    height
        Of the height of either end [m].
    levelling
        Of a height difference [m] per square root of a kilometre.
    range, range_scale
        Of a scanner's ranges [m] and [m/m].
    scan_angle
        Of a scanner's angles [rad].
    target
        Floor of a target's centre in each coordinate [m].
    tilt
        Of the tilt of a levelled scanner [rad].
    gnss_plan, gnss_up
        Of GNSS coordinates in plan and height [m].
    gnss_common
        Share of their variance that a session has in common.
    rod
        Of the length of the rod that carries a target over a mark [m].
    bubble
        Of the rod's bubble [rad].
    eccentricity
        Of the target on its rod [m].
    refraction
        Coefficient of the place, not a standard deviation.
    """

    direction: float | None = None
    zenith: float | None = None
    distance: float | None = None
    scale: float = 0.0
    centring: float = 0.0
    height: float = 0.0
    levelling: float | None = None
    range: float | None = None
    range_scale: float = 0.0
    scan_angle: float | None = None
    target: float = 0.0
    tilt: float | None = None
    gnss_plan: float | None = None
    gnss_up: float | None = None
    gnss_common: float = 0.5
    rod: float | None = None
    bubble: float | None = None
    eccentricity: float = 0.0
    refraction: float = 0.13

    def of_directions(self, length: Array, repetitions: Array) -> Array | None:
        """Standard deviations (n,) of directions [rad], None where the instrument says nothing.

        Parameters
        ----------
        length : (n,)
            Lengths of the sights [m]; NaN leaves the errors of centring out.
        repetitions : (n,)
            Readings that a value is the mean of.
        """
        return _angle(self.direction, self.centring, length, repetitions)

    def of_zeniths(self, length: Array, repetitions: Array) -> Array | None:
        """Standard deviations (n,) of zenith angles [rad], None where the instrument says nothing.

        Parameters
        ----------
        length : (n,)
            Lengths of the sights [m]; NaN leaves the errors of heights out.
        repetitions : (n,)
            Readings that a value is the mean of.
        """
        return _angle(self.zenith, self.height, length, repetitions)

    def of_angles(self, repetitions: Array) -> Array | None:
        """Standard deviations (n,) of angles between two directions [rad], without centring."""
        return None if self.direction is None else np.sqrt(2 / repetitions) * self.direction

    def of_distances(self, length: Array, repetitions: Array) -> Array | None:
        """Standard deviations (n,) of distances [m] with both ends centred.

        Parameters
        ----------
        length : (n,)
            The distances [m].
        repetitions : (n,)
            Readings that a value is the mean of.
        """
        if self.distance is None:
            return None
        own = (self.distance + self.scale * length) / np.sqrt(repetitions)
        sigma: Array = np.hypot(own, np.sqrt(2) * self.centring)
        return sigma

    def of_lines(self, length: Array) -> Array | None:
        """Standard deviations (n,) [m] of height differences levelled along lines (n,) [m]."""
        return None if self.levelling is None else self.levelling * np.sqrt(length / 1000)

    def of_ranges(self, length: Array) -> Array | None:
        """Standard deviations (n,) [m] of scanner ranges (n,) [m]."""
        return None if self.range is None else self.range + self.range_scale * length

    def of_targets(self, xyz: Array) -> Array | None:
        """Covariances (n, 3, 3) [m^2] of points (n, 3) [m] of the scanner frame."""
        length = np.linalg.norm(xyz, axis=1)
        along = self.of_ranges(length)
        if along is None or self.scan_angle is None:
            return None
        return beam_covariance(xyz, along, self.scan_angle * length)


def beam_covariance(xyz: Array, along: Array, across: Array) -> Array:
    """Covariances (n, 3, 3) [m^2] of points from standard deviations along and across the beam.

    Parameters
    ----------
    xyz : (n, 3)
        Points in the scanner frame [m].
    along, across : (n,)
        Standard deviations [m].
    """
    unit = xyz / np.linalg.norm(xyz, axis=1, keepdims=True)
    outer = unit[:, :, None] * unit[:, None, :]
    rest = np.eye(3) - outer
    covariance: Array = (along**2)[:, None, None] * outer + (across**2)[:, None, None] * rest
    return covariance


def _angle(reading: float | None, end: float, length: Array, repetitions: Array) -> Array | None:
    """An angle's standard deviation from its reading and errors of both ends across the sight."""
    if reading is None:
        return None
    across = np.where(np.isnan(length), 0.0, np.sqrt(2) * end / np.where(length > 0, length, 1.0))
    sigma: Array = np.hypot(reading / np.sqrt(repetitions), across)
    return sigma


def pointing_sigma(magnification: float, pointings: int = 1) -> float:
    """Sigma [rad] of pointing with a telescope: 60 arc seconds over its magnification."""
    return float(_POINTING / magnification / np.sqrt(pointings))
