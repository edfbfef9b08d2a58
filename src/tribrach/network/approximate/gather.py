"""Writes the active observations of a network as ties.

Kinds are told apart by their names; :mod:`sight_ties` and :mod:`space_ties` read their fields.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tribrach.geodesy.site import FlatSite
from tribrach.network.approximate import sight_ties, space_ties
from tribrach.network.approximate.collector import Collector
from tribrach.network.approximate.grouping import grouped_median
from tribrach.network.approximate.heights import CURVATURE
from tribrach.network.approximate.ties import (
    Array,
    Faces,
    Fixes,
    Index,
    Lengths,
    Links,
    Rays,
    Rises,
    Shots,
    Ties,
    Vectors,
    Zeniths,
)
from tribrach.network.network import Network
from tribrach.network.observations.base import Use

__all__ = ["gather"]

_READERS = sight_ties.READERS | space_ties.READERS
_FRAME_SIGHTS = ("frame_coordinate", "frame_angle", "frame_distance")


def gather(network: Network, vectors: Array) -> Ties:
    """The ties of all active observations and hard constraints; vectors (V, 3) lever arms."""
    c = Collector(network, vectors)
    in_frames: list[tuple[Any, Index]] = []
    for o in [*network.observations, *(x.observations for x in network.constraints)]:
        rows = np.flatnonzero(o.use == Use.ACTIVE)
        if o.kind in _FRAME_SIGHTS:
            in_frames.append((o, rows))
        elif o.kind in _READERS and len(rows):
            _READERS[o.kind](c, o, rows)
    space_ties.read_frame_sights(c, in_frames)
    for start, end, value in c.north:
        c.add(Rays(np.full(len(start), c.n_sets), start, end, value))
    c.n_sets += 1
    _levelled_shots(c)
    return _ties(c)


def _ties(c: Collector) -> Ties:
    rays, zeniths = c.table(Rays), c.table(Zeniths)
    site = c.network.site
    bent = site.curvature_radius is not None or not isinstance(site, FlatSite)
    lengths, rises = _reduce(c.table(Lengths), zeniths, CURVATURE if bent else 0.0)
    return Ties(
        n_points=c.n_points,
        n_positions=c.n_points + c.n_poses,
        n_nodes=c.n_nodes,
        n_sets=c.n_sets,
        n_scalars=c.n_scalars,
        rays=rays,
        lengths=lengths,
        rises=Rises.joined([c.table(Rises), rises]),
        zeniths=zeniths,
        vectors=c.table(Vectors),
        shots=c.table(Shots),
        links=c.table(Links),
        faces=c.table(Faces),
        fixes=c.table(Fixes),
        levelling=c.levelling,
        set_node=_set_nodes(rays, c.n_sets),
    )


def _set_nodes(rays: Rays, n_sets: int) -> Index:
    """The one node each set is measured from, or -1."""
    low = np.full(n_sets, np.iinfo(np.int64).max)
    high = np.full(n_sets, -1)
    np.minimum.at(low, rays.set, rays.start)
    np.maximum.at(high, rays.set, rays.start)
    high[n_sets - 1] = -1
    return np.where(low == high, high, -1)


def _reduce(lengths: Lengths, zeniths: Zeniths, curvature: float) -> tuple[Lengths, Rises]:
    """Horizontal distances of slope distances that have a zenith angle, and trigonometric rises.

    A zenith angle of the other direction serves as well: its slope is the opposite.
    """
    ends = (lengths.start, lengths.end, zeniths.start, zeniths.end)
    n = 1 + max(int(a.max(initial=0)) for a in ends)
    key = np.concatenate([zeniths.start * n + zeniths.end, zeniths.end * n + zeniths.start])
    both = np.stack([zeniths.slope, zeniths.lift], axis=1)
    keys, values, _ = grouped_median(key, np.concatenate([both, -both]))
    wanted = lengths.start * n + lengths.end
    known = np.isin(wanted, keys)
    at = np.searchsorted(keys, wanted[known])
    cotangent, lift = values[at].T
    flat = lengths.flat.copy()
    by_zenith = lengths.value[known] / np.sqrt(1 + cotangent**2)
    flat[known] = np.where(np.isnan(flat[known]), by_zenith, flat[known])
    rise = flat[known] * cotangent - lift + curvature * flat[known] ** 2
    rises = Rises(lengths.start[known], lengths.end[known], rise)
    return Lengths(lengths.start, lengths.end, lengths.value, flat, lengths.lift), rises


def _levelled_shots(c: Collector) -> None:
    """Shots of levelled scanners are also rays, lengths and rises."""
    shots = c.table(Shots)
    shots = shots[np.isfinite(c.levelling[shots.pose, 0, 0])]
    if len(shots) == 0:
        return
    start = c.n_points + shots.pose
    v = np.einsum("nij,nj->ni", c.levelling[shots.pose], shots.u)
    flat = np.hypot(v[:, 0], v[:, 1])
    steep = flat < 1e-6
    reading = np.arctan2(v[:, 0], v[:, 1])
    c.add(Rays(c.n_scalars + shots.pose, start, shots.target, reading)[~steep])
    zero = np.zeros(len(v))
    c.add(Lengths(start, shots.target, np.linalg.norm(v, axis=1), flat, zero)[~steep])
    c.add(Rises(start, shots.target, v[:, 2]))
