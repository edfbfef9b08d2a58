"""Centres of spheres by votes of the surface: finds those that touch what stands behind them.

A pixel whose neighbours fall back from it, both along its row and its column, as they would on a
sphere of the radius votes for the point one radius behind it along its normal. Many votes in one
place are a candidate (method section 6.4, second detector).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.scan.range_image import RangeImage

__all__ = ["apart", "gather", "vote_for_centers"]


#: neighbours are looked up at this many radii
_REACH = 0.45


#: height of the middle above the chord, as multiples of a sphere's; what noise adds at the upper
#: end, and what a plane's noise must not reach at the lower one, in sigmas of the height
_SAG, _ABOVE, _PLANE = (0.5, 1.7), 2.0, 2.0


#: sigma of the height over that of a range: one range less the mean of two
_HEIGHT = 1.2247


#: edge of a voxel in radii, but not below the second number [m]
_VOXEL, _SMALLEST = 0.25, 0.008


#: votes: at least this many, and this share of what a free sphere would get
_VOTES, _SHARE = 5, 0.2


#: votes kept at most, and candidates returned at most
_MOST, _CANDIDATES = 4_000_000, 400


def vote_for_centers(xyz: Array, image: RangeImage, radius: float, sigma: float) -> Array:
    """Centres (k, 3) [m] that many points voted for, most votes first.

    sigma : range noise [m].
    """
    frame = (image.first_v, image.step_h, image.step_v)
    votes = _votes(xyz, image.index, image.range, frame, image.wraps, radius, sigma)
    if len(votes) == 0:
        return np.empty((0, 3))
    peaks, counts = gather(votes, radius)
    away = np.linalg.norm(peaks, axis=1)
    pixels = _REACH**2 * np.pi * radius**2 / (away**2 * image.step_h * image.step_v)
    flat_sine = np.maximum(np.hypot(peaks[:, 0], peaks[:, 1]) / np.maximum(away, 1e-9), 0.05)
    keep = (counts >= np.maximum(_VOTES, _SHARE * pixels / flat_sine)) & (away > 1.5 * radius)
    chosen = np.flatnonzero(keep)[np.argsort(-counts[keep], kind="stable")][: 4 * _CANDIDATES]
    return np.asarray(apart(peaks[chosen], 0.5 * radius)[:_CANDIDATES])


def gather(votes: Array, radius: float) -> tuple[Array, NDArray[np.int64]]:
    """Places (k, 3) where votes (n, 3) for centres [m] are densest, and their votes (k,)."""
    cell = max(_VOXEL * radius, _SMALLEST)
    keys = np.floor(votes / cell).astype(np.int64)
    keys -= keys.min(axis=0)
    size = keys.max(axis=0) + 3
    flat = (keys[:, 0] * size[1] + keys[:, 1]) * size[2] + keys[:, 2]
    order = np.argsort(flat, kind="stable")
    cells, start = np.unique(flat[order], return_index=True)
    peaks, counts = _peaks(cells, start, votes[order], size)
    return peaks, counts


@njit(cache=True, nogil=True)
def _votes(
    xyz: Array,
    index: NDArray[np.int32],
    ranges: NDArray[np.float32],
    frame: tuple[float, float, float],
    wraps: bool,
    radius: float,
    sigma: float,
) -> Array:
    """Centres (n, 3) that pixels vote for."""
    rows, columns = index.shape
    v0, step_h, step_v = frame
    out = np.empty((4096, 3))
    count = 0
    for i in range(rows):
        sine = max(abs(np.sin(v0 + i * step_v)), 1e-3)
        for j in range(columns):
            r = ranges[i, j]
            if not r > 2 * radius:
                continue
            kh = int(_REACH * radius / (r * step_h * sine) + 0.5)
            kv = int(_REACH * radius / (r * step_v) + 0.5)
            if kh < 1 or kv < 1 or i < kv or i >= rows - kv or kh >= columns // 4:
                continue
            left, right = j - kh, j + kh
            if wraps:
                left, right = left % columns, right % columns
            elif left < 0 or right >= columns:
                continue
            # cheap: both pairs must lie behind the middle by about the height over the chord
            sag = 0.5 * (ranges[i, left] + ranges[i, right]) - r
            if not _plausible(sag, kh * step_h * sine * r, radius, sigma):
                continue
            sag = 0.5 * (ranges[i - kv, j] + ranges[i + kv, j]) - r
            if not _plausible(sag, kv * step_v * r, radius, sigma):
                continue
            middle = xyz[index[i, j]]
            a, b = xyz[index[i, left]], xyz[index[i, right]]
            c, d = xyz[index[i - kv, j]], xyz[index[i + kv, j]]
            good, normal = _convex(middle, a, b, c, d, radius, sigma)
            if not good:
                continue
            if count == len(out):
                if count >= _MOST:
                    return out
                grown = np.empty((2 * count, 3))
                grown[:count] = out
                out = grown
            out[count] = middle - radius * normal
            count += 1
    return out[:count]


@njit(cache=True, nogil=True)
def _plausible(sag: float, half: float, radius: float, sigma: float) -> bool:
    """Can a height along the beam [m] over a chord of this half length be that of a sphere?

    Tilted towards the beam the height along it grows, by up to five times where points still vote.
    """
    wanted = half * half / (2 * radius)
    noise = _HEIGHT * sigma
    least = 0.8 * max(_SAG[0] * wanted, min(_PLANE * noise, wanted))
    return bool(least < sag < 5 * _SAG[1] * wanted + 2 * noise)


@njit(cache=True, nogil=True)
def _convex(
    middle: Array, a: Array, b: Array, c: Array, d: Array, radius: float, sigma: float
) -> tuple[bool, Array]:
    """Do two chords lie below the middle as on a sphere? And the normal towards the scanner."""
    across, up = b - a, d - c
    normal = np.cross(across, up)
    size = np.sqrt((normal**2).sum())
    if not size > 0:
        return False, normal
    normal /= size
    if (normal * middle).sum() > 0:
        normal = -normal
    for k in range(2):
        first, last = (a, b) if k == 0 else (c, d)
        half2 = 0.25 * ((last - first) ** 2).sum()
        if half2 >= radius**2:
            return False, normal
        wanted = radius - np.sqrt(radius**2 - half2)
        sag = ((middle - 0.5 * (first + last)) * normal).sum()
        least = max(_SAG[0] * wanted, min(_PLANE * _HEIGHT * sigma, wanted))
        if not least < sag < _SAG[1] * wanted + _ABOVE * _HEIGHT * sigma:
            return False, normal
    return True, normal


@njit(cache=True, nogil=True)
def _peaks(
    cells: NDArray[np.int64], start: NDArray[np.int64], votes: Array, size: NDArray[np.int64]
) -> tuple[Array, NDArray[np.int64]]:
    """Mean vote and number of votes of every cell with its 26 neighbours that is their maximum."""
    n = len(cells)
    own = np.empty(n, dtype=np.int64)
    for k in range(n):
        own[k] = (start[k + 1] if k + 1 < n else len(votes)) - start[k]
    peaks, counts = np.empty((n, 3)), np.zeros(n, dtype=np.int64)
    found = 0
    for k in range(n):
        if own[k] < 2:
            continue
        total, mean, top = 0, np.zeros(3), True
        for di in range(-1, 2):
            for dj in range(-1, 2):
                for dk in range(-1, 2):
                    key = cells[k] + (di * size[1] + dj) * size[2] + dk
                    at = np.searchsorted(cells, key)
                    if at >= n or cells[at] != key:
                        continue
                    top = top and (own[at] < own[k] or (own[at] == own[k] and at >= k))
                    total += own[at]
                    for m in range(start[at], start[at] + own[at]):
                        mean += votes[m]
        if top:
            peaks[found], counts[found] = mean / total, total
            found += 1
    return peaks[:found], counts[:found]


@njit(cache=True, nogil=True)
def apart(peaks: Array, distance: float) -> Array:
    """Peaks (k, 3), the first ones first, none nearer than ``distance`` [m] to an earlier one."""
    out = np.empty_like(peaks)
    n = 0
    for k in range(len(peaks)):
        free = True
        for m in range(n):
            if ((out[m] - peaks[k]) ** 2).sum() < distance**2:
                free = False
                break
        if free:
            out[n] = peaks[k]
            n += 1
    return out[:n]
