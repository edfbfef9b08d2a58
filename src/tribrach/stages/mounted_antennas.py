"""Antennas and prisms on the scanners of a project whose places are known without the scans."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tribrach.network.observations.antenna import Antennas
from tribrach.network.survey import Survey
from tribrach.project.lever_arms import known_lever_arm
from tribrach.registration.units import Mounted

if TYPE_CHECKING:
    from tribrach.project import Project

__all__ = ["mounted_antennas"]

Array = NDArray[np.float64]

#: a lever arm that is known no better than this tells no targets apart [m]
_VAGUE = 0.05


def mounted_antennas(
    project: Project, survey: Survey, points: Mapping[str, tuple[Array, float]]
) -> dict[str, tuple[Mounted, ...]]:
    """The antennas on each station; points : name to coordinates and one sigma [m].

    Their places are those of the points that are mounted on stations, or of GNSS positions of the
    stations themselves. Lever arms that are hardly known are left out.

    Raises
    ------
    InputError : a lever arm file is unreadable or wrong.
    """
    positions = _positions(survey)
    out: dict[str, tuple[Mounted, ...]] = {}
    for name, station in project.stations.items():
        if station.lever_arm is None:
            continue
        arm = project.lever_arms[station.lever_arm]
        vector, covariance, _ = known_lever_arm(station.lever_arm, arm, project.folder)
        place = positions.get(name)
        if station.mounted_point is not None and station.mounted_point in points:
            place = points[station.mounted_point]
        sigma = _one_sigma(covariance)
        if place is not None and sigma < _VAGUE:
            out[name] = (Mounted(vector, place[0], sigma, place[1]),)
    return out


def _positions(survey: Survey) -> dict[str, tuple[Array, float]]:
    """GNSS positions of antennas that take part, by station: coordinates and one sigma [m]."""
    out: dict[str, tuple[Array, float]] = {}
    for table in survey.tables():
        if table.kind is Antennas:
            part = table.active().columns
            rows = zip(part["station"], part["values"], part["covariance"], strict=True)
            out |= {str(name): (xyz, _one_sigma(c)) for name, xyz, c in rows}
    return out


def _one_sigma(covariance: Array) -> float:
    return float(np.sqrt(np.trace(covariance) / 3))
