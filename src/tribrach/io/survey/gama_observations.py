"""The observations of a GNU Gama file, as far as they fit the points' coordinates.

Set-ups (``<obs>``), height differences, observed coordinates and vectors; each list may have a
covariance matrix of its own. Observations that need a coordinate which is not part of the network
are kept but switched off, with the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.io.survey.gama_axes import Axes
from tribrach.io.survey.gama_element import Element, checked
from tribrach.io.survey.gama_stochastic import Cluster, observation_sigma
from tribrach.network.observations.angle import Angles
from tribrach.network.observations.azimuth import Azimuths
from tribrach.network.observations.base import Observations, Use
from tribrach.network.observations.coordinates import Coordinate
from tribrach.network.observations.direction import Directions
from tribrach.network.observations.gnss_baseline import GnssBaselines
from tribrach.network.observations.height_difference import HeightDifferences
from tribrach.network.observations.horizontal_distance import HorizontalDistances
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.observations.zenith import ZenithAngles
from tribrach.network.survey import Survey
from tribrach.units import MM

__all__ = ["ObservationReader"]

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


class ObservationReader:
    """Adds the observations of the sections to a survey.

    Parameters
    ----------
    survey : its points and sigma0 are there already.
    hand : 1 if the file's angles are clockwise, -1 if counter-clockwise.
    used : (3,) E, N, U of each point that are part of the network.
    """

    def __init__(
        self, survey: Survey, axes: Axes, hand: float, used: dict[str, NDArray[np.bool_]]
    ) -> None:
        self.survey, self.axes, self.hand, self.used = survey, axes, hand, used
        #: sources of the observations that are off
        self.off: list[str] = []
        #: whether observed coordinates tie the network to a frame
        self.controls = False

    def section(self, section: Element) -> None:
        """Read a ``<points-observations>`` with its default standard deviations.

        Raises
        ------
        InputError : with file and line.
        """
        readers: dict[str, Callable[[Element, Cluster], None]] = {
            "obs": lambda child, cluster: self._obs(child, cluster, section),
            "height-differences": self._height_differences,
            "coordinates": self._coordinates,
            "vectors": self._vectors,
        }
        for child in section.children(("point", *readers)):
            if child.tag != "point":
                cluster = Cluster(child)
                readers[child.tag](child, cluster)
                self._correlate(cluster)

    def _obs(self, element: Element, cluster: Cluster, section: Element) -> None:
        """One set-up: its directions share an orientation unknown."""
        station = element.text("from", "")
        height = element.number("from_dh", 0.0)
        if element.has("orientation"):
            element.angle("orientation")  # start values are found, but it must be an angle
        circle = f"orientation {station} ({element.source})"
        for child in element.children((*SIGHTS, "dh", "cov-mat")):
            if child.tag == "cov-mat":
                continue
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
        cluster: Cluster,
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
            columns["orientation"] = [circle]
        value, unit = self._value(element)
        own = cluster.matrix_element is None
        sigma = observation_sigma(element, section) * abs(unit) if own else 1.0
        self._add(kind, element, [value], sigma, cluster, unit, needs, columns)

    def _value(self, element: Element) -> tuple[float, float]:
        """Value [m, rad] and the signed unit of its standard deviation [m, rad]."""
        if element.tag in ("distance", "s-distance"):
            return element.positive("val"), MM
        value, unit = element.angle("val")
        if element.tag == "z-angle":
            if not 0 < value < np.pi:
                raise element.error("the zenith angle is not between 0 and 200 gon")
            return value, unit
        return float(np.remainder(self.hand * value, 2 * np.pi)), self.hand * unit

    def _ends(self, element: Element, start: str) -> dict[str, list[str]]:
        """Start and end, or backsight and foresight of an angle."""
        if element.tag == "angle":
            names = {"start": start, "end": element.text("bs"), "foresight": element.text("fs")}
        else:
            names = {"start": start, "end": element.text("to")}
        for name in names.values():
            self._known(element, name)
        if len(set(names.values())) != len(names):
            raise element.error(f"<{element.tag}> has the same point at two ends")
        return {key: [name] for key, name in names.items()}

    def _known(self, element: Element, name: str) -> None:
        if name not in self.used:
            raise element.error(
                f"<{element.tag}> names point {name}, which is not defined", "define the point"
            )

    def _height_differences(self, element: Element, cluster: Cluster) -> None:
        for child in element.children(("dh", "cov-mat")):
            if child.tag == "dh":
                self._dh(child, child.text("from"), cluster, by_length=True)

    def _dh(self, element: Element, start: str, cluster: Cluster, *, by_length: bool) -> None:
        """A height difference; its sigma may be ``sigma-apr sqrt(km)`` outside of set-ups."""
        sigma = MM
        if cluster.matrix_element is None:
            default = None
            if by_length and element.has("dist"):
                default = self.survey.sigma0 * float(np.sqrt(element.positive("dist")))
            if default is None and not element.has("stdev"):
                raise element.error("<dh> has no standard deviation", "add stdev")
            sigma *= element.positive("stdev", default)
        values = [element.number("val")]
        needs = (False, False, True)
        ends = self._ends(element, start)
        self._add(HeightDifferences, element, values, sigma, cluster, MM, needs, ends)

    def _coordinates(self, element: Element, cluster: Cluster) -> None:
        """Observed coordinates, which have a covariance matrix."""
        for child in element.children(("point", "cov-mat")):
            if child.tag == "cov-mat":
                continue
            name = child.text("id")
            self._known(child, name)
            if not any(child.has(axis) for axis in "xyz"):
                raise child.error(f"point {name} has no coordinates here", "give x and y, or z")
            for column, axis in zip(self.axes.matrix().T, "xyz", strict=True):
                if child.has(axis):
                    to = int(np.argmax(np.abs(column)))
                    values = [child.number(axis) * column[to]]
                    columns = {"position": [name], "axis": np.array([to])}
                    needs = (to == 0, to == 1, to == 2)
                    unit = float(column[to]) * MM
                    self._add(Coordinate, child, values, 1.0, cluster, unit, needs, columns)

    def _vectors(self, element: Element, cluster: Cluster) -> None:
        """Coordinate differences, which have a covariance matrix."""
        for child in element.children(("vec", "cov-mat")):
            if child.tag == "cov-mat":
                continue
            columns: dict[str, Any] = self._ends(child, child.text("from"))
            columns["height_start"] = child.number("from_dh", 0.0)
            columns["height_end"] = child.number("to_dh", 0.0)
            vector = np.array([child.number(name) for name in ("dx", "dy", "dz")])
            values = [self.axes.matrix() @ vector]
            needs = (True, True, True)
            self._add(GnssBaselines, child, values, 1.0, cluster, MM, needs, columns)

    def _add(
        self,
        kind: type[Observations],
        element: Element,
        values: list[Any],
        sigma: float,
        cluster: Cluster,
        unit: float,
        needs: Needs,
        columns: dict[str, Any],
    ) -> None:
        """Add one observation; off, with the reason, where the network lacks what it needs."""
        reason = self._unusable(columns, needs)
        if reason:
            columns = columns | {"use": [int(Use.OFF)], "reason": [reason]}
            self.off.append(element.source)
        elif kind is Coordinate:
            self.controls = True
        table = checked(
            element,
            lambda: self.survey.add(
                kind, values=values, sigma=sigma, source=[element.source], **columns
            ),
        )
        cluster.take(table, len(kind.units), unit)

    def _unusable(self, columns: dict[str, Any], needs: Needs) -> str:
        """Why an observation cannot be used; empty if it can."""
        for key in ("start", "end", "foresight", "position"):
            for name in columns.get(key, ()):
                missing = np.array(needs) & ~self.used[name]
                if missing.any():
                    what = "the height" if not missing[:2].any() else "the position"
                    return f"{what} of {name} is neither fixed nor adjusted"
        return ""

    def _correlate(self, cluster: Cluster) -> None:
        """Give the cluster its covariance matrix."""
        element = cluster.matrix_element
        if element is None:
            if cluster.element.tag in ("coordinates", "vectors") and cluster.table:
                raise cluster.element.error(
                    f"<{cluster.element.tag}> has no covariance matrix", "add <cov-mat>"
                )
            return
        matrix = cluster.covariance(element)
        if cluster.element.tag == "vectors":
            turn = np.kron(np.eye(len(matrix) // 3), self.axes.matrix())
            matrix = turn @ matrix @ turn.T
        item = np.zeros(len(matrix), dtype=int)
        checked(
            element,
            lambda: self.survey.correlate(cluster.table, item, cluster.row, matrix, element.source),
        )
