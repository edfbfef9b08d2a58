"""Writes networks as data files of STAR*NET: local jobs, and jobs in a grid with their project.

Lengths are metres, angles degrees, minutes and seconds, coordinates north before east; every line
has its standard error. A job in space has curvature and refraction: the coefficient of each zenith
angle is written such that both together bend the sight as they do in the network, so that a network
without curvature has 0.5. Heights of rods in levelling, known convergences and scales are reduced.
A network in a projection becomes a job in that grid, whose coordinates are projected and whose
heights are ellipsoidal; its vectors are geocentric. STAR*NET has no inner constraints and no
correlations but those within a vector; what has is named. Format: STAR*NET reference manual.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import EllipsoidSite, FlatSite
from tribrach.io.survey.exported import Exported, Sieve, ValueCovariances, packed_seconds
from tribrach.io.survey.starnet.places import grid_around
from tribrach.io.survey.starnet.settings import (
    REFRACTION_PER_UNIT,
    StarnetSettings,
    name_of_grid,
)
from tribrach.network.facts import codes_of
from tribrach.network.network import Network, axes_in_use
from tribrach.observations.base import Observations
from tribrach.observations.control import (
    Coordinate,
    Coordinates,
    DirectedComponents,
    Heights,
)
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import (
    MEAN_RADIUS,
    Angles,
    Azimuths,
    Directions,
    Distances,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.units import SEC

_HEIGHTS = ("height_instrument", "height_target")
#: codes of sights with two or three stations, and the fields that are written or reduced
_CODES: dict[type[Observations], tuple[str, tuple[str, ...]]] = {
    Angles: ("A", _HEIGHTS),
    Azimuths: ("B", (*_HEIGHTS, "convergence", "astronomic")),
    SlopeDistances: ("D", _HEIGHTS),
    Distances: ("D", _HEIGHTS),
    HorizontalDistances: ("D", (*_HEIGHTS, "reduction")),
    ZenithAngles: ("V", (*_HEIGHTS, "refraction")),
}
#: kinds that are written behind the coordinates of their points
_GIVEN = (Coordinates, GnssPositions, Coordinate, Heights, DirectedComponents)
#: how far the cosine of a direction may be off one
_SAME = 1e-9
#: characters that may stand between the names of a line, the first that no name has is taken
_SEPARATORS = "-:;|~=,"
#: a name as one word of a line
_NAME = re.compile(r"[^\s#'‘’`.][^\s#]*$")
_CORRELATED = "correlated, which STAR*NET knows of vectors only"


def write(network: Network) -> Exported:
    """The network as the text of a data file."""
    return _Writer(network).exported()


class _Writer:
    """A network on its way into a data file."""

    def __init__(self, network: Network) -> None:
        self.network, self.sieve = network, Sieve(network)
        self.grid = None if isinstance(network.site, FlatSite) else _grid(network)
        self.correlations = ValueCovariances(network)
        self.names = network.start.layout.names["point"]
        self.separator = _separator(self.names)
        axes = (o.observed_axes(vars(o)) for o in network.observations)
        used = axes_in_use(axes, network.site)
        self.plane, self.levels = not used[2], not used[0]
        self.written = 0
        #: of points, until a line says them
        self.codes = dict(codes_of(network.facts))
        count = len(self.names)
        self.free = network.free[: 3 * count].reshape(-1, 3)
        self.x = network.start.points.copy()
        #: what stands behind each coordinate E, N, U
        self.marks = [["*" if free else "!" for free in row] for row in self.free]
        if self.grid is not None:
            partly = self.free.any(axis=1) & ~self.free.all(axis=1)
            what = "point", "held in one axis of the work frame alone"
            self.sieve.lost[what] += int(partly.sum())

    def exported(self) -> Exported:
        """The whole file."""
        self._given()
        places = list(self._points())
        lines = list(self._observations())
        if not self.written:
            raise InputError(
                "STAR*NET can hold none of the observations of this network",
                cure="; ".join(self.sieve.sentences()) or "give a network with observations",
            )
        if self.network.datum.kind == "free":
            self.sieve.lost["datum", "inner constraints, which STAR*NET has not"] += 1
        head = [f"# {line}" for line in self.network.title.splitlines()]
        head += [f".{'2D' if self.plane else '3D'}", ".UNITS Meters DMS", ".ORDER NE AtFromTo"]
        if self.separator != "-":
            head.append(f".SEPARATOR {self.separator}")
        if self.grid is not None:
            head.append(".GPS WEIGHT COVARIANCES")
        text = "\n".join([*head, "", *places, "", *lines, ""])
        beside = {} if self.grid is None else {".snproj": _project(self.grid)}
        sieve = self.sieve
        return Exported(text, self.written, sieve.sentences(), sieve.notes(), beside)

    @cached_property
    def coordinates(self) -> Array:
        """Coordinates (n, 3) of the file as E, N, height, NaN where not known."""
        if self.grid is None:
            return self.x
        out = np.full_like(self.x, np.nan)
        known = np.isfinite(self.x).all(axis=1)
        out[known] = self.grid.from_work(self.x[known])
        return out

    @cached_property
    def read_radius(self) -> float:
        """Radius of the Earth [m] that the file is computed with when it is read back."""
        if self.grid is None:
            return StarnetSettings().radius
        known = self.coordinates[np.isfinite(self.coordinates).all(axis=1)]
        if not len(known):
            raise InputError(
                "no point has coordinates, and the job is in a grid",
                cure="give coordinates of at least one point",
            )
        site = grid_around(self.grid.crs, known[:, :2], float(known[:, 2].mean())).site
        return site.curvature_radius or MEAN_RADIUS

    def _points(self) -> Iterator[str]:
        """Coordinates with what is known of them: held, a standard error, or free."""
        for name, xyz, marks in zip(self.names, self.coordinates, self.marks, strict=True):
            plan, height = np.isfinite(xyz[:2]).all(), np.isfinite(xyz[2])
            if self.levels or (height and not plan):
                if height:
                    yield " ".join(["E", name, repr(float(xyz[2])), marks[2], *self._said(name)])
            elif plan:
                axes = (1, 0) if self.plane or not height else (1, 0, 2)
                words = [repr(float(xyz[axis])) for axis in axes] + [marks[axis] for axis in axes]
                yield " ".join(["C", name, *words, *self._said(name)])

    def _said(self, name: str) -> list[str]:
        """The description of a point as one word, at its first appearance."""
        code = self.codes.pop(name, "")
        # a number sign would begin a comment
        return [f"'{code.replace('#', '')}"] if code else []

    def _observations(self) -> Iterator[str]:
        """Lines of all observations; conditions are fixed observations."""
        for table, o in enumerate(self.network.observations):
            if not isinstance(o, _GIVEN):
                yield from self._of_kind(o, table)
        for constraint in self.network.constraints:
            if not isinstance(constraint.observations, _GIVEN):
                yield from self._of_kind(constraint.observations, None)

    def _given(self) -> None:
        """Collect sigmas and marks of given coordinates."""
        for table, o in enumerate(self.network.observations):
            if isinstance(o, _GIVEN):
                self._weigh(o, table)
        for constraint in self.network.constraints:
            if isinstance(constraint.observations, _GIVEN):
                self._weigh(constraint.observations, None)

    def _of_kind(self, o: Observations, table: int | None) -> Iterator[str]:
        """Lines of one table; ``table`` is None for conditions."""
        if isinstance(o, Directions):
            yield from self._directions(o, table)
        elif type(o) in _CODES:
            yield from self._sights(o, table)
        elif type(o) is HeightDifferences:
            held = ("height_start", "height_end", "geoid_start", "geoid_end")
            marks = o.values[:, 0] - o.height_end + o.height_start + o.stated_rise
            for i, sigma in self._rows(o, table, held):
                # the length weighs nothing where a standard error stands
                yield f"L {self._line(o.start[i], o.end[i])} {float(marks[i])!r} 1 {sigma}"
        elif isinstance(o, GnssBaselines) and table is not None and self.grid is not None:
            yield from self._vectors(o, table)
        else:
            self.sieve.refuse_all(o, "STAR*NET has no such observations")

    def _rows(
        self, o: Observations, table: int | None, held: Sequence[str]
    ) -> Iterator[tuple[int, str]]:
        """Observations that are written, with their standard errors as words."""
        rows = self.sieve.rows(o, held)
        if table is not None:
            rows = self._alone(o, table, rows)
        unit = SEC if o.units[0] == "rad" else 1.0
        self.written += len(rows)
        for i in rows.tolist():
            if table is None:
                yield i, "!"
            else:
                variance = float(self.correlations.matrix([(table, i, 0)])[0, 0])
                yield i, repr(float(np.sqrt(variance)) / unit)

    def _alone(self, o: Observations, table: int, rows: Index) -> Index:
        """Of observations (k,) those that no covariance ties to others."""
        group = self.correlations.group
        tied = np.array([group((table, int(i), 0)) is not None for i in rows], dtype=bool)
        self.sieve.refuse(o, int(tied.sum()), _CORRELATED)
        alone: Index = rows[~tied]
        return alone

    def _directions(self, o: Directions, table: int | None) -> Iterator[str]:
        """Sets of directions."""
        sets: dict[tuple[int, int], list[str]] = {}
        for i, sigma in self._rows(o, table, ("orientation", *_HEIGHTS)):
            words = ["DN", self.names[o.end[i]], _angle(o.values[i, 0]), sigma]
            line = " ".join(words + self._heights_over(o, i) + self._said(words[1]))
            sets.setdefault((int(o.orientation[i]), int(o.start[i])), []).append(line)
        for (_, start), lines in sets.items():
            name = self.names[start]
            yield from (" ".join(["DB", name, *self._said(name)]), *lines, "DE")

    def _sights(self, o: Observations, table: int | None) -> Iterator[str]:
        """Angles, bearings, distances and zenith angles."""
        code, held = _CODES[type(o)]
        values, bends = o.values[:, 0].copy(), np.zeros(len(o))
        factor = np.ones(len(o))
        level = isinstance(o, HorizontalDistances)
        if isinstance(o, ZenithAngles):
            bends = self._bends(o)
        elif isinstance(o, Azimuths):
            values += o.convergence - self._convergences(o)
        elif isinstance(o, HorizontalDistances):
            values, factor = values / o.reduction, 1 / o.reduction
        if level and not self.plane:
            yield ".DELTA ON"
        bend: float | None = None
        for i, sigma in self._rows(o, table, held):
            if isinstance(o, ZenithAngles) and bends[i] != bend:
                bend = float(bends[i])
                yield f".REFRACTION {bend!r}"
            if factor[i] != 1.0 and sigma != "!":
                sigma = repr(float(sigma) * float(factor[i]))
            ends = [o.start[i], o.end[i]]  # type: ignore[attr-defined]
            if isinstance(o, Angles):
                ends.append(o.foresight[i])
            value = repr(float(values[i])) if o.units[0] == "m" else _angle(values[i])
            words = [code, self._line(*ends), value, sigma]
            said = self._said(self.names[ends[-1]])
            yield " ".join(words + self._heights_over(o, i) + said)
        if level and not self.plane:
            yield ".DELTA OFF"

    def _bends(self, o: ZenithAngles) -> Array:
        """Coefficients (n,) that bend sights over STAR*NET's Earth as the network does."""
        radius = self.network.site.curvature_radius
        if self.grid is not None:
            own: Array = o.refraction * self.read_radius / (radius or MEAN_RADIUS)
            return own / REFRACTION_PER_UNIT
        straight = np.zeros(len(o)) if radius is None else (1 - o.refraction) / radius
        out: Array = (1 - straight * self.read_radius) / REFRACTION_PER_UNIT
        return out

    def _heights_over(self, o: Observations, i: int) -> list[str]:
        """The word for heights of instrument and target, which are nothing in a flat plan."""
        heights = [float(getattr(o, name)[i]) for name in _HEIGHTS]
        plain = self.grid is None and not isinstance(o, ZenithAngles | SlopeDistances)
        return [] if plain or not any(heights) else ["/".join(map(repr, heights))]

    def _convergences(self, o: Azimuths) -> Array:
        """Azimuth less grid bearing (n,) [rad] as coordinates tell it, zero in a local job."""
        out = np.zeros(len(o))
        if self.grid is None:
            return out
        for i in range(len(o)):
            ends = self.x[[o.start[i], o.end[i]]]
            if np.isfinite(ends).all():
                u = self.network.site.axes(ends[:1])[0] @ (ends[1] - ends[0])
                plan = np.diff(self.grid.from_work(ends), axis=0)[0]
                out[i] = np.arctan2(u[0], u[1]) - np.arctan2(plan[0], plan[1])
            elif np.isfinite(ends).any():
                raise InputError(
                    f"{self.names[o.start[i]]} or {self.names[o.end[i]]} has no coordinates, and "
                    "the bearing of the line is not known without",
                    record=str(o.source[i]),
                    cure="give approximate coordinates",
                )
        return out

    def _vectors(self, o: GnssBaselines, table: int) -> Iterator[str]:
        """Vectors with their covariances, geocentric."""
        assert isinstance(self.network.site, EllipsoidSite)
        turn = self.network.site.w_from_ecef
        above: tuple[float, float] = (0.0, 0.0)
        rows = self._alone(o, table, self.sieve.rows(o, ("height_start", "height_end")))
        self.written += len(rows)
        for i in rows.tolist():
            heights = float(o.height_start[i]), float(o.height_end[i])
            if heights != above:
                above = heights
                yield f".GPS ADDHIHT {above[0]!r} {above[1]!r}"
            c = turn.T @ self.correlations.matrix([(table, i, row) for row in range(3)]) @ turn
            x, y, z = (repr(float(v)) for v in o.values[i] @ turn)
            yield f"G1 {self._line(o.start[i], o.end[i])} {x} {y} {z}"
            yield "G2 " + " ".join(repr(float(c[k, k])) for k in range(3))
            yield "G3 " + " ".join(repr(float(c[j, k])) for j, k in ((0, 1), (0, 2), (1, 2)))

    def _weigh(self, o: Observations, table: int | None) -> None:
        """Given coordinates become marks behind the coordinates of their points."""
        held = ("antenna_height",) if isinstance(o, GnssPositions) and self.grid is None else ()
        rows = self.sieve.rows(o, held)
        if table is not None:
            rows = self._alone(o, table, rows)
        for i in rows.tolist():
            point = int(o.position[i])  # type: ignore[attr-defined]
            axes, place, by_x = self._told(o, i, point)
            if table is None:
                covariance = np.zeros((len(axes), len(axes)))
            else:
                own = self.correlations.matrix([(table, i, row) for row in range(len(o.units))])
                covariance = by_x @ own @ by_x.T
            size = np.sqrt(np.diag(covariance))
            mixed = np.abs(covariance - np.diag(size**2)) > 1e-9 * np.outer(size, size)
            if not axes:
                self.sieve.refuse(o, 1, "along another direction than easting, northing, height")
            elif mixed.any():
                self.sieve.refuse(o, 1, "with correlated coordinates")
            elif any(self.marks[point][axis] != "*" for axis in axes):
                self.sieve.refuse(o, 1, "of a coordinate that is given already")
            else:
                self.written += table is not None
                self.x[point] = place
                for axis, sigma in zip(axes, size, strict=True):
                    self.marks[point][axis] = "!" if table is None else repr(float(sigma))

    def _told(self, o: Observations, i: int, point: int) -> tuple[tuple[int, ...], Array, Array]:
        """Axes E, N, height that a given value tells, the place (3,) with it, and how it enters.

        The last is the derivative (axes, rows) of the file's coordinates by the values; axes are
        empty where they are none of the file's.
        """
        values, place = o.values[i], self.x[point].copy()
        if isinstance(o, Coordinates | GnssPositions):
            place = values.copy()
            if isinstance(o, GnssPositions):
                place[2] -= o.antenna_height[i]
            return (0, 1, 2), place, np.eye(3) if self.grid is None else self._gradients(place)
        if isinstance(o, Coordinate):
            axis = int(o.axis[i])
            place[axis] = values[0]
            return ((axis,) if self.grid is None else ()), place, np.eye(1)
        if isinstance(o, Heights):
            at = place if np.isfinite(place).all() else np.zeros(3)
            up = self.network.site.axes(at[None])[0, 2]
            if self.grid is None:
                place[2] = values[0]
            else:
                place += up * (values[0] - self.network.site.height(at[None])[0])
            return (2,), place, np.eye(1)
        assert isinstance(o, DirectedComponents)
        direction, axes = o.direction[i], ()
        gradients = np.eye(3)[:2] if self.grid is None else self._gradients(place)[:2]
        for axis, gradient in enumerate(gradients):
            if direction @ gradient > (1 - _SAME) * np.linalg.norm(gradient):
                axes = (axis,)  # type: ignore[assignment]
        return axes, place + direction * (values[0] - direction @ place), np.eye(1)

    def _gradients(self, place: Array) -> Array:
        """Derivative (3, 3) of E, N and height by the work frame at a place (3,)."""
        assert self.network.reference.grid is not None
        return self.network.reference.grid.jacobian(place)

    def _line(self, *ends: int) -> str:
        """Names of a line with the separator between them."""
        return self.separator.join(self.names[end] for end in ends)


def _grid(network: Network) -> ProjectedGrid:
    """The projection of the network."""
    frame = network.reference.grid
    grid = None if frame is None else frame.work.grid
    if grid is None or grid.site != network.site or grid.geographic is not None:
        raise InputError(
            "a job of STAR*NET on the ellipsoid is computed in a grid, and this network is in none",
            cure="give the site of the project a crs, or export it to dynaml",
        )
    return grid


def _project(grid: ProjectedGrid) -> str:
    """The project file of a job in a grid, with what decides about results."""
    settings = {
        "adjustment_type": "3D",
        "linear_units": "Meters",
        "angle_output_units": "DMS",
        "local_or_grid_adjustment": "1",
        "coordinate_system_name": name_of_grid(grid.crs),
        "project_elevation": "0.0",
        "geoid_height": "0.0",
        "vert_defl_north": "0.0",
        "vert_defl_east": "0.0",
        "coordinate_order": "NE",
        "angle_station_order": "At-From-To",
        "3D_input_mode": "Slope/Zenith",
        "index_of_refraction": "0.07",
        "geoid_modeling": "0",
        "vert_defl_modeling": "0",
        "gps_factor": "0",
        "gps_centering": "0",
        "gps_transformations": "0",
    }
    lines = [f"{key:<30} {value}" for key, value in settings.items()]
    return "\n".join(["[Adjustment]", *lines, "[DataFileList]", '1 "{name}"', ""])


def _separator(names: Sequence[str]) -> str:
    """A character that no name has; names are words."""
    for name in names:
        if not _NAME.match(name):
            raise InputError(
                f"{name!r} is no name for STAR*NET", cure="give names without blanks, # and quotes"
            )
    whole = "".join(names)
    free = [character for character in _SEPARATORS if character not in whole]
    if not free:
        raise InputError(
            f"names have all of the characters {_SEPARATORS}, and one must stand between names",
            cure="rename points",
        )
    return free[0]


def _angle(value: float) -> str:
    """An angle [rad] in degrees, minutes and seconds."""
    degrees, minutes, seconds = packed_seconds(float(value % (2 * np.pi)), 10)
    return f"{degrees}-{minutes:02d}-{seconds[:2]}.{seconds[2:]}"
