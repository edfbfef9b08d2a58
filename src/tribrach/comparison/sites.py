"""Test sites: pieces of surface on which two clouds are compared, cut from streams of any length.

A site is a ball or a box with its edges along the axes. Points of the compared cloud count when
they are in it; those of the reference also within the limit around it, so that no distance is cut
off at its border. Metres, in the frame of the clouds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.comparison.streams import Spool, Stream

__all__ = ["Geometry", "Site", "cut", "seen_from"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Site:
    """A ball about a center (3,) [m], or a box between two corners (3,) [m]."""

    name: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    radius: float | None = None

    @classmethod
    def ball(cls, name: str, center: tuple[float, float, float], radius: float) -> Site:
        """All points within a radius [m] of a center [m]."""
        x, y, z = center
        low = (x - radius, y - radius, z - radius)
        return cls(name, low, (x + radius, y + radius, z + radius), radius)

    @property
    def center(self) -> Array:
        """Its middle (3,) [m]."""
        middle: Array = (np.array(self.low) + np.array(self.high)) / 2
        return middle

    def inside(self, points: Array, margin: float = 0.0) -> Flags:
        """Which points (n, 3) are in the site or within a margin [m] of it."""
        low, high = np.array(self.low) - margin, np.array(self.high) + margin
        flags: Flags = np.all((points >= low) & (points <= high), axis=1)
        if self.radius is not None and flags.any():
            rows = np.flatnonzero(flags)
            far = ((points[rows] - self.center) ** 2).sum(axis=1)
            flags[rows] = far <= (self.radius + margin) ** 2
        return flags


def cut(
    cloud: Stream,
    sites: Sequence[Site],
    folder: Path,
    margin: float = 0.0,
    progress: Callable[[int], None] = lambda points: None,
) -> Spool:
    """Points of each site (by its number) and within a margin [m], read once, kept in a folder."""
    spool, done = Spool(folder, len(sites)), 0
    for chunk in cloud():
        low, high = chunk.min(axis=0, initial=np.inf), chunk.max(axis=0, initial=-np.inf)
        for number, site in enumerate(sites):
            start, end = np.array(site.low) - margin, np.array(site.high) + margin
            if (low <= end).all() and (high >= start).all():
                spool.add(number, chunk[site.inside(chunk, margin)])
        done += len(chunk)
        progress(done)
    return spool


@dataclass(frozen=True)
class Geometry:
    """How a scanner saw a site: mean range [m] and mean incidence angle [rad].

    The incidence is None where no surface was found.
    """

    range: float
    incidence: float | None


def seen_from(scanner: Array, places: Array, normals: Array) -> Geometry | None:
    """Places (n, 3) with normals (n, 3), NaN where there is no surface, from a scanner (3,)."""
    if len(places) == 0:
        return None
    beams = scanner - places
    length = np.linalg.norm(beams, axis=1)
    cosine = np.abs(np.einsum("ni,ni->n", beams, normals)) / np.maximum(length, 1e-9)
    known = np.isfinite(cosine)
    angle = float(np.arccos(np.minimum(cosine[known], 1.0)).mean()) if known.any() else None
    return Geometry(float(length.mean()), angle)
