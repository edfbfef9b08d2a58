"""Scans: what is in their files."""

from __future__ import annotations

from typing import Any

from tribrach.report.schema.base import Document, DocumentPart, Finite, Matrix

__all__ = ["SCHEMA", "ScansDocument"]

SCHEMA = 1


class FieldPart(DocumentPart):
    """A field of the points with its range."""

    name: str
    dtype: str
    low: Finite
    high: Finite


class NoReturnPart(DocumentPart):
    """What a file has for beams that came back from nothing: numbers of points, and where [m]."""

    zeros: int
    """In the very place of the scanner."""
    repeated: int
    places: list[list[float]]
    """Places that repeat."""
    in_shell: int
    shell: list[float] | None
    """Smallest and largest range of a shell about the scanner."""


class UnitPart(DocumentPart):
    """What the coordinates of a file are counted in; everything here is metres but degrees."""

    names: list[str]
    """Of x, y and z."""
    metres: list[float] | None
    """In one unit of x, y and z; null if x and y are degrees."""
    source: str
    """Who says so."""


class ScanPart(DocumentPart):
    """A scan of a file [m, rad]."""

    file: str
    scan: str
    index: int
    points: int
    records: int | None
    dropped: int
    no_return: NoReturnPart | None
    bounds: list[list[Finite]] | None
    fields: list[FieldPart]
    grid: list[int] | None
    pose: Matrix | None
    """World from scanner, 4 x 4."""
    crs: str | None
    """Of the file."""
    unit: UnitPart
    origin: str
    """Whether the scanner is at 0, 0, 0: stated, assumed or unknown."""
    angular_step: list[Finite] | None
    range_quantiles: list[Finite]
    coordinate_step: Finite
    doubled_share: Finite
    facts: dict[str, Any]
    sentences: list[str]


class ScanPositionPart(DocumentPart):
    """A scan position of a project of RiSCAN PRO [m]."""

    name: str
    registered: bool
    sop: Matrix | None
    """Project from scanner, 4 x 4."""
    reflectors: int
    active: int
    of_control: int
    """Reflectors that are control points."""
    gnss: list[float] | None
    """Position by the scanner's own receiver."""
    gnss_accuracy: float | None


class ScannerProjectPart(DocumentPart):
    """A project of RiSCAN PRO [m]."""

    file: str
    name: str
    crs: str | None
    pop: Matrix | None
    """Global from project, 4 x 4."""
    control: int
    tie_points: int
    positions: list[ScanPositionPart]
    sentences: list[str]


class ScansDocument(Document):
    """What ``tribrach info --json`` writes."""

    scans: list[ScanPart]
    projects: list[ScannerProjectPart]
