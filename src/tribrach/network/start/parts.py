"""Parts that do not hang on the control: grown in frames of their own, then fitted in.

A free network, a traverse between unknown stations, or scanner stations that see each other's
targets before they see control: the part is seeded at one set-up, grown, and carried into
another frame by the places both know (rigid in space; heading and shift where it is levelled).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Mask
from tribrach.network.start.frame import Frame, Kind
from tribrach.network.start.grouping import azimuth, pair_key, wrap
from tribrach.network.start.heights import rises, zeniths
from tribrach.network.start.horizontal import (
    orient,
    robust_planar,
    set_ups,
    transfer,
    traverse,
    unit,
)
from tribrach.network.start.resection import intersect, multilaterate, resect, trilaterate_space
from tribrach.network.start.space import (
    faces,
    fixes,
    headings,
    links,
    poses,
    robust_rigid,
    shots,
    vectors,
)

__all__ = ["join_parts"]

# Single places where a line or circle meets another: all candidates, the best of them kept.
#
# Every tie of an unknown place to known ones is a locus of it in the plan: an oriented ray is a
# line, a distance a circle, the angle between two readings of its own set a circle through both
# targets. All loci are crossed in pairs and each crossing is scored by all loci. Two crossings that
# fit equally well leave the place undecided, unless a frame of its own may choose (``guess``).


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


# Grows a frame from what is known in it until no rule finds anything more.
#
# Rules come in tiers: sound and cheap ones are repeated to their end before the next tier is
# asked, so that chains run through well-determined places first.


Rule = Callable[[Frame], None]


_SPACE: tuple[Rule, ...] = (fixes, vectors, links, poses, shots, faces)


_CHAINS: tuple[Rule, ...] = (transfer, orient, traverse, rises, zeniths, headings)


_STATIONS: tuple[Rule, ...] = (set_ups, headings)


_FIGURES: tuple[Rule, ...] = (intersect, multilaterate, resect, trilaterate_space)


_UPRIGHT = ((*_SPACE, *_CHAINS), _STATIONS, _FIGURES, (cross,))


_RIGID: tuple[tuple[Rule, ...], ...] = (_SPACE, (trilaterate_space,))


#: passes after which used-up ties are put aside
_PRUNE_EVERY = 4


def grow(f: Frame) -> None:
    """Place everything that hangs together with what the frame knows."""
    tiers = _RIGID if f.kind == "rigid" else _UPRIGHT
    passes, tier = 0, 0
    if f.kind != "rigid":
        # what is given orients best
        fixes(f)
        orient(f)
    while tier < len(tiers):
        before = f.count()
        for rule in tiers[tier]:
            rule(f)
        tier = 0 if f.count() > before else tier + 1
        passes += 1
        if passes % _PRUNE_EVERY == 0:
            f.prune()


# Where a part that does not hang on the control can begin to grow.
#
# A seed is a frame of its own with one thing placed by choice: a set-up at the origin with
# orientation zero, a scanner, two places at their measured distance, or, without any distance, two
# set-ups that sight each other a unit apart.


def _blank(world: Frame, kind: Kind, scaled: bool = True) -> Frame:
    """A frame of its own for what is not yet placed in the world."""
    ties = world.ties
    open_set = np.isnan(world.orientation)
    open_set[ties.north] = True
    placed = np.isfinite(world.turn[:, 0, 0]) & world.known[ties.n_points : ties.n_positions]
    open_set[ties.pose_set(np.flatnonzero(placed))] = False
    orientation = np.full_like(world.orientation, np.nan)
    if kind == "oriented":
        orientation[ties.north] = 0.0
    return replace(
        world,
        kind=kind,
        plan=np.full_like(world.plan, np.nan),
        up=np.full_like(world.up, np.nan) if kind == "rigid" else world.up.copy(),
        turn=np.full_like(world.turn, np.nan),
        orientation=orientation,
        normal=np.full_like(world.normal, np.nan),
        offset=np.full_like(world.offset, np.nan),
        open_set=open_set,
        open_pose=~placed,
        scaled=scaled,
    )


def seeds(world: Frame, sets: Mask, poses: Mask, again: bool) -> Iterator[Frame]:
    """Frames to grow from, the best first; sets and poses already tried are left out."""
    yield from _seed_vector(world, again)
    yield from _seed_set(world, sets)
    yield from _seed_pose(world, poses)
    yield from _seed_pair(world, again)
    yield from _seed_base(world, sets)


def _seed_vector(world: Frame, again: bool) -> Iterator[Frame]:
    """The unknown place with most GNSS vectors."""
    v, known = world.ties.vectors, world.known
    rows = ~known[v.start] & ~known[v.end]
    if again or not rows.any():
        return
    ends = np.concatenate([v.start[rows], v.end[rows]])
    f = _blank(world, "oriented")
    node = int(np.argmax(np.bincount(ends)))
    f.plan[node] = 0.0
    f.up[node] = 0.0
    f.floating = True
    yield f


def _seed_set(world: Frame, tried: Mask) -> Iterator[Frame]:
    """The set with most readings that have a distance, at its unknown place."""
    r = world.ties.rays
    node = world.ties.set_node[r.set]
    usable = ~tried[r.set] & np.isnan(world.orientation[r.set]) & (node >= 0)
    usable &= np.isfinite(world.pair_flats(r.start, r.end))
    if not usable.any():
        return
    best = int(np.argmax(np.bincount(r.set[usable])))
    f = _blank(world, "levelled")
    f.orientation[best] = 0.0
    f.plan[world.ties.set_node[best]] = 0.0
    yield f


def _seed_pose(world: Frame, tried: Mask) -> Iterator[Frame]:
    """The scanner with most targets."""
    f = _blank(world, "rigid")
    count = np.bincount(world.ties.shots.pose, minlength=len(f.open_pose))
    k = world.ties.links
    count += np.bincount(np.concatenate([k.first, k.second]), minlength=len(count))
    count = count * (f.open_pose & ~tried)
    if count.max(initial=0) < 1:
        return
    best = int(np.argmax(count))
    f.turn[best] = np.eye(3)
    node = world.ties.n_points + best
    f.plan[node], f.up[node] = 0.0, 0.0
    yield f


def _seed_pair(world: Frame, again: bool) -> Iterator[Frame]:
    """Two unknown places with a distance, in the most densely measured triangle."""
    known = world.known_plan
    s = world.lengths[~(known[world.lengths.start] & known[world.lengths.end])]
    if again or len(s) < 3:
        return
    f = _blank(world, "levelled")
    f.guess, f.handed = True, False
    degree = np.bincount(np.concatenate([s.start, s.end]), minlength=world.ties.n_nodes)
    best = int(np.argmax(degree[s.start] + degree[s.end]))
    a, b = s.start[best : best + 1], s.end[best : best + 1]
    f.plan[a] = 0.0
    f.plan[b, 0], f.plan[b, 1] = 0.0, f.pair_flats(a, b)
    if np.isfinite(f.plan[b]).all():
        yield f


def _seed_base(world: Frame, tried: Mask) -> Iterator[Frame]:
    """Two set-ups that sight each other, with a base of length one: angles without distances."""
    r = world.ties.rays
    node = world.ties.set_node
    r = r[~tried[r.set] & np.isnan(world.orientation[r.set]) & (node[r.set] >= 0)]
    if len(r) == 0:
        return
    ahead = r.start * world.ties.n_nodes + r.end
    mutual = r[np.isin(ahead, r.end * world.ties.n_nodes + r.start)]
    if len(mutual) == 0:
        return
    degree = np.bincount(r.start, minlength=world.ties.n_nodes)
    key = pair_key(mutual.start, mutual.end, world.ties.n_nodes)
    best = int(np.argmax(degree[mutual.start] + degree[mutual.end] - 1e-9 * key))
    f = _blank(world, "levelled", scaled=False)
    f.plan[mutual.start[best]] = 0.0
    f.plan[mutual.end[best]] = 0.0, 1.0
    yield f


#: parts seeded at most, so that hopeless networks end soon
_MOST_PARTS = 2000


def join_parts(world: Frame) -> None:
    """Place in the world what its own growth could not reach: soundly if possible, else roughly.

    Roughly: weak figures are taken, slope distances without heights count as horizontal, and at
    last one of two equally good places is chosen.
    """
    for world.relaxed in (False, True):
        grow(world)
        parts = _join(world)
        if world.complete():
            return
    world.guess = True
    grow(world)
    _merge_all(world, parts)


def _join(world: Frame) -> list[Frame]:
    """Seed, grow and fit in parts; returns those that fit nowhere."""
    _seed_heights(world)
    parts: list[Frame] = []
    tried_sets = np.zeros(len(world.open_set), dtype=bool)
    tried_poses = np.zeros(len(world.open_pose), dtype=bool)
    while not world.complete() and len(parts) < _MOST_PARTS:
        part = next(seeds(world, tried_sets, tried_poses, bool(parts)), None)
        if part is None:
            break
        grow(part)
        _seed_heights(part)
        tried_sets |= np.isfinite(part.orientation) & part.open_set
        tried_poses |= np.isfinite(part.turn[:, 0, 0]) & part.open_pose
        parts = _merge_all(world, [*parts, part])
    return parts


def _seed_heights(f: Frame) -> None:
    """If no height at all is known, one place is given height zero."""
    if f.kind == "rigid" or f.known_up.any():
        return
    r = f.ties.rises
    weight = np.bincount(np.concatenate([r.start, r.end]), minlength=f.ties.n_nodes)
    z = f.ties.zeniths
    weight += np.bincount(np.concatenate([z.start, z.end]), minlength=f.ties.n_nodes)
    if f.kind != "world":
        weight = weight * f.known_plan
    if weight.max(initial=0) > 0:
        f.up[int(np.argmax(weight))] = 0.0
        f.floating = True
        grow(f)


def _merge_all(world: Frame, parts: list[Frame]) -> list[Frame]:
    """Carry parts into the world, or into one another, until none fits any more."""
    moved = True
    while moved and parts:
        moved = False
        for part in sorted(parts, key=lambda p: -p.count()):
            hosts = [world, *(p for p in parts if p is not part)]
            host = next((h for h in hosts if _fit(part, h, h is world)), None)
            if host is not None:
                parts = [p for p in parts if p is not part]
                grow(host)
                moved = True
                break
    return parts


def _fit(part: Frame, host: Frame, host_is_world: bool) -> bool:
    """Carry a part into its host by their common places; False if these do not suffice."""
    if part.kind == "rigid" or host.kind == "rigid":
        if host_is_world and not host.known.any():
            _carry(part, host, np.eye(3), np.zeros(3), 1.0)
            return True
        return _fit_space(part, host)
    if host_is_world and not host.known_plan.any():
        _carry(part, host, _heading(part), np.zeros(3), 1.0)
        return True
    return _fit_plan(part, host, host_is_world)


def _heading(part: Frame) -> Array:
    """Rotation (3, 3) that brings azimuths of a levelled part to north, if it has any."""
    o = part.orientation[part.ties.north]
    return _about_up(0.0 if np.isnan(o) else -o)


def _about_up(angle: float) -> Array:
    """Rotation (3, 3) clockwise about the vertical by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _fit_space(part: Frame, host: Frame) -> bool:
    common = np.flatnonzero(part.known & host.known)
    if len(common) < 3:
        return False
    group = np.zeros(len(common), dtype=np.int64)
    fit, rms = robust_rigid(group, 1, part.space(common), host.space(common))
    if fit.spread[0] < 1e-3 or rms[0] > 0.1 * fit.spread[0]:
        return False
    _carry(part, host, fit.rotation[0], fit.translation[0], 1.0)
    return True


def _fit_plan(part: Frame, host: Frame, host_is_world: bool) -> bool:
    common = np.flatnonzero(part.known_plan & host.known_plan)
    lone = host_is_world and int(host.known_plan.sum()) == 1
    headed = np.isfinite(part.orientation[part.ties.north])
    if len(common) == 1 and part.scaled and (headed or lone):
        turn = _heading(part)
        shift = host.plan[common[0]] - turn[:2, :2] @ part.plan[common[0]]
        _carry(part, host, turn, np.array([*shift, _lift(part, host)]), 1.0)
        return True
    if len(common) < 2:
        return False
    group = np.zeros(len(common), dtype=np.int64)
    local, world = part.plan[common], host.plan[common]
    fit, rms = robust_planar(group, 1, local, world, scale=not part.scaled)
    if not part.handed and len(common) > 2:
        mirrored, other = robust_planar(group, 1, local, world, mirror=True)
        if other[0] < rms[0]:
            fit, rms = mirrored, other
    if fit.spread[0] < 1e-3 or rms[0] > 0.2 * fit.spread[0] * fit.scale[0]:
        return False
    turn = np.eye(3)
    turn[:2, :2] = fit.rotation[0]
    shift3 = np.array([*fit.translation[0], _lift(part, host)])
    _carry(part, host, turn, shift3, float(fit.scale[0]))
    return True


def _lift(part: Frame, host: Frame) -> float:
    """Height shift into the host; zero where the part's heights are the host's already."""
    common = part.known_up & host.known_up
    if not part.floating:
        return 0.0
    return float(np.median((host.up - part.up)[common])) if common.any() else np.nan


def _carry(part: Frame, host: Frame, turn: Array, shift: Array, scale: float) -> None:
    """Place what the part knows and its host does not."""
    xyz = np.concatenate([part.plan, part.up[:, None]], axis=1)
    ups = part.kind == "rigid" or host.kind == "rigid"
    moved = scale * (np.where(np.isnan(xyz) & (not ups), 0.0, xyz) @ turn.T)
    moved = moved + shift
    planar = np.isnan(host.plan).any(axis=1) & part.known_plan
    host.plan[planar] = moved[planar, :2]
    if ups:
        high = np.isnan(host.up) & part.known
        host.up[high] = moved[high, 2]
    else:
        lift = shift[2]
        if np.isnan(lift) and not host.known_up.any():
            lift, host.floating = 0.0, True
        high = np.isnan(host.up) & part.known_up
        host.up[high] = part.up[high] + lift
    new = np.isnan(host.turn[:, 0, 0]) & np.isfinite(part.turn[:, 0, 0])
    host.turn[new] = turn @ part.turn[new]
    flat = np.isfinite(part.normal[:, 0]) & np.isnan(host.normal[:, 0])
    host.normal[flat] = part.normal[flat] @ turn.T
    host.offset[flat] = part.offset[flat] + host.normal[flat] @ np.nan_to_num(shift)
    if not ups and np.linalg.det(turn) > 0:
        angle = np.arctan2(turn[0, 1], turn[0, 0])
        ours = np.isnan(host.orientation) & np.isfinite(part.orientation)
        host.orientation[ours] = wrap(part.orientation[ours] + angle)
