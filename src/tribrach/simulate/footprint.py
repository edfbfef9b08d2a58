"""The footprint of a beam: pixels where it matters, places within it, and averages over it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.kernels import in_threads, njit
from tribrach.simulate.ray_casting import SceneView

#: angle between successive places of a sunflower, which fill a disc evenly
_GOLDEN = np.pi * (3 - np.sqrt(5))
#: surfaces whose ranges within a footprint differ by less count as one [m]
_ONE = 1e-4


@dataclass(frozen=True, eq=False)
class Blend:
    """Means over footprints (n,)."""

    intensity: Array  #: (n,), light received, with nothing counting as zero
    range: Array  #: (n,), weighted by intensity, of the stronger echo where two are told apart [m]
    #: (n,), of incidence where the middle of the beam hit, or at the nearest place hit that counts
    cosine: Array
    spread: Array  #: (n,), of the ranges [m]
    met: NDArray[np.bool_]  #: (n,), something was hit
    several: NDArray[np.bool_]  #: (n,), more than one surface was hit
    #: (n, 3), where the middle of the beam hit, or, if that missed, the nearest place hit [m]
    truth: Array


def uniform_disc(rng: np.random.Generator, count: int) -> Array:
    """Places (count, 2) uniform in the unit disc; both coordinates have variance 1/4."""
    radius = np.sqrt(rng.random(count))
    turn = rng.random(count) * (2 * np.pi)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def unit_vectors(angles: Array, rotation: Array) -> Array:
    """Unit vectors (n, 3) in the world."""
    rays = np.empty((len(angles), 3))
    given = np.ascontiguousarray(angles), np.ascontiguousarray(rotation)
    in_threads(_unit_vectors, len(rays), *given, rays)
    return rays


@njit(cache=True, nogil=True)
def _unit_vectors(first, last, angles, t, rays):  # type: ignore[no-untyped-def]
    for n in range(first, last):
        h, v = angles[n, 0], angles[n, 1]
        x, y, z = np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)
        for k in range(3):
            rays[n, k] = t[k, 0] * x + t[k, 1] * y + t[k, 2] * z


def offset_rays(rays: Array, offset: Array, length: Array) -> Array:
    """Unit vectors (n, 3) that pass beams at an offset."""
    moved = np.empty_like(rays)
    given = np.ascontiguousarray(rays), np.ascontiguousarray(offset), length
    in_threads(_offset_rays, len(rays), *given, moved)
    return moved


@njit(cache=True, nogil=True)
def _offset_rays(first, last, rays, offset, length, moved):  # type: ignore[no-untyped-def]
    for n in range(first, last):
        x, y, z = rays[n, 0], rays[n, 1], rays[n, 2]
        flat = np.hypot(x, y)
        # straight up and down any direction is level
        a, b = (-y / flat, x / flat) if flat > 1e-9 else (1.0, 0.0)
        scale = 1.0 / length[n] if np.isfinite(length[n]) and length[n] > 1e-3 else 0.0
        s, t = offset[n, 0] * scale, offset[n, 1] * scale
        # the vector across is the ray times the level one
        u = x + s * a - t * z * b
        v = y + s * b + t * z * a
        w = z + t * (x * b - y * a)
        size = np.sqrt(u * u + v * v + w * w)
        moved[n, 0], moved[n, 1], moved[n, 2] = u / size, v / size, w / size


def footprints(
    rays: Array, length: Array, diameter: Array, beams: int, rng: np.random.Generator
) -> Array:
    """Rays (n, beams, 3) that sample footprints evenly, the middle of the beam first."""
    n = len(rays)
    number = np.arange(beams)
    radius = np.sqrt((number + 0.5) / beams)
    turn = number * _GOLDEN + rng.random((n, 1)) * (2 * np.pi)
    places = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=2)
    places[:, 0] = 0.0
    scaled = places * (diameter / 2)[:, None, None]
    many = offset_rays(
        np.repeat(rays, beams, axis=0), scaled.reshape(-1, 2), np.repeat(length, beams)
    )
    return many.reshape(n, beams, 3)


def average(
    view: SceneView,
    rays: Array,
    received: Callable[[Array, Array], Array],
    separable: float = np.inf,
) -> Blend:
    """Means over footprints of beams.

    ``received`` gives the light from ranges. Where ranges within a footprint spread by more than
    ``separable`` [m], the range is that of what is within it of the nearest place, or of all that
    is behind, whichever is the stronger echo.
    """
    n, beams = rays.shape[:2]
    hits = view.cast(rays.reshape(-1, 3))
    ranges, cosine = hits.range.reshape(n, beams), hits.cosine.reshape(n, beams)
    light = received(hits.reflectance * hits.cosine, hits.range).reshape(n, beams)
    met = np.isfinite(ranges)
    primitive = np.where(met, hits.primitive.reshape(n, beams), -1)
    spread = np.where(met, ranges, -np.inf).max(axis=1) - ranges.min(axis=1)
    several = (primitive != primitive[:, :1]).any(axis=1) & (spread > _ONE)
    any_met = met.any(axis=1)
    wide = np.flatnonzero(any_met & several & (spread > separable))
    if len(wide):
        light[wide] = _stronger(light[wide], ranges[wide], separable)
        met[wide] &= light[wide] > 0
    kept = np.where(met, ranges, 0.0)
    total = light.sum(axis=1)
    mean = (light * kept).sum(axis=1) / np.where(total > 0, total, 1.0)
    chosen = np.where(met[:, 0], 0, np.where(met, ranges, np.inf).argmin(axis=1))
    at = np.arange(n)
    where = rays[at, chosen] * kept[at, chosen][:, None]
    return Blend(
        total / beams,
        mean,
        cosine[at, chosen],
        np.where(any_met, spread, 0.0),
        any_met & (total > 0),
        several,
        view.origin + where,
    )


def _stronger(light: Array, ranges: Array, separable: float) -> Array:
    """The light (n, beams) of the stronger of two echoes, zero where it is of the other."""
    near = ranges <= ranges.min(axis=1, keepdims=True) + separable
    first, second = np.where(near, light, 0.0), np.where(near, 0.0, light)
    nearer = first.sum(axis=1) >= second.sum(axis=1)
    return np.where(nearer[:, None], first, second)


def border(
    primitive: Array, reflectance: Array, window: Array, ranges: Array
) -> tuple[NDArray[np.bool_], Array]:
    """Pixels with another primitive or reflectance within half windows; the shortest range there.

    A primitive of -2 is a pixel that was not looked at.
    """
    edge, near = np.zeros(primitive.shape, dtype=bool), np.full(primitive.shape, np.inf)
    given = primitive, reflectance, window, ranges
    in_threads(_border, len(edge), *given, edge, near, least=16)
    return edge, near


@njit(cache=True, nogil=True)
def _border(first, last, primitive, reflectance, window, ranges, edge, near):  # type: ignore[no-untyped-def]
    columns, rows = primitive.shape
    for i in range(first, last):
        for j in range(rows):
            p, a, w = primitive[i, j], reflectance[i, j], int(window[i, j])
            if p == -2.0:
                continue
            for k in range(max(i - w, 0), min(i + w + 1, columns)):
                for m in range(max(j - w, 0), min(j + w + 1, rows)):
                    q = primitive[k, m]
                    if q != -2.0:
                        near[i, j] = min(near[i, j], ranges[k, m])
                        if q != p or reflectance[k, m] != a:
                            edge[i, j] = True
