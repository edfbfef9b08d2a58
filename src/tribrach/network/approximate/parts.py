"""Parts that do not hang on the control: grown in frames of their own, then fitted in.

A free network, a traverse between unknown stations, or scanner stations that see each other's
targets before they see control: the part is seeded at one set-up, grown, and carried into
another frame by the places both know (rigid in space; heading and shift where it is levelled).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.network.approximate.frame import Frame
from tribrach.network.approximate.grouping import wrap
from tribrach.network.approximate.growth import grow
from tribrach.network.approximate.plan import robust_planar
from tribrach.network.approximate.seeds import seeds
from tribrach.network.approximate.space import robust_rigid

__all__ = ["join_parts"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

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
