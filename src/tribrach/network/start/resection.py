"""Places where several lines or circles meet.

Many places at once:

* Intersection: rays from known set-ups meet in a point.
* Multilateration: distances to known places, linear in the point after differencing.
* Resection: three or more readings of one set; linear in (cos o, sin o, p, q) with
  ``p = E cos o - N sin o``, ``q = E sin o + N cos o`` because each ray gives
  ``(E_i cos r - N_i sin r) cos o - (E_i sin r + N_i cos r) sin o - p cos r + q sin r = 0``.

What is left, one place at a time (:func:`cross`): every tie of an unknown place to known ones is a
locus of it in the plan: an oriented ray is a line, a distance a circle, the angle between two
readings of its own set a circle through both targets. All loci are crossed in pairs and each
crossing is scored by all loci. Two crossings that fit equally well leave the place undecided,
unless a frame of its own may choose (``guess``).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.network.start.frame import Frame
from tribrach.network.start.grouping import azimuth, grouped_median, grouped_sum, wrap
from tribrach.network.start.sights import unit

#: smallest sine of the angle at which lines may meet
_SHARP = 0.05
#: loci of one place that are crossed with each other
_MOST_LOCI = 12


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
    place = x + centre
    in_front = sign * np.einsum("ni,ni->n", direction, place[group] - through) > 0
    front = np.bincount(group, in_front) > 0.5 * np.bincount(group)
    both = (np.bincount(group) > 2) | (np.bincount(group, in_front) == 2)
    limit = _SHARP**2 / (10 if f.relaxed else 1)
    good = (sharp > limit) & front & both
    f.place_plan(places[good], place[good])


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
    components along the extent of the centres; across their best plane (line) the place lies on one
    side or the other. Both sides are refined and the better one is kept if it is clearly better, or
    if one may ``choose``.
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


@dataclass(frozen=True)
class _Line:
    """Half line from ``point`` along ``direction``."""

    point: Array
    direction: Array

    def miss(self, x: Array) -> Array:
        """Distances (n,) [m] of candidates (n, 2); behind the start counts as far away."""
        d = x - self.point
        ahead = d @ self.direction
        side = np.abs(d[:, 0] * self.direction[1] - d[:, 1] * self.direction[0])
        out: Array = np.where(ahead > 0, side, np.hypot(side, ahead) + np.abs(ahead))
        return out


@dataclass(frozen=True)
class _Circle:
    """Circle about ``centre``; an inscribed-angle circle counts only where the angle holds."""

    centre: Array
    radius: float
    left: Array | None = None
    right: Array | None = None
    angle: float = 0.0

    def miss(self, x: Array) -> Array:
        """Distances (n,) [m] of candidates (n, 2) from the locus."""
        off: Array = np.abs(np.hypot(*(x - self.centre).T) - self.radius)
        if self.left is None or self.right is None:
            return off
        seen = azimuth(self.right - x) - azimuth(self.left - x)
        wrong = np.abs(wrap(seen - self.angle))
        return np.where(wrong > 0.5, off + self.radius, off)


_Locus = _Line | _Circle


def cross(f: Frame) -> None:
    """Place what two or more loci of different places decide; at most one place by choice."""
    known, nodes, before = f.known_plan, _candidates(f), f.count()
    for choose in (False, True) if f.guess else (False,):
        for node in nodes:
            place = _decide(_loci(f, node, known), choose)
            if place is not None:
                f.place_plan(np.array([node]), place[None])
                if choose:
                    return
        if f.count() > before:
            return


def _candidates(f: Frame) -> list[int]:
    """Unknown nodes with two or more ties to known ones, most ties first."""
    known = f.known_plan
    pairs = [(f.rays.start, f.rays.end), (f.lengths.start, f.lengths.end)]
    counts = np.zeros(f.ties.n_nodes, dtype=np.int64)
    for a, b in pairs:
        counts += np.bincount(b[known[a] & ~known[b]], minlength=len(counts))
        counts += np.bincount(a[known[b] & ~known[a]], minlength=len(counts))
    nodes = np.flatnonzero(counts >= 2)
    return [int(n) for n in nodes[np.argsort(-counts[nodes], kind="stable")]]


def _loci(f: Frame, node: int, known: NDArray[np.bool_]) -> list[_Locus]:
    """All loci of a node."""
    out: list[_Locus] = []
    r = f.rays
    oriented = np.isfinite(f.orientation[r.set])
    ahead = r[oriented & (r.end == node) & known[r.start]]
    out += [_Line(f.plan[i], d) for i, d in zip(ahead.start, unit(f.azimuths(ahead)), strict=True)]
    back = r[oriented & (r.start == node) & known[r.end]]
    out += [_Line(f.plan[i], -d) for i, d in zip(back.end, unit(f.azimuths(back)), strict=True)]
    flat = f.flats()
    for at, to in ((f.lengths.start, f.lengths.end), (f.lengths.end, f.lengths.start)):
        rows = np.flatnonzero((to == node) & known[at] & np.isfinite(flat))
        out += [_Circle(f.plan[at[k]], float(flat[k])) for k in rows]
    own = r[~oriented & (r.start == node) & known[r.end]]
    for number in np.unique(own.set):
        same = own[own.set == number]
        for i, j in zip(range(len(same) - 1), range(1, len(same)), strict=True):
            angle = float(same.reading[j] - same.reading[i])
            circle = _inscribed(f.plan[same.end[i]], f.plan[same.end[j]], angle)
            out += [] if circle is None else [circle]
    return out[:_MOST_LOCI]


def _inscribed(left: Array, right: Array, angle: float) -> _Circle | None:
    """Places from which ``right`` appears clockwise of ``left`` by an angle."""
    chord = right - left
    length, sine = float(np.hypot(*chord)), float(np.sin(angle))
    if length < 1e-6 or abs(sine) < 1e-3:
        return None
    # the centre lies on the chord's bisector, to its right for acute clockwise angles
    normal = np.array([chord[1], -chord[0]]) / length
    centre = (left + right) / 2 + normal * length / (2 * np.tan(angle))
    return _Circle(centre, length / abs(2 * sine), left, right, angle)


def _decide(loci: list[_Locus], guess: bool) -> Array | None:
    """The crossing that fits all loci best, if no other fits as well."""
    points = [p for a, b in combinations(loci, 2) for p in _meet(a, b)]
    if not points:
        return None
    x = np.array(points)
    misses = np.array([locus.miss(x) for locus in loci])
    score = np.median(misses, axis=0) + 0.1 * misses.mean(axis=0)
    size = max(float(np.ptp(x, axis=0).max()), 1.0)
    best = int(np.argmin(score))
    if score[best] > 0.05 * size and score[best] > 1.0:
        return None
    apart = np.hypot(*(x - x[best]).T) > 0.02 * size
    rival = score[apart].min() if apart.any() else np.inf
    if rival < 3 * score[best] + 1e-3 * size and not guess:
        return None
    best_place: Array = x[best]
    return best_place


def _meet(a: _Locus, b: _Locus) -> list[Array]:
    """Crossings of two loci, none where they are nearly parallel or apart."""
    if isinstance(a, _Line) and isinstance(b, _Line):
        matrix = np.stack([a.direction, -b.direction], axis=1)
        if abs(np.linalg.det(matrix)) < 0.02:
            return []
        along = np.linalg.solve(matrix, b.point - a.point)
        return [a.point + along[0] * a.direction]
    if isinstance(a, _Line) and isinstance(b, _Circle):
        return _line_circle(a, b)
    if isinstance(a, _Circle) and isinstance(b, _Line):
        return _line_circle(b, a)
    return _two_circles(a, b) if isinstance(a, _Circle) and isinstance(b, _Circle) else []


def _line_circle(line: _Line, circle: _Circle) -> list[Array]:
    """Crossings of a line and a circle, none where they are apart."""
    to_centre = circle.centre - line.point
    along = float(to_centre @ line.direction)
    square = circle.radius**2 - (float(to_centre @ to_centre) - along**2)
    if square < -0.05 * circle.radius**2:
        return []
    half = np.sqrt(max(square, 0.0))
    return [line.point + s * line.direction for s in (along - half, along + half)]


def _two_circles(a: _Circle, b: _Circle) -> list[Array]:
    """Crossings of two circles, none where they are apart."""
    d = b.centre - a.centre
    apart = float(np.hypot(*d))
    if apart < 1e-6:
        return []
    along = (apart**2 + a.radius**2 - b.radius**2) / (2 * apart)
    square = a.radius**2 - along**2
    if square < -0.05 * max(a.radius, b.radius) ** 2:
        return []
    half = np.sqrt(max(square, 0.0))
    e = d / apart
    side = np.array([-e[1], e[0]])
    return [a.centre + along * e + s * half * side for s in (-1.0, 1.0)]
