"""Correlations of calibration parameters with each other, with orientations and with points.

Only between estimable quantities do they mean something: with inner constraints those with
orientations and points are of that datum (method sections 3.2 and 3.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.network.adjustment import Adjustment

__all__ = ["LIMITS", "CorrelatedPair", "Correlations", "calibration_correlations"]


#: correlations from which on pairs are listed
LIMITS = (0.7, 0.9, 0.99)


@dataclass(frozen=True)
class CorrelatedPair:
    """Two unknowns in words and their correlation."""

    a: str
    b: str
    value: float


@dataclass(frozen=True)
class Correlations:
    """Correlations, NaN with what is held.

    within (k, k); orientation (k, 6 S) with E, N, U, tilts and heading of every station; points
    (k, 3 P); names (k,), stations (S,), point_names (P,); pairs : above 0.7, strongest first,
    of parameters with each other and with orientations.
    """

    names: tuple[str, ...]
    stations: tuple[str, ...]
    point_names: tuple[str, ...]
    within: Array
    orientation: Array
    points: Array
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
    """Correlations of scalars by name."""
    layout = adjustment.layout
    mine = np.concatenate([adjustment.columns(name) for name in names])
    poses = layout.columns("pose", np.arange(layout.count("pose"))).ravel()
    points = layout.columns("point", np.arange(layout.count("point"))).ravel()
    reduced = adjustment.reduced
    unit = np.zeros((adjustment.n_unknowns, len(mine)))
    unit[reduced[mine], np.arange(len(mine))] = 1.0
    q = adjustment.cofactor.solve(unit)
    own = np.sqrt(np.diag(q[reduced[mine]]))

    def with_others(columns: Index) -> Array:
        place = reduced[columns]
        free = place >= 0
        out = np.full((len(mine), len(columns)), np.nan)
        if free.any():
            size = np.sqrt(np.maximum(adjustment.cofactor.entries(place[free], place[free]), 0.0))
            size[size == 0] = np.inf
            out[:, free] = q[place[free]].T / own[:, None] / size
        return out

    within, orientation = with_others(mine), with_others(poses)
    pairs = _pairs(names, names, within, triangle=True)
    pairs += _pairs(names, [layout.label(int(c)) for c in poses], orientation, triangle=False)
    pairs.sort(key=lambda pair: -abs(pair.value))
    return Correlations(
        tuple(names),
        layout.names["pose"],
        layout.names["point"],
        within,
        orientation,
        with_others(points),
        tuple(pairs),
    )


def _pairs(
    a: Sequence[str], b: Sequence[str], rho: Array, *, triangle: bool
) -> list[CorrelatedPair]:
    """Pairs above the lowest limit."""
    size = np.nan_to_num(np.abs(rho))
    if triangle:
        size = np.triu(size, 1)
    i, j = np.nonzero(size > LIMITS[0])
    found = zip(i.tolist(), j.tolist(), strict=True)
    return [CorrelatedPair(a[k], b[m], float(rho[k, m])) for k, m in found]
