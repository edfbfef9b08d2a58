"""What a search for targets returns: detections with their numbers, rejections with reasons."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Matrix, Number, Result, Vector

#: what a target can be
Kind = Literal["sphere", "checkerboard", "disc", "plane"]


@dataclass(frozen=True, eq=False)
class Detection(Result):
    """A target that was found, in the coordinates of its scan."""

    kind: Kind
    #: name of the scan
    scan: str
    #: centre in the scanner frame [m]
    center: Vector
    #: its covariance, floor included [m^2]
    covariance: Matrix
    #: radius of a sphere or disc, half the side of a checkerboard, radius of the circle of equal
    #: area for a plane [m]
    radius: Number
    #: root mean square of the residuals of the inliers [m]
    rms: Number
    #: points looked at, and those that determined the centre
    points: int
    inliers: int
    #: distance from scanner to centre [m]; null where the scanner is unknown
    range: Number
    #: mean angle between beam and surface normal of the inliers [rad]; null like the range
    incidence: Number
    #: share of the expected pixels that are inliers, 0 to 1
    coverage: Number
    #: further numbers by name, with the unit in the name
    facts: Mapping[str, Number] = field(default_factory=dict)
    #: what was odd about it
    sentences: tuple[str, ...] = ()

    @property
    def sigmas(self) -> Array:
        """Standard deviations (3,) of the centre along x, y, z [m]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


@dataclass(frozen=True, eq=False)
class Rejected:
    """A candidate that was not a target."""

    #: what it was a candidate for
    kind: Kind
    #: (3,), its place in the scanner frame [m]
    center: Array
    #: why it was refused, one sentence
    reason: str


def lies_on(center: Array, detections: Iterable[Detection], radii: float = 1.0) -> bool:
    """True if a place lies on one of several detections, within so many of their radii."""
    return any(np.linalg.norm(d.center - center) < radii * d.radius for d in detections)


def with_floor(covariance: Array, sigma: float) -> Array:
    """Add the floor of a target type to a covariance (method section 6.3)."""
    return np.asarray(covariance + sigma**2 * np.eye(len(covariance)))
