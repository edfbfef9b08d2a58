"""Comparisons of clouds, and regressions on what was compared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from tribrach.comparison.predicted_classes import predicted_classes
from tribrach.report.regression import RegressionFigures
from tribrach.report.schema.base import Document, DocumentPart, Number, heading
from tribrach.report.schema.motions import MotionsPart

if TYPE_CHECKING:
    from tribrach.comparison.c2c import C2C
    from tribrach.comparison.predicted import OffsetTest, Prediction
    from tribrach.comparison.regression import Regression
    from tribrach.comparison.results import M3C2Figures, SiteResult

__all__ = [
    "ComparisonDocument",
    "StationComparisonPart",
    "comparison_document",
    "station_comparison",
]

SCHEMA = 1


class PitchPart(DocumentPart):
    """Spacing of points on the surface [m]."""

    across: float
    up: float
    lattice: float
    """Share of places that are lattices."""


class SignedPart(DocumentPart):
    """Distances from local planes [m]."""

    count: int
    mean: float
    std: float
    rms: float
    median: float
    q95: float


class NearestPart(DocumentPart):
    """Distances to nearest points [m] beside what sampling alone makes of them."""

    n: int
    mean: Number
    std: Number
    rms: Number
    median: Number
    q95: Number
    beyond: float
    floor_mean: Number
    floor_std: Number
    floor_rms: Number
    floor_model: str | None
    debiased_rms: Number
    pitch_a: PitchPart | None
    pitch_b: PitchPart | None
    local_plane: SignedPart | None
    notes: list[str]


class NormalsPart(DocumentPart):
    """Distances along normals (M3C2) [m]."""

    n: int
    mean: Number
    std: Number
    lod95: Number
    lod95_quadratic: Number
    changed: Number
    cylinder: float
    scale: float
    notes: list[str]


class PredictionPart(DocumentPart):
    """What was predicted of the distance along the normal, and what was observed [m]."""

    sigma: Number
    observed: Number
    ratio: Number
    noise_b: Number
    noise_a: Number
    scatter_b: Number
    scatter_a: Number
    noise_ratio: Number
    noise_ratio_error: Number
    enough: bool
    registration: Number
    angles: Number
    """Largest sigma that systematic angles add to the offset."""
    offset: Number
    offset_sigma: Number
    offset_agrees: bool
    lod95: Number
    lod95_additive: Number
    lod95_spatial: Number
    changed: Number
    verdict: str


class PredictedClassPart(DocumentPart):
    """Predicted against observed of clouds at sites that their scanners saw alike [m]."""

    by: str
    """What the class is of: intensity, range or incidence."""
    low: float
    high: float
    """Its least and largest, as in the files, in metres or radians."""
    clouds: int
    dof: int
    noise: float
    scatter: float
    """Predicted noise and observed scatter of single points."""
    ratio: float
    limits: tuple[float, float]
    """Observed over predicted, and where that lies at 95 %."""
    offset_sigma: float
    offset: float
    """Predicted sigma of the distance between the clouds, and the distance."""
    verdict: str


class ViewPart(DocumentPart):
    """How a scanner saw a site: range [m], incidence [rad]."""

    range: float
    incidence: Number


class ViewsPart(DocumentPart):
    """How both scanners saw a site."""

    a: ViewPart | None
    b: ViewPart | None


class SitePart(DocumentPart):
    """A test site."""

    name: str
    n: int
    range: Number
    incidence: Number
    c2c: NearestPart | None
    m3c2: NormalsPart | None
    predicted_sigma: Number
    prediction: PredictionPart | None
    stations: ViewsPart
    center: tuple[float, float, float] | None = None
    """Its middle in the frame of the clouds [m]."""


class OffsetPart(DocumentPart):
    """The offsets of all sites against the joint covariance of the stations."""

    count: int
    statistic: float
    least: float
    limit: float
    agrees: bool


class UnitsPart(DocumentPart):
    """Units of all numbers."""

    length: str
    angle: str


class _Compared(DocumentPart):
    """A comparison of two clouds or stations, a against the reference b."""

    units: UnitsPart
    a: str
    b: str
    limit: float
    """Longest distance that was compared [m]."""
    sites: list[SitePart]
    classes: list[PredictedClassPart]
    """All sites together, by intensity, range and incidence."""
    offsets: OffsetPart | None


class ComparisonDocument(_Compared, Document):
    """What ``tribrach compare --json`` writes."""

    motions: MotionsPart | None
    """What moved, where it was asked for."""


class StationComparisonPart(_Compared):
    """A comparison between stations of a job."""

    regression: RegressionFigures | None
    """Of nearest-neighbour distances on range and incidence."""
    sentences: list[str]


def comparison_document(
    a: str,
    b: str,
    limit: float,
    sites: Sequence[SiteResult],
    offsets: OffsetTest | None = None,
    motions: MotionsPart | None = None,
) -> ComparisonDocument:
    """A whole comparison.

    Parameters
    ----------
    a, b
        Names of the compared cloud and of the reference.
    limit
        Longest distance that was compared [m].
    sites
        What each site says.
    offsets
        All sites together.
    motions
        What moved, where it was asked for.
    """
    compared = _compared(a, b, limit, sites, offsets) | {"motions": motions}
    return ComparisonDocument.model_validate(heading(SCHEMA) | compared)


def station_comparison(
    a: str,
    b: str,
    limit: float,
    sites: Sequence[SiteResult],
    offsets: OffsetTest | None,
    regression: Regression | None,
    sentences: Sequence[str],
) -> StationComparisonPart:
    """A comparison between stations, as :func:`comparison_document`, with its regression."""
    figures = None if regression is None else RegressionFigures(**vars(regression))
    return StationComparisonPart.model_validate(
        _compared(a, b, limit, sites, offsets)
        | {"regression": figures, "sentences": list(sentences)}
    )


def _compared(
    a: str, b: str, limit: float, sites: Sequence[SiteResult], offsets: OffsetTest | None
) -> dict[str, Any]:
    return {
        "units": {"length": "m", "angle": "rad"},
        "a": a,
        "b": b,
        "limit": limit,
        "sites": [_site(site) for site in sites],
        "classes": predicted_classes(sites),
        "offsets": offsets,
    }


def _site(site: SiteResult) -> dict[str, Any]:
    """Plain numbers; None for what is not known."""
    return {
        "name": site.name,
        "n": site.n,
        "range": site.range,
        "incidence": site.incidence,
        "c2c": None if site.c2c is None else _nearest(site.c2c),
        "m3c2": None if site.m3c2 is None else _normals(site.m3c2),
        "predicted_sigma": site.predicted_sigma,
        "prediction": None if site.prediction is None else _prediction(site.prediction),
        "stations": {"a": site.seen_a, "b": site.seen_b},
        "center": site.center,
    }


def _prediction(p: Prediction) -> dict[str, Any]:
    return {
        "sigma": p.sigma,
        "observed": p.observed,
        "ratio": p.ratio,
        "noise_b": p.noise[0],
        "noise_a": p.noise[1],
        "scatter_b": p.scatter[0],
        "scatter_a": p.scatter[1],
        "noise_ratio": p.noise_ratio,
        "noise_ratio_error": p.noise_ratio_error,
        "enough": p.enough,
        "registration": p.registration,
        "angles": p.angles,
        "offset": p.offset,
        "offset_sigma": p.offset_sigma,
        "offset_agrees": p.offset_agrees,
        "lod95": p.lod95,
        "lod95_additive": p.lod95_additive,
        "lod95_spatial": p.lod95_spatial,
        "changed": p.changed,
        "verdict": p.verdict,
    }


def _nearest(c2c: C2C) -> dict[str, Any]:
    floor = c2c.floor
    return {
        "n": c2c.count,
        "mean": c2c.mean,
        "std": c2c.std,
        "rms": c2c.rms,
        "median": c2c.median,
        "q95": c2c.q95,
        "beyond": c2c.beyond,
        "floor_mean": None if floor is None else floor.mean,
        "floor_std": None if floor is None else floor.std,
        "floor_rms": None if floor is None else floor.rms,
        "floor_model": c2c.model,
        "debiased_rms": c2c.debiased,
        "pitch_a": c2c.pitch_a,
        "pitch_b": c2c.pitch_b,
        "local_plane": c2c.plane,
        "notes": list(c2c.sentences),
    }


def _normals(figures: M3C2Figures) -> dict[str, Any]:
    return {
        "n": figures.count,
        "mean": figures.mean,
        "std": figures.std,
        "lod95": figures.lod95,
        "lod95_quadratic": figures.lod95_quadratic,
        "changed": figures.changed,
        "cylinder": figures.cylinder,
        "scale": figures.scale,
        "notes": list(figures.sentences),
    }
