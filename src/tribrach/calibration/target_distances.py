"""Compares distances between targets from two stations: part of the field check of a scanner.

The distance between two targets does not depend on where it is measured from, but for errors of the
instrument: a range zero ``x10`` shortens it by up to ``2 x10`` where the station stands between the
targets and cancels where it stands on their line outside (method sections 4.2 and 11.3; the field
check of four targets and two stations follows what is published about DVW-Merkblatt 7, whose text
was not at hand). Differences of one station less the other are zero but for noise; their weighted
sum of squares is a chi-square with as many degrees of freedom as their covariance has directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.calibration.misalignment_search import Explanation, explain, whitened
from tribrach.calibration.scanner_readings import ScannerReadings
from tribrach.errors import InputError
from tribrach.geometry.polar import xyz_by_polar, xyz_from_polar
from tribrach.instruments.calibration import NIST
from tribrach.statistics import chi2, norm

__all__ = ["DISTANCE_PARAMETERS", "DistanceCheck", "compare_distances"]

#: targets whose distances are compared, evenly chosen from more
MOST = 40
#: parameters that means of faces still contain and distances show
DISTANCE_PARAMETERS = ("x10", "x1z", "x9z", "x12b", "x11a", "x11b", "x1n")
#: and those of readings of one face
_ONE_FACE = ("x2", "x4", "x6", "x3", "x7", "x9n")


@dataclass(frozen=True)
class DistanceCheck:
    """Differences of distances between targets, first station less second.

    Attributes
    ----------
    stations
        The two stations.
    series
        Its name, empty if there is only one.
    pairs
        Names of the targets of each of the p distances.
    lengths : array (p, 2)
        Distance from either station [m].
    difference, sigma : array (p,)
        Difference and its standard deviation [m].
    limit : array (p,)
        Limits so that all hold together with 1 - alpha or more [m].
    statistic, dof, critical
        Weighted sum of squares, its degrees of freedom and chi-square limit.
    p
        Probability of as much by chance.
    zero, sigma_zero
        Range zero from the differences alone [m].
    explanation
        Misalignments that explain the differences.
    alpha
        Error probability of the check.
    faces
        True if every reading is a mean of both faces.
    in_common
        Number of targets that both stations saw, of which MOST are compared at most.
    """

    stations: tuple[str, str]
    series: str
    pairs: tuple[tuple[str, str], ...]
    lengths: Array
    difference: Array
    sigma: Array
    limit: Array
    statistic: float
    dof: int
    critical: float
    p: float
    zero: float
    sigma_zero: float
    explanation: Explanation
    alpha: float
    faces: bool
    in_common: int

    @property
    def passed(self) -> bool:
        """True if all differences together are noise."""
        return self.statistic <= self.critical


def compare_distances(
    readings: ScannerReadings, first: str, second: str, series: str = "", alpha: float = 0.05
) -> DistanceCheck:
    """Compare distances between the targets that two stations have in common, in one series.

    Parameters
    ----------
    readings
        Means of faces.
    first, second
        The stations.
    series
        Name of the series.
    alpha
        Error probability of the check.

    Returns
    -------
    DistanceCheck
        Differences, their test, and what explains them.

    Raises
    ------
    InputError
        Fewer than three common targets.
    """
    rows_by_target = [_of(readings, station, series) for station in (first, second)]
    common = [t for t in rows_by_target[0] if t in rows_by_target[1]]
    in_common = len(common)
    if len(common) < 3:
        raise InputError(
            f"stations {first} and {second} have {len(common)} targets in common",
            cure="a field check takes four, and three at least",
        )
    if in_common > MOST:
        common = [common[int(k)] for k in np.linspace(0, in_common - 1, MOST)]
    parts = [readings.take(np.array([rows[t] for t in common])) for rows in rows_by_target]
    index = np.array(list(combinations(range(len(common)), 2)))
    faces = bool(all((part.face == 0).all() for part in parts))
    names = DISTANCE_PARAMETERS if faces else (*DISTANCE_PARAMETERS, *_ONE_FACE)
    computed = [_distances(part, index, names) for part in parts]
    lengths = np.stack([m[0] for m in computed], axis=1)
    difference = lengths[:, 0] - lengths[:, 1]
    covariance = computed[0][1] + computed[1][1]
    columns = computed[0][2] - computed[1][2]
    # distances between t targets are functions of 3 t - 6 numbers
    rank = min(len(index), 3 * len(common) - 6)
    white, design = whitened(covariance, rank, difference, columns)
    dof = len(white)
    statistic, critical = float(white @ white), float(chi2.ppf(1 - alpha, dof))
    each = 1 - (1 - alpha) ** (1 / len(index))
    sigma = np.sqrt(np.diag(covariance))
    weight = float(design[:, 0] @ design[:, 0])
    return DistanceCheck(
        stations=(first, second),
        series=series,
        pairs=tuple((common[i], common[j]) for i, j in index),
        lengths=lengths,
        difference=difference,
        sigma=sigma,
        limit=sigma * norm.ppf(1 - each / 2),
        statistic=statistic,
        dof=dof,
        critical=critical,
        p=float(chi2.sf(statistic, dof)),
        zero=float(design[:, 0] @ white) / weight if weight > 0 else float("nan"),
        sigma_zero=1 / np.sqrt(weight) if weight > 0 else float("inf"),
        explanation=explain(names, design, white),
        alpha=alpha,
        faces=faces,
        in_common=in_common,
    )


def _of(readings: ScannerReadings, station: str, series: str) -> dict[str, int]:
    """Row of each target of a station in a series."""
    inside = (readings.station == station) & (readings.series == series)
    return {str(readings.target[i]): int(i) for i in np.flatnonzero(inside)}


def _distances(
    part: ScannerReadings, index: NDArray[np.int64], names: tuple[str, ...]
) -> tuple[Array, Array, Array]:
    """Distances (p,), their covariance (p, p), and what parameters of one make of them (p, k)."""
    xyz = xyz_from_polar(part.polar)
    i, j = index.T
    chord = xyz[j] - xyz[i]
    length = np.linalg.norm(chord, axis=1)
    unit = chord / length[:, None]
    turn = xyz_by_polar(part.polar)
    by_polar = np.zeros((len(index), len(xyz), 3))
    rows = np.arange(len(index))
    by_polar[rows, j] = np.einsum("pi,pij->pj", unit, turn[j])
    by_polar[rows, i] = -np.einsum("pi,pij->pj", unit, turn[i])
    covariance = np.einsum("pti,tij,qtj->pq", by_polar, part.covariance, by_polar, optimize=True)
    model = NIST.select(names)
    r, h, v = part.polar.T
    # measured = true - Delta; a mean of faces keeps the part that does not change its sign
    sides = [model.columns(r, h, v, np.full(len(r), face)) for face in (1.0, -1.0)]
    mean = (sides[0] + sides[1]) / 2
    own = np.where((part.face < 0)[:, None, None], sides[1], sides[0])
    b = np.where((part.face == 0)[:, None, None], mean, own)
    return length, covariance, -np.einsum("pti,tik->pk", by_polar, b)
