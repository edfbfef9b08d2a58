"""Places where several lines or circles meet, for many places at once.

* Intersection: rays from known set-ups meet in a point.
* Multilateration: distances to known places, linear in the point after differencing.
* Resection: three or more readings of one set; linear in (cos o, sin o, p, q) with
  ``p = E cos o - N sin o``, ``q = E sin o + N cos o`` because each ray gives
  ``(E_i cos r - N_i sin r) cos o - (E_i sin r + N_i cos r) sin o - p cos r + q sin r = 0``.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array, Index
from tribrach.network.start.frame import Frame
from tribrach.network.start.grouping import grouped_median, grouped_sum, wrap
from tribrach.network.start.horizontal import unit

__all__ = ["intersect", "multilaterate", "resect", "trilaterate_space"]


#: smallest sine of the angle at which lines may meet
_SHARP = 0.05


def _lines(f: Frame) -> tuple[Index, Array, Array, Array]:
    """Unknown nodes, points on lines through them, directions (n, 2), +1 ahead or -1 behind."""
    known, r = f.known_plan, f.rays
    oriented = np.isfinite(f.orientation[r.set])
    ahead = oriented & known[r.start] & ~known[r.end]
    back = oriented & known[r.end] & ~known[r.start]
    nodes = np.concatenate([r.end[ahead], r.start[back]])
    through = np.concatenate([f.plan[r.start[ahead]], f.plan[r.end[back]]])
    direction = np.concatenate([unit(f.azimuths(r[ahead])), unit(f.azimuths(r[back]))])
    sign = np.concatenate([np.ones(ahead.sum()), -np.ones(back.sum())])
    return nodes, through, direction, sign


def intersect(f: Frame) -> None:
    """Places that two or more oriented rays meet at, the majority deciding."""
    nodes, through, direction, sign = _lines(f)
    if len(nodes) == 0:
        return
    places, group = np.unique(nodes, return_inverse=True)
    size = len(places)
    across = np.stack([direction[:, 1], -direction[:, 0]], axis=1)
    centre = grouped_sum(group, size, through) / np.bincount(group)[:, None]
    right = np.einsum("ni,ni->n", across, through - centre[group])
    weights = np.ones(len(nodes))
    for _ in range(6):
        x, sharp = _solve2(group, size, across, right, weights)
        v = np.abs(np.einsum("ni,ni->n", across, x[group]) - right)
        _, median, _ = grouped_median(group, v[:, None])
        weights = 1 / (v + median[group, 0] + 1e-6)
    found = x + centre
    in_front = sign * np.einsum("ni,ni->n", direction, found[group] - through) > 0
    front = np.bincount(group, in_front) > 0.5 * np.bincount(group)
    both = (np.bincount(group) > 2) | (np.bincount(group, in_front) == 2)
    limit = _SHARP**2 / (10 if f.relaxed else 1)
    good = (sharp > limit) & front & both
    f.place_plan(places[good], found[good])


def _solve2(group: Index, size: int, a: Array, b: Array, w: Array) -> tuple[Array, Array]:
    """Least squares ``a . x = b`` (n, d) by group; smallest over largest eigenvalue."""
    normal = grouped_sum(group, size, w[:, None, None] * a[:, :, None] * a[:, None, :])
    right = grouped_sum(group, size, (w * b)[:, None] * a)
    values, vectors = np.linalg.eigh(normal)
    ratio = values[:, 0] / np.maximum(values[:, -1], 1e-300)
    safe = np.maximum(values, 1e-12 * np.maximum(values[:, -1:], 1e-300))
    x = np.einsum("gij,gj,gkj,gk->gi", vectors, 1 / safe, vectors, right)
    return x, ratio


def multilaterate(f: Frame) -> None:
    """Plan from three or more horizontal distances to known places."""
    known, flat = f.known_plan, f.flats()
    a, b = f.lengths.start, f.lengths.end
    ahead = known[a] & ~known[b] & np.isfinite(flat)
    back = known[b] & ~known[a] & np.isfinite(flat)
    nodes = np.concatenate([b[ahead], a[back]])
    centre = np.concatenate([f.plan[a[ahead]], f.plan[b[back]]])
    radius = np.concatenate([flat[ahead], flat[back]])
    f.place_plan(*_meeting(nodes, centre, radius, choose=False))


def trilaterate_space(f: Frame) -> None:
    """Places from four or more slope distances to known places, or three where one may choose."""
    known = f.known
    a, b = f.lengths.start, f.lengths.end
    slope = np.isnan(f.lengths.flat)
    ahead, back = slope & known[a] & ~known[b], slope & known[b] & ~known[a]
    nodes = np.concatenate([b[ahead], a[back]])
    lift = np.zeros((len(nodes), 3))
    lift[:, 2] = np.concatenate([-f.lengths.lift[ahead], f.lengths.lift[back]])
    centre = f.space(np.concatenate([a[ahead], b[back]])) + lift
    radius = np.concatenate([f.lengths.value[ahead], f.lengths.value[back]])
    f.place(*_meeting(nodes, centre, radius, choose=f.guess))


def _meeting(nodes: Index, centre: Array, radius: Array, *, choose: bool) -> tuple[Index, Array]:
    """Places where circles (n, 2) or spheres (n, 3) about known centres meet.

    From ``|x|^2 - 2 c_i . x + |c_i|^2 = r_i^2``, differenced against the mean, follow the
    components along the extent of the centres; across their best plane (line) the place lies on
    one side or the other. Both sides are refined and the better one is kept if it is clearly
    better, or if one may ``choose``.
    """
    dimension = centre.shape[1]
    keys, counts = np.unique(nodes, return_counts=True)
    rows = np.isin(nodes, keys[counts >= dimension + (not choose)])
    if not rows.any():
        return keys[:0], np.zeros((0, dimension))
    places, group = np.unique(nodes[rows], return_inverse=True)
    mean = grouped_sum(group, len(places), centre[rows]) / np.bincount(group)[:, None]
    c, r = centre[rows] - mean[group], radius[rows]
    sides, extent = _two_sides(group, len(places), c, r)
    fits = [_refine(group, x, c, r) for x in sides]
    first, second = fits[0][1], fits[1][1]
    better = np.where((first <= second)[:, None], fits[0][0], fits[1][0])
    clear = np.maximum(first, second) > 3 * np.minimum(first, second) + 1e-6 * extent
    same = np.linalg.norm(fits[0][0] - fits[1][0], axis=1) < 1e-3 * extent
    good = clear | same | choose
    return places[good], (better + mean)[good]


def _two_sides(group: Index, size: int, c: Array, r: Array) -> tuple[list[Array], Array]:
    """Two candidates (size, d) for centres c about their centroids, and the centres' extents."""
    count = np.bincount(group, minlength=size)
    b = (c**2).sum(axis=1) - r**2
    b -= (np.bincount(group, b, minlength=size) / count)[group]
    values, axes = np.linalg.eigh(grouped_sum(group, size, c[:, :, None] * c[:, None, :]))
    right = grouped_sum(group, size, c * b[:, None] / 2)
    safe = np.maximum(values, 1e-9 * values[:, -1:] + 1e-300)
    along = np.einsum("gji,gj->gi", axes, right) / safe
    along[:, 0] = 0.0
    flat = np.einsum("gij,gj->gi", axes, along)
    square = r**2 - ((flat[group] - c) ** 2).sum(axis=1)
    height = np.sqrt(np.maximum(np.bincount(group, square, minlength=size) / count, 0.0))
    extent = np.sqrt(values[:, -1] / count)
    across = np.maximum(height, 0.01 * extent)[:, None] * axes[:, :, 0]
    return [flat + across, flat - across], extent


def _refine(group: Index, x: Array, c: Array, r: Array) -> tuple[Array, Array]:
    """Gauss-Newton towards the least sum of absolute residuals: places, means of residuals [m]."""
    size = len(x)
    for _ in range(8):
        d = x[group] - c
        length = np.maximum(np.linalg.norm(d, axis=1), 1e-9)
        v = r - length
        _, median, _ = grouped_median(group, np.abs(v)[:, None])
        weights = 1 / (np.abs(v) + median[group, 0] + 1e-6)
        step, _ = _solve2(group, size, d / length[:, None], v, weights)
        x = x + step
    v = np.abs(np.linalg.norm(x[group] - c, axis=1) - r)
    return x, np.bincount(group, v, minlength=size) / np.bincount(group, minlength=size)


def resect(f: Frame) -> None:
    """Set-ups and orientations from three or more readings to known places."""
    known = f.known_plan
    r = f.rays
    r = r[
        np.isnan(f.orientation[r.set])
        & known[r.end]
        & ~known[r.start]
        & (f.ties.set_node[r.set] >= 0)
    ]
    keys, counts = np.unique(r.set, return_counts=True)
    r = r[np.isin(r.set, keys[counts >= 3])]
    if len(r) == 0:
        return
    sets, group = np.unique(r.set, return_inverse=True)
    size, count = len(sets), np.bincount(group)
    centre = grouped_sum(group, size, f.plan[r.end]) / count[:, None]
    x = f.plan[r.end] - centre[group]
    scale = np.sqrt(np.bincount(group, (x**2).sum(axis=1)) / count)
    x = x / np.maximum(scale, 1e-9)[group, None]
    solved, gap = _resect_linear(group, size, x, r.reading)
    o = np.arctan2(solved[:, 1], solved[:, 0])
    cos, sin = np.cos(o), np.sin(o)
    length = np.hypot(solved[:, 0], solved[:, 1])
    p, q = (solved[:, 2:] / np.maximum(length, 1e-300)[:, None]).T
    place = np.stack([p * cos + q * sin, q * cos - p * sin], axis=1)
    ahead = np.einsum("ni,ni->n", x - place[group], unit(r.reading + o[group])) > 0
    share = np.bincount(group, ahead) / count
    o = np.where(share < 0.5, o + np.pi, o)
    good = (gap > (1e-7 if f.relaxed else 1e-5)) & (length > 1e-6)
    good &= (np.abs(share - 0.5) > 0.49) | (count > 3)
    nodes = f.ties.set_node[sets[good]]
    f.place_plan(nodes, (place * scale[:, None] + centre)[good])
    f.orientation[sets[good]] = wrap(o[good] - f.convergence(nodes))


def _resect_linear(group: Index, size: int, x: Array, reading: Array) -> tuple[Array, Array]:
    """Null vectors (size, 4) of the resection equations; second smallest over largest eigenvalue.

    The second smallest vanishes where the set-up and its targets lie on one circle.
    """
    cos, sin = np.cos(reading), np.sin(reading)
    rows = np.stack(
        [x[:, 0] * cos - x[:, 1] * sin, -(x[:, 0] * sin + x[:, 1] * cos), -cos, sin], axis=1
    )
    weights = np.ones(len(rows))
    for _ in range(4):
        normal = grouped_sum(
            group, size, weights[:, None, None] * rows[:, :, None] * rows[:, None, :]
        )
        values, vectors = np.linalg.eigh(normal)
        solved = vectors[:, :, 0]
        v = np.abs(np.einsum("ni,ni->n", rows, solved[group]))
        _, median, _ = grouped_median(group, v[:, None])
        weights = 1 / (v + median[group, 0] + 1e-6)
        weights /= np.maximum(np.bincount(group, weights), 1e-300)[group]
    return solved, values[:, 1] / np.maximum(values[:, 3], 1e-300)
