"""The calibration of a lever arm as a plan: targets that are scanned and measured by GNSS.

The lever arm follows from the station's pose, which its targets give, and from the antenna:
``l = R^T (X_antenna - t)`` (method section 7.1). So every target of such a plan, present or
proposed, is measured by GNSS besides being scanned, and so is the antenna. Planned scanners have
their axes along E, N, U: x, y and z of the lever arm are those of the site.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.answers import Matrix, Result
from tribrach.network.adjustment import Adjustment
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.gnss import Antennas, GnssPositions
from tribrach.observations.scanner import ScannerPolar, TargetCentres
from tribrach.project.plan import LeverArmPlan
from tribrach.questions.plan.scans import ScannerPlace

if TYPE_CHECKING:
    from tribrach.job.opened import Job
    from tribrach.project import Project


#: group of the planned positions
PLANNED = "planned GNSS"
#: steps of the places that are proposed where nothing else says any
_AZIMUTHS, _LENGTHS, _HEIGHTS = 24, 3, 3


@dataclass(frozen=True)
class HorizonGaps(Result):
    """Widest parts of the horizon without targets [rad], without and with the proposals."""

    before: float
    plan: float


@dataclass(frozen=True)
class LeverArmForecast(Result, keys={"after": "plan", "gaps": "horizon_without_targets"}):
    """Covariances (3, 3) of a lever arm [m^2]."""

    name: str
    prior: Matrix  #: as it is known
    before: Matrix | None  #: with the targets of the plan; null where stations were proposed
    #: with the proposed ones as well
    after: Matrix
    gaps: HorizonGaps


class PlannedLeverArm:
    """The section ``[plan.lever_arm]`` of a project, with the stations that carry the antenna."""

    def __init__(self, project: Project, section: LeverArmPlan) -> None:
        self.name, self.section = section.name, section
        if self.name not in project.lever_arms:
            raise project.error(
                ("plan", "lever_arm", "name"),
                f"lever arm {self.name} is not defined",
                f"add a section [lever_arms.{self.name}]",
            )
        self.stations = tuple(n for n, s in project.stations.items() if self.name in s.lever_arm)
        if not self.stations:
            raise project.error(
                ("plan", "lever_arm", "name"),
                f"no station carries lever arm {self.name}",
                f'add a section [stations.NAME] with lever_arm = "{self.name}"',
            )
        if section.gnss not in project.instruments:
            raise project.error(
                ("plan", "lever_arm", "gnss"),
                f"instrument {section.gnss} is not defined",
                f"add a section [instruments.{section.gnss}]",
            )
        precision = project.instruments[section.gnss].precision()
        if precision.gnss_plan is None or precision.gnss_up is None:
            raise project.error(
                ("plan", "lever_arm", "gnss"),
                f"nothing is known of the GNSS positions of {section.gnss}",
                "give the instrument gnss_plan_mm and gnss_up_mm",
            )
        self.sigma = np.array([precision.gnss_plan, precision.gnss_plan, precision.gnss_up])

    def targets(self, station: Array) -> dict[str, Array]:
        """Places (3,) of targets around a station (3,), spread evenly over the window.

        Azimuths are equal steps, distances and heights van der Corput's sequences in base 2
        and 3, so that neither goes with the azimuth.
        """
        s = self.section
        number = np.arange(s.targets)
        azimuth = np.radians(s.window_deg) * ((number + 0.5) / s.targets - 0.5)
        length = s.nearest_m + (s.farthest_m - s.nearest_m) * _radical(number, 2)
        height = s.lowest_m + (s.highest_m - s.lowest_m) * _radical(number, 3)
        return {f"T{k + 1}": x for k, x in enumerate(_around(station, azimuth, length, height))}

    def places(self, station: Array) -> list[Array]:
        """Places (3,) all around a station (3,), where targets could be."""
        s = self.section
        azimuth = 2 * np.pi * np.arange(_AZIMUTHS) / _AZIMUTHS
        length = np.unique(np.linspace(s.nearest_m, s.farthest_m, _LENGTHS))
        height = np.unique(np.linspace(s.lowest_m, s.highest_m, _HEIGHTS))
        grid = [axis.ravel() for axis in np.meshgrid(azimuth, length, height, indexing="ij")]
        return list(_around(station, *grid).round(2))

    def measure(self, survey: Survey, targets: Mapping[str, Array]) -> None:
        """Add the GNSS positions of targets (3,) by name."""
        if targets:
            survey.add(
                GnssPositions,
                values=np.array(list(targets.values())),
                sigma=np.tile(self.sigma, (len(targets), 1)),
                position=list(targets),
                source=[f"{PLANNED} {name}" for name in targets],
                group=PLANNED,
            )

    def measure_antennas(self, survey: Survey, stations: Mapping[str, ScannerPlace]) -> None:
        """Add the positions of the antennas on stations that carry one."""
        carrying = [name for name in stations if name in self.stations]
        if carrying:
            survey.add(
                Antennas,
                values=np.array([stations[name].position for name in carrying]),
                sigma=np.tile(self.sigma, (len(carrying), 1)),
                station=carrying,
                lever_arm=[self.name] * len(carrying),
                source=[f"{PLANNED} {name}" for name in carrying],
                group=PLANNED,
            )


def forecast(
    job: Job, arm: PlannedLeverArm, before: Adjustment | None, after: Adjustment
) -> LeverArmForecast:
    """What predictions without and with the proposals say of a lever arm."""
    prior = job.lever_arms[arm.name].covariance
    start = after if before is None else before
    return LeverArmForecast(
        arm.name,
        prior,
        None if before is None else _covariance(before, arm.name),
        _covariance(after, arm.name),
        HorizonGaps(_gap(start, arm.stations), _gap(after, arm.stations)),
    )


def _covariance(adjustment: Adjustment, name: str) -> Array:
    """Covariance (3, 3) [m^2] of a lever arm, zero for held components."""
    index = adjustment.layout.index("vector", name)
    covariance: Array = adjustment.family_covariances("vector")[index]
    return covariance


def _gap(adjustment: Adjustment, stations: Sequence[str]) -> float:
    """Widest part of the horizon without targets [rad], at the station that sees best around."""
    layout, state = adjustment.layout, adjustment.state
    gaps = [2 * np.pi]
    for pose in (layout.index("pose", n) for n in stations if layout.has("pose", n)):
        angles: list[float] = []
        for o in adjustment.network.observations:
            if isinstance(o, ScannerPolar | TargetCentres):
                seen = o.target[(o.station == pose) & (o.use == Use.ACTIVE)]
                away = state.positions[seen] - state.pose_t[pose]
                angles += np.arctan2(away[:, 1], away[:, 0]).tolist()
        around = np.sort(angles)
        if len(around):
            gaps.append(float(np.diff(around, append=around[0] + 2 * np.pi).max()))
    return min(gaps)


def _around(station: Array, azimuth: Array, length: Array, height: Array) -> Array:
    """Places (n, 3) by azimuth from north, level distance and height from a station (3,)."""
    steps = [length * np.sin(azimuth), length * np.cos(azimuth), height]
    out: Array = station + np.column_stack(steps)
    return out


def _radical(number: NDArray[np.int64], base: int) -> Array:
    """Van der Corput's sequence (n,): the digits of a number behind the point."""
    rest, share = number + 1, 1.0 / base
    out = np.zeros(len(number))
    while rest.any():
        out += share * (rest % base)
        rest, share = rest // base, share / base
    return out
