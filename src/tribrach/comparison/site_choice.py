"""Where could two clouds be compared? Flat pieces of surface that both stations saw.

From samples of both scans with normals: cells of a grid whose points lie on one plane in both
clouds. Of all such cells those are taken that differ most in range and incidence, so that a
regression on both has something to hold on to. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tribrach.comparison.sites import Site

__all__ = ["choose_sites"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: sides of the cells [m]; points of each sample that a cell needs
_SIZE, _FEWEST = 2.0, 8
#: normals of a flat cell agree to this cosine; points keep to its plane within this [m]
_AGREE, _FLAT = 0.97, 0.015
#: no incidence beyond is of use [rad]
_STEEPEST = np.radians(75.0)


def choose_sites(
    clouds: Sequence[tuple[Array, Array]],
    scanners: Sequence[Array],
    count: int = 16,
    size: float = _SIZE,
) -> list[Site]:
    """Up to ``count`` balls on surfaces in both clouds, numbered from 1.

    clouds : points (n, 3) and unit normals (n, 3), NaN where unknown, of either, in one frame;
    scanners : places (3,) of both; size : diameter of the balls [m].
    """
    origin = np.mean([x.mean(axis=0) for x, _ in clouds if len(x)], axis=0)
    cells = [_cells(*cloud, origin, size) for cloud in clouds]
    shared = np.intersect1d(cells[0], cells[1])
    order = [np.argsort(cell, kind="stable") for cell in cells]
    sorted_ = [cell[rows] for cell, rows in zip(cells, order, strict=True)]
    places, figures = [], []
    for key in shared[shared >= 0]:
        rows = [
            at[slice(*np.searchsorted(cell, [key, key + 1]))]
            for cell, at in zip(sorted_, order, strict=True)
        ]
        points = [x[at] for (x, _), at in zip(clouds, rows, strict=True)]
        normals = [n[at] for (_, n), at in zip(clouds, rows, strict=True)]
        found = _flat(points, normals)
        if found is None:
            continue
        middle, normal = found
        beams = [middle - scanner for scanner in scanners]
        length = [float(np.linalg.norm(beam)) for beam in beams]
        cosine = [abs(float(b @ normal)) / d for b, d in zip(beams, length, strict=True)]
        incidence = float(np.arccos(np.clip(min(cosine), -1.0, 1.0)))
        if incidence < _STEEPEST:
            places.append(middle)
            figures.append((max(length), incidence))
    chosen = _spread(np.array(figures).reshape(-1, 2), count)
    return [
        Site.ball(f"{number}", (float(x), float(y), float(z)), size / 2)
        for number, (x, y, z) in enumerate((places[k] for k in chosen), start=1)
    ]


def _cells(points: Array, normals: Array, origin: Array, size: float) -> Index:
    """Number (n,) of the cell of each point, -1 without a normal."""
    whole = np.floor((points - origin) / size).astype(np.int64) + (1 << 20)
    key: Index = (whole[:, 0] << 42) + (whole[:, 1] << 21) + whole[:, 2]
    inside = ((whole >= 0) & (whole < 1 << 21)).all(axis=1) & np.isfinite(normals[:, 0])
    key = np.where(inside, key, -1)
    known, at, many = np.unique(key, return_inverse=True, return_counts=True)
    return np.where((many[at] >= _FEWEST) & (known[at] >= 0), key, -1)


def _flat(points: Sequence[Array], normals: Sequence[Array]) -> tuple[Array, Array] | None:
    """Middle (3,) and normal (3,) of a cell on one plane; None if it is not flat in both clouds."""
    both = np.concatenate(list(points))
    middle = np.mean([x.mean(axis=0) for x in points], axis=0)
    normal = np.linalg.svd(both - both.mean(axis=0), full_matrices=False)[2][-1]
    for x, n in zip(points, normals, strict=True):
        if len(x) < _FEWEST or np.median(np.abs(n @ normal)) < _AGREE:
            return None
        if np.quantile(np.abs((x - both.mean(axis=0)) @ normal), 0.95) > _FLAT:
            return None
    return middle, normal


def _spread(figures: Array, count: int) -> list[int]:
    """Rows of figures (n, k) that lie farthest from each other, each column scaled to its range."""
    if len(figures) == 0:
        return []
    extent = np.ptp(figures, axis=0)
    scaled = figures / np.where(extent > 0, extent, 1.0)
    chosen = [int(np.argmin(scaled.sum(axis=1)))]
    away = np.linalg.norm(scaled - scaled[chosen[0]], axis=1)
    while len(chosen) < min(count, len(figures)) and away.max() > 0:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(scaled - scaled[chosen[-1]], axis=1))
    return chosen
