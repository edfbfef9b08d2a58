"""Writes networks as DynaML, stations and measurements in one file, for DynAdjust to adjust.

Stations are geocentric, in the network's own frame and epoch, and so are vectors and positions with
their covariances; terrestrial measurements refer to the ellipsoid's normal, as in the network.
DynAdjust models no refraction, and its directions have no heights; what has is named and not
written. A station that is held in latitude, longitude or height alone is written in these.
Format: DynaML.xsd of DynAdjust.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import date, timedelta
from typing import Any

import numpy as np
from lxml import etree
from pyproj import CRS
from pyproj.exceptions import ProjError

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geodesy import frames
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.survey.dynadjust.records import ARCSEC
from tribrach.io.survey.exported import Exported, Sieve, ValueCovariances, packed_seconds
from tribrach.network.network import Network
from tribrach.network.start.start_values import find_start
from tribrach.observations.base import Observations
from tribrach.observations.control import Coordinates, DirectedComponents, Heights
from tribrach.observations.ellipsoidal import (
    EllipsoidArcs,
    EllipsoidChords,
    Latitudes,
    Longitudes,
)
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import (
    Angles,
    Azimuths,
    Directions,
    Distances,
    SlopeDistances,
    ZenithAngles,
)

#: letters of measurements with two or three stations and heights, and the fields that are written
_SIGHTS: dict[type[Observations], tuple[str, tuple[str, ...]]] = {
    Angles: ("A", ()),
    Azimuths: ("B", ("convergence", "astronomic")),
    SlopeDistances: ("S", ("height_instrument", "height_target")),
    Distances: ("S", ()),
    ZenithAngles: ("V", ("height_instrument", "height_target")),
    EllipsoidChords: ("C", ()),
    EllipsoidArcs: ("E", ()),
}
#: letters of measurements at one station
_SINGLE: dict[type[Observations], str] = {Heights: "R", Latitudes: "P", Longitudes: "Q"}
#: how far a direction may be off the one that it is taken for
_SAME = 1e-9
_VARIANCE = (("XX", 0, 0), ("XY", 0, 1), ("XZ", 0, 2), ("YY", 1, 1), ("YZ", 1, 2), ("ZZ", 2, 2))


def write(network: Network) -> Exported:
    """The network as the text of a combined DynaML file."""
    writer, root = document(network)
    text = etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="UTF-8")
    return writer.exported(text.decode("utf-8"))


def document(network: Network) -> tuple[_Writer, etree._Element]:
    """The network as the root of a combined DynaML file, and who wrote it."""
    writer = _Writer(network)
    root = etree.Element(
        "DnaXmlFormat",
        {"type": "Combined File", "referenceframe": writer.frame, "epoch": writer.epoch},
    )
    measurements = list(writer.measurements())
    stations = list(writer.stations())
    if not measurements:
        raise InputError(
            "DynaML can hold none of the observations of this network",
            cure="; ".join(writer.sieve.sentences()) or "give a network with observations",
        )
    for element in (*stations, *measurements):
        root.append(element)
    return writer, root


class _Writer:
    """A network on its way into DynaML."""

    def __init__(self, network: Network) -> None:
        if not isinstance(network.site, EllipsoidSite):
            raise InputError(
                "DynaML has geocentric stations, and the site of this network is flat",
                cure="give the project a site with crs, or with latitude and longitude",
            )
        self.network, self.site = network, network.site
        self.frame, self.epoch = _frame(network), _date(network.reference.epoch)
        self.sieve, self.correlations = Sieve(network), ValueCovariances(network)
        state = network.start
        if np.isnan(state.points).any():
            state = find_start(network)
        self.x = state.points
        self.ecef = self.site.to_ecef(self.x)
        self.names = network.start.layout.names["point"]
        self.written = 0
        self.tied = False

    def exported(self, text: str) -> Exported:
        """A text of the network, with what it lacks."""
        return Exported(text, self.written, self.sieve.sentences(), self.sieve.notes())

    def stations(self) -> Iterator[etree._Element]:
        """Every station with what of it is held."""
        count = len(self.names)
        free = self.network.free[: 3 * count].reshape(-1, 3)
        letters = ["FFF" if row.all() else "CCC" for row in free]
        partly = [n for n, row in zip(self.names, free, strict=True) if row.any() != row.all()]
        if partly:
            self.sieve.lost["point", "held in one axis of the work frame alone"] += len(partly)
            letters = ["FFF" if row.any() else "CCC" for row in free]
        types, values = ["XYZ"] * count, [[repr(float(v)) for v in row] for row in self.ecef]
        for k, (kind, held) in self._held().items():
            letters[k], types[k] = held, kind
            if kind == "LLH":
                latitude, longitude, height = self.site.geodetic(self.x[k : k + 1])[0].tolist()
                values[k] = [_packed(latitude, 12), _packed(longitude, 12), repr(height)]
        self._say_datum(letters)
        for name, held, kind, value in zip(self.names, letters, types, values, strict=True):
            element = _element("DnaStation", Name=name, Constraints=held, Type=kind)
            place = _element("StationCoord", Name=name)
            for tag, text in zip(("XAxis", "YAxis", "Height"), value, strict=True):
                etree.SubElement(place, tag).text = text
            element.append(place)
            yield element

    def _held(self) -> dict[int, tuple[str, str]]:
        """Type and letters of stations that conditions hold in some components, by index."""
        held: dict[int, list[tuple[Array, float]]] = {}
        for constraint in self.network.constraints:
            o = constraint.observations
            if not isinstance(o, DirectedComponents):
                self.sieve.refuse_all(o, "DynaML has no such conditions")
                continue
            for i in self.sieve.rows(o):
                given = o.direction[i], float(o.values[i, 0])
                held.setdefault(int(o.position[i]), []).append(given)
        out = {}
        for k, components in held.items():
            found = self._letters(k, components)
            if found is None:
                what = "component", "along another direction than latitude, longitude and height"
                self.sieve.lost[what] += len(components)
            else:
                out[k] = found
        return out

    def _letters(self, k: int, held: Sequence[tuple[Array, float]]) -> tuple[str, str] | None:
        """Type and letters of a station, None if DynaML cannot hold it so."""
        east, north, up = self.site.axes(self.x[k : k + 1])[0]
        if any(abs(direction @ self.x[k] - value) > 1e-6 for direction, value in held):
            return None
        for kind, axes in (
            ("LLH", (north, east, up)),
            ("XYZ", tuple(self.site.w_from_ecef.T)),
        ):
            hits = [[abs(abs(d @ axis) - 1) < _SAME for axis in axes] for d, _ in held]
            if all(any(hit) for hit in hits):
                return kind, "".join(
                    "C" if any(column) else "F" for column in zip(*hits, strict=True)
                )
        return None

    def _say_datum(self, letters: Sequence[str]) -> None:
        """Name a datum that DynAdjust would not have."""
        datum = self.network.datum
        if datum.kind != "free":
            return
        some = datum.names or datum.components is not None
        if some or self.tied or any("C" in each for each in letters):
            what = "datum", "inner constraints over some points, or beside control"
            self.sieve.lost[what] += 1

    def measurements(self) -> Iterator[etree._Element]:
        """All measurements, GNSS first."""
        gnss: list[tuple[int, int]] = []
        rest: list[etree._Element] = []
        for table, o in enumerate(self.network.observations):
            if isinstance(o, GnssBaselines | GnssPositions | Coordinates):
                gnss += [(table, int(i)) for i in self.sieve.rows(o)]
            elif isinstance(o, Directions):
                rest += self._directions(table, o)
            elif type(o) in _SIGHTS:
                rest += self._sights(table, o)
            elif type(o) in _SINGLE:
                rest += self._single(table, o)
            elif type(o) is HeightDifferences:
                rest += self._height_differences(table, o)
            else:
                self.sieve.refuse_all(o, "DynaML has no such measurements")
        yield from self._clusters(gnss)
        yield from rest

    def _alone(self, table: int, o: Observations, rows: Index) -> Index:
        """Of observations (k,) those that no covariance ties to others."""
        group = self.correlations.group
        tied = np.array([group((table, int(i), 0)) is not None for i in rows], dtype=bool)
        self.sieve.refuse(o, int(tied.sum()), "correlated; DynaML correlates GNSS only")
        self.written += int((~tied).sum())
        alone: Index = rows[~tied]
        return alone

    def _sights(self, table: int, o: Observations) -> Iterator[etree._Element]:
        """Angles, azimuths, distances and zenith angles."""
        letter, held = _SIGHTS[type(o)]
        values = o.values[:, 0] + (o.convergence if isinstance(o, Azimuths) else 0.0)
        for i in self._alone(table, o, self.sieve.rows(o, held)):
            ends = [o.start[i], o.end[i]]  # type: ignore[attr-defined]
            if isinstance(o, Angles):
                ends.append(o.foresight[i])
            element = _element("DnaMeasurement", Type=letter, Ignore="")
            for tag, end in zip(("First", "Second", "Third"), ends, strict=False):
                etree.SubElement(element, tag).text = self.names[end]
            self._value(element, o, table, int(i), float(values[i]))
            if "height_instrument" in held:
                for tag, name in (("InstHeight", "instrument"), ("TargHeight", "target")):
                    height = float(getattr(o, f"height_{name}")[i])
                    etree.SubElement(element, tag).text = repr(height)
            yield element

    def _directions(self, table: int, o: Directions) -> Iterator[etree._Element]:
        """Sets of directions: the first of each stands in the measurement itself."""
        rows = self._alone(table, o, self.sieve.rows(o, ("orientation",)))
        for circle in dict.fromkeys(o.orientation[rows].tolist()):
            first, *others = rows[o.orientation[rows] == circle].tolist()
            names = self.names[o.start[first]], self.names[o.end[first]]
            element = _element(
                "DnaMeasurement", Type="D", Ignore="", First=names[0], Second=names[1]
            )
            self._value(element, o, table, first, float(o.values[first, 0]))
            etree.SubElement(element, "Total").text = str(len(others))
            for i in others:
                ray = _element("Directions", Ignore="", Target=self.names[o.end[i]])
                self._value(ray, o, table, i, float(o.values[i, 0]))
                element.append(ray)
            yield element

    def _single(self, table: int, o: Observations) -> Iterator[etree._Element]:
        """Ellipsoidal heights, geodetic latitudes and longitudes."""
        for i in self._alone(table, o, self.sieve.rows(o)):
            name = self.names[o.position[i]]  # type: ignore[attr-defined]
            element = _element("DnaMeasurement", Type=_SINGLE[type(o)], Ignore="", First=name)
            self._value(element, o, table, int(i), float(o.values[i, 0]), circle=False)
            yield element

    def _height_differences(self, table: int, o: HeightDifferences) -> Iterator[etree._Element]:
        """Height differences from mark to mark."""
        marks = o.values[:, 0] - o.height_end + o.height_start
        for i in self._alone(table, o, self.sieve.rows(o, ("height_start", "height_end"))):
            names = {"First": self.names[o.start[i]], "Second": self.names[o.end[i]]}
            element = _element("DnaMeasurement", Type="L", Ignore="", **names)
            self._value(element, o, table, int(i), float(marks[i]))
            yield element

    def _value(
        self,
        element: etree._Element,
        o: Observations,
        table: int,
        i: int,
        value: float,
        *,
        circle: bool = True,
    ) -> None:
        """Value and standard deviation, angles in degrees and arc seconds, within one circle."""
        sigma = float(np.sqrt(self.correlations.matrix([(table, i, 0)])[0, 0]))
        angular = o.units[0] == "rad"
        text = _packed(value % (2 * np.pi) if circle else value, 12) if angular else repr(value)
        etree.SubElement(element, "Value").text = text
        etree.SubElement(element, "StdDev").text = repr(sigma / ARCSEC if angular else sigma)

    def _clusters(self, members: Iterable[tuple[int, int]]) -> Iterator[etree._Element]:
        """Baselines and positions, those of one covariance together."""
        clusters: dict[Any, list[tuple[int, int]]] = {}
        for member in members:
            group = self.correlations.group((*member, 0))
            clusters.setdefault(member if group is None else group, []).append(member)
        for cluster in clusters.values():
            tables = [self.network.observations[table] for table, _ in cluster]
            points = [not isinstance(o, GnssBaselines) for o in tables]
            if any(points) != all(points):
                for o in tables:
                    self.sieve.refuse(o, 1, "baselines and positions are correlated")
                continue
            self.tied = self.tied or points[0]
            self.written += len(cluster)
            yield self._cluster(cluster, points[0])

    def _cluster(self, cluster: Sequence[tuple[int, int]], points: bool) -> etree._Element:
        """A measurement G, X or Y."""
        n = len(cluster)
        places = [(*member, row) for member in cluster for row in range(3)]
        turn = np.kron(np.eye(n), self.site.w_from_ecef)
        covariance = (turn.T @ self.correlations.matrix(places) @ turn).reshape(n, 3, n, 3)
        letter = "Y" if points else "G" if n == 1 else "X"
        element = _element(
            "DnaMeasurement",
            Type=letter,
            Ignore="",
            ReferenceFrame=self.frame,
            Epoch=self.epoch,
            Vscale="1",
            Pscale="1",
            Lscale="1",
            Hscale="1",
        )
        if points:
            etree.SubElement(element, "Coords").text = "XYZ"
        if letter != "G":
            etree.SubElement(element, "Total").text = str(n)
        for k, (table, i) in enumerate(cluster):
            o: Any = self.network.observations[table]
            if points:
                xyz = self.site.to_ecef(o.values[i][None])[0]
                etree.SubElement(element, "First").text = self.names[o.position[i]]
            else:
                xyz = o.values[i] @ self.site.w_from_ecef
                etree.SubElement(element, "First").text = self.names[o.start[i]]
                etree.SubElement(element, "Second").text = self.names[o.end[i]]
            entry = etree.SubElement(element, "Clusterpoint" if points else "GPSBaseline")
            for axis, value in zip("XYZ", xyz, strict=True):
                etree.SubElement(entry, axis).text = repr(float(value))
            for name, row, column in _VARIANCE:
                text = repr(float(covariance[k, row, k, column]))
                etree.SubElement(entry, f"Sigma{name}").text = text
            for later in range(k + 1, n):
                block = etree.SubElement(entry, "PointCovariance" if points else "GPSCovariance")
                for row in range(3):
                    for column in range(3):
                        cell = etree.SubElement(block, f"m{row + 1}{column + 1}")
                        cell.text = repr(float(covariance[k, row, later, column]))
        return element


def _element(tag: str, **texts: str) -> etree._Element:
    """An element with children that hold texts."""
    element = etree.Element(tag)
    for name, text in texts.items():
        etree.SubElement(element, name).text = text
    return element


def _frame(network: Network) -> str:
    """Name of the reference frame of the network's geocentric coordinates."""
    reference = network.reference
    name = reference.frame
    if name is None and reference.crs is not None:
        try:
            geodetic = CRS(reference.crs).geodetic_crs
        except ProjError:
            geodetic = None
        name = None if geodetic is None else geodetic.name
    if name is None:
        raise InputError(
            "the network does not name the reference frame of its coordinates, which DynaML needs",
            cure="give the site of the project a crs or a frame",
        )
    frames.frame(name)
    return name


def _date(epoch: float | None) -> str:
    """The day of a decimal year, as ``dd.mm.yyyy``; DynaML's own default if there is none."""
    if epoch is None:
        return "01.01.2020"
    year = int(epoch)
    first = date(year, 1, 1)
    days = (date(year + 1, 1, 1) - first).days
    return (first + timedelta(days=round((epoch - year) * days))).strftime("%d.%m.%Y")


def _packed(angle: float, decimals: int) -> str:
    """An angle [rad] as ``ddd.mmssss``: degrees, two digits of minutes, then of seconds."""
    degrees, minutes, seconds = packed_seconds(abs(angle), decimals)
    return f"{'-' if angle < 0 else ''}{degrees}.{minutes:02d}{seconds}"
