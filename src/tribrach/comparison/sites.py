"""Test sites: pieces of surface on which two clouds are compared.

A site is a ball or a box with its edges along the axes, cut from streams of any length. Points of
the compared cloud count when they are in it; those of the reference also within the limit around
it, so that no distance is cut off at its border.

Sites are proposed from samples of both scans with normals: cells of a grid whose points lie on one
plane in both clouds. Of all such cells those are taken that differ most in range and incidence, so
that a regression on both has something to hold on to. Metres and radians, in the frame of the
clouds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.answers import Result
from tribrach.comparison.streams import Spool, Stream

#: sides of the cells [m]; points of each sample that a cell needs
_SIZE, _FEWEST = 2.0, 8
#: normals of a flat cell agree to this cosine; points keep to its plane within this [m]
_AGREE, _FLAT = 0.97, 0.015
#: no incidence beyond is of use [rad]
_STEEPEST = np.radians(75.0)


@dataclass(frozen=True)
class ComparisonSite:
    """A ball about a center, or a box between two corners."""

    name: str  #: of the site
    #: corners of the box that holds it [m]
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    radius: float | None = None  #: of a ball [m], None for a box

    @classmethod
    def ball(cls, name: str, center: tuple[float, float, float], radius: float) -> ComparisonSite:
        """All points within a radius [m] of a center [m]."""
        x, y, z = center
        low = (x - radius, y - radius, z - radius)
        return cls(name, low, (x + radius, y + radius, z + radius), radius)

    @property
    def center(self) -> Array:
        """Its middle (3,) [m]."""
        middle: Array = (np.array(self.low) + np.array(self.high)) / 2
        return middle

    def inside(self, points: Array, margin: float = 0.0) -> Mask:
        """Which points (n, 3) are in the site or within a margin [m] of it."""
        low, high = np.array(self.low) - margin, np.array(self.high) + margin
        flags: Mask = np.all((points >= low) & (points <= high), axis=1)
        if self.radius is not None and flags.any():
            rows = np.flatnonzero(flags)
            far = ((points[rows] - self.center) ** 2).sum(axis=1)
            flags[rows] = far <= (self.radius + margin) ** 2
        return flags


def cut(
    cloud: Stream,
    sites: Sequence[ComparisonSite],
    folder: Path,
    margin: float = 0.0,
    progress: Callable[[int], None] = lambda points: None,
    columns: int = 3,
) -> Spool:
    """Cut the points of each site out of a cloud that is read once."""
    spool, done = Spool(folder, len(sites), columns), 0
    for chunk in cloud():
        xyz = chunk[:, :3]
        low, high = xyz.min(axis=0, initial=np.inf), xyz.max(axis=0, initial=-np.inf)
        for number, site in enumerate(sites):
            start, end = np.array(site.low) - margin, np.array(site.high) + margin
            if (low <= end).all() and (high >= start).all():
                spool.add(number, chunk[site.inside(xyz, margin)])
        done += len(chunk)
        progress(done)
    return spool


@dataclass(frozen=True)
class Geometry(Result):
    """How a scanner saw a site: mean range [m], and incidence [rad] where a surface was seen."""

    range: float
    incidence: float | None


def seen_from(scanner: Array, places: Array, normals: Array) -> Geometry | None:
    """Compute range and incidence of places seen from a scanner."""
    if len(places) == 0:
        return None
    beams = scanner - places
    length = np.linalg.norm(beams, axis=1)
    cosine = np.abs(np.einsum("ni,ni->n", beams, normals)) / np.maximum(length, 1e-9)
    known = np.isfinite(cosine)
    angle = float(np.arccos(np.minimum(cosine[known], 1.0)).mean()) if known.any() else None
    return Geometry(float(length.mean()), angle)


def choose_sites(
    clouds: Sequence[tuple[Array, Array]],
    scanners: Sequence[Array],
    count: int = 16,
) -> list[ComparisonSite]:
    """Propose balls on surfaces that both clouds have, numbered from 1."""
    origin = np.mean([x.mean(axis=0) for x, _ in clouds if len(x)], axis=0)
    cells = [_cells(*cloud, origin, _SIZE) for cloud in clouds]
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
        patch = _flat(points, normals)
        if patch is None:
            continue
        middle, normal = patch
        beams = [middle - scanner for scanner in scanners]
        length = [float(np.linalg.norm(beam)) for beam in beams]
        cosine = [abs(float(b @ normal)) / d for b, d in zip(beams, length, strict=True)]
        incidence = float(np.arccos(np.clip(min(cosine), -1.0, 1.0)))
        if incidence < _STEEPEST:
            places.append(middle)
            figures.append((max(length), incidence))
    chosen = _spread(np.array(figures).reshape(-1, 2), count)
    return [
        ComparisonSite.ball(f"{number}", (float(x), float(y), float(z)), _SIZE / 2)
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
