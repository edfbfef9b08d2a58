"""Predicted against observed over all sites of a comparison, by intensity, range and incidence.

Each cloud at each site counts by itself, in the class in which its scanner saw the site. Its own
part is the scatter of single points against their noise; what points share is the distance between
the clouds against its sigma, in which stations and systematic angles stand. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.comparison.predicted import BAND
from tribrach.comparison.results import SiteResult
from tribrach.statistics import chi2

Cause = Literal["intensity", "range", "incidence"]

#: limits of classes: ranges [m], incidence angles [rad]
_RANGES = (0.0, 10.0, 20.0, 30.0, 50.0, 100.0, np.inf)
_INCIDENCES = tuple(np.radians([0.0, 30.0, 45.0, 60.0, 90.0]))
#: classes of intensity, of about as many clouds at sites each
_LIGHTS = 4
#: of the limits of a ratio
_LEVEL = 0.95


@dataclass(frozen=True)
class PredictedClass(Result, without=("square",), also=("ratio", "limits", "verdict")):
    """Predicted against observed of clouds at sites that their scanners saw alike [m]."""

    by: Cause  #: what the class is of: intensity, range or incidence
    #: its least and largest: as in the files, in metres or radians
    low: float
    high: float
    clouds: int  #: clouds at sites in it
    dof: int  #: of the scatter
    #: predicted noise and observed scatter of single points, root mean squares
    noise: float
    scatter: float
    square: float  #: observed over predicted variances of single points, by the degrees of freedom
    #: predicted sigma of the distance between the clouds, and that distance, over the sites
    offset_sigma: float
    offset: float

    @property
    def ratio(self) -> float:
        """Observed scatter over predicted noise."""
        return float(np.sqrt(self.square))

    @property
    def limits(self) -> tuple[float, float]:
        """Where the ratio lies at 95 %, by chi-square of its degrees of freedom."""
        ends = chi2.ppf([(1 + _LEVEL) / 2, (1 - _LEVEL) / 2], max(self.dof, 1))
        low, high = np.sqrt(self.square * max(self.dof, 1) / np.asarray(ends, dtype=float))
        return float(low), float(high)

    @property
    def verdict(self) -> str:
        """The ratio in words: it departs if all of its limits are beyond a tenth."""
        low, high = self.limits
        if low > BAND[1]:
            return "scatter more than predicted"
        if high < BAND[0]:
            return "scatter less than predicted"
        return "as predicted" if BAND[0] <= self.ratio <= BAND[1] else "too few points to tell 10 %"


def predicted_classes(sites: Sequence[SiteResult]) -> list[PredictedClass]:
    """Put the clouds at all sites with a prediction into classes."""
    rows = np.array(list(_rows(sites)), dtype=float).reshape(-1, 8)
    rows = rows[rows[:, 3] > 0]
    out = []
    light = rows[np.isfinite(rows[:, 0]), 0]
    lights = np.unique(np.quantile(light, np.linspace(0, 1, _LIGHTS + 1))) if len(light) else ()
    causes: tuple[tuple[Cause, int, Sequence[float] | Array], ...] = (
        ("intensity", 0, lights), ("range", 1, _RANGES), ("incidence", 2, _INCIDENCES),
    )  # fmt: skip
    for by, column, ends in causes:
        known = rows[np.isfinite(rows[:, column])]
        number = np.clip(np.digitize(known[:, column], ends) - 1, 0, max(len(ends) - 2, 0))
        out += [_class(by, column, known[number == k]) for k in np.unique(number)]
    return out


def _rows(sites: Sequence[SiteResult]) -> Iterator[tuple[float, ...]]:
    """Intensity, range, incidence, degrees of freedom, noise, scatter, offset and its sigma."""
    for site in sites:
        p = site.prediction
        if p is None:
            continue
        # the reference, which is B, is the first cloud of a prediction
        for k, seen, light in ((0, site.seen_b, site.light_b), (1, site.seen_a, site.light_a)):
            if seen is None or not p.noise[k] > 0:
                continue
            slant = np.nan if seen.incidence is None else seen.incidence
            yield (
                np.nan if light is None else light,
                seen.range,
                slant,
                p.dof[k],
                p.noise[k],
                p.scatter[k],
                p.offset,
                p.offset_sigma,
            )


def _class(by: Cause, column: int, rows: Array) -> PredictedClass:
    """Rows (n, 8) of one class summed up."""
    dof, noise, scatter = rows[:, 3], rows[:, 4], rows[:, 5]
    return PredictedClass(
        by=by,
        low=float(rows[:, column].min()),
        high=float(rows[:, column].max()),
        clouds=len(rows),
        dof=int(dof.sum()),
        noise=float(np.sqrt(np.average(noise**2, weights=dof))),
        scatter=float(np.sqrt(np.average(scatter**2, weights=dof))),
        square=float(np.average((scatter / noise) ** 2, weights=dof)),
        offset=float(np.sqrt(np.mean(rows[:, 6] ** 2))),
        offset_sigma=float(np.sqrt(np.mean(rows[:, 7] ** 2))),
    )
