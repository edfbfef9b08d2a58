"""Self-calibrations of scanners."""

from __future__ import annotations

from tribrach.report.schema.base import Document, DocumentPart, Matrix, Number

__all__ = ["SCHEMA", "CalibrationDocument"]

SCHEMA = 1


class FitSigma0(DocumentPart):
    """Sigma of unit weight and redundancy."""

    prior: float
    posterior: Number
    dof: int
    vtpv: float


class CountsPart(DocumentPart):
    """Sizes of the adjustment."""

    observed: int
    unknowns: int
    constraints: int
    defect: int


class ParameterPart(DocumentPart):
    """A calibration parameter: true = measured + correction."""

    name: str
    meaning: str
    unit: str
    value: float
    sigma: float
    t: Number
    significant: bool


class PosePart(DocumentPart):
    """A pose, 4 x 4, with its covariance 6 x 6 of left increments."""

    world_from_scanner: Matrix
    covariance: Matrix


class ReasonPart(DocumentPart):
    """A parameter that cannot be separated, or hardly, and why."""

    name: str
    why: str


class RemedyPart(DocumentPart):
    """What an addition to the design would make estimable."""

    what: str
    estimable: list[str]
    well_separated: list[str]
    sigma: list[Number]


class BlockTestPart(DocumentPart):
    """A test of several parameters together."""

    freedom: int
    redundancy: int
    statistic: Number
    p: Number
    kind: str


class OmittedPart(DocumentPart):
    """A parameter that is no unknown, as the residuals would have it."""

    name: str
    value: float
    sigma: float
    w: float
    limit: float


class TestsPart(DocumentPart):
    """Tests of the parameters and of the model."""

    together: BlockTestPart | None
    gain: BlockTestPart | None
    stations_differ: BlockTestPart | None
    omitted: list[OmittedPart]


class CorrelationPart(DocumentPart):
    """Two unknowns that are hard to tell apart."""

    a: str
    b: str
    value: float


class DatumSigmasPart(DocumentPart):
    """Sigmas of the same observations in another datum."""

    datum: str
    parameters: list[Number]
    stations: Matrix
    points: dict[str, list[Number]]
    distances: list[Number]


class CalibrationDocument(Document):
    """What ``tribrach calibrate --json`` writes."""

    title: str
    datum: str
    sigma_origin: str
    sigma0: FitSigma0
    counts: CountsPart
    parameters: list[ParameterPart]
    covariance: Matrix
    stations: dict[str, PosePart]
    open: list[str]
    closed_by_datum: list[str]
    left_out: list[ReasonPart]
    hardly_separated: list[ReasonPart]
    proposed: list[str]
    remedies: list[RemedyPart]
    tests: TestsPart
    correlations: list[CorrelationPart]
    datums: list[DatumSigmasPart]
    sentences: list[str]
