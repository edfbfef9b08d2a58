"""The distance statistics of ISO 17123-9:2018 from scans of targets from two stations.

Simplified procedure: one series from either station; each difference ``Delta_ij`` of a distance
from the first and from the second station is compared with ``z 2 u_T`` for a stated uncertainty
``u_T`` of a target. Full procedure: three series; the ``Delta_ij`` of the means are compared with
``z 2 u_T / sqrt(3)``, and the residuals of all distances against their means give
``u_ISO-TLS = sqrt(Omega / nu / 2)``, the uncertainty of a target that the distances show, with
``nu = p (m - 1)`` for p distances in m scans, 30 for six in six. It is tested against a stated one
by chi-square and against another day or instrument by F (method section 11.6).

The text of the standard was not at hand. These formulas are those of a published computer program
for both procedures that names its clauses (7.5, 8.3, 8.4.2, 8.4.3, 8.5.1); where targets and
stations have to stand is not known from there.

The standard takes distances for independent and all targets for equally good. They are neither: six
distances share four targets, and ranges and angles are not equally precise. So each limit of the
standard stands beside the rate with which a scanner exceeds it that is as precise as stated, and
the verdict is that of the distribution that the sum of squares really has.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.answers import Number, Result, Table, Vector
from tribrach.calibration.field_series import FTest
from tribrach.calibration.quadratic_forms import (
    equivalent_dof,
    exceedance,
    quantile,
    ratio_quantile,
)
from tribrach.calibration.scanner_readings import ScannerReadings
from tribrach.calibration.target_distances import MeasuredDistances, measured_distances
from tribrach.statistics import chi2, norm

#: scanners as precise as stated whose differences beyond the limit are counted
_DRAWS = 4000
#: targets, and series of either station in the simplified and in the full procedure
TARGETS, SIMPLIFIED, FULL = 4, 1, 3


@dataclass(frozen=True)
class DistanceUncertainty(Result, also=("passed",)):
    """The uncertainty of a target that repeated distances show [m]."""

    #: ``u_ISO-TLS``: root of the mean square of the residuals of all distances over sqrt(2)
    u: float
    dof: int  #: ``nu = p (m - 1)``
    #: of the chi-square with the same mean and variance, as distances are correlated
    dof_equivalent: float
    within: tuple[Number, Number]  #: the same of the series of either station by themselves
    standard_limit: Number  #: largest u by the chi-square of nu, as the standard has it
    standard_rate: Number  #: probability that a scanner as precise as stated exceeds it
    limit: Number  #: largest u by the distribution of correlated distances
    p: Number  #: probability of as much by chance, of the same
    #: variance within the first station over that within the second, each over what is stated,
    #: against two-sided limits
    stations: FTest

    @property
    def passed(self) -> bool:
        """True if the distances are as precise as stated."""
        return self.u <= self.limit


@dataclass(frozen=True)
class TargetDifferences(Table):
    """``Delta_ij``: a mean distance from the first station less that from the second [m]."""

    from_: tuple[str, ...]
    to: tuple[str, ...]
    difference: Vector


@dataclass(frozen=True)
class DistanceStatistics(Result, also=("beyond", "procedure"), without=("alpha_standard",)):
    """Distance statistics of ISO 17123-9; the procedure is empty where its numbers are others."""

    stations: tuple[str, str]
    scans: tuple[int, int]  #: number of series of either
    #: number of targets
    targets: int
    differences: TargetDifferences
    #: ``u_T`` of the stated precision [m]: root of half of the mean variance of a distance
    u_stated: float
    difference_limit: float  #: ``z u_T sqrt(2 / n_1 + 2 / n_2)``, for each difference by itself [m]
    #: how many differences of a scanner as precise as stated are beyond it on average
    expected_beyond: float
    #: probability that such a scanner has as many beyond it as this one, or more; differences
    #: share targets, so that their number varies more than that of independent ones
    beyond_rate: float
    #: what repeated series show, null if a station has only one
    repeated: DistanceUncertainty | None
    alpha_standard: float  #: error probability of the limits of the standard
    #: what the numbers of targets, stations and series of the standard differ in
    departures: tuple[str, ...]

    @property
    def beyond(self) -> int:
        """Number of differences beyond the limit of the standard."""
        return int((np.abs(self.differences.difference) > self.difference_limit).sum())

    @property
    def procedure(self) -> str:
        """The procedure whose numbers these are: simplified, full, or none of them."""
        if self.departures:
            return ""
        return "simplified" if self.scans[0] == SIMPLIFIED else "full"


def distance_statistics(
    readings: ScannerReadings,
    first: str,
    second: str,
    alpha: float = 0.05,
    alpha_standard: float = 0.05,
) -> DistanceStatistics:
    """State the distance statistics of the standard for two stations (method section 11.6)."""
    measured = measured_distances(readings, first, second)
    sides = [measured.mean(name) for name in (first, second)]
    scans = (measured.station.count(first), measured.station.count(second))
    u_stated = float(np.sqrt(measured.variances.mean() / 2))
    z = float(norm.ppf(1 - alpha_standard / 2))
    limit = z * u_stated * float(np.sqrt(2 / scans[0] + 2 / scans[1]))
    sigma = np.sqrt(np.diag(sides[0][1] + sides[1][1]))
    difference = sides[0][0] - sides[1][0]
    beyond = int((np.abs(difference) > limit).sum())
    return DistanceStatistics(
        stations=(first, second),
        scans=scans,
        targets=len(measured.targets),
        differences=TargetDifferences(*measured.ends, difference),
        u_stated=u_stated,
        difference_limit=limit,
        expected_beyond=float(2 * norm.sf(limit / sigma).sum()),
        beyond_rate=_rate(measured, limit, beyond),
        repeated=_repeated(measured, first, u_stated, alpha, alpha_standard)
        if min(scans) > 1
        else None,
        alpha_standard=alpha_standard,
        departures=_departures(readings, measured, scans),
    )


def _rate(measured: MeasuredDistances, limit: float, beyond: int) -> float:
    """Probability of as many differences beyond a limit [m] if readings are as precise as stated.

    A difference is ``sum F_s z_s / n_a - sum F_s z_s / n_b`` over the scans of both stations.
    """
    if beyond == 0:
        return 1.0
    rng = np.random.default_rng(0)
    number = [measured.station.count(name) for name in measured.station]
    # the sign of a station does not matter for independent normal z
    root = np.hstack([f / n for f, n in zip(measured.roots, number, strict=True)])
    as_many = 0
    for _ in range(_DRAWS // 200):
        drawn = np.abs(root @ rng.standard_normal((root.shape[1], 200)))
        as_many += int(((drawn > limit).sum(axis=0) >= beyond).sum())
    return as_many / _DRAWS


def _departures(
    readings: ScannerReadings, measured: MeasuredDistances, scans: tuple[int, int]
) -> tuple[str, ...]:
    """Departures from the numbers of the standard, in words."""
    out = []
    if measured.in_common != TARGETS:
        out.append(f"which has four targets; here there are {measured.in_common}")
    stations = len(set(readings.station))
    if stations != 2:
        out.append(f"it has two stations, here are {stations}, taken in pairs")
    if scans not in ((SIMPLIFIED, SIMPLIFIED), (FULL, FULL)):
        out.append(
            "it has one series from either station or three, here are "
            + (f"{scans[0]}" if scans[0] == scans[1] else f"{scans[0]} and {scans[1]}")
        )
    return tuple(out)


def _repeated(
    measured: MeasuredDistances, first: str, u_stated: float, alpha: float, alpha_standard: float
) -> DistanceUncertainty:
    """What the residuals of repeated distances show."""
    of_first = np.array([name == first for name in measured.station])
    every = np.ones(len(of_first), dtype=bool)
    total, weights = _residuals(measured, every)
    own = [_residuals(measured, chosen) for chosen in (of_first, ~of_first)]
    dof = len(measured.index) * (len(every) - 1)
    dofs = [len(measured.index) * (int(chosen.sum()) - 1) for chosen in (of_first, ~of_first)]
    standard = u_stated * float(np.sqrt(chi2.ppf(1 - alpha_standard, dof) / dof))
    ratio = (own[0][0] / own[0][1].sum()) / (own[1][0] / own[1][1].sum())
    relative = [w / w.sum() for _, w in own]
    return DistanceUncertainty(
        u=float(np.sqrt(total / dof / 2)),
        dof=dof,
        dof_equivalent=equivalent_dof(weights),
        within=(
            float(np.sqrt(own[0][0] / dofs[0] / 2)),
            float(np.sqrt(own[1][0] / dofs[1] / 2)),
        ),
        standard_limit=standard,
        standard_rate=exceedance(2 * dof * standard**2, weights),
        limit=float(np.sqrt(quantile(1 - alpha, weights) / dof / 2)),
        p=exceedance(total, weights),
        stations=FTest(
            float(ratio),
            (equivalent_dof(relative[0]), equivalent_dof(relative[1])),
            ratio_quantile(alpha_standard / 2, *relative),
            ratio_quantile(1 - alpha_standard / 2, *relative),
        ),
    )


def _residuals(measured: MeasuredDistances, chosen: Array) -> tuple[float, Array]:
    """Sum of squares [m^2] of distances against their mean over some scans, and its weights.

    The residuals are ``P F z`` with the projector P on differences between scans, so that weights
    are the eigenvalues of ``F^T P F``, made of blocks ``P_st F_s^T F_t``.
    """
    lengths, roots = measured.lengths[chosen], measured.roots[chosen]
    scans = len(lengths)
    projector = np.eye(scans) - 1 / scans
    blocks = np.einsum("st,spi,tpj->sitj", projector, roots, roots, optimize=True)
    size = scans * roots.shape[2]
    weights = np.linalg.eigvalsh(blocks.reshape(size, size))
    good = weights[weights > 1e-10 * weights[-1]]
    return float(np.square(lengths - lengths.mean(axis=0)).sum()), good
