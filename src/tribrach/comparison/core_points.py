"""Chooses core points, at which clouds are compared, and the normals there.

Core points are one point per cell of a grid: the one nearest to its middle. A surface that lies
along a face of the cells has points in both cells beside the face, and would have every core point
twice: of two that are nearer than half a cell the one that is better placed stays, so that their
number hardly depends on how the grid lies.

The normal at one is the direction of least spread of the points within D / 2 (principal components;
Lague, Brodu and Leroux 2013). Where several scales D are given, that one is taken where the surface
is most planar: the largest ``(l2 - l3) / l1`` of the sorted variances. Metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.comparison.cloud_parts import Source, centred
from tribrach.comparison.point_cells import PointCells, ball_ranges
from tribrach.errors import InputError
from tribrach.kernels import in_threads, njit

#: fewest points that a normal is taken from
FEWEST = 5
_UP = np.array([0.0, 0.0, 1.0])
#: most core points that are kept
MOST = 5_000_000
#: cells along an axis stay whole numbers in 21 bits
_CELLS = 1 << 21


def core_points(
    cloud: Source, spacing: float, most: int = MOST, *, origin: Array | None = None
) -> Array:
    """Choose of each cubic cell of a grid the point nearest to its middle, half a cell apart.

    Of ties the first wins. ``origin`` is a corner of the grid, near the points to keep digits.
    """
    if not spacing > 0:
        raise InputError("the spacing of core points is not positive", record=f"{spacing:g} m")
    known: _Cells | None = None
    waiting: list[_Cells] = []
    for part in cloud():
        if len(part.xyz) == 0:
            continue
        if origin is None:
            origin = part.xyz[0].copy()
        waiting.append(_cells(part.xyz, origin, spacing))
        # all that is known is sorted again only when as much is waiting: n log n over all parts
        if known is None or sum(len(cells[0]) for cells in waiting) >= len(known[0]):
            known, waiting = _merged([*([] if known is None else [known]), *waiting]), []
        if len(known[0]) > most:
            break
    if known is None:
        raise InputError("the cloud has no points to compare at")
    known = _merged([known, *waiting])
    if len(known[0]) > most:
        raise InputError(
            f"a spacing of {spacing:g} m makes more than {most} core points",
            cure="take a wider spacing",
        )
    apart: Array = known[2][_apart(known, spacing / 2)]
    return apart


#: half of the cells around a cell, the other half looks back
_AROUND = [n for n in product((-1, 0, 1), repeat=3) if n > (0, 0, 0)]


def _apart(cells: _Cells, least: float) -> Mask:
    """Which points (m,) stay so that none is nearer than ``least`` to a better placed one."""
    key, miss, xyz = cells
    pairs = []
    for i, j, k in _AROUND:
        beside = key + (i * _CELLS + j) * _CELLS + k
        at = np.minimum(np.searchsorted(key, beside), len(key) - 1)
        one = np.flatnonzero(key[at] == beside)
        two = at[one]
        near = ((xyz[one] - xyz[two]) ** 2).sum(axis=1) < least**2
        pairs.append(np.column_stack([one[near], two[near]]))
    both = np.concatenate(pairs)
    # the better placed of each pair first, and the best placed of all before the others
    rank = np.empty(len(key), dtype=np.int64)
    rank[np.lexsort((key, miss))] = np.arange(len(key))
    better = rank[both[:, 0]] < rank[both[:, 1]]
    both = np.where(better[:, None], both, both[:, ::-1])
    stays = np.ones(len(key), dtype=bool)
    for keep, drop in both[np.argsort(rank[both[:, 0]], kind="stable")].tolist():
        if stays[keep]:
            stays[drop] = False
    return stays


#: numbers of cells, squared misses of their middles [cells], and the points
_Cells = tuple[Index, Array, Array]


def _cells(xyz: Array, origin: Array, spacing: float) -> _Cells:
    """The cells of points (n, 3), each with the nearest to its middle; the first of equal ones."""
    key, miss = np.empty(len(xyz), np.int64), np.empty(len(xyz))
    rows = np.empty(len(xyz), np.int64)
    runs = _runs(np.ascontiguousarray(xyz), origin, spacing, key, miss, rows)
    if runs < 0:
        raise InputError(
            f"the cloud is wider than {_CELLS // 2} cells of {spacing:g} m, or not a number",
            cure="take a wider spacing, or drop points far away",
        )
    return _merged([(key[:runs], miss[:runs], xyz[rows[:runs]])])


@njit(cache=True, nogil=True)
def _runs(xyz, origin, spacing, key, miss, rows):  # type: ignore[no-untyped-def]
    """Cell, miss and row of the best point of each run in one cell; -1 if too wide."""
    half, count = _CELLS // 2, 0
    for n in range(len(xyz)):
        cell, square = np.int64(0), 0.0
        for axis in range(3):
            at = (xyz[n, axis] - origin[axis]) / spacing
            whole = np.floor(at)
            if not abs(whole) < half:
                return -1
            cell = cell * _CELLS + np.int64(whole) + half
            square += (at - whole - 0.5) ** 2
        if count == 0 or key[count - 1] != cell:
            key[count], miss[count], rows[count] = cell, square, n
            count += 1
        elif square < miss[count - 1]:
            miss[count - 1], rows[count - 1] = square, n
    return count


def _merged(several: Sequence[_Cells]) -> _Cells:
    """The nearest point of each cell of all; the first of equal ones."""
    key, miss, xyz = (np.concatenate(column) for column in zip(*several, strict=True))
    order = np.lexsort((miss, key))
    first = np.ones(len(order), dtype=bool)
    first[1:] = key[order[1:]] != key[order[:-1]]
    chosen = order[first]
    return key[chosen], miss[chosen], xyz[chosen]


@dataclass(frozen=True)
class Normals:
    """Normals of core points."""

    vectors: Array  #: (m, 3), unit normals, NaN where fewer than five points are near
    scale: Array  #: (m,), the diameter D that was used [m]
    roughness: Array  #: (m,), standard deviation of the points along the normal [m]
    planarity: Array  #: (m,), ``(l2 - l3) / l1``
    count: Index  #: (m,), points used


def core_normals(
    cloud: Source,
    core: Array,
    scales: Sequence[float],
    *,
    scanner: Array | None = None,
    direction: Array | None = None,
) -> Normals:
    """Estimate normals at core points, towards the scanner or else along ``direction`` or up."""
    if len(scales) == 0 or not min(scales) > 0:
        raise InputError("normals need scales that are positive lengths")
    radii = np.sort(np.asarray(scales, dtype=float)) / 2
    origin = core.mean(axis=0)
    here = core - origin
    reach = radii[-1]
    moments = np.zeros((len(core), len(radii), 10))
    for part in centred(cloud, origin, here.min(axis=0) - reach, here.max(axis=0) + reach):
        cells = PointCells.of(part.xyz, radii[0] / 2).arrays
        in_threads(_moments, len(core), here, radii, cells, moments, least=256)
    towards = _towards(core, scanner, direction)
    vectors, figures = np.empty((len(core), 3)), np.empty((len(core), 4))
    in_threads(_axes, len(core), moments, 2 * radii, towards, vectors, figures)
    scale, roughness, planarity, count = figures.T
    return Normals(vectors, scale, roughness, planarity, count.astype(np.int64))


def _towards(core: Array, scanner: Array | None, direction: Array | None) -> Array:
    """Vectors (m, 3) whose side the normals are on."""
    if scanner is not None:
        towards: Array = scanner - core
        return towards
    return np.broadcast_to(_UP if direction is None else direction, core.shape)


@njit(cache=True, nogil=True)
def _moments(first, last, core, radii, cells, moments):  # type: ignore[no-untyped-def]
    """Add count, sums and products of the points within each radius, relative to the core point."""
    xyz = cells[0]
    for c in range(first, last):
        for s in range(len(radii)):
            n, reach = 0, radii[s] * radii[s]
            # single numbers stay in registers, a row of the table would not
            sx, sy, sz = 0.0, 0.0, 0.0
            xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for begin, end in ball_ranges(core[c], radii[s], cells):
                for k in range(begin, end):
                    x = xyz[k, 0] - core[c, 0]
                    y = xyz[k, 1] - core[c, 1]
                    z = xyz[k, 2] - core[c, 2]
                    if x * x + y * y + z * z <= reach:
                        n += 1
                        sx += x
                        sy += y
                        sz += z
                        xx += x * x
                        yy += y * y
                        zz += z * z
                        xy += x * y
                        xz += x * z
                        yz += y * z
            m = moments[c, s]
            m[0] += n
            m[1], m[2], m[3] = m[1] + sx, m[2] + sy, m[3] + sz
            m[4], m[5], m[6] = m[4] + xx, m[5] + yy, m[6] + zz
            m[7], m[8], m[9] = m[7] + xy, m[8] + xz, m[9] + yz


@njit(cache=True, nogil=True)
def _axes(first, last, moments, scales, towards, vectors, figures):  # type: ignore[no-untyped-def]
    """Normal, and scale, roughness, planarity and count, of the most planar scale."""
    for c in range(first, last):
        for i in range(3):
            vectors[c, i] = np.nan
        for i in range(4):
            figures[c, i] = np.nan
        best = -1.0
        for s in range(len(scales)):
            total = moments[c, s]
            if total[0] < FEWEST:
                continue
            # element by element: operations on rows compile much longer, for their error messages
            m = np.empty(10)
            for i in range(10):
                m[i] = total[i] / total[0]
            spread = np.empty((3, 3))
            for i in range(3):
                spread[i, i] = m[4 + i] - m[1 + i] * m[1 + i]
            spread[0, 1] = spread[1, 0] = m[7] - m[1] * m[2]
            spread[0, 2] = spread[2, 0] = m[8] - m[1] * m[3]
            spread[1, 2] = spread[2, 1] = m[9] - m[2] * m[3]
            values, axes = np.linalg.eigh(spread)
            # all points on one line or in one place have no normal
            if values[1] <= 1e-12 * values[2] or values[2] <= 0.0:
                continue
            planarity = (values[1] - values[0]) / values[2]
            if planarity > best:
                best = planarity
                turned = 0.0
                for i in range(3):
                    turned += axes[i, 0] * towards[c, i]
                sign = -1.0 if turned < 0.0 else 1.0
                for i in range(3):
                    vectors[c, i] = sign * axes[i, 0]
                figures[c, 0], figures[c, 2], figures[c, 3] = scales[s], planarity, total[0]
                figures[c, 1] = np.sqrt(max(values[0], 0.0) * total[0] / (total[0] - 1))
        if best < 0.0:
            figures[c, 3] = moments[c, -1, 0]
