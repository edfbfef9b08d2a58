"""Designs of networks."""

from __future__ import annotations

from pydantic import Field

from tribrach.report.schema.base import Document, DocumentPart, Matrix, Number

__all__ = ["SCHEMA", "PlanDocument"]

SCHEMA = 1


class PlannedDatumPart(DocumentPart):
    """What fixes the frame."""

    kind: str
    names: list[str]


class CriterionPart(DocumentPart):
    """What the design is judged by."""

    kind: str
    points: list[str]
    required: Number
    reached: bool | None


class ExtremePart(DocumentPart):
    """The worst figure of a kind, and where."""

    value: Number
    at: str


class FiguresPart(DocumentPart):
    """What a design is predicted to give [m, 1]."""

    sigma: dict[str, Number]
    redundancy: ExtremePart
    undetected: ExtremePart
    correlation: ExtremePart


class HorizonPart(DocumentPart):
    """Widest part of the horizon without targets [rad]."""

    before: Number
    plan: Number


class ForecastPart(DocumentPart):
    """Covariances of a lever arm [m^2]."""

    name: str
    prior: Matrix | None
    before: Matrix | None
    plan: Matrix | None
    horizon_without_targets: HorizonPart


class PlacePart(DocumentPart):
    """A place of the plan."""

    xyz: list[Number]
    covariance: Matrix
    new: bool


class SightPart(DocumentPart):
    """Everything observed from one place to another [m, rad]."""

    from_: str = Field(alias="from")
    to: str
    kinds: str
    length: Number
    azimuth: Number
    zenith: Number
    values: int
    redundancy: Number
    undetected: Number


class ProposalPart(DocumentPart):
    """A target or station to add."""

    add: str
    name: str
    xyz: list[Number]
    before: Number
    after: Number


class MovePart(DocumentPart):
    """A move of one target or station."""

    name: str
    to: str
    xyz: list[Number]
    before: Number
    after: Number


class SparePart(DocumentPart):
    """What the criterion becomes without one target or station."""

    sort: str
    name: str
    before: Number
    after: Number


class SetsPart(DocumentPart):
    """Repetitions by station that the requirement takes."""

    sets: dict[str, int]
    value: Number
    reached: bool


class PrecisionPart(DocumentPart):
    """How precise one group of readings must be."""

    group: str
    sigma: float
    factor: Number
    perfect: Number


class DatumFiguresPart(DocumentPart):
    """The plan in another datum [m]."""

    datum: str
    sigma: Number
    mean: Number
    distance: Number
    redundancy: Number
    refused: str


class PlanDocument(Document):
    """What ``tribrach plan --json`` writes."""

    title: str
    datum: PlannedDatumPart
    criterion: CriterionPart
    before: FiguresPart | None
    plan: FiguresPart | None
    lever_arm: ForecastPart | None
    points: dict[str, PlacePart]
    stations: dict[str, PlacePart]
    parameters: dict[str, Number]
    sights: list[SightPart]
    designs_judged: int
    proposals: list[ProposalPart]
    moves: list[MovePart]
    without: list[SparePart]
    sets: SetsPart | None
    precision: list[PrecisionPart]
    datums: list[DatumFiguresPart]
    findings: list[str]
    warnings: list[str]
