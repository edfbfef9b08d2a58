"""DynaML, the XML of DynAdjust: station, measurement and combined files."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import RefusalCollector
from tribrach.io.survey.dynadjust.records import (
    ARCSEC,
    SIGHTS,
    Entry,
    GnssCluster,
    RecordPlace,
    Records,
    StationRecord,
    TerrestrialRecord,
    number,
    packed_dms,
)
from tribrach.io.xml_file import line_of, load

#: elements of a variance and of a covariance block
_VARIANCE = ("SigmaXX", "SigmaXY", "SigmaXZ", "SigmaYY", "SigmaYZ", "SigmaZZ")
#: frame and epoch of files that name none, as the schema has them
DEFAULT = "GDA2020", "01.01.2020"
_BLOCK = [[f"m{i}{j}" for j in (1, 2, 3)] for i in (1, 2, 3)]


def parse(path: Path, refused: RefusalCollector) -> Records:
    """Records of one DynaML file."""
    root = load(path, "DnaXmlFormat")
    frame, epoch = DEFAULT
    frame = root.get("referenceframe", frame)
    records = Records(str(path), str(frame), str(root.get("epoch", epoch)))
    for element in _children(root):
        with refused.record():
            take(records, element)
    return records


def take(records: Records, element: Any) -> None:
    """Add a station or a measurement."""
    node = _Node(element, RecordPlace(records.file, line_of(element)))
    if element.tag == "DnaStation":
        records.stations.append(node.station())
    elif element.tag == "DnaMeasurement":
        _measurement(records, node)
    else:
        raise node.place.error(f"element <{element.tag}> is not of DynaML")


def _children(element: Any) -> Iterator[Any]:
    """Child elements without comments."""
    return (child for child in element if isinstance(child.tag, str))


class _Node:
    """An element with its place."""

    def __init__(self, element: Any, place: RecordPlace) -> None:
        self.element, self.place = element, place

    def nodes(self) -> Iterator[_Node]:
        """Children with their places."""
        for child in _children(self.element):
            yield _Node(child, RecordPlace(self.place.file, line_of(child)))

    @cached_property
    def _texts(self) -> dict[str, str]:
        """Text of the first child of each name."""
        # the last one that is put in stays
        return {child.tag: child.text or "" for child in self.element.iterchildren(reversed=True)}

    def text(self, tag: str, default: str | None = None) -> str:
        """Text of a child."""
        text = self._texts.get(tag)
        if text is None and default is None:
            raise self.place.error(f"<{self.element.tag}> has no <{tag}>")
        return (text or "").strip() or (default or "")

    def number(self, tag: str, default: str | None = None) -> float:
        """The number in a child."""
        return number(self.text(tag, default), f"<{tag}>", self.place)

    @property
    def ignored(self) -> bool:
        """True if the element ``Ignore`` holds a star."""
        return "*" in self.text("Ignore", " ")

    def station(self) -> StationRecord:
        """The record of a station."""
        coordinates = self.element.find("StationCoord")
        if coordinates is None:
            raise self.place.error("<DnaStation> has no <StationCoord>")
        node = _Node(coordinates, RecordPlace(self.place.file, line_of(coordinates)))
        return StationRecord(
            self.text("Name"),
            self.text("Constraints"),
            self.text("Type"),
            (node.text("XAxis"), node.text("YAxis"), node.text("Height")),
            node.text("HemisphereZone", " ").strip(),
            self.place,
        )

    def entry(self, first: str, second: str, ignored: bool, covariance: str) -> Entry:
        """A baseline or a point with its covariances."""
        blocks = [node.block() for node in self.nodes() if node.element.tag == covariance]
        return Entry(
            first,
            second,
            (self.text("X"), self.text("Y"), self.text("Z")),
            tuple(self.number(tag) for tag in _VARIANCE),
            blocks,
            ignored,
            self.place,
        )

    def block(self) -> Array:
        """A 3x3 covariance block."""
        return np.array([[self.number(tag) for tag in row] for row in _BLOCK])


def _measurement(records: Records, node: _Node) -> None:
    kind = node.text("Type").upper()
    if kind in ("G", "X", "Y"):
        records.clusters.append(_cluster(records, node, kind))
    elif kind == "D":
        records.sights += _directions(node)
    elif kind in SIGHTS:
        records.sights.append(_sight(node, kind))
    else:
        records.refuse(kind, node.ignored, node.place)


def _cluster(records: Records, node: _Node, kind: str) -> GnssCluster:
    """A GNSS measurement; station names stand before the element they belong to, or in it."""
    tag, covariance = (
        ("Clusterpoint", "PointCovariance") if kind == "Y" else ("GPSBaseline", "GPSCovariance")
    )
    first, second = node.text("First", ""), node.text("Second", "")
    entries: list[Entry] = []
    for child in node.nodes():
        name = child.element.tag
        if name == "First":
            first = (child.element.text or "").strip()
        elif name == "Second":
            second = (child.element.text or "").strip()
        elif name == tag:
            ends = child.text("First", first), child.text("Second", second)
            entries.append(child.entry(*ends, node.ignored, covariance))
    total = node.text("Total", "") if kind != "G" else "1"
    if not entries or (total and total != str(len(entries))):
        raise node.place.error(f"the measurement has {len(entries)} of {total or 'its'} <{tag}>")
    v, p, lam, h = (node.number(f"{axis}scale", "1") for axis in "VPLH")
    return GnssCluster(
        kind,
        node.text("Coords", "XYZ") if kind == "Y" else "XYZ",
        entries,
        (v, p, lam, h),
        node.text("ReferenceFrame", records.frame),
        node.text("Epoch", records.epoch),
        node.place,
    )


def _sight(node: _Node, kind: str) -> TerrestrialRecord:
    count, angular = SIGHTS[kind]
    return TerrestrialRecord(
        kind,
        tuple(node.text(tag) for tag in ("First", "Second", "Third")[:count]),
        _value(node, angular),
        node.number("StdDev") * (ARCSEC if angular else 1.0),
        node.number("InstHeight", "0"),
        node.number("TargHeight", "0"),
        node.ignored,
        node.place,
    )


def _directions(node: _Node) -> list[TerrestrialRecord]:
    """The directions of a set.

    The first one stands in the measurement itself, the others in ``Directions``.
    """
    name = f"orientation of {node.text('First')} ({node.place})"
    sights = []
    for k, item in enumerate([node, *(n for n in node.nodes() if n.element.tag == "Directions")]):
        names = (node.text("First"), item.text("Second" if k == 0 else "Target"))
        sights.append(
            TerrestrialRecord(
                "D",
                names,
                _value(item, True),
                item.number("StdDev") * ARCSEC,
                0.0,
                0.0,
                node.ignored or item.ignored,
                item.place,
                name,
            )
        )
    return sights


def _value(node: _Node, angular: bool) -> float:
    """The value of a measurement in metres or radians."""
    text = node.text("Value")
    return packed_dms(text, "<Value>", node.place) if angular else node.number("Value")
