"""Comparisons of epochs, and epochs themselves."""

from __future__ import annotations

from typing import Literal

from tribrach.report.schema.base import Document, DocumentPart, Finite, Matrix, Number

__all__ = [
    "EpochComparisonPart",
    "EpochDocument",
    "EpochsDocument",
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
