"""A survey from Comp3D's records.

Sigmas that depend on the distance, rotation axes and equalities need approximate places of the
points. Where the coordinate file does not give them, the survey is built twice: first without
what needs them, to find start values, then in full.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.io.survey.comp3d_control import add_control, free_axes
from tribrach.io.survey.comp3d_groups import add_axis, add_baselines, add_equal, add_frame
from tribrach.io.survey.comp3d_points import Points
from tribrach.io.survey.comp3d_project import Project
from tribrach.io.survey.comp3d_records import Observed
from tribrach.io.survey.comp3d_sights import Distances, add_sight, coincident
from tribrach.io.survey.comp3d_starts import Pose, axis_start, frame_poses, offset_points
from tribrach.io.survey.comp3d_tables import Tables
from tribrach.io.survey.comp3d_text import Problems
from tribrach.network.approximate import find_start
from tribrach.network.network import Datum
from tribrach.network.survey import Survey

__all__ = ["assemble"]

Array = NDArray[np.float64]


def assemble(project: Project, points: Points, observed: Observed, problems: Problems) -> Survey:
    """The survey of a project; the values of a simulation are computed ones.

    Raises
    ------
    InputError : a point is held in a project with inner constraints, or points that are sighted
        have one and the same place.
    NoStartValues : points whose approximate place is needed cannot be located.
    """
    assembly = _Assembly(project, points, observed, problems)
    assembly.check()
    assembly.locate()
    survey, tables = assembly.build()
    tables.add_to(survey)
    if project.simulation:
        network = survey.network()
        computed = tables.computed(network.with_start(find_start(network)))
        survey, tables = assembly.build()
        tables.add_to(survey, computed)
    return assembly.finish(survey)


@dataclass
class _Assembly:
    project: Project
    points: Points
    observed: Observed
    problems: Problems

    def __post_init__(self) -> None:
        grid = self.project.grid
        assert grid is not None
        self.site = grid.site
        records = self.points.records
        enh = np.array([record.enh for record in records.values()])
        self.given = dict(zip(records, grid.to_work(enh), strict=True))
        self.active = self.observed.names(active=True)
        self.known = {n: x for n, x in self.given.items() if all(records[n].used)}
        self.poses: list[Pose | None] = []
        self.levels: dict[str, Array] = {}

    def check(self) -> None:
        """Refuse what cannot be computed."""
        for record in self.points.records.values():
            if self.project.inner_constraints and any(record.held) and not record.far:
                raise record.line.error(
                    f"point {record.name} is held, but the project uses inner constraints",
                    "give it sigmas or switch inner constraints off",
                )
        for sight in self.observed.sights:
            if coincident(sight, self.points.records, self.given):
                a, b = (self.points.records[name] for name in sight.names)
                raise sight.line.error(
                    f"points {a.name} and {b.name} are sighted from each other, but "
                    f"{a.line.source} and {b.line.source} give them one and the same place",
                    "give better approximate coordinates or leave one of them out",
                )

    def locate(self) -> None:
        """Find approximate places: by offsets, by subframes, at last by the whole network."""
        self._extend()
        if not self._complete():
            survey, tables = self.build(core=True)
            tables.add_to(survey)
            state = find_start(survey.network())
            for name, x in zip(state.layout.names["point"], state.points, strict=True):
                if name not in self.levels and name not in self.given:
                    self.known.setdefault(name, x)
            self._extend()

    def _extend(self) -> None:
        up = np.array([0.0, 0.0, 1.0])
        self.levels |= offset_points(self.observed, self.known, self.given)
        self.poses = frame_poses(self.observed.frames, self.known, up)

    def _complete(self) -> bool:
        """True if every distance, axis and equality has what it needs."""
        places = self.given | self.levels | self.known
        distance = Distances(self.observed.sights, places)
        lengths = (
            distance(*s.names) is not None
            for s in self.observed.sights
            if s.by_distance and not s.off
        )
        axes = (axis_start(axis, self.known) is not None for axis in self.observed.axes)
        equal = (
            any({p.start, p.end} <= places.keys() for p in e.pairs) for e in self.observed.equals
        )
        return all(lengths) and all(axes) and all(equal)

    def build(self, *, core: bool = False) -> tuple[Survey, Tables]:
        """Survey with points and stations, and its tables; core leaves out axes and equalities."""
        survey, tables = Survey(site=self.site), Tables()
        stations = self._stations(survey)
        present = self._points(survey, tables, stations)
        places = self.given | self.levels | self.known
        distance = Distances(self.observed.sights, places)
        for sight in self.observed.sights:
            if not sight.off or set(sight.names) <= present:
                sigma = sight.sigma(distance(*sight.names) or 100.0)
                add_sight(tables, sight, sigma, self.project, self.site, places)
        rounds = [(s.circle, not s.off) for s in self.observed.sights if s.circle]
        for circle in dict.fromkeys(name for name, _ in rounds):
            if (circle, True) not in rounds and circle in _circles(tables):
                survey.scalars[circle] = (0.0, False)
        for frame, station in zip(self.observed.frames, stations, strict=True):
            if frame.code == 19:
                add_baselines(tables, frame, self.site)
            else:
                add_frame(tables, frame, station, self.known)
        if not core:
            self._groups(survey, tables, places)
        return survey, tables

    def _stations(self, survey: Survey) -> list[str]:
        """Add a station for each subframe; their names, "" for baselines."""
        names: list[str] = []
        for frame, pose in zip(self.observed.frames, self.poses, strict=True):
            name = frame.origin
            if frame.code != 19:
                if name in survey.stations:
                    name = f"{name} ({frame.line.source})"
                place, rotation = pose if pose is not None else (self.known.get(frame.origin), None)
                nowhere = np.full(3, np.nan)
                survey.station(
                    name,
                    translation=nowhere if place is None else place,
                    rotation=rotation,
                    source=frame.line.source,
                )
            names.append(name if frame.code != 19 else "")
        return names

    def _points(self, survey: Survey, tables: Tables, stations: list[str]) -> set[str]:
        """Add points and control; the names of all positions."""
        switched_off = self.observed.names(active=False)
        for name, record in self.points.records.items():
            x, held = self.given[name], name not in self.active
            if held and not any(record.constrained) and name not in switched_off:
                continue
            inner = self.project.inner_constraints
            add_control(tables, record, x, self.site, inner=inner)
            if name not in survey.stations:
                # a free point that only switched-off observations see stays where it is given
                still = held and not any(record.constrained)
                survey.point(
                    name,
                    x,
                    free=(False,) * 3 if still else free_axes(record),
                    role="control" if any(record.constrained) and not inner else "free",
                    source=record.line.source,
                )
        for name in sorted(self.active - survey.points.keys() - survey.stations.keys()):
            if name in self.levels:
                survey.point(name, self.levels[name], free=(False, False, True))
            else:
                survey.point(name, self.known.get(name, np.full(3, np.nan)))
        return survey.points.keys() | survey.stations.keys()

    def _groups(self, survey: Survey, tables: Tables, places: dict[str, Array]) -> None:
        for axis in self.observed.axes:
            start = axis_start(axis, self.known)
            if start is None:
                raise axis.line.error(
                    f"no target on the axis {axis.origin} has three positions that can be located",
                    "observe its points or give their coordinates",
                )
            if axis.origin in survey.points and np.isnan(survey.points[axis.origin].xyz).any():
                survey.points[axis.origin].xyz = start.origin
            add_axis(survey, tables, axis, start)
        for equal in self.observed.equals:
            add_equal(survey, tables, equal, places, self.site)

    def finish(self, survey: Survey) -> Survey:
        """Datum, warnings and facts."""
        project, records = self.project, self.points.records
        survey.warnings += self.problems.warnings
        _warn(
            survey,
            "No observation sees",
            [n for n in records if n not in survey.points and n not in survey.stations],
            "left out",
        )
        still = [
            n
            for n, p in survey.points.items()
            if n not in self.active
            and not any(p.free)
            and n in records
            and not any(records[n].held)
        ]
        _warn(survey, "Only switched-off observations see", still, "kept where given")
        bent = [n for n, r in records.items() if r.deflection and n in survey.points]
        _warn(survey, "Deflections of the vertical are given at", bent, "not applied")
        if project.simulation:
            survey.warnings.append(
                f"The project is a simulation ({project.simulation}): measured values are not "
                "used, computed ones take their place."
            )
        if project.inner_constraints:
            far = {n for n, r in records.items() if r.far}
            names = [*survey.points, *survey.stations]
            survey.datum = Datum("free", tuple(n for n in names if n not in far))
        grid = project.grid
        assert grid is not None
        survey.info |= {
            "format": "Comp3D",
            "title": project.name,
            "grid": grid.crs,
            "grid_origin": [grid.easting, grid.northing],
            "refraction": project.refraction,
            "simulation": project.simulation,
        }
        return survey


def _circles(tables: Tables) -> set[str]:
    """Names of all orientation unknowns that have directions."""
    return {name for rows in tables.rows.values() for name in rows.columns.get("orientation", [])}


def _warn(survey: Survey, what: str, names: list[str], then: str) -> None:
    """A warning that names at most ten points."""
    if names:
        more = f" and {len(names) - 10} more" if len(names) > 10 else ""
        survey.warnings.append(f"{what} {', '.join(names[:10])}{more}: {then}.")
