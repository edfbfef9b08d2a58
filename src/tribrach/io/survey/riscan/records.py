"""What stands in a RiSCAN PRO project file (``.rsp``), before it means anything.

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
from tribrach.errors import InputError
from tribrach.io.xml_file import line_of, load

__all__ = ["Position", "RiscanProject", "ScanPosition", "TiePoint", "parse"]


@dataclass(frozen=True)
class TiePoint:
    """A target in one frame: vector (3,); accuracy (3,) along the beam and twice across, or None;
    direction (3,) of the first accuracy, or None; height as given with control.
    """

    name: str
    vector: Array
    accuracy: Array | None
    direction: Array | None
    height: float
    active: bool
    source: str

    def error(self, what: str) -> InputError:
        """An error at this tie point."""
        return InputError(what, record=self.source)


@dataclass(frozen=True)
class Position:
    """The scanner's own GNSS: vector (3,), stated accuracy [m], code of the coordinate system."""

    vector: Array
    accuracy: float
    system: str
    enabled: bool
    source: str


@dataclass(frozen=True)
class ScanPosition:
    """A scanner station: SOP (4, 4) or None, whether the program had registered it, targets."""

    name: str
    sop: Array | None
    registered: bool
    targets: tuple[TiePoint, ...]
    position: Position | None
    conditions: dict[str, str]
    source: str


@dataclass(frozen=True)
class RiscanProject:
    """A project: POP (4, 4) or None, scan positions, tie points in PRCS and in GLCS."""

    name: str
    pop: Array | None
    stations: tuple[ScanPosition, ...]
    prcs: tuple[TiePoint, ...]
    glcs: tuple[TiePoint, ...]


def parse(path: Path) -> RiscanProject:
    """The records of a project file.

    Raises
    ------
    InputError
        Not a RiSCAN PRO project, or a number, vector or matrix in it is malformed.
    """
    root = _Node(load(path, "project"), str(path))
    positions = root.child("scanpositions")
    if positions is None:
        raise InputError(
            "the project has no <scanpositions>",
            file=path,
            cure="give the project.rsp of a RiSCAN PRO project",
        )
    return RiscanProject(
        root.text("name") or root.element.get("name", ""),
        root.matrix("pop"),
        tuple(_station(node) for node in positions.children("scanposition")),
        _tie_points(root, "tpl_prcs", "tp_prcs"),
        _tie_points(root, "tpl_glcs", "tp_glcs"),
    )


class _Node:
    """An element and the file it is in."""

    def __init__(self, element: Any, file: str) -> None:
        self.element, self.file = element, file

    @property
    def source(self) -> str:
        """``file:line``."""
        return f"{self.file}:{line_of(self.element)}"

    def error(self, what: str) -> InputError:
        """An error at this element."""
        return InputError(what, file=self.file, line=line_of(self.element))

    def child(self, tag: str) -> _Node | None:
        """The first child of a name."""
        found = self.element.find(tag)
        return None if found is None else _Node(found, self.file)

    def children(self, tag: str) -> Iterator[_Node]:
        """All children of a name."""
        return (_Node(e, self.file) for e in self.element.findall(tag))

    def text(self, tag: str) -> str:
        """Text of a child, empty if there is none."""
        return (self.element.findtext(tag) or "").strip()

    def flag(self, tag: str, default: bool) -> bool:
        """A child of 0 or 1."""
        text = self.text(tag)
        return text != "0" if text else default

    def numbers(self, count: int) -> Array:
        """The element's own numbers, exactly so many."""
        words = (self.element.text or "").split()
        try:
            values = np.array([float(word) for word in words])
        except ValueError:
            values = np.array([np.nan])
        if len(values) != count or not np.isfinite(values).all():
            raise self.error(f"<{self.element.tag}> does not hold {count} numbers")
        return values

    def number(self, tag: str, default: float | None = None) -> float:
        """Number in a child."""
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
        """A rigid motion (4, 4) in ``tag/matrix``, None if it is missing.

        Raises
        ------
        InputError
            The upper left part is not a rotation.
        """
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
    found = parent.child(group)
    if found is None:
        return ()
    active = found.flag("active", True)
    return tuple(_tie_point(node, active) for node in found.children(tag))


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
    )
