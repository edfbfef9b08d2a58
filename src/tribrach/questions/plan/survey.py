"""A planned survey: what a project has measured, what it plans, and what could come to it.

Planned scanner stations see every target that the scene, the range and the incidence let them see,
besides the scans that a table of planned observations names.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError, InputError
from tribrach.io.survey.csv import tables as csv_tables
from tribrach.io.survey.csv.planned import read_planned
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.starnet import reader as starnet
from tribrach.job.survey_files import starnet_plan
from tribrach.network.adjustment import adjust
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.declaration import Role
from tribrach.observations.gnss import GnssPositions
from tribrach.observations.scanner import Inclinations
from tribrach.project.plan import PlanSection
from tribrach.questions.plan.lever_arm import PlannedLeverArm
from tribrach.questions.plan.scans import PlannedScans, ScannerPlace

if TYPE_CHECKING:
    from tribrach.job.opened import Job
    from tribrach.project import Project


def read_places(path: Path, context: Context) -> dict[str, Array]:
    """Coordinates (3,) by name of a file of points, in the work frame [m]."""
    survey = csv_tables.read(path, replace(context, role="approximate"))
    out = {}
    for name, point in survey.points.items():
        if not np.isfinite(point.xyz).all():
            raise InputError(
                f"{name} has no complete coordinates", record=point.source, cure="give all three"
            )
        out[name] = point.xyz
    if not out:
        raise InputError("there are no places", file=path, cure="give a table of coordinates")
    return out


class PlanSurvey:
    """The plan of a project, to which targets and stations can be added."""

    def __init__(self, job: Job, further: Survey | None = None) -> None:
        project = job.project
        assert project.plan is not None
        self.job, self.project, self.plan, self.further = job, project, project.plan, further
        section = project.plan.lever_arm
        #: the lever arm that the plan is about, or None
        self.arm = None if section is None else PlannedLeverArm(project, section)
        self._bare = self._plain({})
        self.context = Context(frame=self._bare.frame)
        surveyed = self._surveyed()
        self.points = {n: p.xyz for n, p in surveyed.points.items() if np.isfinite(p.xyz).all()}
        given = surveyed.points.items()
        self.known = {n for n, p in given if p.covariance is not None or not p.free.all()}
        self.known |= surveyed.named(GnssPositions, "position")
        self.measured: dict[str, ScannerPlace] = {}
        self._start = self._adjusted(surveyed)
        planned = self._planned_stations()
        #: planned stations, and the measured ones where none is planned
        self.stations = planned or dict(self.measured)
        self.planned = tuple(planned)
        if self.arm is not None and not self.points:
            first = next((n for n in self.stations if n in self.arm.stations), None)
            if first is not None:
                self.points = self.arm.targets(self.stations[first].position)
        self.tables = self._planned_observations()
        for table, _ in self.tables:
            self.known |= table.named(GnssPositions, "position")
        self.extra = {pair for _, scans in self.tables for pair in scans}
        self.scans = PlannedScans(job.instruments, self.extra)
        self._check_names()
        self.targets = self.plan.targets or tuple(self.points)

    def _plain(self, stations: Mapping[str, Any]) -> Job:
        """The job without what concerns planned stations."""
        return self.job.changed(calibration=None, scale_bars=(), stations=dict(stations))

    def _surveyed(self) -> Survey:
        """Survey of the existing measurements."""
        known = self._bare.surveyed(self.further).stations
        own = {n: s for n, s in self.project.stations.items() if n in known}
        return self._plain(own).surveyed(self.further)

    def _adjusted(self, survey: Survey) -> dict[str, Any]:
        """Adjusted scalars of what was measured; its points and stations get their places."""
        active_only(survey)
        if all(table.kind.facts.role is Role.GIVEN for table in survey.tables()):
            return {}
        try:
            adjustment = adjust(survey.network())
        except AdjustmentError as error:
            raise InputError(
                "what the project has measured cannot be adjusted by itself",
                cure="leave it out of the plan, or plan it as observations: " + str(error),
            ) from error
        layout, state = adjustment.layout, adjustment.state
        self.points |= dict(zip(layout.names["point"], state.points, strict=True))
        poses = zip(layout.names["pose"], state.pose_t, state.pose_r, strict=True)
        self.measured = {name: ScannerPlace(t, r) for name, t, r in poses}
        return dict(zip(layout.names["scalar"], state.scalars, strict=True))

    def _planned_observations(self) -> list[tuple[Survey, list[tuple[str, str]]]]:
        """Surveys of planned observations, each with the sights of its planned scans."""
        paths = [self.project.folder / name for name in self.plan.observations]
        theirs = starnet_plan(self.project)
        tables = [
            read_planned(path, self._reading(), self.points) for path in paths if path not in theirs
        ]
        return tables + ([(starnet.read(theirs, part="planned"), [])] if theirs else [])

    def _planned_stations(self) -> dict[str, ScannerPlace]:
        if self.plan.stations is None:
            if self.arm is None or self.measured:
                return {}
            # the calibration of a lever arm needs one scanner, and nobody cares where
            return {self.arm.stations[0]: ScannerPlace(np.zeros(3), np.eye(3))}
        given = read_places(self.project.folder / self.plan.stations, self.context)
        return {name: ScannerPlace(xyz, np.eye(3)) for name, xyz in given.items()}

    def _check_names(self) -> None:
        """Names are there, and mean one thing."""
        for name in self.planned:
            if name in self.points or name in self.measured:
                raise self._error(
                    "stations", f"{name} is a point or station of the project already"
                )
        for key in ("targets", "new_points"):
            for name in getattr(self.plan, key):
                if name not in self.points:
                    raise self._error(
                        key,
                        f"{name} has no approximate coordinates",
                        "add it to a file of points, with role approximate",
                    )
        for station, target in sorted(self.extra):
            if station not in self.stations or target not in self.points:
                lost = target if station in self.stations else station
                raise self._error(
                    "observations",
                    f"a planned scan names {lost}, which has no place",
                    "add it to the file of stations or of points",
                )

    def _error(self, key: str, what: str, cure: str | None = None) -> InputError:
        return self.project.error(("plan", key), what, cure)

    def _reading(self) -> Context:
        instruments = self.job.instruments
        return replace(self.context, precision=instruments.precision(instruments.of_planned(None)))

    def survey(
        self,
        targets: Mapping[str, Array] | None = None,
        stations: Mapping[str, ScannerPlace] | None = None,
    ) -> Survey:
        """The planned survey, with further targets and stations."""
        out = Survey(site=self.context.frame.site)
        own = {name: self.points[name] for name in self.targets}
        for table, _ in self.tables:
            out.merge(table)
        for name, xyz in (targets or {}).items():
            out.point(name, xyz, source="proposed target")
        all_targets = own | dict(targets or {})
        everywhere = {n: self.stations[n] for n in self.planned} | dict(stations or {})
        further = {n: p for n, p in self.stations.items() if n not in everywhere}
        self._stand(out, everywhere)
        self.scans.add(out, everywhere, all_targets, self.scans.seen(everywhere, all_targets))
        if self.arm is not None:
            here = own if everywhere else {}
            unknown = {n: x for n, x in here.items() if n not in self.known}
            self.arm.measure(out, unknown | dict(targets or {}))
            self.arm.measure_antennas(out, everywhere)
        # stations that are measured already look at what is new only
        if targets:
            for name, place in further.items():
                out.station(name, translation=place.position, rotation=place.rotation)
            self.scans.add(out, further, targets, self.scans.seen(further, targets))
        return out

    def _stand(self, survey: Survey, stations: Mapping[str, ScannerPlace]) -> None:
        """Scanner stations with their places, levelled ones with their compensators."""
        for name, place in stations.items():
            survey.station(name, translation=place.position, rotation=place.rotation)
        section = self.project.stations
        free = [n for n in stations if n not in section or not section[n].levelled]
        if self.plan.levelling_arcsec is not None and free:
            survey.add(
                Inclinations,
                values=np.zeros((len(free), 2)),
                sigma=float(np.radians(self.plan.levelling_arcsec / 3600)),
                station=free,
                source=[f"compensator of {n}" for n in free],
            )

    def network(
        self,
        targets: Mapping[str, Array] | None = None,
        stations: Mapping[str, ScannerPlace] | None = None,
    ) -> Network:
        """The whole planned network, with further targets and stations."""
        planned = self.survey(targets, stations)
        self._calibrate(planned)
        if self.further is not None:
            planned.merge(self.further)
        whole = self._as_planned.surveyed(planned)
        active_only(whole, {*self.plan.new_points, *self.plan.points})
        if not whole.tables():
            raise self._error(
                "stations",
                "the plan observes nothing",
                "name stations that see targets, or planned observations",
            )
        network = whole.network()
        if "datum" in self.project.model_fields_set:
            network = network.with_datum(network.datum)
        return self._started(network)

    @cached_property
    def _as_planned(self) -> Job:
        """The job, with planned antennas of a lever arm as positions of their stations."""
        if self.arm is None:
            return self.job
        stations = {
            name: s.model_copy(update={"mounted_point": ()}) if name in self.planned else s
            for name, s in self.project.stations.items()
        }
        return self.job.changed(stations=stations)

    def candidates(
        self, targets: Mapping[str, Array], stations: Mapping[str, ScannerPlace], base: Network
    ) -> Network | None:
        """Observations of targets or of stations that could come, with what they touch.

        New targets are seen from the stations of the base, new stations see its targets.
        """
        out = Survey(site=self.context.frame.site)
        layout, start = base.start.layout, base.start
        present = {
            n: ScannerPlace(
                start.pose_t[layout.index("pose", n)], start.pose_r[layout.index("pose", n)]
            )
            for n in layout.names["pose"]
        }
        for name, xyz in zip(layout.names["point"], start.points, strict=True):
            out.point(name, xyz)
        for name, place in present.items():
            out.station(name, translation=place.position, rotation=place.rotation)
        for name, xyz in targets.items():
            out.point(name, xyz)
        self.scans.add(out, present, targets, self.scans.seen(present, targets))
        if self.arm is not None:
            self.arm.measure(out, targets)
            self.arm.measure_antennas(out, stations)
        if stations:
            known = set(layout.names["point"])
            own = {n: x for n, x in self._scanned().items() if n in known}
            self._stand(out, stations)
            self.scans.add(out, stations, own, self.scans.seen(stations, own))
        if not out.tables():
            return None
        self._calibrate(out)
        return self._started(out.network())

    def _scanned(self) -> dict[str, Array]:
        return {name: self.points[name] for name in self.targets}

    def _calibrate(self, survey: Survey) -> None:
        """Calibration unknowns as the project has them."""
        self.job.calibrations.apply(survey, survey.stations, self.job.instruments.of_planned)

    def _started(self, network: Network) -> Network:
        """The network with approximate values for everything that is known."""
        start = network.start
        layout = start.layout
        points, t, r = start.points.copy(), start.pose_t.copy(), start.pose_r.copy()
        for k, name in enumerate(layout.names["point"]):
            if name in self.points:
                points[k] = np.where(np.isnan(points[k]), self.points[name], points[k])
        for k, name in enumerate(layout.names["pose"]):
            if name in self.measured:
                t[k], r[k] = self.measured[name].position, self.measured[name].rotation
        scalars = np.array(
            [
                value if np.isfinite(value) else self._start.get(name, np.nan)
                for name, value in zip(layout.names["scalar"], start.scalars, strict=True)
            ]
        )
        return network.with_start(
            replace(start, points=points, pose_t=t, pose_r=r, scalars=scalars)
        )


def active_only(survey: Survey, keep: Container[str] = ()) -> None:
    """Leave out what takes no part, and points that nothing observes then, but for some."""
    survey.replace_tables([[table.active()] for table in survey.tables()])
    joint = survey.joint_tables()
    survey.replace_tables([[t] if t.n or k in joint else [] for k, t in enumerate(survey.tables())])
    used: set[str] = set()
    for table in survey.tables():
        used |= table.names("point") | table.names("position")
    survey.points = {
        n: p for n, p in survey.points.items() if n in used or n in keep or p.covariance is not None
    }


def plan_of(project: Project) -> PlanSection:
    """The plan of a project."""
    if project.plan is None:
        raise project.error((), "the project has no section [plan]", "add [plan]")
    return project.plan


def named(places: Sequence[Array], letter: str, taken: set[str]) -> dict[str, Array]:
    """Places (3,) with names that are not taken: a letter and a number."""
    out: dict[str, Array] = {}
    number = 0
    for place in places:
        number += 1
        while f"{letter}{number}" in taken:
            number += 1
        out[f"{letter}{number}"] = place
    return out
