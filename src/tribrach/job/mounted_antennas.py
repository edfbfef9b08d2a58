"""Antennas and prisms on the scanners of a project, and what is known of them without scans."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.gnss.sessions import SessionResult
from tribrach.network.adjustment import Adjustment
from tribrach.network.survey import Survey
from tribrach.observations.gnss import Antennas, MountedPoints
from tribrach.registration.rigid_units import Mounted
from tribrach.sentences import Sentence

if TYPE_CHECKING:
    from tribrach.job.opened import Job


#: a lever arm that is known no better than this tells no targets apart [m]
_VAGUE = 0.05
#: heights of antennas on scanners above this are worth a question [m]
_RAISED = 0.005


def mounted_antennas(
    job: Job, survey: Survey, points: Mapping[str, tuple[Array, float]]
) -> dict[str, tuple[Mounted, ...]]:
    """The antennas on each station; points : name to coordinates and one sigma [m].

    Their places are those of the points that are mounted on stations, or of GNSS positions of the
    stations themselves. Lever arms that are hardly known are left out.
    """
    positions = _positions(survey)
    out: dict[str, tuple[Mounted, ...]] = {}
    for name, station in job.project.stations.items():
        known = []
        for arm_name, point in zip_longest(station.lever_arm, station.mounted_point):
            arm = job.lever_arms[arm_name]
            place = points.get(point, positions.get((name, arm_name)))
            sigma = _one_sigma(arm.covariance)
            if place is not None and sigma < _VAGUE:
                known.append(Mounted(arm.vector, place[0], sigma, place[1]))
        if known:
            out[name] = tuple(known)
    return out


def _positions(survey: Survey) -> dict[tuple[str, str], tuple[Array, float]]:
    """GNSS positions of antennas, by station and lever arm: coordinates and one sigma [m]."""
    out: dict[tuple[str, str], tuple[Array, float]] = {}
    for table in survey.tables():
        if table.kind is Antennas:
            part = table.active().columns
            ends = zip(part["station"], part["lever_arm"], strict=True)
            rows = zip(ends, part["values"], part["covariance"], strict=True)
            out |= {(str(a), str(b)): (xyz, _one_sigma(c)) for (a, b), xyz, c in rows}
    return out


def _one_sigma(covariance: Array) -> float:
    return float(np.sqrt(np.trace(covariance) / 3))


def raised_antennas(adjustment: Adjustment, sessions: Sequence[SessionResult]) -> list[str]:
    """Sentences on antennas of scanners whose files say that they stand over a mark."""
    on: dict[str, str] = {}
    for o in adjustment.network.observations:
        if isinstance(o, MountedPoints):
            on |= {point: station for station, point in o.ends(adjustment.layout)}
    heights = {
        name: height
        for session in sessions
        for baseline in session.baselines
        for name, height in zip(baseline.names, baseline.heights, strict=True)
        if name in on and abs(height) > _RAISED
    }
    return [
        Sentence(
            "The baselines to {name}, which is mounted on {on}, end {height:3} m under the "
            "reference point of its antenna, as its file or antenna_height_m says: does "
            "its lever arm end there as well?",
            name=name,
            on=on[name],
            height=height,
        )
        for name, height in heights.items()
    ]
