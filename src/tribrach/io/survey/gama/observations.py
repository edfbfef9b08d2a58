"""The observations of a GNU Gama file and their standard deviations.

Set-ups (``<obs>``), height differences, observed coordinates and vectors; each list may have a
covariance matrix of its own. Observations that need a coordinate which is not part of the network
are kept but switched off, with the reason.

A standard deviation is the observation's own ``stdev``, a default of its section, or in the
covariance matrix of its cluster (upper band by rows). The file has mm and cc, or arc seconds where
the angle is in degrees; here they are metres and radians.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.survey.gama.axes import Axes
from tribrach.io.survey.gama.element import NAMESPACE, Element, checked
from tribrach.network.survey import Survey
from tribrach.network.survey_rows import Row, SurveyRows
from tribrach.observations.base import Observations, Use
from tribrach.observations.control import Coordinate
from tribrach.observations.gnss import GnssBaselines
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import (
    Angles,
    Azimuths,
    Directions,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.units import CC, GON, MM, beyond_circle

Needs = tuple[bool, bool, bool]

#: kind of each element of a set-up, and which of E, N, U it needs at both ends
SIGHTS: dict[str, tuple[type[Observations], Needs]] = {
    "direction": (Directions, (True, True, False)),
    "distance": (HorizontalDistances, (True, True, False)),
    "angle": (Angles, (True, True, False)),
    "azimuth": (Azimuths, (True, True, False)),
    "s-distance": (SlopeDistances, (True, True, True)),
    "z-angle": (ZenithAngles, (True, True, True)),
}
#: names of elements as files have them, those of older ones without the namespace
_SPACES = ("", NAMESPACE)
_POINTS = frozenset(space + "point" for space in _SPACES)
_SETUPS = frozenset(space + "obs" for space in _SPACES)
#: sights that become rows without an object for each where they have nothing special
_PLAIN_SIGHTS: dict[str, type[Observations]] = {
    space + name: SIGHTS[name][0]
    for space in _SPACES
    for name in ("direction", "distance", "s-distance", "z-angle")
}
#: their columns, and those of directions, in the order of other sights
_PLAIN_COLUMNS = ("start", "end", "height_instrument", "height_target", "use", "reason")
_DIRECTION_COLUMNS = (*_PLAIN_COLUMNS[:4], "orientation", *_PLAIN_COLUMNS[4:])
#: their attributes as most files have them, in any order
_PLAIN = frozenset(("to", "val", "stdev", "from_dh", "to_dh"))
#: and those of their set-ups
_PLAIN_SETUP = frozenset(("from", "from_dh"))
_ACTIVE = int(Use.ACTIVE)
#: numbers of theirs above this are looked at
_USUAL = 1e6
_TURN = 2 * np.pi
#: attributes of a section with the default standard deviations of its angles
_DEFAULTS = {
    "direction": "direction-stdev",
    "angle": "angle-stdev",
    "azimuth": "azimuth-stdev",
    "z-angle": "zenith-angle-stdev",
}

#: no accuracy of distances grows with a higher power of them
STEEPEST = 5.0


def distance_sigma(section: Element, metres: float) -> float | None:
    """Default ``a + b D^c`` [mm] of a distance, D in km, b 0 and c 1 if not given; else None."""
    if not section.has("distance-stdev"):
        return None
    words = section.text("distance-stdev").split()
    if len(words) > 3:
        raise section.error("distance-stdev has more than three numbers", "give a, b and c")
    numbers = [section.as_number("distance-stdev", word) for word in words]
    a, b, c = (*numbers, *(0.0, 0.0, 1.0)[len(numbers) :])
    if abs(c) > STEEPEST:
        raise section.error(f"the exponent of distance-stdev is {c:g}", "give a, b and c")
    return float(a + b * (metres / 1000) ** c)


def observation_sigma(element: Element, section: Element) -> float:
    """Standard deviation of a sight as written (mm, cc or arc seconds)."""
    default = None
    if element.tag in _DEFAULTS and section.has(_DEFAULTS[element.tag]):
        default = section.number(_DEFAULTS[element.tag])
    elif element.tag in ("distance", "s-distance"):
        default = distance_sigma(section, element.number("val"))
    if default is None and not element.has("stdev"):
        raise element.error(f"<{element.tag}> has no standard deviation", "add stdev")
    return element.positive("stdev", default)


@dataclass
class GamaCluster:
    """Observations of one ``<obs>`` or list, which share a covariance matrix if there is one."""

    element: Element  #: the ``<obs>`` or list
    #: of each value: that of its observation among the rows, and which of its values it is
    number: list[int] = field(default_factory=list)
    row: list[int] = field(default_factory=list)
    #: of each standard deviation [m or rad], negative where the file's axis or angle runs against
    #: ours
    unit: list[float] = field(default_factory=list)
    #: false for each value of an observation that is left out
    kept: list[bool] = field(default_factory=list)

    @cached_property
    def matrix_element(self) -> Element | None:
        """The cluster's ``<cov-mat>``, None without one."""
        matrices = list(self.element.node.iterchildren("{*}cov-mat"))
        if len(matrices) > 1:
            raise self.element.child(matrices[1]).error("a second covariance matrix", "keep one")
        return self.element.child(matrices[0]) if matrices else None

    def check(self) -> None:
        """Refuse a second covariance matrix before any of the observations."""
        _ = self.matrix_element

    def take(self, number: int, rows: int, unit: float) -> None:
        """Note the values of one observation."""
        self.number += [number] * rows
        self.row += list(range(rows))
        self.unit += [unit] * rows
        self.kept += [True] * rows

    def leave_out(self, rows: int, unit: float) -> None:
        """Note that the values of one observation are left out."""
        self.unit += [unit] * rows
        self.kept += [False] * rows

    def covariance(self, element: Element) -> NDArray[np.float64]:
        """Covariance matrix (k, k) [m^2, rad^2] of the values in the file's axes."""
        unit = np.array(self.unit)
        return band_matrix(element, len(unit)) * np.outer(unit, unit)


def band_matrix(element: Element, size: int) -> NDArray[np.float64]:
    """Symmetric matrix (size, size) of a ``<cov-mat dim band>``."""
    dim, band = _whole(element, "dim"), _whole(element, "band")
    if dim != size:
        raise element.error(
            f"the covariance matrix has dimension {dim} for {size} values", "correct dim"
        )
    numbers = [element.as_number("an element", w) for w in (element.node.text or "").split()]
    upper = [(i, j) for i in range(dim) for j in range(i, min(i + band, dim - 1) + 1)]
    if len(numbers) != len(upper):
        raise element.error(
            f"the covariance matrix has {len(numbers)} elements instead of {len(upper)}",
            "give the upper band by rows",
        )
    matrix = np.zeros((dim, dim))
    row, column = np.array(upper, dtype=int).reshape(-1, 2).T
    matrix[row, column] = matrix[column, row] = numbers
    return matrix


def _points(columns: dict[str, Any]) -> list[str]:
    """Names of the points of one observation."""
    keys = ("start", "end", "foresight", "position")
    return [columns[key] for key in keys if key in columns]


def _circle(station: str, source: str) -> str:
    """Name of the orientation unknown of a set-up."""
    return f"orientation {station} ({source})"


def _whole(element: Element, name: str) -> int:
    value = element.number(name)
    if value != int(value) or value < 0:
        raise element.error(f"{name} is {value:g}", "give a whole number")
    return int(value)


_Sight = tuple[type[Observations], Row]


class _PlainSights:
    """Sights that have nothing special, which are most of a large file.

    They are judged by their numbers alone and become rows without an object for each; what is
    special in any way, a mistake among it, is left to :class:`ObservationReader`.
    """

    def __init__(self, reader: ObservationReader, section: Element) -> None:
        self._whole, self._hand, self._file = reader.whole, reader.hand, section.file
        self._rows = reader.rows
        #: rows of each kind, from its first on
        self._of: dict[type[Observations], list[Row]] = {}
        # where it is a number: all others are special
        self._default = {
            tag: section.node.get(_DEFAULTS.get(tag.rpartition("}")[2], "distance-stdev"), "")
            for tag in _PLAIN_SIGHTS
        }

    def setup(self, node: Any) -> bool:
        """Take a set-up of nothing but plain sights; False for any other, untouched."""
        if not _PLAIN_SETUP.issuperset(node.keys()):
            return False
        station = node.get("from", "").strip()
        try:
            height = float(node.get("from_dh", 0.0))
        except ValueError:
            return False
        if station not in self._whole or not abs(height) < _USUAL:
            return False
        circle = _circle(station, f"{self._file}:{node.sourceline}")
        sights = []
        for child in node:
            sight = self.sight(child, station, height, circle)
            if sight is None:
                return False
            sights.append(sight)
        for sight in sights:
            self.take(sight)
        return True

    def sight(self, node: Any, station: str, height: float, circle: str) -> _Sight | None:
        """A sight from a station with this height and circle, None if it is special."""
        kind = _PLAIN_SIGHTS.get(node.tag)
        if kind is None:
            return None
        given = dict(node.items())
        if not _PLAIN.issuperset(given):
            return None
        try:
            end = given["to"].strip()
            value = float(given["val"])
            sigma = float(given["stdev"] if "stdev" in given else self._default[node.tag])
            own, other = float(given.get("from_dh", height)), float(given.get("to_dh", 0.0))
        except (KeyError, ValueError):
            return None
        # NaN is not below anything
        small = max(abs(value), sigma, abs(own), abs(other)) < _USUAL and sigma > 0 and value > 0
        if not small or end == station or end not in self._whole:
            return None
        source = f"{self._file}:{node.sourceline}"
        if kind is Directions:
            value *= GON
            if value > _TURN:
                return None
            columns = (station, end, own, other, circle, _ACTIVE, "")
            return kind, (self._hand * value % _TURN, sigma * CC, source, columns)
        unit = MM
        if kind is ZenithAngles:
            value, unit = value * GON, CC
            if value >= np.pi:
                return None
        return kind, (value, sigma * unit, source, (station, end, own, other, _ACTIVE, ""))

    def take(self, sight: _Sight) -> None:
        """Give a sight to the survey."""
        kind, row = sight
        if kind not in self._of:
            names = _DIRECTION_COLUMNS if kind is Directions else _PLAIN_COLUMNS
            self._of[kind] = self._rows.table(kind, names)
        self._of[kind].append(row)


class ObservationReader:
    """Adds the observations of the sections to a survey.

    ``hand``: 1 if the file's angles are clockwise, -1 if counter-clockwise; ``used``: which of E,
    N, U (3,) of each point are part of the network.
    """

    def __init__(
        self, survey: Survey, axes: Axes, hand: float, used: dict[str, NDArray[np.bool_]]
    ) -> None:
        self.survey, self.axes, self.hand, self.used = survey, axes, hand, used
        self.rows = SurveyRows(survey)
        #: clusters with their matrices, which are given to the survey behind the observations
        self._matrices: list[tuple[GamaCluster, Element, NDArray[np.float64]]] = []
        #: points whose coordinates are all part of the network
        self.whole = {name for name, own in used.items() if own.all()}
        #: sources of the observations that are off
        self.off: list[str] = []
        #: sources of the observations that are left out, by the point that is not defined
        self.undefined: dict[str, list[str]] = {}
        #: sources of the zenith angles of face two, which are taken from the full circle
        self.face_two: list[str] = []
        #: whether observed coordinates tie the network to a frame
        self.controls = False

    def section(self, section: Element) -> None:
        """Read a ``<points-observations>`` with default sigmas; refuse what is wrong in it."""
        readers: dict[str, Callable[[Element, GamaCluster], None]] = {
            "obs": lambda child, cluster: self._obs(child, cluster, section, plain),
            "height-differences": self._height_differences,
            "coordinates": self._coordinates,
            "vectors": self._vectors,
        }
        plain = _PlainSights(self, section)
        for node in section.node:
            if node.tag in _POINTS or (node.tag in _SETUPS and plain.setup(node)):
                continue
            child = section.allowed(node, ("point", *readers))
            if child is None or child.tag == "point":
                continue
            before = child.refused.count
            with child.refused.record():
                cluster = GamaCluster(child)
                cluster.check()
                readers[child.tag](child, cluster)
                # a matrix fits all values of its cluster
                if child.refused.count == before:
                    self._correlate(cluster)

    def _obs(
        self, element: Element, cluster: GamaCluster, section: Element, plain: _PlainSights
    ) -> None:
        """One set-up: its directions share an orientation unknown."""
        station = element.text("from", "")
        height = element.number("from_dh", 0.0)
        if element.has("orientation"):
            element.angle("orientation")  # start values are found, but it must be an angle
        circle = _circle(station, element.source)
        own = cluster.matrix_element is None and station in self.whole
        for node in element.node:
            sight = plain.sight(node, station, height, circle) if own else None
            if sight is not None:
                plain.take(sight)
                continue
            child = element.allowed(node, (*SIGHTS, "dh", "cov-mat"))
            if child is None or child.tag == "cov-mat":
                continue
            with child.refused.record():
                start = child.text("from", station)
                if not start:
                    raise child.error(f"<{child.tag}> has no station", "give from")
                if child.tag == "dh":
                    self._dh(child, start, cluster, by_length=False)
                else:
                    self._sight(child, start, height, circle, cluster, section)

    def _sight(
        self,
        element: Element,
        start: str,
        height: float,
        circle: str,
        cluster: GamaCluster,
        section: Element,
    ) -> None:
        """One observation of a set-up."""
        kind, needs = SIGHTS[element.tag]
        columns: dict[str, Any] = self._ends(element, start)
        columns["height_instrument"] = element.number("from_dh", height)
        columns["height_target"] = element.number("to_dh", 0.0)
        for name in ("bs_dh", "fs_dh"):
            element.number(name, 0.0)  # heights do not enter horizontal angles
        if kind is Directions:
            columns["orientation"] = circle
        value, unit = self._value(element)
        own = cluster.matrix_element is None
        sigma = observation_sigma(element, section) * abs(unit) if own else 1.0
        self._add(kind, element, value, sigma, cluster, unit, needs, columns)

    def _value(self, element: Element) -> tuple[float, float]:
        """Value [m, rad] and the signed unit of its standard deviation [m, rad]."""
        if element.tag in ("distance", "s-distance"):
            return element.positive("val"), MM
        value, unit = element.angle("val")
        if element.tag == "z-angle":
            if not 0 < value < 2 * np.pi or abs(value - np.pi) < 1e-12:
                raise element.error("the zenith angle is not between 0 and 400 gon, or is 200 gon")
            if value > np.pi:
                self.face_two.append(element.source)
                return 2 * np.pi - value, -unit
            return value, unit
        # more than a circle is judged where all angles are
        turned = self.hand * value
        inside = not beyond_circle(value)
        return float(np.remainder(turned, 2 * np.pi)) if inside else turned, self.hand * unit

    def _ends(self, element: Element, start: str) -> dict[str, Any]:
        """Start and end, or backsight and foresight of an angle."""
        if element.tag == "angle":
            names = {"start": start, "end": element.text("bs"), "foresight": element.text("fs")}
        else:
            names = {"start": start, "end": element.text("to")}
        if len(set(names.values())) != len(names):
            raise element.error(f"<{element.tag}> has the same point at two ends")
        return names

    def _height_differences(self, element: Element, cluster: GamaCluster) -> None:
        for child in element.children(("dh", "cov-mat")):
            if child.tag == "dh":
                with child.refused.record():
                    self._dh(child, child.text("from"), cluster, by_length=True)

    def _dh(self, element: Element, start: str, cluster: GamaCluster, *, by_length: bool) -> None:
        """A height difference; outside set-ups its sigma may be ``sigma-apr sqrt(km)``."""
        sigma = MM
        if cluster.matrix_element is None:
            default = None
            if by_length and element.has("dist"):
                default = self.survey.sigma0 * float(np.sqrt(element.positive("dist")))
            if default is None and not element.has("stdev"):
                raise element.error("<dh> has no standard deviation", "add stdev")
            sigma *= element.positive("stdev", default)
        value = element.number("val")
        needs = (False, False, True)
        ends = self._ends(element, start)
        self._add(HeightDifferences, element, value, sigma, cluster, MM, needs, ends)

    def _coordinates(self, element: Element, cluster: GamaCluster) -> None:
        """Observed coordinates, which have a covariance matrix."""
        for child in element.children(("point", "cov-mat")):
            if child.tag == "point":
                with child.refused.record():
                    self._coordinate(child, cluster)

    def _coordinate(self, element: Element, cluster: GamaCluster) -> None:
        """The observed coordinates of one point."""
        name = element.text("id")
        if not any(element.has(axis) for axis in "xyz"):
            raise element.error(f"point {name} has no coordinates here", "give x and y, or z")
        for column, axis in zip(self.axes.matrix().T, "xyz", strict=True):
            if element.has(axis):
                to = int(np.argmax(np.abs(column)))
                value = element.number(axis) * float(column[to])
                columns = {"position": name, "axis": to}
                needs = (to == 0, to == 1, to == 2)
                unit = float(column[to]) * MM
                self._add(Coordinate, element, value, 1.0, cluster, unit, needs, columns)

    def _vectors(self, element: Element, cluster: GamaCluster) -> None:
        """Coordinate differences, which have a covariance matrix."""
        for child in element.children(("vec", "cov-mat")):
            if child.tag == "vec":
                with child.refused.record():
                    self._vector(child, cluster)

    def _vector(self, element: Element, cluster: GamaCluster) -> None:
        """One vector."""
        columns: dict[str, Any] = self._ends(element, element.text("from"))
        columns["height_start"] = element.number("from_dh", 0.0)
        columns["height_end"] = element.number("to_dh", 0.0)
        vector = np.array([element.number(name) for name in ("dx", "dy", "dz")])
        values = self.axes.matrix() @ vector
        needs = (True, True, True)
        self._add(GnssBaselines, element, values, 1.0, cluster, MM, needs, columns)

    def _add(
        self,
        kind: type[Observations],
        element: Element,
        value: Any,
        sigma: float,
        cluster: GamaCluster,
        unit: float,
        needs: Needs,
        columns: dict[str, Any],
    ) -> None:
        """Add one observation; it is off if the network lacks a coordinate that it needs.

        One that names a point which is not defined is left out, as gama-local does.
        """
        for name in _points(columns):
            if name not in self.used:
                lines = self.undefined.setdefault(name, [])
                lines += [element.source] if element.source not in lines[-1:] else []
                cluster.leave_out(len(kind.units), unit)
                return
        reason = self._unusable(columns, needs)
        if reason:
            self.off.append(element.source)
        elif kind is Coordinate:
            self.controls = True
        use = Use.OFF if reason else Use.ACTIVE
        columns = columns | {"use": int(use), "reason": reason}
        number = self.rows.add(kind, value, sigma, element.source, columns)
        cluster.take(number, len(kind.units), unit)

    def _unusable(self, columns: dict[str, Any], needs: Needs) -> str:
        """Why an observation cannot be used; empty if it can."""
        for name in _points(columns):
            missing = np.array(needs) & ~self.used[name]
            if missing.any():
                what = "the height" if not missing[:2].any() else "the position"
                return f"{what} of {name} is neither fixed nor adjusted"
        return ""

    def finish(self, refused: RefusalCollector, path: Path) -> None:
        """Give all observations to the survey, and the clusters their matrices."""

        def refuse(source: str, error: InputError) -> None:
            line = int(source.rpartition(":")[2])
            refused.add(InputError(error.what, file=path, line=line, cure=error.cure))

        self.rows.settle(refuse)
        for cluster, element, matrix in self._matrices:
            places = self.rows.places(cluster.number)
            if places is None:
                continue
            table, item = np.array(places, dtype=int).T
            correlate = partial(
                self.survey.correlate, table, item, cluster.row, matrix, element.source
            )
            with refused.record():
                checked(element, correlate)

    def _correlate(self, cluster: GamaCluster) -> None:
        """Read the covariance matrix of the cluster."""
        element = cluster.matrix_element
        if element is None:
            if cluster.element.tag in ("coordinates", "vectors") and cluster.kept:
                raise cluster.element.error(
                    f"<{cluster.element.tag}> has no covariance matrix", "add <cov-mat>"
                )
            return
        matrix = cluster.covariance(element)
        if cluster.element.tag == "vectors":
            turn = np.kron(np.eye(len(matrix) // 3), self.axes.matrix())
            matrix = turn @ matrix @ turn.T
        kept = np.flatnonzero(cluster.kept)
        if len(kept) == 0:
            return
        self._matrices.append((cluster, element, matrix[np.ix_(kept, kept)]))
