"""The error budget of every station: samples of its scans, regions, parts (method 5.1 and 5.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.cloud.budget import PointBudget, point_budget
from tribrach.cloud.placement import Placement
from tribrach.geometry.rotation import skew
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.job.surface_samples import sample_of
from tribrach.network.adjustment import Adjustment
from tribrach.network.contributions import by_category, contributions
from tribrach.registration.geometry_warnings import (
    TargetsAround,
    extrapolation_factor,
    targets_around,
)

__all__ = ["BudgetPart", "BudgetRow", "error_budget", "reach_sentences"]


@dataclass(frozen=True)
class BudgetPart:
    """A part of the budget: variance of all three directions, along the normal, in the surface.

    normal and tangential are None where no normals are known.
    """

    name: str
    variance: float
    normal: float | None
    tangential: float | None


@dataclass(frozen=True)
class BudgetRow:
    """A region of a station by range [m] and incidence [degrees]; share of the sampled points."""

    station: str
    region: str
    points: int
    share: float
    parts: tuple[BudgetPart, ...]

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
    state: Remembered,
) -> list[str]:
    """One sentence for each station whose scans are extrapolated; placements by scan name."""
    sentences = []
    for around in targets_around(adjustment):
        seen = [s for s in scans if s.station == around.station and s.origin_known]
        if not seen or len(around.targets) < 2:
            continue
        where = placements[seen[0].name]
        points = np.concatenate([where.pose @ sample_of(scan, state).xyz for scan in seen])
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
        f"the scans of station {around.station} reach {factor:.1f} times as far as its targets "
        f"surround: what the station leaves uncertain is {1e3 * among:.1f} mm at the targets and "
        f"{1e3 * out:.1f} mm out there (3D, 95 % of the points below); targets around the object "
        "would hold it"
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


#: regions with fewer sampled points are not worth a row
_FEW = 20


@dataclass(frozen=True)
class _Sampled:
    """Ranges, incidence angles (n,) [degrees], NaN where unknown, and the budget of the points."""

    range: Array
    incidence: Array
    budget: PointBudget


def error_budget(
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    adjustment: Adjustment,
    state: Remembered,
    factor: float = 1.0,
) -> list[BudgetRow]:
    """State the budget of the regions of every station whose points have a covariance.

    Parameters
    ----------
    scans, placements
        Scans, and where they stand by their names.
    adjustment
        The network that placed them.
    state
        Where samples of points are remembered.
    factor
        On a-priori covariances, as in the placements (a posteriori variance).
    """
    rows: list[BudgetRow] = []
    for station in dict.fromkeys(scan.station for scan in scans):
        shares = by_category(contributions(adjustment, station), factor)
        sampled = [
            _sampled(scan, placements[scan.name], shares, state)
            for scan in scans
            if scan.station == station and placements[scan.name].noise is not None
        ]
        if sampled:
            rows += _regions(station, sampled)
    return rows


def _sampled(
    scan: StationScan, where: Placement, shares: Mapping[str, Array], state: Remembered
) -> _Sampled:
    """Budget of a sample of one scan."""
    sample = sample_of(scan, state)
    length = np.linalg.norm(sample.xyz, axis=1)
    cosine = np.abs(np.einsum("ni,ni->n", sample.xyz, sample.normals)) / length
    incidence = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    budget = point_budget(sample.xyz, where, shares, sample.normals, sample.intensity)
    return _Sampled(length, incidence, budget)


def _regions(station: str, sampled: Sequence[_Sampled]) -> list[BudgetRow]:
    """Rows of a station, from near and straight to far and slanted, then those without normals."""
    length = np.concatenate([s.range for s in sampled])
    incidence = np.concatenate([s.incidence for s in sampled])
    names = sampled[0].budget.names
    variance = np.concatenate([s.budget.variances for s in sampled], axis=1)
    normal = np.concatenate([s.budget.along_normal for s in sampled], axis=1)
    at = np.digitize(length, RANGES) - 1
    slant = np.where(np.isnan(incidence), -1, np.digitize(incidence, _INCIDENCES[1:-1]))
    rows = []
    for i in range(len(RANGES) - 1):
        for j in (*range(len(_INCIDENCES) - 1), -1):
            inside = (at == i) & (slant == j)
            if np.count_nonzero(inside) < _FEW:
                continue
            mean = variance[:, inside].mean(axis=1)
            across = normal[:, inside].mean(axis=1) if j >= 0 else None
            rows.append(
                BudgetRow(
                    station=station,
                    region=_words(i, j),
                    points=int(np.count_nonzero(inside)),
                    share=float(inside.mean()),
                    parts=tuple(_part(name, k, mean, across) for k, name in enumerate(names)),
                )
            )
    return rows


def _part(name: str, k: int, mean: Array, across: Array | None) -> BudgetPart:
    """One part of a region."""
    total = float(mean[k])
    along = None if across is None else float(across[k])
    return BudgetPart(name, total, along, None if along is None else total - along)


def _words(i: int, j: int) -> str:
    """A region in words."""
    low, high = RANGES[i], RANGES[i + 1]
    distance = f"over {low:g} m" if np.isinf(high) else f"{low:g} to {high:g} m"
    if j < 0:
        return f"{distance}, surface unknown"
    return f"{distance}, {_INCIDENCES[j]:g} to {_INCIDENCES[j + 1]:g}°"
