"""The error budget of every station: samples of its scans, regions, parts (method 5.1 and 5.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.cloud.budget import POINT_PARTS, SYSTEMATIC, PointBudget, point_budget
from tribrach.cloud.placement import Placement
from tribrach.geometry.rotation import skew
from tribrach.job.scans import StationScan
from tribrach.job.surface_samples import SurfaceSamples
from tribrach.network.adjustment import Adjustment
from tribrach.network.contributions import by_category, contributions
from tribrach.registration.geometry_warnings import (
    TargetsAround,
    extrapolation_factor,
    targets_around,
)
from tribrach.scan.surface_sample import SurfaceSample
from tribrach.sentences import Sentence
from tribrach.units import DEG, span


@dataclass(frozen=True)
class BudgetPart(Result):
    """A part of the budget: variance of all three directions, along the normal, in the surface.

    normal and tangential are None where no normals are known.
    """

    name: str
    variance: float
    normal: float | None
    tangential: float | None


@dataclass(frozen=True)
class BudgetRow(Result, without=("range_share",), also=("own", "neighbours", "shared")):
    """A class of the points of a station, and what their covariances are made of."""

    station: str  #: its name
    region: str  #: the class in words
    #: sampled points, and their share of those of the station
    points: int
    share: float
    parts: tuple[BudgetPart, ...]  #: what adds up
    #: what the class is of: region, by range [m] and incidence [degrees], or intensity
    by: Literal["region", "intensity"] = "region"
    #: share of the variance of ranges that neighbouring points have in common, None where nobody
    #: says
    range_share: float | None = None

    @property
    def own(self) -> float:
        """Variance that is new with every point, and that a mean of points reduces [m^2]."""
        return _sum(self.parts, POINT_PARTS) - (self.range_share or 0.0) * self._range

    @property
    def neighbours(self) -> float | None:
        """Variance common to neighbouring points but not to points far apart [m^2].

        None where nothing is known of it: no share of the ranges, no systematic part of angles.
        """
        systematic = self.part(SYSTEMATIC)
        if self.range_share is None and systematic is None:
            return None
        return (self.range_share or 0.0) * self._range + (systematic or 0.0)

    @property
    def shared(self) -> float:
        """Variance common to all points of the station [m^2], a mean over the class.

        Points side by side have no less in any mean of them; the mean of points far apart may, as
        what turns the station moves them in different directions.
        """
        return self.variance - _sum(self.parts, (*POINT_PARTS, SYSTEMATIC))

    @property
    def _range(self) -> float:
        """Variance of ranges, incidence included [m^2]."""
        return _sum(self.parts, ("range", "incidence"))

    @property
    def variance(self) -> float:
        """Sum over the parts [m^2]."""
        return sum(part.variance for part in self.parts)

    @property
    def normal(self) -> float | None:
        """Sum along the normal [m^2]."""
        return _sum_of([part.normal for part in self.parts])

    @property
    def tangential(self) -> float | None:
        """Sum in the surface [m^2]."""
        return _sum_of([part.tangential for part in self.parts])

    def part(self, *names: str) -> float | None:
        """Variance [m^2] of parts together; None if the budget has none of them."""
        variances = [part.variance for part in self.parts if part.name in names]
        return sum(variances) if variances else None


def _sum(parts: Sequence[BudgetPart], names: Sequence[str]) -> float:
    """Variance [m^2] of the parts of these names."""
    return sum(part.variance for part in parts if part.name in names)


def _sum_of(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) if len(known) == len(values) and known else None


# Do scans reach beyond the targets of their station, and what does that cost there?


#: hulls that must grow by more are worth a sentence, if errors grow by more as well
_FAR, _WORSE = 1.5, 1.3


def reach_sentences(
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    adjustment: Adjustment,
    samples: SurfaceSamples,
) -> list[str]:
    """One sentence for each station whose scans are extrapolated; placements by scan name."""
    sentences = []
    placed = [around for around in targets_around(adjustment) if len(around.targets) > 1]
    stations = {around.station for around in placed}
    looked = [scan for scan in scans if scan.station in stations and scan.origin_known]
    taken = samples.of(looked)
    for around in placed:
        seen = [scan for scan in looked if scan.station == around.station]
        if not seen:
            continue
        where = placements[seen[0].name]
        points = np.concatenate([where.pose @ taken[scan.name].xyz for scan in seen])
        if len(points):
            sentences += _sentence(around, where, points)
    return sentences


def _sentence(around: TargetsAround, where: Placement, points: Array) -> list[str]:
    """What the reach of points (n, 3) [m] means for a station."""
    factor = extrapolation_factor(around.targets, around.place, points)
    among = float(np.sqrt(np.mean(_station_sigmas(around.targets, where) ** 2)))
    out = float(np.quantile(_station_sigmas(points, where), 0.95))
    if factor < _FAR or out < _WORSE * among:
        return []
    return [
        Sentence(
            "the scans of station {around.station} reach {factor:1} times as far as its "
            "targets stand: what the station leaves uncertain is {among:mm1} at the "
            "targets and {out:mm1} out there (3D, 95 % of the points below); targets "
            "around the object would hold it",
            around=around,
            factor=factor,
            among=among,
            out=out,
        )
    ]


def _station_sigmas(world: Array, where: Placement) -> Array:
    """Three-dimensional sigmas (n,) [m] that points get from their station alone."""
    arm = world - where.pose.translation
    geo = np.concatenate([np.broadcast_to(np.eye(3), (len(arm), 3, 3)), -skew(arm)], axis=2)
    variance = np.einsum("nij,jk,nik->n", geo, where.covariance, geo)
    sigma: Array = np.sqrt(np.maximum(variance, 0.0))
    return sigma


#: limits of the regions: ranges [m], incidence angles [degrees]
RANGES = (0.0, 10.0, 20.0, 30.0, 50.0, 100.0, np.inf)
_INCIDENCES = (0.0, 30.0, 45.0, 60.0, 90.0)
#: where classes of intensity end, as shares of the points
_QUARTERS = (0.25, 0.5, 0.75)
#: what a common scale of the ranges and refraction have done to the pose of a station
COMMON_ERRORS = "scale and refraction"
#: shares of a covariance that are rounding
_NEGLIGIBLE = 1e-6
#: regions with fewer sampled points are not worth a row
_FEW = 20


@dataclass(frozen=True)
class _Sampled:
    """Attributes of n sampled points, NaN where unknown, and their budget.

    range [m], incidence [degrees], intensity (n,) : as in the file; shared : of the variance of
    ranges, by neighbours.
    """

    range: Array
    incidence: Array
    intensity: Array
    budget: PointBudget
    shared: float | None


def error_budget(
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    adjustment: Adjustment,
    samples: SurfaceSamples,
    factor: float = 1.0,
) -> list[BudgetRow]:
    """State the budget of the regions of every station whose points have a covariance."""
    rows: list[BudgetRow] = []
    known = [scan for scan in scans if placements[scan.name].noise is not None]
    taken = samples.of(known)
    for station in dict.fromkeys(scan.station for scan in scans):
        first = next(placements[scan.name] for scan in scans if scan.station == station)
        shares = station_shares(adjustment, first, factor)
        sampled = [
            _sampled(taken[scan.name], placements[scan.name], shares)
            for scan in known
            if scan.station == station
        ]
        if sampled:
            rows += _regions(station, sampled)
    return rows


def station_shares(
    adjustment: Adjustment, where: Placement, factor: float = 1.0
) -> dict[str, Array]:
    """Shares (6, 6) of the covariance of a station by what they come from; they add up to it."""
    shares = by_category(contributions(adjustment, where.station), factor)
    rest = where.covariance - factor * adjustment.covariance(where.station)
    return shares | _considered(rest, where)


def _considered(rest: Array, where: Placement) -> dict[str, Array]:
    """Effect of considered errors (6, 6) on a station; {} without effect."""
    size = np.sqrt(np.maximum(np.diag(where.covariance), np.finfo(float).tiny))
    return {COMMON_ERRORS: rest} if np.abs(rest / size[:, None] / size).max() > _NEGLIGIBLE else {}


def _sampled(sample: SurfaceSample, where: Placement, shares: Mapping[str, Array]) -> _Sampled:
    """Budget of a sample of one scan."""
    length = np.linalg.norm(sample.xyz, axis=1)
    cosine = np.abs(np.einsum("ni,ni->n", sample.xyz, sample.normals)) / length
    incidence = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    budget = point_budget(sample.xyz, where, shares, sample.normals, sample.intensity)
    light = np.full(len(length), np.nan) if sample.intensity is None else sample.intensity
    share = None if where.noise is None else where.noise.shared_share
    return _Sampled(length, incidence, light, budget, share)


def _regions(station: str, sampled: Sequence[_Sampled]) -> list[BudgetRow]:
    """Rows of a station, from near and straight to far and slanted, then those without normals.

    After them those of the intensities, from dark to bright, of points whose surface is known.
    """
    names = sampled[0].budget.names
    pooled = _Pooled(
        station,
        names,
        np.concatenate([s.budget.variances for s in sampled], axis=1),
        np.concatenate([s.budget.along_normal for s in sampled], axis=1),
        _common_share(sampled),
    )
    length = np.concatenate([s.range for s in sampled])
    incidence = np.concatenate([s.incidence for s in sampled])
    at = np.digitize(length, RANGES) - 1
    slant = np.where(np.isnan(incidence), -1, np.digitize(incidence, _INCIDENCES[1:-1]))
    rows = []
    for i in range(len(RANGES) - 1):
        for j in (*range(len(_INCIDENCES) - 1), -1):
            rows += pooled.row((at == i) & (slant == j), _words(i, j), known=j >= 0)
    light = np.concatenate([s.intensity for s in sampled])
    known = np.isfinite(incidence)
    for low, high in _classes(light):
        inside = (light >= low) & (light <= high)
        faced = bool(np.count_nonzero(inside & known) >= _FEW)
        words = f"intensity {span(low, high)}"
        rows += pooled.row(inside & known if faced else inside, words, known=faced, by="intensity")
    return rows


def _classes(light: Array) -> list[tuple[float, float]]:
    """Limits of classes of intensities (n,) of about as many points; none where all are alike."""
    known = np.sort(light[np.isfinite(light)])
    if not len(known) or known[0] == known[-1]:
        return []
    parts = np.split(known, np.searchsorted(known, np.quantile(known, _QUARTERS), side="right"))
    return [(float(part[0]), float(part[-1])) for part in parts if len(part)]


def _common_share(sampled: Sequence[_Sampled]) -> float | None:
    """The share of ranges that neighbours have in common, where all scans say the same."""
    shares = {s.shared for s in sampled}
    return shares.pop() if len(shares) == 1 else None


@dataclass(frozen=True)
class _Pooled:
    """Variances (m, n) of the m parts of the budget of all points of a station, and by normals."""

    station: str
    names: tuple[str, ...]
    variance: Array
    normal: Array
    range_share: float | None

    def row(
        self,
        inside: NDArray[np.bool_],
        words: str,
        *,
        known: bool,
        by: Literal["region", "intensity"] = "region",
    ) -> list[BudgetRow]:
        """The row of some points (n,), known : with normals; none for a few points."""
        count = int(np.count_nonzero(inside))
        if count < _FEW:
            return []
        mean = self.variance[:, inside].mean(axis=1)
        across = self.normal[:, inside].mean(axis=1) if known else None
        parts = tuple(_part(name, k, mean, across) for k, name in enumerate(self.names))
        share = float(inside.mean())
        return [BudgetRow(self.station, words, count, share, parts, by, self.range_share)]


def _part(name: str, k: int, mean: Array, across: Array | None) -> BudgetPart:
    """One part of a region."""
    total = float(mean[k])
    along = None if across is None else float(across[k])
    return BudgetPart(name, total, along, None if along is None else total - along)


def _words(i: int, j: int) -> str:
    """A region in words."""
    low, high = RANGES[i], RANGES[i + 1]
    distance = (
        Sentence("over {low:mg}", low=low)
        if np.isinf(high)
        else Sentence("{low:mg~} to {high:mg}", low=low, high=high)
    )
    if j < 0:
        return Sentence("{distance}, surface unknown", distance=distance)
    return Sentence(
        "{distance}, {low:°g~} to {high:°g}",
        distance=distance,
        low=_INCIDENCES[j] * DEG,
        high=_INCIDENCES[j + 1] * DEG,
    )
