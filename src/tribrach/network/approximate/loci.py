"""Single places where a line or circle meets another: all candidates, the best of them kept.

Every tie of an unknown place to known ones is a locus of it in the plan: an oriented ray is a
line, a distance a circle, the angle between two readings of its own set a circle through both
targets. All loci are crossed in pairs and each crossing is scored by all loci. Two crossings that
fit equally well leave the place undecided, unless a frame of its own may choose (``guess``).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tribrach.network.approximate.frame import Frame
from tribrach.network.approximate.grouping import azimuth, wrap
from tribrach.network.approximate.plan import unit

__all__ = ["cross"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_MOST_LOCI = 12


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
    to_centre = circle.centre - line.point
    along = float(to_centre @ line.direction)
    square = circle.radius**2 - (float(to_centre @ to_centre) - along**2)
    if square < -0.05 * circle.radius**2:
        return []
    half = np.sqrt(max(square, 0.0))
    return [line.point + s * line.direction for s in (along - half, along + half)]


def _two_circles(a: _Circle, b: _Circle) -> list[Array]:
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
