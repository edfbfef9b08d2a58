"""The plan of a project: predicted figures, proposals, what can be spared, what is still missing.

Stations come first, then targets (seen from the new stations as well), then moves; each proposal
is judged by updates of one covariance, and the figures that are given in the end are those of a
prediction of the whole plan.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from tribrach._types import Array, Progress
from tribrach.answers import Matrix, Number, Result, Vector
from tribrach.epochs.design import detectable_displacement
from tribrach.job.opened import Job
from tribrach.network.adjustment import Adjustment
from tribrach.network.network import Network
from tribrach.network.roles import datum_names
from tribrach.network.survey import Survey
from tribrach.planning.datum_choices import DatumChoice, compare_datums
from tribrach.planning.prediction import Criterion, Figures, figures
from tribrach.planning.weights import RequiredPrecision, SetsByStation
from tribrach.questions.plan.lever_arm import LeverArmForecast, forecast
from tribrach.questions.plan.sights import PlannedSight, sights_of
from tribrach.questions.plan.survey import PlanSurvey, plan_of
from tribrach.questions.plan.work import DesignProposal, PlanWork, Relocation, Spare, axes_of


@dataclass(frozen=True)
class PlannedDatum(Result):
    """What fixes the frame."""

    kind: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Requirement(Result):
    """What the design is judged by."""

    kind: str
    points: tuple[str, ...]
    required: Number | None
    reached: bool | None


@dataclass(frozen=True)
class PlannedPlace(Result):
    """A place of the plan."""

    xyz: Vector
    covariance: Matrix
    new: bool


@dataclass(frozen=True)
class DesignResult(
    Result,
    without=("criterion", "required", "network", "adjustment", "single", "places", "judged_at"),
    also=("requirement", "datum", "points", "stations", "parameters", "sights"),
    keys={
        "requirement": "criterion",
        "after": "plan",
        "relocations": "moves",
        "spares": "without",
        "precisions": "precision",
        "judged": "designs_judged",
    },
):
    """What planning found."""

    title: str
    criterion: Criterion
    required: float | None
    #: of the plan with its proposals
    network: Network
    adjustment: Adjustment
    #: without and with the proposals
    before: Figures | None
    after: Figures
    proposals: tuple[DesignProposal, ...] = ()
    relocations: tuple[Relocation, ...] = ()
    spares: tuple[Spare, ...] = ()
    datums: tuple[DatumChoice, ...] = ()
    sets: SetsByStation | None = None
    precisions: tuple[RequiredPrecision, ...] = ()
    #: criterion with each candidate of the first search alone, by name, and their places (3,) [m]
    single: Mapping[str, float] = field(default_factory=dict)
    places: Mapping[str, Array] = field(default_factory=dict)
    #: positions that moves and spares are about, which stay where they are
    judged_at: tuple[str, ...] = ()
    judged: int = 0
    warnings: tuple[str, ...] = ()
    lever_arm: LeverArmForecast | None = None  #: where the plan is about one

    @property
    def detectable(self) -> float:
        """Displacement of the worst point that two epochs measured like this find [m]."""
        return detectable_displacement(self.after.worst.value, axes_of(self.adjustment))

    @property
    def reached(self) -> bool | None:
        """Is the requirement met? None without one."""
        if self.required is None:
            return None
        value = self.after.value(self.criterion.kind)
        if self.criterion.kind == "redundancy":
            return value >= self.required
        return value <= self.required * (1 + 1e-9)

    @property
    def requirement(self) -> Requirement:
        """What the design is judged by."""
        judged = self.criterion
        return Requirement(judged.kind, judged.names, self.required, self.reached)

    @property
    def datum(self) -> PlannedDatum:
        """What fixes the frame."""
        kind = "free" if self.adjustment.defect else self.adjustment.network.datum.kind
        return PlannedDatum(kind, datum_names(self.adjustment))

    @property
    def points(self) -> dict[str, PlannedPlace]:
        """Targets and points."""
        return self._standing("point")

    @property
    def stations(self) -> dict[str, PlannedPlace]:
        """Scanner stations."""
        return self._standing("pose")

    def _standing(self, family: Literal["point", "pose"]) -> dict[str, PlannedPlace]:
        a = self.adjustment
        new = {p.name for p in self.proposals}
        xyz = a.state.points if family == "point" else a.state.pose_t
        of_all = zip(a.layout.names[family], xyz, a.family_covariances(family), strict=True)
        return {name: PlannedPlace(x, c[:3, :3], name in new) for name, x, c in of_all}

    @property
    def parameters(self) -> dict[str, Number]:
        """Sigmas of the scalars."""
        a = self.adjustment
        names = a.layout.names["scalar"]
        return {name: float(np.sqrt(a.covariance(name)[0, 0])) for name in names}

    @cached_property
    def sights(self) -> tuple[PlannedSight, ...]:
        """From one place to another."""
        return sights_of(self.adjustment)


def plan_project(
    job: Job,
    further: Survey | None = None,
    progress: Progress = lambda what, done, total: None,
) -> DesignResult:
    """Plan a job; further : what scans of the project brought."""
    section = plan_of(job.project)
    survey = PlanSurvey(job, further)
    names = section.points or section.new_points
    if survey.arm is not None:
        names = (survey.arm.name,)
    criterion = Criterion(section.criterion, names)
    work = PlanWork(survey, criterion, progress)
    work.cover()
    criterion = work.settle()
    first = work.prediction() if not work.proposals else None
    before = None if first is None else figures(first, criterion)
    work.add_stations(section.add_stations - len(work.proposals))
    work.add_targets(section.add_targets)
    relocations = work.relocations(section.move_targets)
    spares = work.spares() if section.drop else ()
    adjustment = work.prediction()
    network = adjustment.network
    after = figures(adjustment, criterion)
    progress("datums", 0, None)
    # a lever arm is no place: it has no datum
    datums = [] if survey.arm is not None else compare_datums(work.network(), criterion)
    required = section.required(axes_of(adjustment))
    sets, precisions = work.weights(required)
    return DesignResult(
        job.project.title,
        criterion,
        required,
        network,
        adjustment,
        before,
        after,
        tuple(work.proposals),
        relocations,
        spares,
        tuple(datums),
        sets,
        precisions,
        work.single,
        {name: work.looked_at[name] for name in work.single},
        work.judged_at,
        work.judged,
        (*adjustment.warnings, *work.warnings),
        None if survey.arm is None else forecast(job, survey.arm, first, adjustment),
    )
