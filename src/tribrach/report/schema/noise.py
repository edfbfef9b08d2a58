"""The noise of a scanner by its own scans."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tribrach.report.noise import noise_rows, noise_sentences
from tribrach.report.numbers import matrix, number
from tribrach.report.schema.base import Document, DocumentPart, Matrix, Number, heading

if TYPE_CHECKING:
    from tribrach.job.estimate_noise import NoiseEstimate

__all__ = ["NoiseDocument", "noise_document"]

SCHEMA = 1


class PatchedScanPart(DocumentPart):
    """What one scan gave."""

    source: str
    patches: int
    points: int
    windows: int
    """Windows filled by points, of which some are curved or have points far off."""
    curved: int
    uneven: int
    gridded: bool
    step: float
    """Step of the coordinates [m], 0 if they are fine."""
    unit: str
    """What the intensities are."""
    remark: str


class IntensityLawPart(DocumentPart):
    """``sigma = a I^b + c`` [m] for intensities I from low to high, in the unit of the files."""

    a: float
    b: float
    c: float
    low: float
    high: float
    covariance: Matrix
    """Of a, b and c; null where a figure is at its limit."""


class EffectPart(DocumentPart):
    """What a cause still does after the law: share by which sigma grows, and its sigma."""

    change: float
    sigma: float


class NoiseClassPart(DocumentPart):
    """A class of points: standard deviations along the beam [m]."""

    by: str
    low: float
    high: float
    """Limits, in the unit of the files, metres or radians."""
    patches: int
    points: int
    observed: float
    fitted: float
    chi2_dof: float
    """Squared residuals over the variances fitted, by the degrees of freedom."""
    stated: Number


class NeighboursPart(DocumentPart):
    """What neighbouring points share of the variance of ranges, over which angle [rad]."""

    share: float
    sigma: float
    angle: float


class NoiseDocument(Document):
    """What ``tribrach noise --json`` writes."""

    scans: list[PatchedScanPart]
    patches: int
    points: int
    """Smooth patches, and points on them."""
    spread: float
    """Variance factor of the patches about the law, 1 for noise alone."""
    law: IntensityLawPart | None
    why: str
    """Why there is no law of the intensity."""
    range: float
    """Law of the range without intensity [m], over the cosine of the incidence, ..."""
    range_scale: float
    """... with a part that grows [m/m]."""
    horizontal: float
    vertical: float
    """Noise across the beam [rad] ..."""
    horizontal_sigma: Number
    vertical_sigma: Number
    place: float
    """... and at any range [m]."""
    place_sigma: Number
    by_range: EffectPart
    """At twice the range."""
    by_incidence: EffectPart
    """At 60 degrees rather than straight on."""
    neighbours: NeighboursPart | None
    classes: list[NoiseClassPart]
    instrument: dict[str, float]
    """Keys and values for an instrument file, in the units of their names."""
    stated_by: str
    doubts: list[str]
    """Why the figures are an upper bound."""
    sentences: list[str]


def noise_document(estimate: NoiseEstimate) -> NoiseDocument:
    """The estimate as a document."""
    fitted, law, shared = estimate.fitted, estimate.fitted.law, estimate.shared
    data = heading(SCHEMA) | {
        "scans": [PatchedScanPart.model_validate(scan) for scan in estimate.scans],
        "patches": fitted.patches,
        "points": fitted.points,
        "spread": fitted.spread,
        "law": None
        if law is None
        else {name: getattr(law, name) for name in ("a", "b", "c", "low", "high")}
        | {"covariance": [list(row) for row in matrix(fitted.law_covariance)]},
        "why": fitted.why,
        "range": fitted.range,
        "range_scale": fitted.range_scale,
        "horizontal": fitted.horizontal,
        "vertical": fitted.vertical,
        "horizontal_sigma": number(fitted.angle_sigmas[0]),
        "vertical_sigma": number(fitted.angle_sigmas[1]),
        "place": fitted.place,
        "place_sigma": number(fitted.place_sigma),
        "by_range": EffectPart.model_validate(fitted.by_range),
        "by_incidence": EffectPart.model_validate(fitted.by_incidence),
        "neighbours": None
        if shared is None
        else {"share": shared.share, "sigma": shared.sigma, "angle": shared.angle},
        "classes": [
            NoiseClassPart(
                by=row.by,
                low=row.seen.low,
                high=row.seen.high,
                patches=row.seen.patches,
                points=row.seen.points,
                observed=row.seen.observed,
                fitted=row.seen.stated,
                chi2_dof=row.seen.chi2_dof,
                stated=row.stated,
            )
            for row in noise_rows(estimate)
        ],
        "instrument": {key: float(np.float64(v)) for key, v in estimate.figures().items()},
        "stated_by": estimate.stated_by,
        "doubts": estimate.doubts,
        "sentences": noise_sentences(estimate),
    }
    return NoiseDocument.model_validate(data)
