"""What a search for targets returns: detections with their numbers, rejections with reasons."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Matrix, Number, Result, Vector

#: what a target can be
Kind = Literal["sphere", "checkerboard", "disc", "plane", "corner", "edge", "hole", "axis", "place"]


@dataclass(frozen=True, eq=False)
class Detection(Result):
    """A target that was found, in the coordinates of its scan."""

    kind: Kind
    scan: str  #: name of the scan
    center: Vector  #: centre in the scanner frame [m]
    covariance: Matrix  #: its covariance, floor included [m^2]
    #: radius of a sphere or disc, half the side of a checkerboard, radius of the circle of equal
    #: area for a plane [m]
    radius: Number
    rms: Number  #: root mean square of the residuals of the inliers [m]
    #: points looked at, and those that determined the centre
    points: int
    inliers: int
    range: Number  #: distance from scanner to centre [m]; null where the scanner is unknown
    #: mean angle between beam and surface normal of the inliers [rad]; null like the range
    incidence: Number
    coverage: Number  #: share of the expected pixels that are inliers, 0 to 1
    #: further numbers by name, with the unit in the name
    facts: Mapping[str, Number] = field(default_factory=dict)
    sentences: tuple[str, ...] = ()  #: what was odd about it

    @property
    def sigmas(self) -> Array:
        """Standard deviations (3,) of the centre along x, y, z [m]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


@dataclass(frozen=True, eq=False)
class Rejected:
    """A candidate that was not a target."""

    kind: Kind  #: what it was a candidate for
    center: Array  #: (3,), its place in the scanner frame [m]
    reason: str  #: why it was refused, one sentence


def lies_on(center: Array, detections: Iterable[Detection], radii: float = 1.0) -> bool:
    """True if a place lies on one of several detections, within so many of their radii."""
    return any(np.linalg.norm(d.center - center) < radii * d.radius for d in detections)


def with_floor(covariance: Array, sigma: float) -> Array:
    """Add the floor of a target type to a covariance (method section 6.3)."""
    return np.asarray(covariance + sigma**2 * np.eye(len(covariance)))
