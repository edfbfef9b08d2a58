"""What a search for targets returns: detections with their numbers, rejections with reasons."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Self

import numpy as np

from tribrach._types import Array

__all__ = ["Detection", "Kind", "Rejected", "lies_on", "with_floor"]


#: what a target can be
Kind = Literal["sphere", "checkerboard", "disc", "plane"]


@dataclass(frozen=True, eq=False)
class Detection:
    """One target found in a scan.

    kind, scan : what it is and the name of the scan; center (3,), covariance (3, 3) : scanner
    frame [m, m^2], floor included; radius : of a sphere or disc, half the side of a checkerboard,
    radius of the circle of equal area for a plane [m]; rms : of the residuals of the inliers [m];
    points, inliers : points looked at and points that determined the centre; range : from scanner
    to centre [m]; incidence : mean angle between beam and surface normal of the inliers [rad], both
    NaN where the scanner is unknown;
    coverage : share of the expected pixels that are inliers, 0 to 1; facts : further numbers by
    name with the unit in the name; sentences : what was odd about it.
    """

    kind: Kind
    scan: str
    center: Array
    covariance: Array
    radius: float
    rms: float
    points: int
    inliers: int
    range: float
    incidence: float
    coverage: float
    facts: Mapping[str, float] = field(default_factory=dict)
    sentences: tuple[str, ...] = ()

    @property
    def sigmas(self) -> Array:
        """Standard deviations (3,) of the centre along x, y, z [m]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def to_dict(self) -> dict[str, Any]:
        """JSON form: metres, incidence in radians, covariance row by row; None if not known."""
        return {
            "kind": self.kind,
            "scan": self.scan,
            "center": [float(x) for x in self.center],
            "covariance": [[float(x) for x in row] for row in self.covariance],
            "radius": float(self.radius),
            "rms": float(self.rms),
            "points": int(self.points),
            "inliers": int(self.inliers),
            "range": _number(self.range),
            "incidence": _number(self.incidence),
            "coverage": float(self.coverage),
            "facts": {name: float(value) for name, value in self.facts.items()},
            "sentences": list(self.sentences),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """The same from its JSON form."""
        arrays = {name: np.array(data[name], dtype=float) for name in ("center", "covariance")}
        unknown = {k: float("nan") for k in ("range", "incidence") if data[k] is None}
        return cls(**{**data, **arrays, **unknown, "sentences": tuple(data["sentences"])})


@dataclass(frozen=True, eq=False)
class Rejected:
    """A candidate (center (3,) [m], scanner frame) that was no target, and why in one sentence."""

    kind: Kind
    center: Array
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        center = [float(x) for x in self.center]
        return {"kind": self.kind, "center": center, "reason": self.reason}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """The same from its JSON form."""
        return cls(data["kind"], np.array(data["center"], dtype=float), data["reason"])


def _number(value: float) -> float | None:
    """A number as JSON can hold it."""
    return float(value) if np.isfinite(value) else None


def lies_on(center: Array, detections: Iterable[Detection], radii: float = 1.0) -> bool:
    """Is a place (3,) [m] within so many radii of the centre of one of the detections?"""
    return any(np.linalg.norm(d.center - center) < radii * d.radius for d in detections)


def with_floor(covariance: Array, sigma: float) -> Array:
    """Covariance (3, 3) plus ``sigma`` [m] in every direction (the target-type floor, 6.3)."""
    return np.asarray(covariance + sigma**2 * np.eye(len(covariance)))
