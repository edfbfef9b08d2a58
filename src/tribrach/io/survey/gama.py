"""GNU Gama local networks (``.gkf``): all observation kinds, covariance matrices and axes.

The file's x and y become E and N by the letters of ``axes-xy``; angles that run counter-clockwise
(``angles="right-handed"``) change sign. Angles are gon, or degrees written ``D-M-S``; standard
deviations are mm and cc (or arc seconds with degrees).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io import xml_file
from tribrach.network.network import Datum
from tribrach.network.observations.angle import Angles
from tribrach.network.observations.azimuth import Azimuths
from tribrach.network.observations.base import Observations
from tribrach.network.observations.coordinates import Coordinate
from tribrach.network.observations.direction import Directions
from tribrach.network.observations.gnss_baseline import GnssBaselines
from tribrach.network.observations.height_difference import HeightDifferences
from tribrach.network.observations.horizontal_distance import HorizontalDistances
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.observations.zenith import ZenithAngles
from tribrach.network.survey import Survey
from tribrach.units import CC, SEC, parse_angle

__all__ = ["Axes", "read"]

NAMESPACE = "{http://www.gnu.org/software/gama/gama-local}"
MM = 1e-3
AXES = ("ne", "sw", "es", "wn", "en", "nw", "se", "ws")


@dataclass(frozen=True)
class Axes:
    """The file's horizontal axes: ``x`` and ``y`` as unit vectors (E, N)."""

    letters: str = "ne"

    def matrix(self) -> NDArray[np.float64]:
        """(3, 3): E, N, U of the file's x, y, z."""
        direction = {"n": (0, 1), "s": (0, -1), "e": (1, 0), "w": (-1, 0)}
        out = np.eye(3)
        out[:2, :2] = np.array([direction[letter] for letter in self.letters]).T
        return out


@dataclass
class _Element:
    """An XML element with its attributes as typed values; every error names file and line."""

    node: Any
    path: Path

    @property
    def tag(self) -> str:
        return str(self.node.tag).removeprefix(NAMESPACE)

    @property
    def source(self) -> str:
        return f"{self.path.name}:{self.node.sourceline}"

    def error(self, what: str, cure: str | None = None) -> InputError:
        return InputError(what, file=self.path, line=self.node.sourceline, cure=cure)

    def children(self) -> Iterator[_Element]:
        for node in self.node:
            if isinstance(node.tag, str):
                yield _Element(node, self.path)

    def text(self, name: str, default: str | None = None) -> str:
        value = self.node.get(name, default)
        if value is None:
            raise self.error(f"<{self.tag}> has no attribute {name}", f"add {name}")
        return str(value).strip()

    def number(self, name: str, default: float | None = None) -> float:
        if name not in self.node.attrib and default is not None:
            return default
        return self._float(name, self.text(name))

    def _float(self, name: str, text: str) -> float:
        try:
            value = float(text)
        except ValueError as error:
            raise self.error(f"{name} of <{self.tag}> is not a number: {text!r}") from error
        if not np.isfinite(value):
            raise self.error(f"{name} of <{self.tag}> is not a finite number: {text}")
        return value

    def angle(self, name: str) -> tuple[float, float]:
        """Angle [rad] and the unit [rad] of its standard deviation."""
        text = self.text(name)
        sexagesimal = text.count("-") >= 2
        try:
            return parse_angle(text, "dms" if sexagesimal else "gon"), SEC if sexagesimal else CC
        except ValueError as error:
            raise self.error(f"{name} of <{self.tag}> is not an angle: {text!r}") from error


@dataclass
class _Defaults:
    """Standard deviations of the whole file, as written (mm, cc or arc seconds)."""

    element: _Element
    sigma_apriori: float

    def angle(self, tag: str) -> float | None:
        name = {"z-angle": "zenith-angle"}.get(tag, tag) + "-stdev"
        return self.element.number(name) if name in self.element.node.attrib else None

    def distance(self, metres: float) -> float | None:
        """``a + b D^c`` [mm], D in km."""
        if "distance-stdev" not in self.element.node.attrib:
            return None
        words = self.element.text("distance-stdev").split()
        parts = [self.element._float("distance-stdev", word) for word in words]
        a, b, c = (*parts, 0.0, 1.0)[:3] if len(parts) == 1 else (*parts, 1.0)[:3]
        return float(a + b * (metres / 1000) ** c)


@dataclass
class _Cluster:
    """Observations of one ``<obs>``: they share a covariance matrix if the file gives one."""

    element: _Element
    table: list[int] = field(default_factory=list)
    row: list[int] = field(default_factory=list)
    #: unit of each value's standard deviation, signed by the axes
    unit: list[float] = field(default_factory=list)

    def take(self, table: int, rows: int, unit: float) -> None:
        self.table += [table] * rows
        self.row += list(range(rows))
        self.unit += [unit] * rows


def read(path: Path) -> Survey:
    """The survey in a ``.gkf`` file.

    ``survey.info["axes"]`` keeps the file's :class:`Axes`, ``info["sigma_act"]`` which standard
    deviation the file wants its covariances scaled with.

    Raises
    ------
    InputError : the file, with its line, and what is wrong there.
    """
    path = Path(path)
    root = _Element(xml_file.load(path, NAMESPACE + "gama-local"), path)
    networks = [child for child in root.children() if child.tag == "network"]
    if len(networks) != 1:
        raise root.error("there must be one <network>")
    return _Reader(networks[0]).survey


class _Reader:
    """Walks the file once and fills the survey."""

    def __init__(self, network: _Element) -> None:
        axes = network.text("axes-xy", "ne").lower()
        if axes not in AXES:
            raise network.error(f"axes-xy is {axes!r}", f"use one of {', '.join(AXES)}")
        handed = network.text("angles", "left-handed")
        if handed not in ("left-handed", "right-handed"):
            raise network.error(f"angles is {handed!r}", "use left-handed or right-handed")
        self.world = Axes(axes).matrix()
        self.sign = 1.0 if handed == "left-handed" else -1.0
        self.survey = Survey()
        self.survey.info["axes"] = Axes(axes)
        self.survey.info["sigma_act"] = "aposteriori"
        self.sets = 0
        parts = {
            "description": self._description,
            "parameters": self._parameters,
            "points-observations": self._points_observations,
        }
        self.survey.sigma0 = 10.0
        for child in network.children():
            _dispatch(parts, child)(child)

    def _description(self, element: _Element) -> None:
        self.survey.info["title"] = " ".join((element.node.text or "").split())

    def _parameters(self, element: _Element) -> None:
        self.survey.sigma0 = element.number("sigma-apr", 10.0)
        if self.survey.sigma0 <= 0:
            raise element.error("sigma-apr is not above zero")
        act = element.text("sigma-act", "aposteriori")
        if act not in ("apriori", "aposteriori"):
            raise element.error(f"sigma-act is {act!r}", "use apriori or aposteriori")
        self.survey.info["sigma_act"] = act
        self.survey.info["confidence"] = element.number("conf-pr", 0.95)

    def _points_observations(self, element: _Element) -> None:
        self.defaults = _Defaults(element, self.survey.sigma0)
        parts = {
            "point": self._point,
            "obs": self._obs,
            "height-differences": self._height_differences,
            "coordinates": self._coordinates,
            "vectors": self._vectors,
        }
        children = list(element.children())
        for child in children:  # points may stand anywhere: they come first
            if child.tag == "point":
                self._point(child)
            if child.tag == "coordinates":
                self._points_with_observed_coordinates(child)
        for child in children:
            if child.tag != "point":
                _dispatch(parts, child)(child)
        self._choose_datum()

    def _point(self, element: _Element) -> None:
        name = element.text("id")
        fixed, adjusted = element.text("fix", ""), element.text("adj", "")
        if not set(fixed.lower() + adjusted.lower()) <= set("xyz"):
            raise element.error(f"point {name} has fix={fixed!r} adj={adjusted!r}", "use x, y, z")
        given = [element.number(axis, np.nan) for axis in "xyz"]
        used = [axis in (fixed + adjusted).lower() for axis in "xyz"]
        missing = [a for a, v in zip("xyz", given, strict=True) if a in fixed.lower() and v != v]
        if missing:
            raise element.error(f"point {name} is fixed without {missing[0]}", "give it")
        # an axis that the network does not use is held at zero
        xyz = np.where(used, given, 0.0)
        free = np.array([axis in adjusted.lower() for axis in "xyz"])
        datum = np.array([axis in adjusted for axis in "XYZ"])
        swap = np.abs(self.world) > 0.5
        known = ~np.isnan(xyz)
        enu = self.world @ np.where(known, xyz, 0.0)
        enu[~(swap @ known)] = np.nan
        self._checked(
            element,
            lambda: self.survey.point(
                name,
                enu,
                free=swap @ free,
                role="control" if fixed else "free",
                datum=swap @ datum if datum.any() else None,
                source=element.source,
            ),
        )

    def _points_with_observed_coordinates(self, element: _Element) -> None:
        """A point may be defined where its coordinates are observed."""
        for child in element.children():
            defines = "adj" in child.node.attrib or "fix" in child.node.attrib
            if child.tag == "point" and defines and child.text("id") not in self.survey.points:
                self._point(child)

    def _obs(self, element: _Element) -> None:
        self.sets += 1
        station = element.text("from", "")
        cluster = _Cluster(element)
        circle = f"orientation {station} ({element.source})"
        for child in element.children():
            if child.tag != "cov-mat":
                start = child.text("from", station)
                if not start:
                    raise child.error(f"<{child.tag}> has no station", "add from")
                self._sight(child, start, element.number("from_dh", 0.0), circle, cluster)
        self._covariance(cluster)

    def _sight(
        self, element: _Element, start: str, hi: float, circle: str, cluster: _Cluster
    ) -> None:
        """One observation of a set-up."""
        if element.tag == "dh":
            return self._dh(element, start, cluster)
        kinds: dict[str, type[Observations]] = {
            "direction": Directions,
            "angle": Angles,
            "azimuth": Azimuths,
            "z-angle": ZenithAngles,
            "distance": HorizontalDistances,
            "s-distance": SlopeDistances,
        }
        kind = _dispatch(kinds, element)
        ends = self._ends(element, start)
        columns: dict[str, Any] = {
            "height_instrument": element.number("from_dh", hi),
            "height_target": element.number("to_dh", 0.0),
        }
        if kind in (Directions, Angles, Azimuths, ZenithAngles):
            value, unit = element.angle("val")
            stdev = self._stdev(element, self.defaults.angle(element.tag), cluster)
            if kind in (Directions, Angles):
                value *= self.sign
        else:
            value, unit = element.number("val"), MM
            if value <= 0:
                raise element.error(f"<{element.tag}> is not above zero")
            stdev = self._stdev(element, self.defaults.distance(value), cluster)
        if kind is Directions:
            columns["orientation"] = [circle]
        sign = self.sign if kind in (Directions, Angles) else 1.0
        self._add(kind, element, [value], stdev * unit, cluster, sign * unit, **ends, **columns)
        return None

    def _ends(self, element: _Element, start: str) -> dict[str, list[str]]:
        """Start and end columns, or backsight and foresight of an angle."""
        if element.tag == "angle":
            names = {"start": start, "end": element.text("bs"), "foresight": element.text("fs")}
        else:
            names = {"start": start, "end": element.text("to")}
        for name in names.values():
            self._known(element, name)
        if len(set(names.values())) != len(names):
            raise element.error(f"<{element.tag}> has the same point at two ends")
        return {key: [name] for key, name in names.items()}

    def _known(self, element: _Element, name: str) -> None:
        if name not in self.survey.points:
            raise element.error(
                f"<{element.tag}> names point {name}, which is not defined", "define the point"
            )

    def _dh(self, element: _Element, start: str, cluster: _Cluster) -> None:
        default = None
        if "dist" in element.node.attrib:
            length = element.number("dist")
            if length <= 0:
                raise element.error("dist of <dh> is not above zero")
            default = self.defaults.sigma_apriori * float(np.sqrt(length))
        stdev = self._stdev(element, default, cluster)
        ends = self._ends(element, start)
        self._add(
            HeightDifferences, element, [element.number("val")], stdev * MM, cluster, MM, **ends
        )

    def _height_differences(self, element: _Element) -> None:
        cluster = _Cluster(element)
        for child in element.children():
            if child.tag == "dh":
                self._dh(child, child.text("from"), cluster)
            elif child.tag != "cov-mat":
                raise child.error(f"<{child.tag}> is unknown here")
        self._covariance(cluster)

    def _coordinates(self, element: _Element) -> None:
        """Observed coordinates with their covariance matrix."""
        cluster = _Cluster(element)
        for child in element.children():
            if child.tag == "cov-mat":
                continue
            if child.tag != "point":
                raise child.error(f"<{child.tag}> is unknown here")
            name = child.text("id")
            self._known(child, name)
            for k, axis in enumerate("xyz"):
                if axis in child.node.attrib:
                    column = self.world[:, k]
                    to = int(np.argmax(np.abs(column)))
                    self._add(
                        Coordinate,
                        child,
                        [child.number(axis) * column[to]],
                        1.0,
                        cluster,
                        float(column[to]) * MM,
                        position=[name],
                        axis=np.array([to]),
                    )
        self._covariance(cluster, needed=True)

    def _vectors(self, element: _Element) -> None:
        """Coordinate differences with their covariance matrix."""
        cluster = _Cluster(element)
        for child in element.children():
            if child.tag == "cov-mat":
                continue
            if child.tag != "vec":
                raise child.error(f"<{child.tag}> is unknown here")
            ends = self._ends(child, child.text("from"))
            vector = np.array([child.number(name) for name in ("dx", "dy", "dz")])
            heights = {
                "height_start": child.number("from_dh", 0.0),
                "height_end": child.number("to_dh", 0.0),
            }
            values = [self.world @ vector]
            self._add(GnssBaselines, child, values, 1.0, cluster, MM, **ends, **heights)
        self._covariance(cluster, needed=True)

    def _add(
        self,
        kind: type[Observations],
        element: _Element,
        values: list[Any],
        sigma: float,
        cluster: _Cluster,
        unit: float,
        **columns: Any,
    ) -> None:
        table = self._checked(
            element,
            lambda: self.survey.add(
                kind, values=values, sigma=sigma, source=[element.source], **columns
            ),
        )
        cluster.take(table, len(kind.units), unit)

    def _stdev(self, element: _Element, default: float | None, cluster: _Cluster) -> float:
        """Standard deviation as written; 1 where a covariance matrix will replace it."""
        if _cov_mat(cluster.element) is not None:
            return 1.0
        if "stdev" not in element.node.attrib and default is None:
            raise element.error(f"<{element.tag}> has no standard deviation", "add stdev")
        value = element.number("stdev", default)
        if value <= 0:
            raise element.error(f"stdev of <{element.tag}> is {value:g}", "give one above zero")
        return value

    def _covariance(self, cluster: _Cluster, *, needed: bool = False) -> None:
        """Give the cluster its covariance matrix (upper band by rows, mm and cc squared)."""
        element = _cov_mat(cluster.element)
        if element is None:
            if needed and cluster.table:
                raise cluster.element.error(
                    f"<{cluster.element.tag}> has no covariance matrix", "add <cov-mat>"
                )
            return
        matrix = _band_matrix(element, len(cluster.table))
        if cluster.element.tag == "vectors":
            turn = np.kron(np.eye(len(matrix) // 3), self.world)
            matrix = turn @ matrix @ turn.T
        unit = np.array(cluster.unit)
        item = np.zeros(len(unit), dtype=int)
        self._checked(
            element,
            lambda: self.survey.correlate(
                cluster.table, item, cluster.row, matrix * np.outer(unit, unit), element.source
            ),
        )

    @staticmethod
    def _checked(element: _Element, action: Callable[[], Any]) -> Any:
        """Run a survey call; its complaints gain the file and line."""
        try:
            return action()
        except InputError as error:
            raise element.error(error.what, error.cure) from error

    def _choose_datum(self) -> None:
        """Marked coordinates carry inner constraints; all of them if nothing is fixed."""
        points = self.survey.points.values()
        marked = any(p.datum is not None for p in points)
        held = any(p.role == "control" for p in points)
        if marked or not held:
            self.survey.datum = Datum("free")


def _dispatch(table: dict[str, Any], element: _Element) -> Any:
    if element.tag not in table:
        raise element.error(f"<{element.tag}> is unknown here", f"use {', '.join(table)}")
    return table[element.tag]


def _cov_mat(element: _Element) -> _Element | None:
    node = element.node.find(NAMESPACE + "cov-mat")
    return None if node is None else _Element(node, element.path)


def _band_matrix(element: _Element, size: int) -> NDArray[np.float64]:
    """Symmetric matrix of a ``<cov-mat dim band>``."""
    dim, band = int(element.number("dim")), int(element.number("band"))
    if dim != size:
        raise element.error(
            f"the covariance matrix has dimension {dim} for {size} values", "correct dim"
        )
    words = (element.node.text or "").split()
    numbers = [element._float("an element", word) for word in words]
    lengths = [min(band, dim - 1 - i) + 1 for i in range(dim)]
    if len(numbers) != sum(lengths):
        raise element.error(
            f"the covariance matrix has {len(numbers)} elements instead of {sum(lengths)}",
            "give the upper band by rows",
        )
    matrix = np.zeros((dim, dim))
    place = 0
    for i, length in enumerate(lengths):
        matrix[i, i : i + length] = numbers[place : place + length]
        place += length
    return matrix + np.triu(matrix, 1).T
