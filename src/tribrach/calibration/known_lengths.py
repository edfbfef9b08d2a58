"""Compares distances between targets with known ones: what two stations cannot see of a scanner.

A scale of the range is the same at every station, so that no comparison of stations shows it; it
takes lengths from elsewhere, of a total station, a tracker or control points. With the measured
mean distances ``d`` of every station, the known ones ``l`` and the range zero ``x10``,

``d - l = s l + x10 c``

gives the scale s beside the range zero, whose columns c are those of the comparison of stations
(method section 11.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.calibration.misalignment_search import whitened
from tribrach.calibration.scanner_readings import ScannerReadings
from tribrach.calibration.target_distances import measured_distances
from tribrach.statistics import chi2, norm

__all__ = ["KnownLengths", "LengthCheck", "compare_lengths"]

#: directions of a covariance with a smaller share of its largest variance have no own information:
#: what is left there is of second order in the errors
_DIRECTION = 1e-6


@dataclass(frozen=True)
class KnownLengths:
    """Distances between targets that are known.

    Attributes
    ----------
    pairs : tuple of k pairs of str
        Their targets.
    lengths : array (k,)
        Distances [m].
    covariance : array (k, k)
        Their covariance [m^2].
    entries : tuple of (str, tuple of int)
        What the table states and can state wrongly, in words, with the lengths that it makes: a
        distance its own, coordinates of a point all those of the point.
    without_sigma : tuple of str
        Targets with coordinates that state no sigma and so make no known length.
    """

    pairs: tuple[tuple[str, str], ...]
    lengths: Array
    covariance: Array
    entries: tuple[tuple[str, tuple[int, ...]], ...] = ()
    without_sigma: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.pairs)


@dataclass(frozen=True)
class LengthCheck:
    """Measured distances less known ones.

    Attributes
    ----------
    stations : tuple of k str
        From where each was measured; means over the series of a station.
    pairs : tuple of k pairs of str
        Targets of each.
    lengths : array (k, 2)
        Measured and known [m].
    difference, sigma : array (k,)
        Measured less known, and its standard deviation [m].
    limit : array (k,)
        Limits so that all hold together with 1 - alpha or more [m].
    statistic, dof, critical
        Weighted sum of squares of all, its degrees of freedom and chi-square limit.
    p
        Probability of as much by chance.
    scale, sigma_scale
        Scale of the range.
    with_zero
        True if it was estimated beside a range zero.
    t_limit
        Largest ratio of scale and its sigma.
    alpha
        Error probability of both tests together.
    """

    stations: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    lengths: Array
    difference: Array
    sigma: Array
    limit: Array
    statistic: float
    dof: int
    critical: float
    p: float
    scale: float
    sigma_scale: float
    with_zero: bool
    t_limit: float
    alpha: float

    @property
    def scale_passed(self) -> bool:
        """True if no scale is significant."""
        return not abs(self.scale) > self.t_limit * self.sigma_scale

    @property
    def passed(self) -> bool:
        """True if the differences are noise and there is no scale."""
        return self.statistic <= self.critical and self.scale_passed


def compare_lengths(
    readings: ScannerReadings, known: KnownLengths, alpha: float = 0.05
) -> LengthCheck | None:
    """Compare mean distances of every station with known lengths (method section 11.3).

    Parameters
    ----------
    readings
        Means of faces; every station and series is a scan.
    known
        The lengths.
    alpha
        Error probability of the check.

    Returns
    -------
    LengthCheck or None
        None if no station saw both ends of a known length in all of its scans.
    """
    parts = [
        part
        for name in dict.fromkeys(str(s) for s in readings.station)
        if (part := _of_station(readings, known, name)) is not None
    ]
    if not parts:
        return None
    row = np.concatenate([part[0] for part in parts])
    measured = np.concatenate([part[1] for part in parts])
    zero = np.concatenate([part[3] for part in parts])
    difference = measured - known.lengths[row]
    covariance = known.covariance[np.ix_(row, row)].copy()
    at = 0
    for part in parts:
        end = at + len(part[0])
        covariance[at:end, at:end] += part[2]
        at = end
    value = np.linalg.eigvalsh(covariance)
    rank = int((value > _DIRECTION * value[-1]).sum())
    columns = np.stack([known.lengths[row], zero], axis=1)
    white, design = whitened(covariance, rank, difference, columns)
    half = 1 - np.sqrt(1 - alpha)
    each = 1 - (1 - alpha) ** (1 / len(row))
    sigma = np.sqrt(np.diag(covariance))
    statistic, dof = float(white @ white), len(white)
    scale, sigma_scale, with_zero = _scale(white, design)
    return LengthCheck(
        stations=tuple(name for part in parts for name in [part[4]] * len(part[0])),
        pairs=tuple(known.pairs[k] for k in row),
        lengths=np.stack([measured, known.lengths[row]], axis=1),
        difference=difference,
        sigma=sigma,
        limit=sigma * norm.ppf(1 - each / 2),
        statistic=statistic,
        dof=dof,
        critical=float(chi2.ppf(1 - half, dof)),
        p=float(chi2.sf(statistic, dof)),
        scale=scale,
        sigma_scale=sigma_scale,
        with_zero=with_zero,
        t_limit=float(norm.ppf(1 - half / 2)),
        alpha=alpha,
    )


def _of_station(
    readings: ScannerReadings, known: KnownLengths, station: str
) -> tuple[Index, Array, Array, Array, str] | None:
    """Rows of the known lengths that a station has, its means, covariance and column of x10."""
    own = readings.take(readings.station == station)
    ends = {name for pair in known.pairs for name in pair}
    own = own.take(np.array([str(t) in ends for t in own.target], dtype=bool))
    scans = set(own.series)
    times: Mapping[str, int] = {t: int((own.target == t).sum()) for t in ends}
    complete = {t for t, count in times.items() if count == len(scans) and count}
    row = np.array(
        [k for k, (a, b) in enumerate(known.pairs) if a in complete and b in complete],
        dtype=np.int64,
    )
    if not len(row):
        return None
    used = {name for k in row for name in known.pairs[k]}
    own = own.take(np.array([str(t) in used for t in own.target], dtype=bool))
    measured = measured_distances(own, station, least=2, most=len(used))
    mean, covariance, columns = measured.mean(station)
    place = {frozenset(pair): k for k, pair in enumerate(measured.pairs)}
    take = np.array([place[frozenset(known.pairs[k])] for k in row])
    at = measured.parameters.index("x10")
    return row, mean[take], covariance[np.ix_(take, take)], columns[take, at], station


def _scale(white: Array, design: Array) -> tuple[float, float, bool]:
    """Scale by least squares beside a range zero, or alone where that cannot be told from it."""
    size = np.linalg.norm(design, axis=0)
    unit = design / np.where(size > 0, size, 1.0)
    # both at once only where the columns differ by a tenth of a radian or more
    with_zero = len(white) > 1 and size[1] > 0 and 1 - (unit[:, 0] @ unit[:, 1]) ** 2 > 1e-2
    part = design if with_zero else design[:, :1]
    cofactor = np.linalg.inv(part.T @ part)
    value = cofactor @ (part.T @ white)
    return float(value[0]), float(np.sqrt(cofactor[0, 0])), bool(with_zero)
