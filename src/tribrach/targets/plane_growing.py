"""Regions of a range image that are planes: blocks of pixels first, then the pixels around them.

The image is cut into blocks. A block whose points are flat is a seed or joins the region beside it
if it lies in its plane; the region's plane follows from sums over its blocks. In the end pixels of
blocks across edges are given to the region whose plane they lie in (method section 8.3).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tribrach.scan.range_image import RangeImage

__all__ = ["grow_planes"]

Array = NDArray[np.float64]
Labels = NDArray[np.int32]

#: pixels along a block's edge, and the size on the surface [m] that it should have
_EDGE, _SIZE = (5, 48), 0.08
#: a block is flat if its thickness is below this many sigmas and its points fill this share
_FLAT, _FULL = 2.0, 0.6
#: a block lies in a plane: centre within these sigmas plus [m], normal within [rad]
_OFF, _OFF_LEAST, _TURN = 1.0, 2e-3, float(np.radians(12.0))
#: regions smaller than this many blocks are dropped
_BLOCKS = 4
#: pixels lie in a plane within this many sigmas plus [m]
_PIXEL, _PIXEL_LEAST = 3.0, 1e-3


def grow_planes(xyz: Array, image: RangeImage, sigma: float) -> tuple[Labels, int]:
    """Region (rows, columns) int32 of every pixel, -1 for none, and the number of regions.

    xyz (n, 3) : points of the image [m]; sigma : range noise [m].
    """
    edge = _block_edge(image)
    sums = _block_sums(xyz, image.index, edge)
    fits = _block_planes(sums, edge * edge)
    flat = (fits[..., 6] <= _FLAT * sigma) & (sums[..., 0] >= _FULL * edge * edge)
    order = np.argsort(np.where(flat, fits[..., 6], np.inf), axis=None)[: int(flat.sum())]
    blocks, planes = _grown(sums, fits, flat, order, image.wraps, sigma)
    labels = _pixels(xyz, image.index, blocks, planes, edge, image.wraps, sigma)
    return labels, len(planes)


def _block_edge(image: RangeImage) -> int:
    """Pixels along a block: about 8 cm on surfaces at the median range."""
    typical = float(np.nanmedian(image.range[:: max(1, image.shape[0] // 200)]))
    pixels = _SIZE / max(typical * np.sqrt(image.step_h * image.step_v), 1e-9)
    return int(np.clip(round(pixels), *_EDGE))


@njit(cache=True, nogil=True)
def _block_sums(xyz: Array, index: NDArray[np.int32], edge: int) -> Array:
    """Number, sums and products (10) of the points of every block."""
    rows, columns = index.shape
    high, wide = (rows + edge - 1) // edge, (columns + edge - 1) // edge
    out = np.zeros((high, wide, 10))
    for i in range(rows):
        for j in range(columns):
            k = index[i, j]
            if k < 0:
                continue
            s = out[i // edge, j // edge]
            x, y, z = xyz[k, 0], xyz[k, 1], xyz[k, 2]
            s[0] += 1
            s[1] += x
            s[2] += y
            s[3] += z
            s[4] += x * x
            s[5] += x * y
            s[6] += x * z
            s[7] += y * y
            s[8] += y * z
            s[9] += z * z
    return out


@njit(cache=True, nogil=True)
def _plane(s: Array) -> Array:
    """Centre, normal towards the scanner, thickness (7) of the points with these sums."""
    out = np.empty(7)
    c = s[1:4] / s[0]
    m = np.empty((3, 3))
    m[0, 0] = s[4] / s[0] - c[0] * c[0]
    m[0, 1] = m[1, 0] = s[5] / s[0] - c[0] * c[1]
    m[0, 2] = m[2, 0] = s[6] / s[0] - c[0] * c[2]
    m[1, 1] = s[7] / s[0] - c[1] * c[1]
    m[1, 2] = m[2, 1] = s[8] / s[0] - c[1] * c[2]
    m[2, 2] = s[9] / s[0] - c[2] * c[2]
    values, vectors = np.linalg.eigh(m)
    normal = np.ascontiguousarray(vectors[:, 0])
    if (normal * c).sum() > 0:
        normal = -normal
    out[:3], out[3:6], out[6] = c, normal, np.sqrt(max(values[0], 0.0))
    return out


@njit(cache=True, nogil=True)
def _block_planes(sums: Array, full: int) -> Array:
    """Planes (high, wide, 7) of blocks that are at least half full; thickness inf of others."""
    high, wide = sums.shape[:2]
    out = np.full((high, wide, 7), np.inf)
    for i in range(high):
        for j in range(wide):
            if sums[i, j, 0] >= 0.5 * full and sums[i, j, 0] >= 6:
                out[i, j] = _plane(sums[i, j])
    return out


@njit(cache=True, nogil=True)
def _joins(block: Array, plane: Array, sigma: float) -> bool:
    """Does a flat block lie in the plane of a region?"""
    turn = (block[3:6] * plane[3:6]).sum()
    if turn < np.cos(_TURN):
        return False
    off = ((block[:3] - plane[:3]) * plane[3:6]).sum()
    return bool(abs(off) < _OFF * sigma + _OFF_LEAST)


@njit(cache=True, nogil=True)
def _grown(
    sums: Array,
    fits: Array,
    flat: NDArray[np.bool_],
    order: NDArray[np.int64],
    wraps: bool,
    sigma: float,
) -> tuple[Labels, Array]:
    """Region (high, wide) of every block and planes (regions, 7), from the flattest blocks on."""
    high, wide = flat.shape
    region = np.full((high, wide), -1, dtype=np.int32)
    planes = np.empty((64, 7))
    stack = np.empty((high * wide, 2), dtype=np.int32)
    count = 0
    for at in order:
        if region[at // wide, at % wide] >= 0:
            continue
        region[at // wide, at % wide] = count
        stack[0, 0], stack[0, 1] = at // wide, at % wide
        first, last, update = 0, 1, 3
        total = sums[at // wide, at % wide].copy()
        plane = fits[at // wide, at % wide].copy()
        while first < last:
            i, j = stack[first, 0], stack[first, 1]
            first += 1
            for di, dj in ((0, 1), (0, -1), (1, 0), (-1, 0)):
                a, b = i + di, j + dj
                if wraps:
                    b %= wide
                if a < 0 or a >= high or b < 0 or b >= wide or region[a, b] >= 0:
                    continue
                if not flat[a, b] or not _joins(fits[a, b], plane, sigma):
                    continue
                region[a, b] = count
                stack[last, 0], stack[last, 1] = a, b
                last += 1
                total += sums[a, b]
                if last >= update:  # the plane follows its blocks, ever less often
                    plane, update = _plane(total), last + max(1, last // 8)
        if last < _BLOCKS:
            for k in range(last):
                region[stack[k, 0], stack[k, 1]] = -2
            continue
        if count == len(planes):
            grown = np.empty((2 * count, 7))
            grown[:count] = planes
            planes = grown
        planes[count] = _plane(total)
        count += 1
    return region, planes[:count]


@njit(cache=True, nogil=True)
def _pixels(
    xyz: Array,
    index: NDArray[np.int32],
    region: Labels,
    planes: Array,
    edge: int,
    wraps: bool,
    sigma: float,
) -> Labels:
    """Region of every pixel: the plane that it is nearest to, of its block and those around."""
    rows, columns = index.shape
    high, wide = region.shape
    out = np.full((rows, columns), -1, dtype=np.int32)
    allowed = _PIXEL * sigma + _PIXEL_LEAST
    near = np.empty(9, dtype=np.int32)
    for bi in range(high):
        for bj in range(wide):
            n = 0
            for di in range(-1, 2):
                for dj in range(-1, 2):
                    a, b = bi + di, bj + dj
                    if wraps:
                        b %= wide
                    if a < 0 or a >= high or b < 0 or b >= wide or region[a, b] < 0:
                        continue
                    fresh = True
                    for m in range(n):
                        fresh = fresh and near[m] != region[a, b]
                    if fresh:
                        near[n] = region[a, b]
                        n += 1
            if n == 0:
                continue
            for i in range(bi * edge, min(rows, (bi + 1) * edge)):
                for j in range(bj * edge, min(columns, (bj + 1) * edge)):
                    if index[i, j] >= 0:
                        out[i, j] = _nearest(xyz[index[i, j]], near[:n], planes, allowed)
    return out


@njit(cache=True, nogil=True)
def _nearest(point: Array, near: Labels, planes: Array, allowed: float) -> int:
    """The region whose plane is nearest to a point and within ``allowed`` [m], else -1."""
    best, found = allowed, -1
    for k in near:
        p = planes[k]
        off = abs((point[0] - p[0]) * p[3] + (point[1] - p[1]) * p[4] + (point[2] - p[2]) * p[5])
        if off < best:
            best, found = off, k
    return found
