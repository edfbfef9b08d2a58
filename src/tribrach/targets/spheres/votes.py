"""Proposes centres of spheres by votes of the surface, also of spheres that touch a wall.

A pixel whose neighbours fall back from it along its row and its column, as they would on a sphere
of the radius, votes for the point one radius behind it along its normal. Many votes in one place
are a candidate (method section 6.4, second detector).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.kernels import njit
from tribrach.scan.range_image import RangeImage


@dataclass(frozen=True)
class VoteGates:
    """Which pixels vote for the centre of a sphere, and which places with votes are candidates.

    Chosen by hand with test_sphere_search.
    """

    reach_radii: float = 0.45  #: neighbours are looked up at this many radii
    #: height of the middle above the chord, as multiples of a sphere's: at least, at most
    least_height: float = 0.5
    most_height: float = 1.7
    above_sigmas: float = 2.0  #: what noise adds at the upper end, in sigmas of the height
    #: what the noise of a plane must not reach at the lower end, in sigmas of the height
    plane_sigmas: float = 2.0
    #: the quick test along the beam is wider: heights seen from the side, by these factors
    quick_least: float = 0.8
    quick_most: float = 5.0
    #: sigma of the height over that of a range: one range less the mean of two, sqrt(3/2)
    height_sigma: float = 1.2247
    #: edge of a voxel in radii, but not below this [m]
    voxel_radii: float = 0.25
    least_voxel_m: float = 0.008
    peak_votes: int = 2  #: a voxel with fewer votes is no peak
    #: a candidate has so many votes, and this share of what a free sphere would get
    least_votes: int = 5
    votes_share: float = 0.2
    #: candidates are farther from the scanner than this, nearer to each other than that are one
    nearest_radii: float = 1.5
    apart_radii: float = 0.5
    #: votes kept at most, and candidates returned at most: bound memory and time
    most_votes: int = 4_000_000
    most_candidates: int = 400


GATES = VoteGates()

# compiled code reads constants of the module, not attributes of an object
_REACH_RADII = GATES.reach_radii
_LEAST_HEIGHT = GATES.least_height
_MOST_HEIGHT = GATES.most_height
_ABOVE_SIGMAS = GATES.above_sigmas
_PLANE_SIGMAS = GATES.plane_sigmas
_QUICK_LEAST = GATES.quick_least
_QUICK_MOST = GATES.quick_most
_HEIGHT_SIGMA = GATES.height_sigma
_PEAK_VOTES = GATES.peak_votes
_MOST_VOTES = GATES.most_votes


def vote_for_centers(xyz: Array, image: RangeImage, radius: float, sigma: float) -> Array:
    """Places that many pixels vote for as the centre of a sphere, most votes first."""
    frame = (image.first_v, image.step_h, image.step_v)
    votes = _votes(xyz, image.index, image.range, frame, image.wraps, radius, sigma)
    if len(votes) == 0:
        return np.empty((0, 3))
    peaks, counts = gather(votes, radius)
    away = np.linalg.norm(peaks, axis=1)
    pixels = GATES.reach_radii**2 * np.pi * radius**2 / (away**2 * image.step_h * image.step_v)
    flat_sine = np.maximum(np.hypot(peaks[:, 0], peaks[:, 1]) / np.maximum(away, 1e-9), 0.05)
    keep = (counts >= np.maximum(GATES.least_votes, GATES.votes_share * pixels / flat_sine)) & (
        away > GATES.nearest_radii * radius
    )
    chosen = np.flatnonzero(keep)[np.argsort(-counts[keep], kind="stable")][
        : 4 * GATES.most_candidates
    ]
    return np.asarray(apart(peaks[chosen], GATES.apart_radii * radius)[: GATES.most_candidates])


def gather(votes: Array, radius: float) -> tuple[Array, NDArray[np.int64]]:
    """Places where votes are densest, and their numbers of votes."""
    cell = max(GATES.voxel_radii * radius, GATES.least_voxel_m)
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
            kh = int(_REACH_RADII * radius / (r * step_h * sine) + 0.5)
            kv = int(_REACH_RADII * radius / (r * step_v) + 0.5)
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
                if count >= _MOST_VOTES:
                    return out
                grown = np.empty((2 * count, 3))
                grown[:count] = out
                out = grown
            out[count] = middle - radius * normal
            count += 1
    return out[:count]


@njit(cache=True, nogil=True)
def _plausible(sag: float, half: float, radius: float, sigma: float) -> bool:
    """True if a height along the beam over a chord of a given half length may be that of a sphere.

    Lengths in metres. Where the surface is tilted towards the beam, the height along the beam
    grows, by up to five times where points still vote.
    """
    height = half * half / (2 * radius)
    noise = _HEIGHT_SIGMA * sigma
    least = _QUICK_LEAST * max(_LEAST_HEIGHT * height, min(_PLANE_SIGMAS * noise, height))
    return bool(least < sag < _QUICK_MOST * _MOST_HEIGHT * height + _ABOVE_SIGMAS * noise)


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
        height = radius - np.sqrt(radius**2 - half2)
        sag = ((middle - 0.5 * (first + last)) * normal).sum()
        least = max(_LEAST_HEIGHT * height, min(_PLANE_SIGMAS * _HEIGHT_SIGMA * sigma, height))
        if not least < sag < _MOST_HEIGHT * height + _ABOVE_SIGMAS * _HEIGHT_SIGMA * sigma:
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
    number = 0
    for k in range(n):
        if own[k] < _PEAK_VOTES:
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
            peaks[number], counts[number] = mean / total, total
            number += 1
    return peaks[:number], counts[:number]


@njit(cache=True, nogil=True)
def apart(peaks: Array, distance: float) -> Array:
    """Keep the first of several peaks that are near each other, the best first."""
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
