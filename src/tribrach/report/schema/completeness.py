"""Completeness of surveys."""

from __future__ import annotations

from tribrach.report.schema.base import Document, DocumentPart, Number

__all__ = ["SCHEMA", "CompletenessDocument"]

SCHEMA = 1


class GapPart(DocumentPart):
    """Cells that hang together [m]."""

    middle: list[float]
    extent: list[float]
    cells: int


class GapsPart(DocumentPart):
    """The largest gaps of every sort."""

    no_station: list[GapPart]
    one_station: list[GapPart]
    sigma_not_reached: list[GapPart]


class CompletenessDocument(Document):
    """What ``tribrach complete --json`` writes."""

    cell: float
    surface: str
    cells: int
    seen_by: dict[str, int]
    stations: dict[str, float]
    required_sigma: Number
    sigma: dict[str, int] | None
    gaps: GapsPart
    sentences: list[str]
