"""Field checks of scanners."""

from __future__ import annotations

from pydantic import Field

from tribrach.report.schema.base import Document, DocumentPart, Number

__all__ = ["SCHEMA", "CheckDocument"]

SCHEMA = 2


class ReadingPart(DocumentPart):
    """Half differences of both faces of one reading."""

    reading: str
    rms: Number
    rms_metres: Number
    statistic: Number
    dof: int
    limit: Number
    p: Number
    passed: bool


class MisalignmentPart(DocumentPart):
    """A misalignment that would explain what was found."""

    parameter: str
    value: Number
    sigma: Number
    t: Number
    alternatives: list[str]


class ExplanationPart(DocumentPart):
    """Misalignments, and the sum of squares before and after."""

    causes: list[MisalignmentPart]
    before: Number
    after: Number
    limit: Number


class TwoFacePart(DocumentPart):
    """The comparison of both faces."""

    passed: bool
    components: list[ReadingPart]
    explanation: ExplanationPart
    detectable: dict[str, Number]


class RangeZeroPart(DocumentPart):
    """Zero of ranges [m]."""

    value: Number
    sigma: Number


class DistancePairPart(DocumentPart):
    """A distance between two targets from two stations [m]."""

    from_: str = Field(alias="from")
    to: str
    lengths: list[Number]
    difference: Number
    sigma: Number
    limit: Number


class DistancesPart(DocumentPart):
    """Distances between targets from two stations."""

    stations: list[str]
    scans: list[int]
    passed: bool
    statistic: Number
    dof: int
    limit: Number
    p: Number
    range_zero: RangeZeroPart
    pairs: list[DistancePairPart]
    explanation: ExplanationPart


class VarianceRatioPart(DocumentPart):
    """An F test."""

    ratio: Number
    dof: list[float]
    lower: Number
    upper: Number
    passed: bool


class RepeatedDistancesPart(DocumentPart):
    """The uncertainty of a target that repeated distances show [m]."""

    u: float
    dof: int
    dof_equivalent: float
    within: list[Number]
    limit: Number
    p: Number
    passed: bool
    standard_limit: Number
    standard_rate: Number
    stations: VarianceRatioPart


class TargetDifferencePart(DocumentPart):
    """A distance from the first station less that from the second [m]."""

    from_: str = Field(alias="from")
    to: str
    difference: Number


class StatisticsPart(DocumentPart):
    """Distance statistics of ISO 17123-9; the procedure is empty where its numbers are others."""

    stations: list[str]
    scans: list[int]
    targets: int
    procedure: str
    departures: list[str]
    differences: list[TargetDifferencePart]
    u_stated: float
    difference_limit: float
    beyond: int
    expected_beyond: float
    beyond_rate: float
    repeated: RepeatedDistancesPart | None


class KnownLengthPart(DocumentPart):
    """A known length and what a station measured [m]."""

    station: str
    from_: str = Field(alias="from")
    to: str
    measured: Number
    known: Number
    difference: Number
    sigma: Number
    limit: Number


class LengthsPart(DocumentPart):
    """Measured distances against known ones."""

    passed: bool
    statistic: Number
    dof: int
    limit: Number
    p: Number
    scale: Number
    sigma_scale: Number
    beside_zero: bool
    t_limit: Number
    rows: list[KnownLengthPart]


class SeriesPart(DocumentPart):
    """Repeated scans of a few targets."""

    scans: int
    targets: int
    s: float
    dof: int
    dof_equivalent: float
    s_station: dict[str, float]
    stated: float
    statistic: Number
    limit: Number
    p: Number
    passed: bool
    stations: VarianceRatioPart | None


class CheckDocument(Document):
    """What ``tribrach check --json`` writes."""

    title: str
    passed: bool
    failures: list[str]
    alpha: float
    alpha_each: float
    readings: int
    stations: list[str]
    targets: list[str]
    two_face: TwoFacePart | None
    distances: list[DistancesPart]
    statistics: list[StatisticsPart]
    lengths: LengthsPart | None
    series: SeriesPart | None
    change: VarianceRatioPart | None
    change_of_distances: VarianceRatioPart | None
    findings: list[str]
    sources: str
