"""Distances that sampling alone makes between clouds, and how the points of a cloud lie.

The nearest point of a rectangular lattice is the middle of the cell that a query falls into, so
that the distances over a rectangle are the floor (method section 5.5). A scan is such a lattice on
every small piece of surface: steps of the angles times the range, stretched by the incidence. For
points at random the floor is that of a Poisson process.

At each place the nearest points give a plane; in it, the shortest two directions between points
give a lattice, which is fitted to all points near by (a lattice with gaps or noise keeps its
pitch). Where they are no lattice the floor is measured: distances of evenly spread places in the
plane to the nearest of the points. Metres; the frame of the cloud.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Mask
from tribrach.comparison.nearest import Neighbours
from tribrach.kernels import njit

#: neighbours around a place; more where their noise hides the plane
_NEIGHBOURS = (64, 256, 1024, 4096)
#: places times neighbours at a time; more places are thinned
_MOST = 200_000
#: thickness over width of a neighbourhood that is a plane, and whose points are all there
_THIN = 0.25
#: share of the neighbourhood's radius within which no point is missing, and for measured floors
_INNER, _DISC = 0.7, 0.3
#: the middle of points all around a place is not further from it than this share of their radius
_ASIDE = 0.25
#: points that a lattice must explain, and how well: residuals over the pitch, points per cell
_FEWEST, _MISFIT, _FILLING = 9, 0.2, 0.25
#: places in the plane at which the floor of one neighbourhood is measured
_DRAWS = 32


@dataclass(frozen=True)
class Floor:
    """Distances that sampling alone makes."""

    #: mean, standard deviation and root mean square [m]
    mean: float
    std: float
    rms: float

    @classmethod
    def from_moments(cls, mean: float, square: float) -> Floor:
        """From the mean [m] and the mean square [m^2]."""
        return cls(mean, float(np.sqrt(max(square - mean**2, 0.0))), float(np.sqrt(square)))


def lattice_mean(pitch_x: Array, pitch_y: Array) -> Array:
    """Mean distances on rectangular lattices.

    The mean distance from the corner of a rectangle ``p x q`` with diagonal d to its points, ``d/3
    + p^2/(6q) asinh(q/p) + q^2/(6p) asinh(p/q)``, for a quarter of the cell.
    """
    p, q = np.asarray(pitch_x) / 2, np.asarray(pitch_y) / 2
    mean: Array = np.hypot(p, q) / 3
    mean = mean + p**2 / (6 * q) * np.arcsinh(q / p) + q**2 / (6 * p) * np.arcsinh(p / q)
    return mean


def lattice_square(pitch_x: Array, pitch_y: Array) -> Array:
    """Mean squared distances (n,) [m^2], ``(s_x^2 + s_y^2) / 12``."""
    square: Array = (np.asarray(pitch_x) ** 2 + np.asarray(pitch_y) ** 2) / 12
    return square


@dataclass(frozen=True)
class SamplingPattern:
    """How the points of a cloud lie around n places.

    On horizontal surfaces upwards is the second axis of the plan. Without a lattice both pitches
    are the root of the area per point.
    """

    known: Mask  #: (n,), true for places on a plane
    pitch: Array  #: (n, 2), pitches across and upwards [m]
    lattice: Mask  #: (n,), true where a lattice has these pitches
    mean: Array  #: (n,), mean of the floor [m]
    square: Array  #: (n,), mean square of the floor [m^2]
    normal: Array  #: (n, 3), unit normals

    @classmethod
    def join(cls, patterns: list[SamplingPattern]) -> SamplingPattern:
        """Patterns of several parts, one after the other."""
        names = ("known", "pitch", "lattice", "mean", "square", "normal")
        empty = pattern(Neighbours(np.empty((0, 3))), np.empty((0, 3)))
        return cls(
            *(np.concatenate([getattr(p, name) for p in (empty, *patterns)]) for name in names)
        )


def pattern(cloud: Neighbours, places: Array, limit: float = np.inf) -> SamplingPattern:
    """Find how the points of a cloud lie around places on or near its surface."""
    count = len(places)
    figures = np.full((count, 9), np.nan)
    rest = np.arange(count)
    centred = places - cloud.origin
    for k in _NEIGHBOURS:
        if len(rest) == 0 or cloud.count < k:
            break
        rest = rest[:: -(-len(rest) * k // _MOST)]
        _, indices = cloud.local_query(places[rest], k=k)
        figures[rest] = _places(cloud.points, centred[rest], indices, _disc(_DRAWS), limit)
        rest = rest[np.isnan(figures[rest, 8])]
    known = np.isfinite(figures[:, 0])
    pitch, lattice = figures[:, :2], figures[:, 2] > 0
    mean, square = figures[:, 3].copy(), figures[:, 4].copy()
    # the closed form is that of whole cells
    whole = lattice & (np.hypot(*pitch.T) / 2 <= limit)
    mean[whole] = lattice_mean(*pitch[whole].T)
    square[whole] = lattice_square(*pitch[whole].T)
    return SamplingPattern(known, pitch, lattice, mean, square, figures[:, 5:8])


def _disc(count: int) -> Array:
    """Places (n, 2) spread evenly over the unit disc, on a spiral by the golden angle."""
    k = np.arange(count)
    radius, angle = np.sqrt((k + 0.5) / count), k * np.pi * (3 - np.sqrt(5))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


@njit(cache=True, nogil=True)
def _places(points, places, indices, disc, limit):  # type: ignore[no-untyped-def]
    """Pitches, lattice or not, mean and square of the measured floor, normal; NaN if not known.

    The last column is set where more neighbours would not help.
    """
    out = np.full((len(places), 9), np.nan)
    for n in range(len(places)):
        near = np.empty((indices.shape[1], 3))
        for k in range(indices.shape[1]):
            for i in range(3):
                near[k, i] = points[indices[n, k], i] - places[n, i]
        radius = np.sqrt(near[-1, 0] ** 2 + near[-1, 1] ** 2 + near[-1, 2] ** 2)
        axes, thin = _plane(near)
        if thin > _THIN:
            continue
        out[n, 8] = 1.0
        uv = _inner(near, axes, _INNER * radius)
        if len(uv) < _FEWEST or _lopsided(uv, _INNER * radius):
            continue
        mean, square = _measured(uv, disc, _DISC * radius, limit)
        if np.isnan(mean):
            continue
        basis, good = _lattice(uv, _INNER * radius)
        if good:
            across, up = _pitches(basis, axes)
        else:
            across = up = np.sqrt(np.pi * (_INNER * radius) ** 2 / len(uv))
        out[n, 0], out[n, 1], out[n, 2] = across, up, 1.0 if good else 0.0
        out[n, 3], out[n, 4] = mean, square
        for i in range(3):
            out[n, 5 + i] = axes[i, 0]
    return out


@njit(cache=True, nogil=True)
def _plane(near):  # type: ignore[no-untyped-def]
    """Principal axes as columns, the normal first, and thickness over the lesser width."""
    mean = np.zeros(3)
    for k in range(len(near)):
        for i in range(3):
            mean[i] += near[k, i] / len(near)
    spread = np.zeros((3, 3))
    for k in range(len(near)):
        for i in range(3):
            for j in range(3):
                spread[i, j] += (near[k, i] - mean[i]) * (near[k, j] - mean[j])
    values, axes = np.linalg.eigh(spread)
    thin = np.sqrt(max(values[0], 0.0) / values[1]) if values[1] > 0 else np.inf
    return axes, thin


@njit(cache=True, nogil=True)
def _inner(near, axes, radius):  # type: ignore[no-untyped-def]
    """Points (m, 2) in the plane about the place, within the radius."""
    uv = np.empty((len(near), 2))
    count = 0
    for k in range(len(near)):
        u, v = 0.0, 0.0
        for i in range(3):
            u += near[k, i] * axes[i, 1]
            v += near[k, i] * axes[i, 2]
        if u * u + v * v <= radius * radius:
            uv[count, 0], uv[count, 1] = u, v
            count += 1
    return uv[:count].copy()


@njit(cache=True, nogil=True)
def _lopsided(uv, radius):  # type: ignore[no-untyped-def]
    """True if the points lie to one side of the place, as beyond the border of a surface."""
    u, v = 0.0, 0.0
    for k in range(len(uv)):
        u += uv[k, 0]
        v += uv[k, 1]
    return u * u + v * v > (_ASIDE * radius * len(uv)) ** 2


@njit(cache=True, nogil=True)
def _measured(uv, disc, radius, limit):  # type: ignore[no-untyped-def]
    """Mean and mean square of distances from a disc of places to the nearest points, or NaN."""
    mean, square, used = 0.0, 0.0, 0
    for d in range(len(disc)):
        best = np.inf
        for k in range(len(uv)):
            u, v = uv[k, 0] - radius * disc[d, 0], uv[k, 1] - radius * disc[d, 1]
            here = u * u + v * v
            best = min(best, here)
        if best <= limit * limit:
            mean += np.sqrt(best)
            square += best
            used += 1
    return (mean / used, square / used) if used > 0 else (np.nan, np.nan)


@njit(cache=True, nogil=True)
def _lattice(uv, radius):  # type: ignore[no-untyped-def]
    """Two shortest vectors as columns (2, 2) of the lattice that fits; False if none does."""
    first, best = 0, np.inf
    for k in range(len(uv)):
        if uv[k, 0] ** 2 + uv[k, 1] ** 2 < best:
            first, best = k, uv[k, 0] ** 2 + uv[k, 1] ** 2
    start = uv[first].copy()
    basis = _shortest(uv, first)
    reach = max(_length(basis, 0), _length(basis, 1))
    shift, misfit, used = start, np.inf, 0
    # the nearest points fix the whole numbers of those further out
    for growth in (1.5, 2.5, 4.0, np.inf, np.inf):
        det = basis[0, 0] * basis[1, 1] - basis[0, 1] * basis[1, 0]
        if not abs(det) > 1e-12 * reach**2:
            return basis, False
        basis, shift, misfit, used = _refined(uv, basis, shift, growth * reach, det)
        if used < 4:
            return basis, False
    det = abs(basis[0, 0] * basis[1, 1] - basis[0, 1] * basis[1, 0])
    short = min(_length(basis, 0), _length(basis, 1))
    filling = len(uv) * det / (np.pi * radius**2)
    return basis, misfit < _MISFIT * short and abs(filling - 1) < _FILLING


@njit(cache=True, nogil=True)
def _length(basis, k):  # type: ignore[no-untyped-def]
    """Length of a column."""
    return np.sqrt(basis[0, k] ** 2 + basis[1, k] ** 2)


@njit(cache=True, nogil=True)
def _shortest(uv, origin):  # type: ignore[no-untyped-def]
    """From one point the shortest way to another, and the shortest at 30 degrees to it or more."""
    basis = np.zeros((2, 2))
    for column in range(2):
        best = np.inf
        for k in range(len(uv)):
            u, v = uv[k, 0] - uv[origin, 0], uv[k, 1] - uv[origin, 1]
            length = np.sqrt(u * u + v * v)
            cross = abs(basis[0, 0] * v - basis[1, 0] * u)
            aside = column == 0 or cross > 0.5 * _length(basis, 0) * length
            if 0.0 < length < best and aside:
                best = length
                basis[0, column], basis[1, column] = u, v
    return basis


@njit(cache=True, nogil=True)
def _refined(uv, basis, shift, reach, det):  # type: ignore[no-untyped-def]
    """Least squares of the lattice through the points within reach: basis, shift, RMS, points."""
    whole = np.empty((len(uv), 4))
    used = 0
    for k in range(len(uv)):
        x, y = uv[k, 0] - shift[0], uv[k, 1] - shift[1]
        if x * x + y * y <= reach * reach:
            whole[used, 0] = np.round((x * basis[1, 1] - y * basis[0, 1]) / det)
            whole[used, 1] = np.round((y * basis[0, 0] - x * basis[1, 0]) / det)
            whole[used, 2], whole[used, 3] = uv[k, 0], uv[k, 1]
            used += 1
    if used < 4:
        return basis, shift, np.inf, 0
    mean = np.zeros(4)
    for k in range(used):
        for a in range(4):
            mean[a] += whole[k, a] / used
    # moments of whole numbers i, j and places u, v
    m = np.zeros((4, 4))
    for k in range(used):
        for a in range(4):
            for b in range(4):
                m[a, b] += (whole[k, a] - mean[a]) * (whole[k, b] - mean[b])
    both = m[0, 0] * m[1, 1] - m[0, 1] * m[0, 1]
    if both < 0.1:
        return basis, shift, np.inf, 0
    fitted, centre, total = np.empty((2, 2)), np.empty(2), 0.0
    for a in range(2):
        fitted[a, 0] = (m[0, 2 + a] * m[1, 1] - m[1, 2 + a] * m[0, 1]) / both
        fitted[a, 1] = (m[1, 2 + a] * m[0, 0] - m[0, 2 + a] * m[0, 1]) / both
        centre[a] = mean[2 + a] - fitted[a, 0] * mean[0] - fitted[a, 1] * mean[1]
        total += m[2 + a, 2 + a] - fitted[a, 0] * m[0, 2 + a] - fitted[a, 1] * m[1, 2 + a]
    return fitted, centre, np.sqrt(max(total, 0.0) / max(2 * used - 6, 1)), used


@njit(cache=True, nogil=True)
def _pitches(basis, axes):  # type: ignore[no-untyped-def]
    """Sides of the rectangle of a cell's area along its shorter vector: across, upwards."""
    det = abs(basis[0, 0] * basis[1, 1] - basis[0, 1] * basis[1, 0])
    k = 0 if _length(basis, 0) <= _length(basis, 1) else 1
    side = _length(basis, k)
    # up: the direction in the plane that rises most; the second of the plan where none does
    axis = 2 if abs(axes[2, 0]) < 0.9 else 1
    rise = axes[axis, 1] * basis[0, k] + axes[axis, 2] * basis[1, k]
    steepest = np.sqrt(axes[axis, 1] ** 2 + axes[axis, 2] ** 2)
    if abs(rise) > np.sqrt(0.5) * side * steepest:
        return det / side, side
    return side, det / side
