"""What a comparison of two clouds says of each test site, and the same as JSON.

Metres; incidence in radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tribrach.comparison.c2c import C2C, Pitch
from tribrach.comparison.m3c2 import M3C2
from tribrach.comparison.predicted import OffsetTest, Prediction
from tribrach.comparison.sites import Geometry

__all__ = ["M3C2Figures", "SiteResult", "comparison_json"]

SCHEMA = 1


@dataclass(frozen=True)
class M3C2Figures:
    """Distances along normals over a site: how many, mean and standard deviation [m].

    Figures are None where nothing was usable.

    Attributes
    ----------
    lod95
        Mean level of detection as published, lod95_quadratic with variances added.
    changed
        Share of the distances beyond their quadratic level.
    cylinder, scale
        Diameters [m] of the cylinders and of the neighbourhoods of the normals.
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
    def of(cls, found: M3C2) -> M3C2Figures:
        """Over all usable core points."""
        rows = found.usable & np.isfinite(found.distance)
        distance, level = found.distance[rows], found.lod95_quadratic[rows]
        some = len(distance) > 0
        return cls(
            count=len(distance),
            mean=float(distance.mean()) if some else None,
            std=float(distance.std()) if some else None,
            lod95=float(found.lod95[rows].mean()) if some else None,
            lod95_quadratic=float(level.mean()) if some else None,
            changed=float((np.abs(distance) > level).mean()) if some else None,
            cylinder=found.settings.diameter,
            scale=float(max(found.settings.scales)),
            sentences=tuple(found.warnings),
        )


@dataclass(frozen=True)
class SiteResult:
    """A site: points n of the compared cloud in it, how both scanners saw it, its figures.

    Attributes
    ----------
    seen_a, seen_b
        None where the scanner's place is not known.
    prediction
        Of the distance along the normal and what was observed of it, None where the stations
        are not known.
    """

    name: str
    n: int
    seen_a: Geometry | None = None
    seen_b: Geometry | None = None
    c2c: C2C | None = None
    m3c2: M3C2Figures | None = None
    prediction: Prediction | None = None

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

    def to_json(self) -> dict[str, Any]:
        """Plain numbers; None for what is not known."""
        return {
            "name": self.name,
            "n": self.n,
            "range": self.range,
            "incidence": self.incidence,
            "c2c": None if self.c2c is None else _c2c_json(self.c2c),
            "m3c2": None if self.m3c2 is None else _m3c2_json(self.m3c2),
            "predicted_sigma": self.predicted_sigma,
            "prediction": None if self.prediction is None else _prediction_json(self.prediction),
            "stations": {
                side: None if seen is None else asdict(seen)
                for side, seen in (("a", self.seen_a), ("b", self.seen_b))
            },
        }


def comparison_json(
    a: str, b: str, limit: float, sites: Sequence[SiteResult], offsets: OffsetTest | None = None
) -> dict[str, Any]:
    """A whole comparison; a, b : names of the clouds; limit [m]; offsets : all sites together."""
    return {
        "schema": SCHEMA,
        "units": {"length": "m", "angle": "rad"},
        "a": a,
        "b": b,
        "limit": limit,
        "sites": [site.to_json() for site in sites],
        "offsets": None if offsets is None else asdict(offsets) | {"agrees": offsets.agrees},
    }


def _prediction_json(p: Prediction) -> dict[str, Any]:
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
        "offset": p.offset,
        "offset_sigma": p.offset_sigma,
        "offset_agrees": p.offset_agrees,
        "lod95": p.lod95,
        "lod95_additive": p.lod95_additive,
        "lod95_spatial": p.lod95_spatial,
        "changed": p.changed,
        "verdict": p.verdict,
    }


def _c2c_json(c2c: C2C) -> dict[str, Any]:
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
        "pitch_a": _pitch_json(c2c.pitch_a),
        "pitch_b": _pitch_json(c2c.pitch_b),
        "local_plane": None if c2c.plane is None else asdict(c2c.plane),
        "notes": list(c2c.sentences),
    }


def _pitch_json(pitch: Pitch | None) -> dict[str, float] | None:
    return None if pitch is None else asdict(pitch)


def _m3c2_json(figures: M3C2Figures) -> dict[str, Any]:
    data = asdict(figures)
    count, notes = data.pop("count"), list(data.pop("sentences"))
    return {"n": count, **data, "notes": notes}
