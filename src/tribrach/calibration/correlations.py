"""Correlations of calibration parameters with each other, with orientations and with points.

Only between estimable quantities do they mean something: with inner constraints those with
orientations and points are of that datum (method sections 3.2 and 3.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.answers import Number, Result
from tribrach.network.adjustment import Adjustment

#: correlations from which on pairs are listed
LIMITS = (0.7, 0.9, 0.99)


@dataclass(frozen=True)
class CorrelatedPair(Result):
    """Two unknowns that are hard to tell apart, and their correlation."""

    a: str
    b: str
    value: Number


@dataclass(frozen=True)
class Correlations:
    """Correlations of calibration parameters; NaN with what is held."""

    names: tuple[str, ...]  #: the k parameters
    stations: tuple[str, ...]  #: the S stations
    point_names: tuple[str, ...]  #: the P points
    within: Array  #: (k, k), of parameters with each other
    orientation: Array  #: (k, 6 S), with E, N, U, tilts and heading of every station
    points: Array  #: (k, 3 P), with the coordinates of points
    #: pairs above 0.7 of parameters with each other and with orientations, the strongest first
    pairs: tuple[CorrelatedPair, ...]

    def above(self, limit: float) -> int:
        """Number of pairs above a limit."""
        return sum(abs(pair.value) > limit for pair in self.pairs)

    @property
    def strongest_by_point(self) -> Array:
        """Largest absolute correlation (k, P) over the coordinates of each point."""
        cube = np.abs(self.points).reshape(len(self.names), -1, 3)
        out: Array = np.nan_to_num(cube).max(axis=2, initial=0.0)
        return out


def calibration_correlations(adjustment: Adjustment, names: Sequence[str]) -> Correlations:
    """Correlations of calibration parameters with each other, stations and points."""
    layout = adjustment.layout
    own_columns = np.concatenate([adjustment.columns(name) for name in names])
    poses = layout.columns("pose", np.arange(layout.count("pose"))).ravel()
    points = layout.columns("point", np.arange(layout.count("point"))).ravel()
    reduced = adjustment.reduced
    unit = np.zeros((adjustment.n_unknowns, len(own_columns)))
    unit[reduced[own_columns], np.arange(len(own_columns))] = 1.0
    q = adjustment.cofactor.solve(unit)
    own = np.sqrt(np.diag(q[reduced[own_columns]]))

    def with_others(columns: Index) -> Array:
        place = reduced[columns]
        free = place >= 0
        out = np.full((len(own_columns), len(columns)), np.nan)
        if free.any():
            size = np.sqrt(np.maximum(adjustment.cofactor.entries(place[free], place[free]), 0.0))
            size[size == 0] = np.inf
            out[:, free] = q[place[free]].T / own[:, None] / size
        return out

    within, orientation = with_others(own_columns), with_others(poses)
    pairs = _pairs(names, names, within, triangle=True)
    pairs += _pairs(names, [layout.label(int(c)) for c in poses], orientation, triangle=False)
    pairs.sort(key=lambda pair: -abs(pair.value))
    return Correlations(
        names=tuple(names),
        stations=layout.names["pose"],
        point_names=layout.names["point"],
        within=within,
        orientation=orientation,
        points=with_others(points),
        pairs=tuple(pairs),
    )


def _pairs(
    a: Sequence[str], b: Sequence[str], rho: Array, *, triangle: bool
) -> list[CorrelatedPair]:
    """Pairs above the lowest limit."""
    size = np.nan_to_num(np.abs(rho))
    if triangle:
        size = np.triu(size, 1)
    i, j = np.nonzero(size > LIMITS[0])
    places = zip(i.tolist(), j.tolist(), strict=True)
    return [CorrelatedPair(a[k], b[m], float(rho[k, m])) for k, m in places]
