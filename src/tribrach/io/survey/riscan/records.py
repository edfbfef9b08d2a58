"""The content of a RiSCAN PRO project file (``.rsp``) as plain records.

Frames of that program: SOCS is the scanner's own, PRCS that of the project, GLCS the global one;
SOP takes SOCS to PRCS (per scan position), POP takes PRCS to GLCS. Lengths in metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.io.xml_file import line_of, load
from tribrach.units import too_large


@dataclass(frozen=True)
class TiePoint:
    """A target in one frame."""

    name: str  #: of the target
    vector: Array  #: (3,), coordinates [m]
    accuracy: Array | None  #: (3,), along the beam and twice across it [m]
    direction: Array | None  #: (3,), direction of the first accuracy
    height: float  #: as given with control [m]
    active: bool  #: false if it is switched off
    source: str  #: ``file:line``
    link: str = ""  #: path of the tie point that this one is the same as, "" without one

    def error(self, what: str) -> InputError:
        """The error of this tie point."""
        return InputError(what, record=self.source)


@dataclass(frozen=True)
class Position:
    """The position of the scanner's own GNSS receiver."""

    vector: Array  #: (3,), coordinates [m]
    accuracy: float  #: as stated [m]
    system: str  #: code of the coordinate system
    enabled: bool  #: false if it is switched off
    source: str  #: ``file:line``


@dataclass(frozen=True)
class ScanPosition:
    """A station of the scanner."""

    name: str  #: of the station
    sop: Array | None  #: (4, 4), SOCS to PRCS
    registered: bool  #: the program had determined the SOP
    targets: tuple[TiePoint, ...]  #: in SOCS
    position: Position | None  #: of the GNSS receiver
    conditions: dict[str, str]  #: of the atmosphere, as text
    source: str  #: ``file:line``


@dataclass(frozen=True)
class RiscanProject:
    """A project."""

    name: str  #: of the project
    pop: Array | None  #: (4, 4), PRCS to GLCS
    stations: tuple[ScanPosition, ...]  #: scan positions
    #: tie points in these frames
    prcs: tuple[TiePoint, ...]
    glcs: tuple[TiePoint, ...]
    crs: str = ""  #: name of the project's coordinate system, "" if it has none


def parse(path: Path) -> RiscanProject:
    """The records of a project file."""
    refused = RefusalCollector()
    root = _Node(load(path, "project"), str(path), refused)
    positions = root.child("scanpositions")
    if positions is None:
        raise InputError(
            "the project has no <scanpositions>",
            file=path,
            cure="give the project.rsp of a RiSCAN PRO project",
        )
    with refused:
        stations = []
        for node in positions.children("scanposition"):
            with refused.record():
                stations.append(_station(node))
        project = RiscanProject(
            root.text("name") or root.element.get("name", ""),
            root.matrix("pop"),
            tuple(stations),
            _tie_points(root, "tpl_prcs", "tp_prcs"),
            _tie_points(root, "tpl_glcs", "tp_glcs"),
            root.text("gsm_project_crs"),
        )
    return project


class _Node:
    """An element, the file it is in, and what is refused in it."""

    def __init__(self, element: Any, file: str, refused: RefusalCollector) -> None:
        self.element, self.file, self.refused = element, file, refused

    @property
    def source(self) -> str:
        """``file:line``."""
        return f"{self.file}:{line_of(self.element)}"

    def error(self, what: str) -> InputError:
        """The error of this element."""
        return InputError(what, file=self.file, line=line_of(self.element))

    def child(self, tag: str) -> _Node | None:
        """The first child of a name."""
        element = self.element.find(tag)
        return None if element is None else _Node(element, self.file, self.refused)

    def children(self, tag: str) -> Iterator[_Node]:
        """All children of a name."""
        return (_Node(e, self.file, self.refused) for e in self.element.findall(tag))

    def text(self, tag: str) -> str:
        """Text of a child, empty if there is none."""
        return (self.element.findtext(tag) or "").strip()

    def reference(self, tag: str) -> str:
        """Path that a child refers to, empty if there is none."""
        node = self.child(tag)
        return "" if node is None else str(node.element.get("noderef") or "").strip()

    def flag(self, tag: str, default: bool) -> bool:
        """A child that is 0 or 1 as a truth value."""
        text = self.text(tag)
        return text != "0" if text else default

    def numbers(self, count: int) -> Array:
        """The element's own numbers."""
        words = (self.element.text or "").split()
        try:
            values = np.array([float(word) for word in words])
        except ValueError:
            values = np.array([np.nan])
        if len(values) != count or not np.isfinite(values).all():
            raise self.error(f"<{self.element.tag}> does not hold {count} numbers")
        if too_large(values):
            raise self.error(f"<{self.element.tag}> holds a number beyond any measurement")
        return values

    def number(self, tag: str, default: float | None = None) -> float:
        """The number in a child."""
        node = self.child(tag)
        if node is None or (default is not None and not self.text(tag)):
            if default is None:
                raise self.error(f"<{self.element.tag}> has no <{tag}>")
            return default
        return float(node.numbers(1)[0])

    def vector(self, tag: str) -> Array | None:
        """Three numbers in a child, None if it is missing."""
        node = self.child(tag)
        return None if node is None else node.numbers(3)

    def matrix(self, tag: str) -> Array | None:
        """The rigid motion (4, 4) in ``tag/matrix``, None if it is missing."""
        node = self.child(tag)
        inner = None if node is None else node.child("matrix")
        if inner is None:
            return None
        matrix = inner.numbers(16).reshape(4, 4)
        r = matrix[:3, :3]
        if not np.allclose(r @ r.T, np.eye(3), atol=1e-6) or np.linalg.det(r) < 0:
            raise inner.error(f"the matrix of <{tag}> is not a rotation with a translation")
        return matrix


def _station(node: _Node) -> ScanPosition:
    name = node.text("name") or node.element.get("name", "")
    if not name:
        raise node.error("a scan position has no name")
    conditions = {
        key: node.text(tag)
        for key, tag in (
            ("temperature_C", "ppm_air_temperature"),
            ("pressure_hPa", "ppm_air_pressure"),
            ("instrument", "ppm_instrument"),
        )
        if node.text(tag)
    }
    return ScanPosition(
        name,
        node.matrix("sop"),
        node.flag("registered", False),
        _tie_points(node, "tpl_socs", "tp_socs"),
        _position(node),
        conditions,
        node.source,
    )


def _position(node: _Node) -> Position | None:
    vector = node.child("position_vector")
    if vector is None:
        return None
    return Position(
        vector.numbers(3),
        node.number("position_accuracy", float("nan")),
        node.text("position_coordsys"),
        node.flag("position_enabled", True),
        vector.source,
    )


def _tie_points(parent: _Node, group: str, tag: str) -> tuple[TiePoint, ...]:
    points = parent.child(group)
    if points is None:
        return ()
    active = points.flag("active", True)
    out = []
    for node in points.children(tag):
        with node.refused.record():
            out.append(_tie_point(node, active))
    return tuple(out)


def _tie_point(node: _Node, active: bool) -> TiePoint:
    name = node.text("name") or node.element.get("name", "")
    vector = node.vector("vector")
    if not name or vector is None:
        raise node.error(f"<{node.element.tag}> needs a name and a vector")
    return TiePoint(
        name,
        vector,
        node.vector("accuracy"),
        node.vector("direction"),
        node.number("height", 0.0),
        active and node.flag("active", True),
        node.source,
        node.reference("linked_ref"),
    )
