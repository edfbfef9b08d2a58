"""The plan of a project: predicted figures, proposals, what can be spared, what is still missing.

Stations come first, then targets (seen from the new stations as well), then moves; each proposal
is judged by updates of one covariance, and the figures that are given in the end are those of a
prediction of the whole plan.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tribrach._types import Array, Progress
from tribrach.epochs.design import detectable_displacement
from tribrach.job.opened import Job
from tribrach.job.plan.lever_arm import LeverArmForecast, forecast
from tribrach.job.plan.survey import PlanSurvey, plan_of
from tribrach.job.plan.work import DesignProposal, PlanWork, Relocation, Spare, axes_of
from tribrach.network.adjustment import Adjustment
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.planning.datum_choices import DatumChoice, compare_datums
from tribrach.planning.prediction import Criterion, Figures, figures
from tribrach.planning.weights import RequiredPrecision, SetsByStation
from tribrach.project import Project

__all__ = ["DesignResult", "plan_project"]


@dataclass(frozen=True)
class DesignResult:
    """Everything that planning found.

    network, adjustment : of the plan with its proposals; before, after : figures without and with
    them; single : criterion with each candidate alone, by name, of the first search; places : of
    these (3,) [m]; judged_at : positions that moves and spares are about, which stay where they
    are; judged : how many designs were looked at; lever_arm : where the plan is about one;
    project : which says how it is written; None: as pages without one.
    """

    title: str
    criterion: Criterion
    required: float | None
    network: Network
    adjustment: Adjustment
    before: Figures | None
    after: Figures
    proposals: tuple[DesignProposal, ...] = ()
    relocations: tuple[Relocation, ...] = ()
    spares: tuple[Spare, ...] = ()
    datums: tuple[DatumChoice, ...] = ()
    sets: SetsByStation | None = None
    precisions: tuple[RequiredPrecision, ...] = ()
    single: Mapping[str, float] = field(default_factory=dict)
    places: Mapping[str, Array] = field(default_factory=dict)
    judged_at: tuple[str, ...] = ()
    judged: int = 0
    warnings: tuple[str, ...] = ()
    lever_arm: LeverArmForecast | None = None
    project: Project | None = None

    @property
    def detectable(self) -> float:
        """Displacement of the worst point that two epochs measured like this find [m]."""
        sigma = float(self.after.sigma.max(initial=0.0))
        return detectable_displacement(sigma, axes_of(self.adjustment))

    @property
    def reached(self) -> bool | None:
        """Is the requirement met? None without one."""
        if self.required is None:
            return None
        value = self.after.value(self.criterion.kind)
        if self.criterion.kind == "redundancy":
            return value >= self.required
        return value <= self.required * (1 + 1e-9)


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
        job.project,
    )
