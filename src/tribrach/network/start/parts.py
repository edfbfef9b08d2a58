"""Grows the work frame, and parts that do not hang on the control, which are then fitted in.

A frame grows by rules that place whatever hangs together with what it knows. The rules come in
tiers: sound and cheap ones are repeated to their end before the next tier is asked, so that chains
run through well-determined places first.

A free network, a traverse between unknown stations, or scanner stations that see each other's
targets before they see control grow as parts: a part is seeded in a frame of its own with one thing
placed by choice (a set-up at the origin with orientation zero, a scanner, two places at their
measured distance, or, without any distance, two set-ups that sight each other a unit apart), grown,
and carried into another frame by the places both know (rigid in space; heading and shift where it
is levelled).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from tribrach._types import Array, Mask
from tribrach.network.start.frame import Frame, Kind
from tribrach.network.start.grouping import pair_key, wrap
from tribrach.network.start.resection import (
    cross,
    intersect,
    multilaterate,
    resect,
    trilaterate_space,
)
from tribrach.network.start.sights import (
    orient,
    rises,
    robust_planar,
    set_ups,
    transfer,
    traverse,
    zeniths,
)
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

#: places what it can in a frame
Rule = Callable[[Frame], None]
_SPACE: tuple[Rule, ...] = (fixes, vectors, links, poses, shots, faces)
_CHAINS: tuple[Rule, ...] = (transfer, orient, traverse, rises, zeniths, headings)
_STATIONS: tuple[Rule, ...] = (set_ups, headings)
_FIGURES: tuple[Rule, ...] = (intersect, multilaterate, resect, trilaterate_space)
#: tiers of rules in frames whose vertical is known, and in frames that know nothing
_UPRIGHT = ((*_SPACE, *_CHAINS), _STATIONS, _FIGURES, (cross,))
_RIGID: tuple[tuple[Rule, ...], ...] = (_SPACE, (trilaterate_space,))

#: passes after which used-up ties are put aside
_PRUNE_EVERY = 4
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


def seeds(world: Frame, sets: Mask, poses: Mask, again: bool) -> Iterator[Frame]:
    """Frames to grow from, the best first; sets and poses already tried are left out."""
    yield from _seed_vector(world, again)
    yield from _seed_set(world, sets)
    yield from _seed_pose(world, poses)
    yield from _seed_pair(world, again)
    yield from _seed_base(world, sets)


def _blank(world: Frame, kind: Kind, scaled: bool = True) -> Frame:
    """A frame of its own for what is not yet placed in the world."""
    ties = world.ties
    open_set = np.isnan(world.orientation)
    open_set[ties.north] = True
    placed = np.isfinite(world.turn[:, 0, 0]) & world.known[ties.n_points : ties.n_positions]
    poses = ties.pose_set(np.arange(len(placed)))
    open_set[poses] = ~placed & (open_set[poses] | np.isfinite(ties.heading))
    orientation = np.full_like(world.orientation, np.nan)
    if kind == "oriented":
        orientation[ties.north] = 0.0
        orientation[poses] = ties.heading
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
    """Carry a part into its host by three or more common places in space."""
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
    """Carry a part into its host by common places in plan, and by heights."""
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
        new = np.isnan(host.orientation) & np.isfinite(part.orientation)
        host.orientation[new] = wrap(part.orientation[new] + angle)
