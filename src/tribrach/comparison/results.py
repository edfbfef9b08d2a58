"""The result of a comparison of two clouds at each test site.

Metres; incidence in radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach.comparison.c2c import C2C
from tribrach.comparison.m3c2 import M3C2
from tribrach.comparison.predicted import Prediction
from tribrach.comparison.sites import Geometry

__all__ = ["WHOLE", "M3C2Figures", "SiteResult"]

#: name of the one site where no sites are given
WHOLE = "all"


@dataclass(frozen=True)
class M3C2Figures:
    """Distances along normals over a site; figures are None where nothing was usable.

    Attributes
    ----------
    count
        Distances.
    mean, std
        Mean and standard deviation [m].
    lod95
        Mean level of detection as published [m].
    lod95_quadratic
        Mean level with variances added [m].
    changed
        Share of the distances beyond their quadratic level.
    cylinder, scale
        Diameters of the cylinders and of the neighbourhoods of the normals [m].
    sentences
        What a reader has to know.
    """

    count: int
    mean: float | None
    std: float | None
    lod95: float | None
    lod95_quadratic: float | None
    changed: float | None
    cylinder: float
    scale: float
    sentences: tuple[str, ...] = ()

    @classmethod
    def of(cls, result: M3C2) -> M3C2Figures:
        """Over all usable core points."""
        rows = result.usable & np.isfinite(result.distance)
        distance, level = result.distance[rows], result.lod95_quadratic[rows]
        some = len(distance) > 0
        return cls(
            count=len(distance),
            mean=float(distance.mean()) if some else None,
            std=float(distance.std()) if some else None,
            lod95=float(result.lod95[rows].mean()) if some else None,
            lod95_quadratic=float(level.mean()) if some else None,
            changed=float((np.abs(distance) > level).mean()) if some else None,
            cylinder=result.settings.diameter,
            scale=float(max(result.settings.scales)),
            sentences=tuple(result.warnings),
        )


@dataclass(frozen=True)
class SiteResult:
    """The figures of a site.

    Attributes
    ----------
    name
        Of the site.
    n
        Points of the compared cloud in it.
    seen_a, seen_b
        How both scanners saw it, None where the scanner's place is not known.
    c2c
        Distances point to point.
    m3c2
        Distances along normals.
    prediction
        Of the distance along the normal and what was observed of it, None where the stations
        are not known.
    light_a, light_b
        Mean intensities of both clouds there, as in the files of their scans, None where unknown.
    center
        Its middle [m] in the frame of the clouds, None where nothing of it was compared.
    """

    name: str
    n: int
    seen_a: Geometry | None = None
    seen_b: Geometry | None = None
    c2c: C2C | None = None
    m3c2: M3C2Figures | None = None
    prediction: Prediction | None = None
    light_a: float | None = None
    light_b: float | None = None
    center: tuple[float, float, float] | None = None

    @property
    def predicted_sigma(self) -> float | None:
        """Of the distance between single points along the normal [m], None if not predicted."""
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
