"""Compares the observed distance of two clouds with what their uncertainty predicts.

Predicted along the normal of the surface, from the joint covariance of both stations and the noise
of single points of each scan (method sections 5.1, 5.2, 9.3): ``s^2 = n^T (C_1 + C_2 + C_reg) n``.
Observed without any sampling in it: the scatter of each cloud about its own mean in projection
cylinders, and the mean distance of one from the other, ``o^2 = s_1^2 + s_2^2 + L^2``. The scatter
is new with every point, the distance is one draw that all points of a site share, and neighbouring
sites too. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pykdtree.kdtree import KDTree
from scipy.spatial import cKDTree

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.comparison.cloud_parts import CloudChunk, Source
from tribrach.comparison.m3c2_ep import M3C2EP
from tribrach.comparison.station_pair import StationPair
from tribrach.instruments.neighbours import overlap_share
from tribrach.scan.normals import FLATTEST
from tribrach.statistics import chi2

#: observed over predicted is as predicted within these limits
BAND = (0.9, 1.1)
#: a ratio is worth a verdict if its own standard error is at most this
_ERROR = 0.03
#: core points whose neighbours are looked at, at most
_LOOKED_AT = 20_000
#: of the test of all offsets together, and of one site among many
_LEVEL, _SITE_LEVEL = 0.95, 0.9973


def with_random(
    stream: Callable[[], Iterable[Array]],
    placement: Placement,
    core: Array,
    normals: Array,
    *,
    incidence: bool = True,
) -> Source:
    """Give a cloud the random covariance of its points, ``C_int`` carried into its frame.

    Chunks are (n, 3), or (n, 4) with their intensity as in the file, NaN where unknown. A point
    takes the normal of the nearest core point. ``incidence`` divides sigmas of ranges by the
    cosine.
    """
    if placement.noise is None:
        raise ValueError("points without a scanner origin have no covariance")
    alone = Placement(placement.station, placement.pose, np.zeros((6, 6)), placement.noise.random)
    known = np.isfinite(normals[:, 0])
    origin = core.mean(axis=0)
    tree = KDTree(core[known] - origin) if known.any() else None

    def chunks() -> Iterable[CloudChunk]:
        for chunk in stream():
            xyz, cosine = np.ascontiguousarray(chunk[:, :3]), None
            light = chunk[:, 3] if chunk.shape[1] > 3 else None
            if incidence and tree is not None and len(xyz):
                nearest = normals[known][tree.query(xyz - origin)[1]]
                beam = xyz - placement.pose.translation
                along = np.abs(np.einsum("ni,ni->n", beam, nearest))
                cosine = np.clip(along / np.linalg.norm(beam, axis=1), FLATTEST, 1.0)
            local = placement.pose.inverse @ xyz
            yield CloudChunk(xyz, covariances(local, alone, cosine, light))

    return chunks


@dataclass(frozen=True)
class Prediction(
    Result,
    without=("noise", "scatter", "dof", "offset_noise", "row"),
    also=(
        "sigma",
        "observed",
        "ratio",
        "noise_b",
        "noise_a",
        "scatter_b",
        "scatter_a",
        "noise_ratio",
        "noise_ratio_error",
        "enough",
        "offset_sigma",
        "offset_agrees",
        "verdict",
    ),
):
    """Predicted and observed distance along the normal [m]."""

    #: predicted noise and observed scatter of single points, of the first and the second cloud
    noise: tuple[float, float]
    scatter: tuple[float, float]
    dof: tuple[int, int]  #: degrees of freedom of each scatter
    registration: float  #: predicted sigma between the stations at the site
    offset: float  #: mean distance of the second cloud from the first
    offset_noise: float  #: sigma of the offset from the points alone
    row: tuple[float, ...]  #: what the unknowns of both stations (12 + k,) do to the offset
    #: mean levels of detection with propagated uncertainty
    lod95: float
    lod95_additive: float
    #: as published, to compare with other programs; its false alarms are 0.5 to 36 %, not 5
    lod95_spatial: float | None
    changed: float  #: share of the distances beyond the first level
    angles: float = 0.0  #: largest sigma that systematic angles of both scans add to the offset

    @property
    def noise_a(self) -> float:
        """Predicted noise of single points of the second cloud, A."""
        return self.noise[1]

    @property
    def noise_b(self) -> float:
        """Predicted noise of single points of the first cloud, B."""
        return self.noise[0]

    @property
    def scatter_a(self) -> float:
        """Observed scatter of single points of the second cloud, A."""
        return self.scatter[1]

    @property
    def scatter_b(self) -> float:
        """Observed scatter of single points of the first cloud, B."""
        return self.scatter[0]

    @property
    def sigma(self) -> float:
        """Predicted sigma of the distance between single points of both clouds."""
        return float(np.hypot(np.hypot(*self.noise), self.offset_floor))

    @property
    def observed(self) -> float:
        """The same as observed: scatter of both clouds and distance between them."""
        return float(np.hypot(np.hypot(*self.scatter), self.offset))

    @property
    def ratio(self) -> float:
        """Observed over predicted."""
        return self.observed / self.sigma

    @property
    def noise_ratio(self) -> float:
        """Observed scatter of single points over the predicted noise of both clouds."""
        return float(np.hypot(*self.scatter) / np.hypot(*self.noise))

    @property
    def noise_ratio_error(self) -> float:
        """Standard error of that ratio, if the noise is as predicted."""
        shares = [s**4 / (2 * max(n, 1)) for s, n in zip(self.noise, self.dof, strict=True)]
        return float(np.sqrt(sum(shares)) / np.hypot(*self.noise) ** 2)

    @property
    def enough(self) -> bool:
        """True if there are points enough to tell ten per cent."""
        return self.noise_ratio_error <= _ERROR

    @property
    def offset_floor(self) -> float:
        """Sigma of the offset that no number of points makes smaller: stations and angles."""
        return float(np.hypot(self.registration, self.angles))

    @property
    def offset_sigma(self) -> float:
        """Predicted sigma of the offset, with stations, angles and points."""
        return float(np.hypot(self.offset_floor, self.offset_noise))

    @property
    def offset_agrees(self) -> bool:
        """True if ``offset^2 / sigma^2`` is below chi-square of one at 99.7 %.

        That is three sigma: one of many sites beyond two is nothing to be told of.
        """
        return self.offset**2 <= float(chi2.ppf(_SITE_LEVEL, 1)) * self.offset_sigma**2

    @property
    def noise_agrees(self) -> bool:
        """True if the scatter is within ten per cent, or chance explains what it is beyond it."""
        reach = 1.96 * self.noise_ratio_error
        return BAND[0] - reach <= self.noise_ratio <= BAND[1] + reach

    @property
    def verdict(self) -> str:
        """The comparison in words."""
        words = []
        if not self.enough:
            words.append("too few points to tell 10 %")
        elif not self.noise_agrees:
            more = "more" if self.noise_ratio > 1 else "less"
            words.append(f"scatter {more} than predicted")
        if not self.offset_agrees:
            words.append("farther apart than predicted")
        return ", ".join(words) or "as predicted"


def predict(result: M3C2EP, stations: StationPair, diameter: float) -> Prediction | None:
    """Sum up distances with propagated uncertainty; overlapping cylinders count for less."""
    used = result.usable & np.isfinite(result.distance) & np.isfinite(result.sigma)
    if not used.any():
        return None
    one, two = result.first, result.second
    dof = [np.maximum(cloud.count[used] - 1, 0) for cloud in (one, two)]
    shared = multiplicity(result.core[used], result.normals.vectors[used], diameter)
    core, normals = result.core[used], result.normals.vectors[used]
    row = stations.mean_row(core, normals)
    spatial = result.lod95_spatial[used]
    distance, level = result.distance[used], result.lod95_quadratic[used]
    return Prediction(
        noise=(_pooled(one.expected[used], dof[0]), _pooled(two.expected[used], dof[1])),
        scatter=(_pooled(one.spread[used], dof[0]), _pooled(two.spread[used], dof[1])),
        dof=(int(dof[0].sum() / shared), int(dof[1].sum() / shared)),
        registration=float(np.sqrt(max(float(row @ stations.covariance @ row), 0.0))),
        offset=float(distance.mean()),
        offset_noise=float(np.sqrt(shared * (result.sigma_random[used] ** 2).mean() / used.sum())),
        row=tuple(row.tolist()),
        lod95=float(level.mean()),
        lod95_additive=float(result.lod95_additive[used].mean()),
        lod95_spatial=float(np.nanmean(spatial)) if np.isfinite(spatial).any() else None,
        changed=float((np.abs(distance) > level).mean()),
        angles=stations.mean_angles(core, normals),
    )


def multiplicity(core: Array, normals: Array, diameter: float) -> float:
    """In how many cylinders each point is, on the average: mean sum of the shares in common.

    Two cylinders have the share of two discs in common, their axes so far apart as they are across
    the normal.
    """
    chosen = np.unique(np.linspace(0, len(core) - 1, min(len(core), _LOOKED_AT)).astype(np.int64))
    tree = cKDTree(core)
    near = [np.asarray(some) for some in tree.query_ball_point(core[chosen], 1.5 * diameter)]
    first = np.repeat(chosen, [len(some) for some in near])
    between = core[np.concatenate(near)] - core[first]
    along = np.einsum("ni,ni->n", between, normals[first])
    across = np.sqrt(np.maximum((between**2).sum(axis=1) - along**2, 0.0))
    return float(overlap_share(across / diameter).sum() / len(chosen))


def _pooled(sigma: Array, dof: NDArray[np.int64]) -> float:
    """Standard deviations (m,) over all cylinders, each for its degrees of freedom."""
    return float(np.sqrt(np.average(np.nan_to_num(sigma) ** 2, weights=dof)))


@dataclass(frozen=True)
class OffsetTest(Result, also=("agrees",)):
    """The offsets of all sites against the joint covariance of both stations."""

    count: int  #: number of sites
    statistic: float  #: ``L^T C^-1 L`` with ``C = A S A^T + D``, what the sites share included
    #: 2.5 and 97.5 % of chi-square of their number; 0 where nothing can be too small, since what
    #: angles err by is a bound and no sigma
    least: float
    limit: float

    @property
    def agrees(self) -> bool:
        """True if the offsets are as large as predicted, and not smaller either."""
        return self.least <= self.statistic <= self.limit


def compare_offsets(predictions: Sequence[Prediction], stations: StationPair) -> OffsetTest | None:
    """Test the offsets of all sites of one pair of stations together."""
    if not predictions:
        return None
    rows = np.array([one.row for one in predictions])
    offsets = np.array([one.offset for one in predictions])
    noise = np.array([one.offset_noise for one in predictions])
    angles = np.array([one.angles for one in predictions])

    def statistic(own: Array) -> float:
        covariance = rows @ stations.covariance @ rows.T + np.diag(own**2)
        return float(offsets @ np.linalg.solve(covariance, offsets))

    k = len(predictions)
    tail = (1 - _LEVEL) / 2
    found, least = statistic(np.hypot(noise, angles)), float(chi2.ppf(tail, k))
    # systematic angles are a bound: offsets may be as small as they would be without them
    if found < least <= statistic(noise):
        least = 0.0
    return OffsetTest(k, found, least, float(chi2.ppf(1 - tail, k)))
