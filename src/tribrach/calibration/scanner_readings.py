"""Readings of targets by scanners: stations, series, faces; pairs of faces and their means.

Range r [m], horizontal angle H (counter-clockwise) and zenith angle V [rad], back-face readings
folded to the front: ``V_f = 2 pi - V``, ``H_f = H - pi`` (method sections 1.2 and 4.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError

#: names (n,)
Names = NDArray[np.object_]


@dataclass(frozen=True)
class ScannerReadings:
    """Readings of targets by scanners."""

    #: (n,), names
    station: Names
    series: Names
    target: Names
    face: Array  #: (n,), +1 front, -1 back, 0 the mean of both
    polar: Array  #: (n, 3), range [m], H and V [rad], folded to the front
    covariance: Array  #: (n, 3, 3), of r, H, V [m, rad]
    source: Names  #: (n,), where each came from

    def __len__(self) -> int:
        return len(self.polar)

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> ScannerReadings:
        """Some of the readings."""
        return ScannerReadings(
            *(getattr(self, name)[chosen] for name in ScannerReadings.__dataclass_fields__)
        )


@dataclass(frozen=True)
class FacePairs:
    """Targets (n,) measured in both faces, see :class:`ScannerReadings`."""

    #: (n,), names
    station: Names
    series: Names
    target: Names
    half: Array  #: (n, 3), half of front less back, in r, H, V [m, rad]
    covariance: Array  #: (n, 3, 3), of the half difference, which is that of the mean too
    polar: Array  #: (n, 3), mean of both faces [m, rad]

    def __len__(self) -> int:
        return len(self.half)


def folded(polar: Array, face: Array) -> tuple[Array, Array]:
    """Fold readings to the front; faces +1 or -1 count where V, back beyond pi, does not say it."""
    raw = polar[:, 2] > np.pi
    out = polar.copy()
    out[raw, 1] -= np.pi
    out[raw, 2] = 2 * np.pi - out[raw, 2]
    out[:, 1] = _wrapped(out[:, 1])
    return out, np.where(raw, -1.0, face)


def _wrapped(angle: Array) -> Array:
    """Angles in [-pi, pi)."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)


def _groups(readings: ScannerReadings) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number of each reading's (station, series, target), and the first reading of each."""
    key = np.array(
        [
            "\0".join(parts)
            for parts in zip(readings.station, readings.series, readings.target, strict=True)
        ]
    )
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return rank[number], first[order]


def _by_face(
    readings: ScannerReadings,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """First reading of every group, and its front and back reading, -1 for none."""
    number, first = _groups(readings)
    sides = []
    for face in (1.0, -1.0):
        rows = np.flatnonzero(readings.face == face)
        side = np.full(len(first), -1, dtype=np.int64)
        side[number[rows]] = rows
        twice = np.bincount(number[rows], minlength=len(first)) > 1
        if twice.any():
            row = int(first[np.flatnonzero(twice)[0]])
            raise InputError(
                f"{readings.station[row]} has target {readings.target[row]} twice on one face",
                record=str(readings.source[row]) or None,
                cure="tell the series apart in a column set, or the faces in a column face",
            )
        sides.append(side)
    return first, sides[0], sides[1]


def face_pairs(readings: ScannerReadings) -> FacePairs:
    """Pair readings of both faces."""
    first, front, back = _by_face(readings)
    both = (front >= 0) & (back >= 0)
    first, front, back = first[both], front[both], back[both]
    difference = readings.polar[front] - readings.polar[back]
    difference[:, 1] = _wrapped(difference[:, 1])
    half = difference / 2
    return FacePairs(
        readings.station[first],
        readings.series[first],
        readings.target[first],
        half,
        (readings.covariance[front] + readings.covariance[back]) / 4,
        readings.polar[back] + half,
    )


def face_means(readings: ScannerReadings) -> ScannerReadings:
    """One reading for each station, series and target: the mean of both faces, face 0, if both."""
    first, front, back = _by_face(readings)
    both = (front >= 0) & (back >= 0)
    one = np.where(front >= 0, front, back)
    polar, covariance = readings.polar[one].copy(), readings.covariance[one].copy()
    pairs = face_pairs(readings)
    polar[both], covariance[both] = pairs.polar, pairs.covariance
    return ScannerReadings(
        readings.station[first],
        readings.series[first],
        readings.target[first],
        np.where(both, 0.0, readings.face[one]),
        polar,
        covariance,
        readings.source[first],
    )
