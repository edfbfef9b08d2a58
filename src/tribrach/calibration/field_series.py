"""Tests the precision of a scanner by series of scans of a few targets from two stations.

Every scan of every series is a free set-up of its own; all of them and the targets are adjusted as
one free network, so that what is left are errors of the instrument and of finding targets. With t
targets and m scans the redundancy is ``(m - 1) (3 t - 6)``: 30 for four targets, two stations and
three series. The tests are those of the ISO 17123 family: the experimental standard deviation
against the stated one (chi-square), against an earlier one (F), and, since two stations see other
errors, what the stations differ by against what the series do (F).

The workflow follows what is published about ISO 17123-9:2018 (two stations, four targets, one or
three series); the text of the standard was not at hand, and no conformity with it is claimed
(method section 11.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.answers import Number, Result
from tribrach.calibration.quadratic_forms import equivalent_dof
from tribrach.calibration.scanner_readings import ScannerReadings
from tribrach.errors import InputError
from tribrach.geometry.polar import xyz_by_polar, xyz_from_polar
from tribrach.geometry.rotation import skew
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.scanner import TargetCentres
from tribrach.statistics import chi2, f


@dataclass(frozen=True)
class FTest(Result, also=("passed",)):
    """A ratio of two variances against its limits; the lower is zero in a one-sided test."""

    ratio: Number  #: first variance over the second
    #: degrees of freedom of both
    dof: tuple[float, float]
    lower: Number
    upper: Number

    @property
    def passed(self) -> bool:
        """True if the ratio is within the limits."""
        return self.lower <= self.ratio <= self.upper


@dataclass(frozen=True)
class SeriesCheck(
    Result, also=("passed",), without=("series", "s_bound", "largest", "largest_at", "alpha")
):
    """Repeated scans of a few targets."""

    scans: int
    targets: int
    series: int
    #: experimental standard deviation of a coordinate of a target centre [m], all coordinates
    #: weighted equally
    s: float
    dof: int  #: its redundancy
    #: degrees of freedom of the chi-square that spreads as s^2 does with the stated precision,
    #: since coordinates are neither independent nor equally precise
    dof_equivalent: float
    #: experimental standard deviation within each station's own series [m]
    s_station: dict[str, float]
    stated: float  #: standard deviation of a coordinate by the stated precision, mean [m]
    #: weighted sum of squares with the stated precision against its limit
    statistic: Number
    limit: Number
    p: Number  #: probability of as much by chance
    s_bound: float  #: largest true standard deviation that s does not contradict [m]
    #: what stations differ by against their own scatter; null without repeated series
    stations: FTest | None
    #: largest residual of a coordinate [m], and where
    largest: float
    largest_at: str
    alpha: float  #: error probability of each test

    @property
    def passed(self) -> bool:
        """True if the scanner is as precise as stated."""
        return self.statistic <= self.limit


def check_series(readings: ScannerReadings, alpha: float = 0.05) -> SeriesCheck:
    """Adjust all series and test them (method section 11.2)."""
    targets, scans = _complete(readings)
    keep = np.isin(readings.target, targets)
    readings = readings.take(keep)
    stated = _adjusted(readings, weighted=True)
    plain = _adjusted(readings, weighted=False)
    dof = plain.dof
    s2 = plain.vtpv / dof
    spread = _equivalent_dof(readings, plain)
    own = {
        str(name): _adjusted(readings.take(readings.station == name), weighted=False)
        for name in dict.fromkeys(readings.station)
        if len(set(readings.series[readings.station == name])) > 1
    }
    worst = int(np.argmax(np.abs(plain.residuals)))
    o = plain.network.observations[plain.rows.table[worst]]
    start, end = o.ends(plain.layout)[int(plain.rows.item[worst])]
    return SeriesCheck(
        scans=len(scans),
        targets=len(targets),
        series=len(set(readings.series)),
        s=float(np.sqrt(s2)),
        dof=dof,
        dof_equivalent=spread,
        s_station={name: float(np.sqrt(a.vtpv / a.dof)) for name, a in own.items()},
        stated=_coordinate_sigma(readings),
        statistic=stated.vtpv,
        limit=float(chi2.ppf(1 - alpha, dof)),
        p=float(chi2.sf(stated.vtpv, dof)),
        s_bound=float(np.sqrt(s2 * spread / chi2.ppf(alpha, spread))),
        stations=_between(readings, alpha),
        largest=float(plain.residuals[worst]),
        largest_at=f"{start} -> {end}",
        alpha=alpha,
    )


def against_earlier(
    now: float, dof_now: float, before: float, dof_before: float, alpha: float = 0.05
) -> FTest:
    """Compare an experimental standard deviation with an earlier one, two-sided (section 11.2)."""
    lower, upper = (float(f.ppf(q, dof_now, dof_before)) for q in (alpha / 2, 1 - alpha / 2))
    return FTest((now / before) ** 2, (dof_now, dof_before), lower, upper)


def _complete(readings: ScannerReadings) -> tuple[list[str], list[tuple[str, str]]]:
    """Targets that every scan has, and the scans."""
    scans = list(dict.fromkeys(zip(readings.station, readings.series, strict=True)))
    if len(scans) < 2:
        raise InputError(
            "there is one scan only", cure="scan the targets from two stations, or in series"
        )
    seen = [
        set(readings.target[(readings.station == s) & (readings.series == k)]) for s, k in scans
    ]
    common = set.intersection(*seen)
    targets = [str(t) for t in dict.fromkeys(readings.target) if t in common]
    if len(targets) < 3:
        raise InputError(
            f"all scans together have {len(targets)} targets in common",
            cure="the check takes four targets that every scan sees, and three at least",
        )
    return targets, scans


def _name(station: str, series: str) -> str:
    """Name of a scan: station and series."""
    return f"{station}, series {series}" if series else station


def _centres(readings: ScannerReadings) -> tuple[Array, Array]:
    """Centres (n, 3) in the scanner frames and their covariances (n, 3, 3)."""
    turn = xyz_by_polar(readings.polar)
    covariance = turn @ readings.covariance @ turn.transpose(0, 2, 1)
    return xyz_from_polar(readings.polar), (covariance + covariance.transpose(0, 2, 1)) / 2


def _equivalent_dof(readings: ScannerReadings, adjusted: Adjustment) -> float:
    """Degrees of freedom of the chi-square that spreads as the plain sum of squares does.

    A centre in a scanner's frame moves with its point, turned into that frame, and with the
    translation and the turn of the scanner; what is at right angles to all of these is left as
    residuals, and the eigenvalues of the covariance in there are the weights of their squares.
    """
    centres, covariance = _centres(readings)
    layout = adjusted.layout
    names = [_name(s, k) for s, k in zip(readings.station, readings.series, strict=True)]
    pose = {name: k for k, name in enumerate(dict.fromkeys(names))}
    point = {str(name): k for k, name in enumerate(dict.fromkeys(readings.target))}
    design = np.zeros((len(centres), 3, 3 * len(point) + 6 * len(pose)))
    for row, (name, target) in enumerate(zip(names, readings.target, strict=True)):
        turn = adjusted.state.pose_r[layout.index("pose", name)]
        at = 3 * point[str(target)]
        design[row, :, at : at + 3] = turn.T
        at = 3 * len(point) + 6 * pose[name]
        design[row, :, at : at + 3] = np.eye(3)
        design[row, :, at + 3 : at + 6] = skew(centres[row])
    size = 3 * len(centres)
    vectors, values, _ = np.linalg.svd(design.reshape(size, -1), full_matrices=True)
    rank = int((values > 1e-9 * values[0]).sum())
    left = vectors[:, rank:].reshape(len(centres), 3, -1)
    return equivalent_dof(
        np.linalg.eigvalsh(np.einsum("nia,nij,njb->ab", left, covariance, left, optimize=True))
    )


def _coordinate_sigma(readings: ScannerReadings) -> float:
    """Root of the mean variance of a coordinate [m], as stated."""
    return float(np.sqrt(np.einsum("nii->n", _centres(readings)[1]).mean() / 3))


def _adjusted(readings: ScannerReadings, *, weighted: bool) -> Adjustment:
    """The free network of all scans; with the stated covariances, or all coordinates alike.

    Coordinates that are all alike have a sigma of a metre, so that the variance factor is the
    variance of a coordinate.
    """
    survey = Survey(datum=Datum("free"))
    centres, covariance = _centres(readings)
    names = [_name(s, k) for s, k in zip(readings.station, readings.series, strict=True)]
    for name in dict.fromkeys(names):
        survey.station(name)
    survey.add(
        TargetCentres,
        values=centres,
        covariance=covariance if weighted else np.tile(np.eye(3), (len(centres), 1, 1)),
        station=names,
        target=[str(t) for t in readings.target],
        source=[str(s) for s in readings.source],
    )
    return adjust(survey.network())


def _between(readings: ScannerReadings, alpha: float) -> FTest | None:
    """Differences of stations against the scatter of their own series, by the stated weights.

    The sum of squares of all less those of each station by itself is what the stations differ by.
    """
    stations = list(dict.fromkeys(readings.station))
    parts = [readings.take(readings.station == name) for name in stations]
    if len(stations) < 2 or any(len(set(part.series)) < 2 for part in parts):
        return None
    whole = _adjusted(readings, weighted=True)
    own = [_adjusted(part, weighted=True) for part in parts]
    within, dof = sum(a.vtpv for a in own), sum(a.dof for a in own)
    more = whole.dof - dof
    ratio = (whole.vtpv - within) / more / (within / dof)
    return FTest(float(ratio), (more, dof), 0.0, float(f.ppf(1 - alpha, more, dof)))
