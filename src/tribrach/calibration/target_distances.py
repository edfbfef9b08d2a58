"""Compares distances between targets from two stations: part of the field check of a scanner.

The distance between two targets does not depend on where it is measured from, but for errors of the
instrument: a range zero ``x10`` shortens it by up to ``2 x10`` where the station stands between the
targets and cancels where it stands on their line outside (method sections 4.2 and 11.3; the field
check of four targets and two stations follows what is published about DVW-Merkblatt 7, whose text
was not at hand). Means over the series of one station less those of the other are zero but for
noise; their weighted sum of squares is a chi-square with as many degrees of freedom as their
covariance has directions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.answers import Estimate, Matrix, Table, Test, Vector
from tribrach.calibration.misalignment_search import Explanation, explain, whitened
from tribrach.calibration.scanner_readings import ScannerReadings
from tribrach.errors import InputError
from tribrach.geometry.polar import xyz_by_polar, xyz_from_polar
from tribrach.instruments.calibration import NIST
from tribrach.statistics import chi2, norm

#: targets whose distances are compared, evenly chosen from more
MOST = 40
#: parameters that means of faces still contain and distances show
DISTANCE_PARAMETERS = ("x10", "x1z", "x9z", "x12b", "x11a", "x11b", "x1n")
#: and those of readings of one face
_ONE_FACE = ("x2", "x4", "x6", "x3", "x7", "x9n")


@dataclass(frozen=True)
class MeasuredDistances:
    """Distances between targets in each of m scans."""

    station: tuple[str, ...]  #: of each scan
    targets: tuple[str, ...]  #: that every scan has, MOST of them at most
    index: NDArray[np.int64]  #: (p, 2), targets of each distance
    lengths: Array  #: (m, p), distances [m]
    roots: Array  #: (m, p, 3 t), ``F`` with the covariance ``F F^T`` of the distances of a scan [m]
    columns: Array  #: (m, p, k), what parameters of one make of them
    parameters: tuple[str, ...]  #: their names
    faces: bool  #: true if every reading is a mean of both faces
    in_common: int  #: number of targets that all scans have

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Names of the targets of each distance."""
        return tuple(zip(*self.ends, strict=True))

    @property
    def ends(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names of the first and of the second target of each distance."""
        first, second = (tuple(self.targets[k] for k in column) for column in self.index.T)
        return first, second

    @property
    def variances(self) -> Array:
        """Variances (m, p) of the distances [m^2]."""
        out: Array = np.einsum("mpt,mpt->mp", self.roots, self.roots)
        return out

    @property
    def rank(self) -> int:
        """Numbers behind the distances: t targets have 3 t - 6."""
        return min(len(self.index), 3 * len(self.targets) - 6)

    def mean(self, station: str) -> tuple[Array, Array, Array]:
        """Mean distances (p,) of a station, their covariance (p, p) and columns (p, k)."""
        scans = [k for k, name in enumerate(self.station) if name == station]
        covariance = sum(self.roots[k] @ self.roots[k].T for k in scans) / len(scans) ** 2
        return self.lengths[scans].mean(axis=0), covariance, self.columns[scans].mean(axis=0)


@dataclass(frozen=True)
class TargetPairs(Table):
    """A distance between two targets from two stations [m]."""

    from_: tuple[str, ...]
    to: tuple[str, ...]
    lengths: Matrix  #: mean distance from either station
    #: first station less second
    difference: Vector
    sigma: Vector
    limit: Vector  #: limits that hold together with 1 - alpha or more


@dataclass(frozen=True)
class DistanceCheck(Test, without=("alpha", "in_common")):
    """Distances between targets from two stations."""

    stations: tuple[str, str]
    #: number of series of either, over which means are taken
    scans: tuple[int, int]
    pairs: TargetPairs
    #: zero of ranges from the differences alone [m]
    range_zero: Estimate
    explanation: Explanation
    alpha: float  #: error probability of the check
    in_common: int  #: number of targets that all scans have, of which MOST are compared at most


def measured_distances(
    readings: ScannerReadings, *stations: str, least: int = 3, most: int = MOST
) -> MeasuredDistances:
    """Measure the distances between the targets that all scans of some stations have in common."""
    scans = _scans(readings, stations)
    rows = [_of(readings, name, one) for name, one in scans]
    common = common_targets(readings, *stations)
    in_common = len(common)
    if in_common < least:
        raise InputError(
            f"stations {' and '.join(stations)} have {in_common} targets in common",
            cure="a field check takes four, and three at least",
        )
    if in_common > most:
        common = [common[int(k)] for k in np.linspace(0, in_common - 1, most)]
    parts = [readings.take(np.array([scan[t] for t in common])) for scan in rows]
    index = np.array(list(combinations(range(len(common)), 2)))
    faces = bool(all((part.face == 0).all() for part in parts))
    names = DISTANCE_PARAMETERS if faces else (*DISTANCE_PARAMETERS, *_ONE_FACE)
    computed = [_distances(part, index, names) for part in parts]
    lengths, roots, columns = (np.stack([one[k] for one in computed]) for k in range(3))
    return MeasuredDistances(
        tuple(name for name, _ in scans),
        tuple(common),
        index,
        lengths,
        roots,
        columns,
        names,
        faces,
        in_common,
    )


def compare_distances(
    readings: ScannerReadings, first: str, second: str, alpha: float = 0.05
) -> DistanceCheck:
    """Compare distances between targets, means over the series of two stations (section 11.3)."""
    measured = measured_distances(readings, first, second)
    sides = [measured.mean(name) for name in (first, second)]
    lengths = np.stack([side[0] for side in sides], axis=1)
    difference = lengths[:, 0] - lengths[:, 1]
    covariance = sides[0][1] + sides[1][1]
    columns = sides[0][2] - sides[1][2]
    white, design = whitened(covariance, measured.rank, difference, columns)
    dof = len(white)
    statistic = float(white @ white)
    each = 1 - (1 - alpha) ** (1 / len(measured.index))
    sigma = np.sqrt(np.diag(covariance))
    weight = float(design[:, 0] @ design[:, 0])
    return DistanceCheck(
        stations=(first, second),
        scans=(measured.station.count(first), measured.station.count(second)),
        pairs=TargetPairs(
            *measured.ends, lengths, difference, sigma, sigma * norm.ppf(1 - each / 2)
        ),
        statistic=statistic,
        dof=dof,
        limit=float(chi2.ppf(1 - alpha, dof)),
        p=float(chi2.sf(statistic, dof)),
        range_zero=Estimate(
            float(design[:, 0] @ white) / weight if weight > 0 else math.nan,
            1 / math.sqrt(weight) if weight > 0 else math.inf,
        ),
        explanation=explain(measured.parameters, design, white),
        alpha=alpha,
        in_common=measured.in_common,
    )


def common_targets(readings: ScannerReadings, *stations: str) -> list[str]:
    """Targets that every scan of some stations has."""
    rows = [_of(readings, name, one) for name, one in _scans(readings, stations)]
    return [t for t in rows[0] if all(t in other for other in rows[1:])] if rows else []


def _scans(readings: ScannerReadings, stations: tuple[str, ...]) -> list[tuple[str, str]]:
    """Station and series of the scans of some stations."""
    return [
        (name, str(one))
        for name in stations
        for one in dict.fromkeys(readings.series[readings.station == name])
    ]


def _of(readings: ScannerReadings, station: str, series: str) -> dict[str, int]:
    """Row of each target of a station in a series."""
    inside = (readings.station == station) & (readings.series == series)
    return {str(readings.target[i]): int(i) for i in np.flatnonzero(inside)}


def _distances(
    part: ScannerReadings, index: NDArray[np.int64], names: tuple[str, ...]
) -> tuple[Array, Array, Array]:
    """Distances (p,), the root of their covariance (p, 3 t), what parameters of one make (p, k)."""
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
    root = np.einsum("pti,tij->ptj", by_polar, np.linalg.cholesky(part.covariance))
    model = NIST.select(names)
    r, h, v = part.polar.T
    # measured = true - Delta; a mean of faces keeps the part that does not change its sign
    sides = [model.columns(r, h, v, np.full(len(r), face)) for face in (1.0, -1.0)]
    mean = (sides[0] + sides[1]) / 2
    own = np.where((part.face < 0)[:, None, None], sides[1], sides[0])
    b = np.where((part.face == 0)[:, None, None], mean, own)
    return length, root.reshape(len(index), -1), -np.einsum("pti,tik->pk", by_polar, b)
