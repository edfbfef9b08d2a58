"""A survey from Comp3D's records: points, control, sights, subframes, axes and equalities.

Sigmas that depend on the distance, rotation axes and equalities need approximate places of the
points. Where the coordinate file does not give them, the survey is built twice: first without the
observations that need them, to find start values, then in full.

A fully weighted point is control with a covariance; a partly weighted one is observed axis by axis:
east and north of the grid, height over the ellipsoid. A file of covariances correlates them. Points
with a height only keep their plan position and the other way round. Coordinates that are held drop
out if the whole point is held and are hard constraints otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import NoStartValues
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.survey.comp3d.covariances import TableKey, Weight, correlate
from tribrach.io.survey.comp3d.points import Comp3dPoint, Comp3dPoints
from tribrach.io.survey.comp3d.project import Comp3dProject
from tribrach.io.survey.comp3d.records import (
    AxisRecord,
    EqualRecord,
    FrameEntry,
    FrameRecord,
    Observed,
    SightRecord,
)
from tribrach.io.survey.comp3d.starts import (
    AxisStart,
    Pose,
    axis_start,
    frame_poses,
    offset_points,
)
from tribrach.io.survey.comp3d.text import Problems
from tribrach.io.survey.csv.matrix import CoordinateCovariance
from tribrach.network.facts import Fact
from tribrach.network.network import Datum, Network
from tribrach.network.start.start_values import find_start
from tribrach.network.survey import Survey
from tribrach.observations.base import Observations, Use
from tribrach.observations.control import Coordinates, DirectedComponents, Heights
from tribrach.observations.gnss import GnssBaselines
from tribrach.observations.instrument_frames import (
    AxisFeet,
    AxisPlanes,
    AxisRadii,
    FrameAngles,
    FrameCoordinates,
    FrameDistances,
)
from tribrach.observations.levelling import (
    EqualDistances,
    EqualHeightDifferences,
    HeightDifferences,
)
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.observations.sights import (
    Azimuths,
    Directions,
    HorizontalDistances,
    LocalOffsets,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.observations.unknowns import State
from tribrach.units import SEC

#: observations that a sentence names
_NAMED = 10
#: reasons of observations that are switched off
INNER = "the project uses inner constraints"
_OFF = "its sigma is negative in the file"
#: points closer than this [m] have no direction between them
TOO_CLOSE = 1e-6
#: kinds of the codes of plain observations
_KINDS: dict[int, type[Observations]] = {
    1: SlopeDistances,
    2: HorizontalDistances,
    3: SlopeDistances,
    5: Directions,
    6: ZenithAngles,
    7: Directions,
    8: Azimuths,
    14: LocalOffsets,
    15: LocalOffsets,
}


@dataclass
class _Rows:
    values: list[Any] = field(default_factory=list)
    covariance: list[Any] = field(default_factory=list)
    source: list[str] = field(default_factory=list)
    reason: list[str] = field(default_factory=list)
    columns: dict[str, list[Any]] = field(default_factory=dict)


@dataclass
class Tables:
    """Observations gathered one by one, for a survey that takes one table per kind and group."""

    rows: dict[TableKey, _Rows] = field(default_factory=dict)
    weights: dict[str, Weight] = field(default_factory=dict)

    def put(
        self,
        kind: type[Observations],
        value: float | tuple[float, ...] | Array,
        sigma: float | tuple[float, ...] | Array,
        source: str,
        columns: Mapping[str, object],
        *,
        off: str = "",
        group: str = "",
        hard: bool = False,
    ) -> tuple[TableKey, int]:
        """Add one observation."""
        rows = self.rows.setdefault((kind, group, hard), _Rows())
        size = len(kind.units)
        spread = np.asarray(sigma, dtype=float)
        if spread.ndim < 2:
            spread = np.diag(np.broadcast_to(spread, size) ** 2)
        rows.values.append(np.broadcast_to(np.asarray(value, dtype=float), size))
        rows.covariance.append(spread)
        rows.source.append(source)
        rows.reason.append(off)
        for name, entry in columns.items():
            rows.columns.setdefault(name, []).append(entry)
        return (kind, group, hard), len(rows.values) - 1

    def computed(self, network: Network) -> dict[tuple[str, str], Array]:
        """Values (n, rows) of each kind and group as the network's start values give them."""
        return {(o.kind, o.group): o.predict(network.start) for o in network.observations}

    def add_to(
        self,
        survey: Survey,
        computed: dict[tuple[str, str], Array] | None = None,
        covariances: CoordinateCovariance | None = None,
    ) -> None:
        """Add all rows to a survey."""
        numbers: dict[TableKey, int] = {}
        for (kind, group, hard), rows in self.rows.items():
            values = np.array(rows.values)
            if computed is not None and not hard:
                values = computed[kind.kind, group or kind.kind]
            numbers[kind, group, hard] = survey.add(
                kind,
                values=values,
                covariance=None if hard else np.array(rows.covariance),
                source=rows.source,
                group=group,
                hard=hard,
                use=[Use.OFF if reason else Use.ACTIVE for reason in rows.reason],
                reason=rows.reason,
                **{name: np.array(entries) for name, entries in rows.columns.items()},
            )
        if covariances is not None:
            correlate(survey, covariances, self.weights, numbers)


def grid_axes(x: Array, site: EllipsoidSite) -> Array:
    """East and north of the grid in the local horizon, and up, as rows (3, 3).

    The grid of the computation has the north of the project's centre everywhere.

    ``x`` (3,): place in W [m].
    """
    up = site.axes(x[None])[0, 2]
    east = np.array([1.0, 0.0, 0.0]) - up[0] * up
    east /= np.linalg.norm(east)
    return np.stack([east, np.cross(up, east), up])


def free_axes(record: Comp3dPoint) -> tuple[bool, ...]:
    """Which of E, N, U of W are unknown."""
    if all(record.used) and not all(record.held):
        return True, True, True
    return tuple(u and not h for u, h in zip(record.used, record.held, strict=True))


def add_control(
    tables: Tables, record: Comp3dPoint, x: Array, site: EllipsoidSite, *, inner: bool
) -> None:
    """Add the constraints of a point.

    ``x`` (3,): its place in W [m]; ``inner``: the project uses inner constraints, which switch
    these off.
    """
    axes = grid_axes(x, site)
    off = INNER if inner and not record.far else ""
    weighted = [c and not h for c, h in zip(record.constrained, record.held, strict=True)]
    if all(weighted) and min(record.sigmas) > 0:
        covariance = axes.T @ np.diag(np.square(record.sigmas)) @ axes
        where = {"position": record.name}
        source = record.line.source
        key, item = tables.put(Coordinates, x, covariance, source, where, off=off, group="control")
        if not off:
            rows = {axis: (key, item, axis) for axis in range(3)}
            tables.weights[record.name] = Weight(rows, record.sigmas, axes)
        return
    free = free_axes(record)
    single: dict[int, tuple[TableKey, int, int]] = {}
    for axis in range(3):
        sigma = record.sigmas[axis]
        if weighted[axis]:
            reason = off or ("" if sigma > 0 else "its sigma is negative in the file")
            key, item = _put(
                tables, record, axis, x, axes, site, abs(sigma), off=reason, group="control"
            )
            if not reason:
                single[axis] = key, item, 0
        elif record.held[axis] and free[axis]:
            _put(tables, record, axis, x, axes, site, 1.0, hard=True)
    if single:
        tables.weights[record.name] = Weight(single, record.sigmas, None)


def _put(
    tables: Tables,
    record: Comp3dPoint,
    axis: int,
    x: Array,
    axes: Array,
    site: EllipsoidSite,
    sigma: float,
    *,
    off: str = "",
    group: str = "",
    hard: bool = False,
) -> tuple[TableKey, int]:
    """Observe one coordinate of a point."""
    kind: type[Observations] = Heights
    value = float(site.height(x[None])[0])
    columns: dict[str, object] = {"position": record.name}
    if axis < 2:
        kind, value = DirectedComponents, float(axes[axis] @ x)
        columns["direction"] = axes[axis]
    source = record.line.source
    return tables.put(kind, value, sigma, source, columns, off=off, group=group, hard=hard)


class PointDistances:
    """Distances [m] between points, for sigmas that depend on them: measured, else computed.

    A distance that is switched off is still closer than approximate coordinates.

    ``known``: coordinates (3,) by name [m].
    """

    def __init__(self, sights: list[SightRecord], known: dict[str, Array]) -> None:
        self._known = known
        measured: dict[frozenset[str], list[float]] = {}
        for sight in sights:
            if sight.code in (1, 3) and sight.value > 0:
                measured.setdefault(frozenset(sight.names), []).append(sight.value)
        self._measured = {pair: float(np.median(values)) for pair, values in measured.items()}

    def __call__(self, start: str, end: str) -> float | None:
        """Distance [m] between two points, None if neither measured nor computed."""
        measured = self._measured.get(frozenset((start, end)))
        if measured is not None or not {start, end} <= self._known.keys():
            return measured
        return max(float(np.linalg.norm(self._known[start] - self._known[end])), TOO_CLOSE)


def coincident(sight: SightRecord, points: dict[str, Comp3dPoint], known: dict[str, Array]) -> bool:
    """True if both ends have one place and the observation cannot be made between them."""
    if sight.off or sight.code in (2, 4, 14, 15) or not set(sight.names) <= points.keys():
        return False
    chord = known[sight.end] - known[sight.start]
    chord[2] += sight.height_target - sight.height_instrument
    flat = float(np.hypot(chord[0], chord[1]))
    return flat < TOO_CLOSE and (sight.angular or abs(chord[2]) < TOO_CLOSE)


def add_sight(
    tables: Tables,
    sight: SightRecord,
    sigma: float,
    project: Comp3dProject,
    site: EllipsoidSite,
    places: dict[str, Array],
) -> None:
    """Add one plain observation.

    ``sigma``: its standard deviation [m, rad]; ``places``: approximate coordinates (3,) in W by
    name [m].
    """
    columns: dict[str, object] = {"start": sight.start, "end": sight.end}
    off = sight.off
    if sight.code == 8 and project.inner_constraints:
        off = off or INNER
    if sight.code == 4:
        columns |= {"height_start": sight.height_instrument, "height_end": sight.height_target}
        kind: type[Observations] = HeightDifferences
    else:
        columns["height_instrument"] = sight.height_instrument
        columns["height_target"] = sight.height_target
        kind = _KINDS[sight.code]
    radius = site.curvature_radius or 1.0
    if sight.code in (5, 7):
        columns["orientation"] = sight.circle
    elif sight.code == 6:
        columns["refraction"] = project.refraction
    elif sight.code == 2:
        columns["reduction"] = radius / (radius + _height(sight.end, places, site))
    elif sight.code in (14, 15):
        columns["azimuth"] = _azimuth(sight.code - 14, places.get(sight.start), site)
        columns["reduction"] = radius / (radius + _height(sight.start, places, site))
    tables.put(kind, sight.value, sigma, sight.line.source, columns, off=off)


def _height(name: str, places: dict[str, Array], site: EllipsoidSite) -> float:
    """Height [m] of a point, zero if its place is unknown."""
    return float(site.height(places[name][None])[0]) if name in places else 0.0


def _azimuth(axis: int, x: Array | None, site: EllipsoidSite) -> float:
    """Azimuth [rad] of the grid's east (0) or north (1) at a place, as at the centre if unknown."""
    if x is None:
        return float(np.pi / 2 * (1 - axis))
    east, north, _ = site.axes(x[None])[0] @ grid_axes(x, site)[axis]
    return float(np.arctan2(east, north))


def add_frame(tables: Tables, frame: FrameRecord, station: str, known: dict[str, Array]) -> None:
    """Add the targets of a subframe, and the condition that it is levelled if it is.

    ``known``: coordinates (3,) by name [m].
    """
    origin = known.get(frame.origin)
    for entry in frame.entries:
        _add_entry(tables, frame, entry, station, _distance(frame, entry, origin, known))
    if frame.levelled:
        tables.put(Inclinations, 0.0, 1.0, frame.line.source, {"station": station}, hard=True)
    if station != frame.origin:
        ends = {"start": frame.origin, "end": station}
        tables.put(GnssBaselines, 0.0, 1.0, frame.line.source, ends, hard=True)


def _distance(
    frame: FrameRecord, entry: FrameEntry, origin: Array | None, known: dict[str, Array]
) -> float:
    """Distance [m] to a target for its sigmas: measured, else computed, else 1 m."""
    if frame.code == 11:
        return float(np.linalg.norm(entry.values))
    if entry.values[2] > 0:
        return entry.values[2]
    if origin is not None and entry.target in known:
        return float(np.linalg.norm(known[entry.target] - origin))
    return 1.0


def _add_entry(
    tables: Tables, frame: FrameRecord, entry: FrameEntry, station: str, distance: float
) -> None:
    source = entry.line.source
    ends: dict[str, object] = {"station": station, "target": entry.target}
    scales = (distance,) * 3 if frame.code == 11 else (1 / distance, 1 / distance, distance)
    sigmas = np.array(entry.own) + np.array(entry.by_distance) * scales
    if frame.code == 11 and not any(entry.off) and entry.height == 0:
        tables.put(TargetCentres, entry.values, sigmas, source, ends)
        return
    for i in range(3):
        columns = ends | {"height_target": entry.height}
        kind: type[Observations] = FrameDistances
        if frame.code == 11:
            kind = FrameCoordinates
            columns["axis"] = i
        elif i < 2:
            kind = FrameAngles
            columns["circle"] = i
        elif entry.values[i] <= 0:
            # a ray without a distance
            continue
        tables.put(kind, entry.values[i], sigmas[i], source, columns, off=entry.off[i])


def add_baselines(tables: Tables, frame: FrameRecord, site: EllipsoidSite) -> None:
    """Add baselines, turned from ECEF into W with their covariances."""
    turn = site.w_from_ecef
    for entry in frame.entries:
        xx, xy, xz, yy, yz, zz = entry.covariance
        covariance = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        columns: dict[str, object] = {"start": frame.origin, "end": entry.target}
        columns |= {"height_start": frame.height, "height_end": entry.height}
        tables.put(
            GnssBaselines,
            turn @ np.array(entry.values),
            turn @ covariance @ turn.T,
            entry.line.source,
            columns,
            off=entry.off[0],
        )


def add_axis(survey: Survey, tables: Tables, axis: AxisRecord, start: AxisStart) -> None:
    """Add a rotation axis: two slopes, a place and a radius for each target, its feet."""
    name = f"axis {axis.origin} ({axis.line.source})"
    slopes = {f"slope_{i}": f"slope {i} of {name}" for i in (1, 2)}
    ends: dict[str, object] = {"origin": axis.origin, "main": start.main, **slopes}
    for slope, value in zip(slopes.values(), start.slopes, strict=True):
        survey.scalars[slope] = (value, True)
    for target, along in start.along.items():
        survey.scalars[f"place of {target} on {name}"] = (along, True)
        survey.scalars[f"radius of {target} on {name}"] = (start.radius[target], True)
    for circle in axis.circles:
        place, size = (f"{what} of {circle.target} on {name}" for what in ("place", "radius"))
        here = ends | {"along": place, "point": circle.point}
        for kind, sigma, more in (
            (AxisRadii, circle.sigma_radius, {"radius": size}),
            (AxisPlanes, circle.sigma_plane, {}),
        ):
            off = "" if sigma > 0 else _OFF
            tables.put(kind, 0.0, abs(sigma), circle.line.source, here | more, off=off)
    for point, line in axis.feet:
        tables.put(AxisFeet, 0.0, 1.0, line.source, ends | {"point": point}, hard=True)


def add_equal(
    survey: Survey, tables: Tables, equal: EqualRecord, known: dict[str, Array], site: EllipsoidSite
) -> None:
    """Add pairs with a common value, which starts as the mean over the pairs that are known.

    ``known``: coordinates (3,) by name [m].
    """
    kind = EqualHeightDifferences if equal.code == 21 else EqualDistances
    values = []
    for pair in equal.pairs:
        if {pair.start, pair.end} <= known.keys():
            ends = np.array([known[pair.start], known[pair.end]])
            heights = site.height(ends)
            values.append(
                heights[1] - heights[0] if equal.code == 21 else np.linalg.norm(ends[1] - ends[0])
            )
        columns = {"start": pair.start, "end": pair.end, "common": equal.name}
        off = "" if pair.sigma > 0 else _OFF
        tables.put(kind, 0.0, abs(pair.sigma), pair.line.source, columns, off=off)
    survey.scalars[equal.name] = (float(np.mean(values)) if values else 0.0, True)


def assemble(
    project: Comp3dProject,
    points: Comp3dPoints,
    observed: Observed,
    problems: Problems,
    covariances: CoordinateCovariance | None = None,
) -> Survey:
    """The survey of a project; the values of a simulation are computed ones."""
    assembly = _Assembly(project, points, observed, problems)
    assembly.check()
    assembly.locate()
    survey, tables = assembly.build()
    tables.add_to(survey, covariances=covariances)
    if project.simulation:
        network = survey.network()
        computed = tables.computed(network.with_start(find_start(network)))
        survey, tables = assembly.build()
        tables.add_to(survey, computed, covariances)
    return assembly.finish(survey)


@dataclass(frozen=True)
class Comp3dFacts(Fact):
    """What a Comp3D project says besides its observations."""

    grid: ProjectedGrid  #: projection of the given coordinates
    refraction: float  #: coefficient of refraction
    simulation: str  #: kind of the simulation, "" for measured values


@dataclass
class _Assembly:
    project: Comp3dProject
    points: Comp3dPoints
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
        """Refuse projects that cannot be computed."""
        refused = self.problems.refused
        for record in self.points.records.values():
            if self.project.inner_constraints and any(record.held) and not record.far:
                refused.add(
                    record.line.error(
                        f"point {record.name} is held, but the project uses inner constraints",
                        "give it sigmas or switch inner constraints off",
                    )
                )
        for sight in self.observed.sights:
            if coincident(sight, self.points.records, self.given):
                a, b = (self.points.records[name] for name in sight.names)
                refused.add(
                    sight.line.error(
                        f"points {a.name} and {b.name} are sighted from each other, but "
                        f"{a.line.source} and {b.line.source} give them one and the same place",
                        "give better approximate coordinates or leave one of them out",
                    )
                )
        refused.settle()

    def locate(self) -> None:
        """Find approximate places: by offsets, by subframes, and last by the whole network."""
        self._extend()
        if not self._complete():
            state = self._placed()
            for name, x in zip(state.layout.names["point"], state.points, strict=True):
                if name not in self.levels and name not in self.given:
                    self.known.setdefault(name, x)
            self._extend()

    def _placed(self) -> State:
        """Places by the whole network; points that cannot be placed are left out, as in Comp3D."""
        while True:
            survey, tables = self.build(core=True)
            tables.add_to(survey)
            network = survey.network()
            try:
                return find_start(network)
            except NoStartValues as error:
                names = {name for family, name in error.unplaced if family == "point"}
                rest = len(network.start.layout.names["point"]) - len(names)
                if not names or rest <= len(names):
                    raise
                self._leave_out(names)

    def _leave_out(self, names: set[str]) -> None:
        """Leave out points and what was observed of them, with a warning for each."""
        lines = self.observed.without(names)
        for name in sorted(names):
            listed = ", ".join(lines[name][:_NAMED])
            more = f" and {len(lines[name]) - _NAMED} more" if len(lines[name]) > _NAMED else ""
            self.problems.warnings.append(
                f"Point {name} cannot be placed: it is left out with its observations "
                f"({listed}{more})."
            )
        self.active = self.observed.names(active=True)
        self._extend()

    def _extend(self) -> None:
        up = np.array([0.0, 0.0, 1.0])
        self.levels |= offset_points(self.observed, self.known, self.given)
        self.poses = frame_poses(self.observed.frames, self.known, up)

    def _complete(self) -> bool:
        """True if every distance, axis and equality has what it needs."""
        places = self.given | self.levels | self.known
        distance = PointDistances(self.observed.sights, places)
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
        """Survey with points and stations, and its tables; ``core`` omits axes and equalities."""
        survey, tables = Survey(site=self.site), Tables()
        stations = self._stations(survey)
        present = self._points(survey, tables, stations)
        places = self.given | self.levels | self.known
        distance = PointDistances(self.observed.sights, places)
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
        """Add a station for each subframe."""
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
        """Add points and control."""
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
        """Add datum, warnings and facts."""
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
        for name, record in records.items():
            if record.deflection is not None and (name in survey.points or name in survey.stations):
                eta, xi = record.deflection
                survey.deflections[name] = (xi * SEC, eta * SEC)
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
        survey.title = project.name
        survey.leaves_out_unplaced = True
        survey.facts = (Comp3dFacts(grid, project.refraction, project.simulation),)
        return survey


def _circles(tables: Tables) -> set[str]:
    """Names of all orientation unknowns that have directions."""
    return {name for rows in tables.rows.values() for name in rows.columns.get("orientation", [])}


def _warn(survey: Survey, what: str, names: list[str], then: str) -> None:
    """Add a warning that names at most ten points."""
    if names:
        more = f" and {len(names) - 10} more" if len(names) > 10 else ""
        survey.warnings.append(f"{what} {', '.join(names[:10])}{more}: {then}.")
