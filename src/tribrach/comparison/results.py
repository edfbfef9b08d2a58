"""The result of a comparison of two clouds at each test site.

Metres; incidence in radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach.answers import Result
from tribrach.comparison.c2c import C2C
from tribrach.comparison.m3c2 import M3C2
from tribrach.comparison.predicted import Prediction
from tribrach.comparison.sites import Geometry

#: name of the one site where no sites are given
WHOLE = "all"


@dataclass(frozen=True)
class M3C2Figures(Result):
    """Distances along normals (M3C2) [m]; figures are null where nothing was usable."""

    #: distances
    n: int
    mean: float | None
    std: float | None
    lod95: float | None  #: mean level of detection as published
    lod95_quadratic: float | None  #: mean level with variances added
    changed: float | None  #: share of the distances beyond their quadratic level
    #: diameters of the cylinders and of the neighbourhoods of the normals
    cylinder: float
    scale: float
    notes: tuple[str, ...] = ()  #: what a reader has to know

    @classmethod
    def of(cls, result: M3C2) -> M3C2Figures:
        """Over all usable core points."""
        rows = result.usable & np.isfinite(result.distance)
        distance, level = result.distance[rows], result.lod95_quadratic[rows]
        some = len(distance) > 0
        return cls(
            n=len(distance),
            mean=float(distance.mean()) if some else None,
            std=float(distance.std()) if some else None,
            lod95=float(result.lod95[rows].mean()) if some else None,
            lod95_quadratic=float(level.mean()) if some else None,
            changed=float((np.abs(distance) > level).mean()) if some else None,
            cylinder=result.settings.diameter,
            scale=float(max(result.settings.scales)),
            notes=tuple(result.warnings),
        )


@dataclass(frozen=True)
class Views(Result):
    """Range and incidence of both scanners at a site."""

    a: Geometry | None
    b: Geometry | None


@dataclass(frozen=True)
class SiteResult(
    Result,
    without=("seen_a", "seen_b", "light_a", "light_b"),
    also=("range", "incidence", "predicted_sigma", "stations"),
):
    """A test site."""

    name: str
    n: int  #: points of the compared cloud in it
    #: how both scanners saw it, None where the scanner's place is not known
    seen_a: Geometry | None = None
    seen_b: Geometry | None = None
    #: distances point to point, and along normals
    c2c: C2C | None = None
    m3c2: M3C2Figures | None = None
    prediction: Prediction | None = None  #: None where the stations are not known
    #: mean intensities of both clouds there, as in the files of their scans
    light_a: float | None = None
    light_b: float | None = None
    #: its middle in the frame of the clouds [m], null where nothing of it was compared
    center: tuple[float, float, float] | None = None

    @property
    def stations(self) -> Views:
        """How both scanners saw it, null where the scanner's place is not known."""
        return Views(self.seen_a, self.seen_b)

    @property
    def predicted_sigma(self) -> float | None:
        """Sigma of the distance between single points along the normal [m], None if unknown."""
        return None if self.prediction is None else self.prediction.sigma

    @property
    def range(self) -> float | None:
        """The longer of the mean ranges [m] from both scanners."""
        return max((g.range for g in self._seen), default=None)

    @property
    def incidence(self) -> float | None:
        """The larger of the mean incidence angles [rad] at both scanners."""
        angles = [g.incidence for g in self._seen if g.incidence is not None]
        return max(angles, default=None)

    @property
    def _seen(self) -> list[Geometry]:
        return [g for g in (self.seen_a, self.seen_b) if g is not None]
