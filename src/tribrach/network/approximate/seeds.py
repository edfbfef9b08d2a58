"""Where a part that does not hang on the control can begin to grow.

A seed is a frame of its own with one thing placed by choice: a set-up at the origin with
orientation zero, a scanner, two places at their measured distance, or, without any distance, two
set-ups that sight each other a unit apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tribrach.network.approximate.frame import Frame, Kind
from tribrach.network.approximate.grouping import pair_key

__all__ = ["seeds"]

Mask = NDArray[np.bool_]


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
