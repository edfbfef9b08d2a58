"""Writes networks as GNU Gama files (``.gkf``), for gama-local to adjust.

Axes are ``ne`` with clockwise angles, lengths metres with standard deviations in mm, angles gon
with standard deviations in cc. gama-local adjusts on a plane with parallel plumb lines and without
refraction: what an observation carries that the format has no place for is reduced where that
leaves its equation as it is (heights of rods, known meridian convergence, known scale of a
horizontal distance, heights of antennas on a flat site), and named otherwise. Format: GNU Gama
manual, "XML input data format for gama-local".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.site import FlatSite
from tribrach.io.survey.exported import Exported, Place, Sieve, ValueCovariances
from tribrach.io.survey.gama.element import NAMESPACE
from tribrach.io.survey.gama.reader import GamaFacts
from tribrach.network.facts import codes_of, facts_of
from tribrach.network.network import Network
from tribrach.observations.base import Observations
from tribrach.observations.control import Coordinate, Coordinates, Heights
from tribrach.observations.declaration import ObservedAxes
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import (
    Angles,
    Azimuths,
    Directions,
    Distances,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.units import CC, GON, MM

#: elements of sights, and the fields that are written or reduced
_SIGHTS: dict[type[Observations], tuple[str, tuple[str, ...]]] = {
    Directions: ("direction", ("orientation",)),
    Angles: ("angle", ()),
    Azimuths: ("azimuth", ("convergence", "astronomic")),
    HorizontalDistances: ("distance", ("reduction",)),
    SlopeDistances: ("s-distance", ()),
    Distances: ("s-distance", ()),
    ZenithAngles: ("z-angle", ("refraction",)),
}
_HEIGHTS = ("height_instrument", "height_target")
#: kinds whose equation does not know where the vertical is
_ANYWHERE = (SlopeDistances, Distances, GnssBaselines, GnssPositions, Coordinates, Coordinate)
#: x, y, z of the file as axes E, N, U
_FILE_AXES = (1, 0, 2)
_PLANE = "its plumb lines are not parallel, and those of gama-local are"


@dataclass(frozen=True)
class _Entry:
    """An element of a cluster."""

    list: str  #: name of the list that it stands in
    #: of the element; ``start`` is its station, "" for lists that have none
    tag: str
    attributes: dict[str, str]
    places: tuple[Place, ...]  #: its values in the network, in the order of the file
    #: file units of one metre or radian, for each value
    scale: tuple[float, ...]
    start: str = ""
    circle: int = -1  #: orientation unknown, -1 for none
    matrix: bool = False  #: its list must have a covariance matrix


def write(network: Network) -> Exported:
    """The network as the text of a ``.gkf`` file.

    >>> write(tribrach.read("network.csv").network()).text  # doctest: +SKIP
    """
    sieve = Sieve(network)
    for constraint in network.constraints:
        sieve.refuse_all(constraint.observations, "gama-local has no conditions")
    entries = list(_entries(network, sieve))
    correlations = ValueCovariances(network)
    clusters = list(_clusters(network, entries, correlations, sieve))
    if not clusters:
        raise InputError(
            "gama-local can hold none of the observations of this network",
            cure="; ".join(sieve.sentences()) or "give a network with observations",
        )
    spaces: dict[Any, str] = {None: NAMESPACE.strip("{}")}
    root = etree.Element(NAMESPACE + "gama-local", nsmap=spaces)
    body = etree.SubElement(root, "network", {"axes-xy": "ne", "angles": "left-handed"})
    if network.title:
        etree.SubElement(body, "description").text = network.title
    known, codes = facts_of(network.facts, GamaFacts), codes_of(network.facts)
    etree.SubElement(
        body,
        "parameters",
        {
            "sigma-apr": repr(float(network.sigma0)),
            "sigma-act": known[0].sigma_act if known else "apriori",
            "conf-pr": repr(float(known[0].confidence)) if known else "0.95",
        },
    )
    section = etree.SubElement(body, "points-observations")
    for attributes in _points(network, [e for cluster in clusters for e in cluster]):
        etree.SubElement(section, "point", attributes)
        if code := codes.get(attributes["id"]):
            # points have no attribute for it; two hyphens would end a remark
            section.append(etree.Comment(f" {code.replace('-', ' ')} "))
    for cluster in clusters:
        _write_cluster(section, cluster, correlations)
    text = etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="UTF-8")
    written = len({place[:2] for cluster in clusters for e in cluster for place in e.places})
    return Exported(text.decode("utf-8"), written, sieve.sentences(), sieve.notes())


def _entries(network: Network, sieve: Sieve) -> Iterator[_Entry]:
    """Elements of all observations that the format has."""
    flat = isinstance(network.site, FlatSite)
    for table, o in enumerate(network.observations):
        if not flat and type(o) not in _ANYWHERE:
            sieve.refuse_all(o, _PLANE)
        elif type(o) in _SIGHTS:
            yield from _sights(network, table, o, sieve)
        elif isinstance(o, HeightDifferences) and type(o) is HeightDifferences:
            yield from _height_differences(network, table, o, sieve)
        elif isinstance(o, GnssBaselines):
            yield from _vectors(network, table, o, sieve)
        elif isinstance(o, Coordinates | GnssPositions):
            yield from _positions(network, table, o, sieve)
        elif isinstance(o, Coordinate):
            yield from _single_coordinates(network, table, o, sieve)
        elif isinstance(o, Heights):
            for i in sieve.rows(o):
                name = network.start.layout.position_name(int(o.position[i]))
                value = {"id": name, "z": repr(float(o.values[i, 0]))}
                yield _coordinate(value, ((table, int(i), 0),))
        else:
            sieve.refuse_all(o, "gama-local has no such observations")


def _sights(network: Network, table: int, o: Observations, sieve: Sieve) -> Iterator[_Entry]:
    """Directions, angles, azimuths, distances and zenith angles."""
    tag, held = _SIGHTS[type(o)]
    flat, name_of = isinstance(network.site, FlatSite), network.start.layout.position_name
    plan = o.facts.axes == ObservedAxes.PLAN
    # on a flat site heights do not enter what is measured in plan; elsewhere nothing holds them
    rows = sieve.rows(o, (*held, *(_HEIGHTS if flat else ())))
    keep = np.zeros(len(o), dtype=bool)
    keep[rows] = True
    values, scale = o.values[:, 0].copy(), np.ones(len(o))
    if isinstance(o, ZenithAngles) and network.site.curvature_radius is not None:
        bent = o.refraction != 1.0
        keep = sieve.drop(o, keep, bent, "with curvature and refraction, which gama-local has not")
    elif isinstance(o, Azimuths):
        values += o.convergence
    elif isinstance(o, HorizontalDistances):
        values, scale = values / o.reduction, 1 / o.reduction
    if not isinstance(o, ZenithAngles | HorizontalDistances | SlopeDistances):
        values = values % (2 * np.pi)
    unit, sigma_unit = (1.0, MM) if o.units[0] == "m" else (GON, CC)
    for i in np.flatnonzero(keep):
        ends = {"to": name_of(int(o.end[i]))}  # type: ignore[attr-defined]
        if isinstance(o, Angles):
            ends = {"bs": ends["to"], "fs": name_of(int(o.foresight[i]))}
        attributes = {**ends, "val": repr(float(values[i] / unit))}
        if not plan:
            for key, name in zip(("from_dh", "to_dh"), _HEIGHTS, strict=True):
                height = float(getattr(o, name)[i])
                if height:
                    attributes[key] = repr(height)
        yield _Entry(
            "obs",
            tag,
            attributes,
            ((table, int(i), 0),),
            (float(scale[i]) / sigma_unit,),
            start=name_of(int(o.start[i])),  # type: ignore[attr-defined]
            circle=int(o.orientation[i]) if isinstance(o, Directions) else -1,
        )


def _height_differences(
    network: Network, table: int, o: HeightDifferences, sieve: Sieve
) -> Iterator[_Entry]:
    """Levelled height differences, from mark to mark."""
    name_of = network.start.layout.position_name
    held = ("height_start", "height_end", "geoid_start", "geoid_end")
    marks = o.values[:, 0] - o.height_end + o.height_start + o.stated_rise
    for i in sieve.rows(o, held):
        ends = {"from": name_of(int(o.start[i])), "to": name_of(int(o.end[i]))}
        attributes = {**ends, "val": repr(float(marks[i]))}
        yield _Entry("height-differences", "dh", attributes, ((table, int(i), 0),), (1 / MM,))


def _vectors(network: Network, table: int, o: GnssBaselines, sieve: Sieve) -> Iterator[_Entry]:
    """Coordinate differences."""
    flat, name_of = isinstance(network.site, FlatSite), network.start.layout.position_name
    for i in sieve.rows(o, ("height_start", "height_end") if flat else ()):
        attributes = {"from": name_of(int(o.start[i])), "to": name_of(int(o.end[i]))}
        for key, axis in zip(("dx", "dy", "dz"), _FILE_AXES, strict=True):
            attributes[key] = repr(float(o.values[i, axis]))
        for key, height in (("from_dh", o.height_start[i]), ("to_dh", o.height_end[i])):
            if height:
                attributes[key] = repr(float(height))
        places = tuple((table, int(i), axis) for axis in _FILE_AXES)
        yield _Entry("vectors", "vec", attributes, places, (1 / MM,) * 3, matrix=True)


def _positions(
    network: Network, table: int, o: Coordinates | GnssPositions, sieve: Sieve
) -> Iterator[_Entry]:
    """Control with a covariance, and GNSS positions."""
    flat = isinstance(network.site, FlatSite)
    values = o.values.copy()
    if isinstance(o, GnssPositions):
        values[:, 2] -= o.antenna_height
    for i in sieve.rows(o, ("antenna_height",) if flat else ()):
        name = network.start.layout.position_name(int(o.position[i]))
        attributes = {"id": name}
        for key, axis in zip("xyz", _FILE_AXES, strict=True):
            attributes[key] = repr(float(values[i, axis]))
        yield _coordinate(attributes, tuple((table, int(i), axis) for axis in _FILE_AXES))


def _single_coordinates(
    network: Network, table: int, o: Coordinate, sieve: Sieve
) -> Iterator[_Entry]:
    """Coordinates E and N of a point together, U alone; the format has no E or N alone."""
    waiting: dict[tuple[int, int], list[int]] = {}
    for i in sieve.rows(o):
        position, axis = int(o.position[i]), int(o.axis[i])
        name = network.start.layout.position_name(position)
        if axis == 2:
            value = {"id": name, "z": repr(float(o.values[i, 0]))}
            yield _coordinate(value, ((table, int(i), 0),))
        elif waiting.get((position, 1 - axis)):
            other = waiting[position, 1 - axis].pop(0)
            east, north = (int(i), other) if axis == 0 else (other, int(i))
            value = {"id": name, "x": repr(float(o.values[north, 0]))}
            value["y"] = repr(float(o.values[east, 0]))
            yield _coordinate(value, ((table, north, 0), (table, east, 0)))
        else:
            waiting.setdefault((position, axis), []).append(int(i))
    left = sum(map(len, waiting.values()))
    sieve.refuse(o, left, "E or N alone, which gama-local has not")


def _coordinate(attributes: dict[str, str], places: tuple[Place, ...]) -> _Entry:
    """An observed point."""
    scale = (1 / MM,) * len(places)
    return _Entry("coordinates", "point", attributes, places, scale, matrix=True)


def _clusters(
    network: Network, entries: list[_Entry], correlations: ValueCovariances, sieve: Sieve
) -> Iterator[list[_Entry]]:
    """Entries that belong together: by their circle or by a covariance; others by their station."""
    if not entries:
        return
    nodes: dict[tuple[str, Any], int] = {}
    rows, columns = [], []
    for k, entry in enumerate(entries):
        keys: list[tuple[str, Any]] = [
            ("joint", group)
            for group in {correlations.group(place) for place in entry.places}
            if group is not None
        ]
        if entry.circle >= 0:
            keys.append(("circle", entry.circle))
        if not keys and not entry.matrix:
            keys = [(entry.list, entry.start)]
        for key in keys:
            rows.append(k)
            columns.append(nodes.setdefault(key, len(entries) + len(nodes)))
    size = len(entries) + len(nodes)
    links = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    label = connected_components(links, directed=False)[1][: len(entries)]
    order: dict[int, list[_Entry]] = {}
    for entry, number in zip(entries, label.tolist(), strict=True):
        order.setdefault(number, []).append(entry)
    for cluster in order.values():
        why = _unholdable(cluster)
        if why is None:
            yield cluster
        else:
            for table, _ in sorted({place[:2] for e in cluster for place in e.places}):
                sieve.refuse(network.observations[table], 1, why)


def _unholdable(cluster: list[_Entry]) -> str | None:
    """Why a list of the format cannot hold these entries together; None if it can."""
    if len({entry.list for entry in cluster}) > 1:
        return "correlated with observations of another list"
    circles = {(entry.circle, entry.start) for entry in cluster if entry.circle >= 0}
    if len(circles) > 1:
        return "correlated with directions of another set"
    return None


def _write_cluster(section: etree._Element, cluster: list[_Entry], known: ValueCovariances) -> None:
    """A set-up or a list, with its covariance matrix if one is needed."""
    starts = [entry.start for entry in cluster if entry.circle >= 0] or [cluster[0].start]
    own = {"from": starts[0]} if starts[0] else {}
    element = etree.SubElement(section, cluster[0].list, own)
    places = [place for entry in cluster for place in entry.places]
    scale = np.array([s for entry in cluster for s in entry.scale])
    joined = any(known.group(place) is not None for place in places)
    matrix = any(entry.matrix for entry in cluster) or joined
    covariance = known.matrix(places) * np.outer(scale, scale)
    k = 0
    for entry in cluster:
        attributes = dict(entry.attributes)
        if entry.start and entry.start != starts[0]:
            attributes = {"from": entry.start, **attributes}
        if not matrix:
            attributes["stdev"] = repr(float(np.sqrt(covariance[k, k])))
        etree.SubElement(element, entry.tag, attributes)
        k += len(entry.places)
    if matrix:
        _write_matrix(element, covariance)


def _write_matrix(element: etree._Element, covariance: Array) -> None:
    """The upper band of a covariance matrix, by rows."""
    row, column = np.nonzero(covariance)
    band = int(np.abs(row - column).max(initial=0))
    size = len(covariance)
    node = etree.SubElement(element, "cov-mat", {"dim": str(size), "band": str(band)})
    lines = (
        " ".join(repr(float(x)) for x in covariance[i, i : min(i + band, size - 1) + 1])
        for i in range(size)
    )
    node.text = "\n" + "\n".join(lines) + "\n"


def _points(network: Network, entries: Iterable[_Entry]) -> Iterator[dict[str, str]]:
    """Attributes of every point: coordinates, which of them are fixed, free, and of the datum."""
    layout, start = network.start.layout, network.start.points
    count = layout.count("point")
    free = network.free[: 3 * count].reshape(-1, 3)
    datum = _datum(network, free)
    used = free | _seen(network, entries)
    for i, name in enumerate(layout.names["point"]):
        attributes = {"id": name}
        if np.isfinite(start[i, :2]).all() and used[i, :2].any():
            attributes |= {"x": repr(float(start[i, 1])), "y": repr(float(start[i, 0]))}
        if np.isfinite(start[i, 2]) and used[i, 2]:
            attributes["z"] = repr(float(start[i, 2]))
        fixed, adjusted = "", ""
        for letters, axes in (("xy", [0, 1]), ("z", [2])):
            own, carries = free[i, axes], datum[i, axes]
            if not used[i, axes].any():
                continue
            if own.any() != own.all() or carries.any() != carries.all():
                raise InputError(
                    f"point {name} is fixed or of the datum in E or N alone",
                    cure="hold both or none; gama-local knows them together only",
                )
            if own.all():
                adjusted += letters.upper() if carries.all() else letters
            else:
                fixed += letters
        yield attributes | {k: v for k, v in (("fix", fixed), ("adj", adjusted)) if v}


def _datum(network: Network, free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Coordinates (n, 3) that carry inner constraints."""
    datum, layout = network.datum, network.start.layout
    if datum.kind != "free":
        return np.zeros_like(free)
    if datum.components is not None:
        return free & datum.components[: free.size].reshape(-1, 3)
    names = set(datum.names)
    chosen = np.array([not names or name in names for name in layout.names["point"]], dtype=bool)
    out: NDArray[np.bool_] = free & chosen[:, None]
    return out


def _seen(network: Network, entries: Iterable[_Entry]) -> NDArray[np.bool_]:
    """Coordinates (n, 3) that observations of the file refer to, whether they are free or not."""
    out = np.zeros((network.start.layout.count("point"), 3), dtype=bool)
    axes = {ObservedAxes.PLAN: [0, 1], ObservedAxes.HEIGHTS: [2], ObservedAxes.SPACE: [0, 1, 2]}
    for table, item in {place[:2] for entry in entries for place in entry.places}:
        o = network.observations[table]
        columns = axes.get(o.facts.axes, [0, 1, 2])
        if isinstance(o, Coordinate):
            columns = [int(o.axis[item])]
        for reference in o.references():
            if reference.family == "position":
                out[int(getattr(o, reference.name)[item]), columns] = True
    return out
