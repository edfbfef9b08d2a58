"""Comparisons of epochs, and epochs themselves."""

from __future__ import annotations

from typing import Any, Literal

from tribrach.report.schema.base import Document, DocumentPart, Finite, Matrix, Number

__all__ = [
    "EpochComparisonPart",
    "EpochDocument",
    "EpochsDocument",
    "SeriesDocument",
]


class CongruencePart(DocumentPart):
    """A test of the quadratic form of differences."""

    statistic: float
    dof: int
    limit: float
    significance: float
    """Probability of a larger statistic if nothing moved."""
    passed: bool


class OwnTestPart(DocumentPart):
    """The global test of one epoch."""

    vtpv: float
    dof: int
    lower: float
    upper: float
    passed: bool


class DisplacementPart(DocumentPart):
    """What became of a point, in the datum of the stable points."""

    reference: bool
    xyz: list[Finite]
    """E, N, U at the first epoch [m]."""
    displacement: list[float]
    """Along the axes of the comparison [m]."""
    covariance: Matrix
    """Of the displacement [m^2]."""
    test: Finite
    limit: float
    significance: Finite
    test_least: Finite
    """With the systematic part that explains most of it."""
    test_largest: Finite
    verdict: Literal["moved", "not moved", "cannot tell"]
    detectable: Finite
    """Displacement found with the stated power in the hardest direction [m]."""
    detectable_easiest: Finite


class SearchPart(DocumentPart):
    """Which reference points moved."""

    before: CongruencePart
    after: CongruencePart
    moved: list[str]
    partners: list[list[str]]
    """Groups that explain the differences nearly as well."""
    resolved: bool
    combinations: int
    exhaustive: bool


class CommonMotionPart(DocumentPart):
    """A motion of the whole that was taken out by choice."""

    name: str
    value: float
    """In metres, radians or 1."""
    sigma: float
    test: float
    limit: float


class EpochComparisonPart(DocumentPart):
    """Two epochs compared."""

    first: str
    second: str
    axes: list[Literal["E", "N", "U"]]
    confidence: float
    power: float
    covariances: Literal["prior", "posterior"]
    dof: int
    """Of both epochs together; 0 where it is not known."""
    motions: list[str]
    """What is taken out of the differences."""
    systematic: list[float]
    """Bounds of systematic parts in E, N, U [m]."""
    stable: list[str]
    """Points that carry the datum."""
    held: list[str]
    """Points that are held in both epochs."""
    whole: CongruencePart
    references: SearchPart | None
    own: list[OwnTestPart | None]
    """Of the first and the second epoch; null where it is not known."""
    precision: CongruencePart | None
    """Ratio of the variance factors of both epochs."""
    common: list[CommonMotionPart]
    points: dict[str, DisplacementPart]
    only_first: list[str]
    only_second: list[str]
    sentences: list[str]


class EpochsDocument(Document):
    """What ``tribrach epochs --json`` writes."""

    comparisons: list[EpochComparisonPart]


class EpochSitePart(DocumentPart):
    """Where the frame of an epoch lies [rad, m]."""

    latitude: float
    longitude: float
    ellipsoidal_height: float
    ellipsoid: list[float]


class EpochDocument(Document):
    """What ``tribrach adjust --epoch`` writes, for ``tribrach epochs``."""

    kind: Literal["epoch"]
    label: str
    datum: str
    site: EpochSitePart | None
    names: list[str]
    xyz: list[list[Number]]
    """E, N, U [m]; null where the network has no such coordinate."""
    covariance: list[list[float]]
    """Of all coordinates, a priori: rows of the lower triangle [m^2]."""
    motions: list[str]
    """Motions of the whole that the observations leave open."""
    dof: int
    variance_factor: Number


class SeriesSettingsPart(DocumentPart):
    """How cycles are adjusted and compared [m, rad, s, 1]."""

    references: list[str]
    sigma_direction: float
    sigma_zenith: float
    sigma_distance: float
    sigma_ppm: float
    pause: float
    baseline: int
    confidence: float
    as_stated: bool
    scale: bool


class CyclePointPart(DocumentPart):
    """A point in a cycle."""

    displacement: list[float]
    """Since the baseline, along E, N, U [m]."""
    sigma: list[float]
    test: Finite
    limit: float
    verdict: Literal["moved", "not moved", "cannot tell"]


class CyclePart(DocumentPart):
    """A cycle of a series."""

    key: str
    """Digest of its readings."""
    time: str
    """When it began, UTC."""
    start: float
    """The same in seconds since 1970."""
    sights: int
    reason: str
    """Why it could not be adjusted or compared; empty if it was."""
    test: Finite
    dof: int
    limit: Finite
    moved: list[str]
    """Reference points that moved."""
    resolved: bool
    points: dict[str, CyclePointPart]


class JumpPart(DocumentPart):
    """A step of a series."""

    time: str
    size: float
    sigma: float
    test: float
    limit: float


class AxisFitPart(DocumentPart):
    """What a series along one axis consists of [m, m/day]."""

    axis: Literal["E", "N", "U"]
    rate: float
    rate_sigma: float
    trend: bool
    amplitude: float
    amplitude_sigma: float
    phase: float
    """Of the largest value, as a part of a day after midnight UTC."""
    period: bool
    jumps: list[JumpPart]
    outliers: list[str]
    """Times of values that took no part."""
    scatter: float
    """Of the residuals over the sigmas of the values."""
    correlation: float


class SeriesDocument(Document):
    """What ``tribrach series --json`` writes, and ``--resume`` reads."""

    kind: Literal["series"]
    settings: SeriesSettingsPart
    baseline: dict[str, Any]
    """As an epoch file."""
    factor: float
    """What variances are multiplied by, from the scatter that most reference points share."""
    wander: dict[str, list[list[float]]]
    """Covariance in E, N, U of what a reference point does within a day [m^2]."""
    cycles: list[CyclePart]
    series: dict[str, list[AxisFitPart]]
    sentences: list[str]
