"""Lines of sight through a scene, for plans: which places a station sees.

A place is seen if nothing nearer stops the line to it, it lies within the reach of the instrument
and off its poles, and its surface is not too oblique. The direction of the surface is that of the
scene where a place lies on it, or the normal given with the place; free-standing places are round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.geometry.polar import NEAREST, POLE
from tribrach.simulate.ray_casting import SceneView
from tribrach.simulate.scene import Scene

#: a place this close to a surface lies on it [m]
ON_SURFACE = 0.05
#: step of the rays that look for places on surfaces [rad]
_STEP = float(np.radians(1.5))


@dataclass(frozen=True)
class SightLines:
    """Lines from stations (s,) to places (n,)."""

    length: Array  #: (s, n), in metres
    seen: NDArray[np.bool_]  #: (s, n), the place is seen
    steep: Array  #: (s, n), angle of incidence [rad], NaN for places that lie on no surface
    hidden: NDArray[np.bool_]  #: (s, n), something nearer stops the line


def sight_lines(
    origins: Array,
    places: Array,
    scene: Scene | None = None,
    *,
    longest: float = np.inf,
    steepest: float = np.pi / 2,
) -> SightLines:
    """Lines of sight from instruments to places."""
    chord = places[None, :, :] - origins[:, None, :]
    length = np.linalg.norm(chord, axis=2)
    unit = chord / np.where(length > 0, length, 1.0)[:, :, None]
    steep = np.full(length.shape, np.nan)
    hidden = np.zeros(length.shape, dtype=bool)
    if scene is not None:
        for k, origin in enumerate(origins):
            hits = SceneView(scene, origin).cast(unit[k])
            hidden[k] = hits.range < length[k] - ON_SURFACE
            on = np.abs(hits.range - length[k]) <= ON_SURFACE
            steep[k, on] = np.arccos(np.clip(hits.cosine[on], 0.0, 1.0))
    off_pole = np.hypot(unit[:, :, 0], unit[:, :, 1]) > np.sin(POLE)
    within = (length >= NEAREST) & (length <= longest) & off_pole
    flat = np.isnan(steep) | (steep <= steepest)
    return SightLines(length, within & flat & ~hidden, steep, hidden)


def surface_places(
    scene: Scene, origins: Array, spacing: float, *, longest: float, steepest: float
) -> Array:
    """Places on the surfaces of a scene that instruments see.

    Those that two instruments or more see come first, in the order of how many.
    """
    h = np.arange(-np.pi, np.pi, _STEP)
    v = np.arange(_STEP, np.pi - _STEP / 2, _STEP)
    hh, vv = (a.ravel() for a in np.meshgrid(h, v))
    rays = np.stack([np.sin(vv) * np.cos(hh), np.sin(vv) * np.sin(hh), np.cos(vv)], axis=1)
    parts = [np.zeros((0, 3))]
    for origin in origins:
        ranges = SceneView(scene, origin).cast(rays).range
        met = np.isfinite(ranges) & (ranges <= longest)
        parts.append(origin + ranges[met, None] * rays[met])
    hits = np.concatenate(parts)
    cells = np.floor(hits / spacing).astype(np.int64)
    # of every cell the hit nearest to its middle, so that places are spread evenly
    off = np.linalg.norm(hits - (cells + 0.5) * spacing, axis=1)
    order = np.argsort(off, kind="stable")
    _, first = np.unique(cells[order], axis=0, return_index=True)
    places = hits[order[np.sort(first)]]
    lines = sight_lines(origins, places, scene, longest=longest, steepest=steepest)
    count = lines.seen.sum(axis=0)
    best = np.argsort(-count, kind="stable")
    return np.asarray(places[best[count[best] > 0]])
