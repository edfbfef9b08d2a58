"""Writes the active observations of a network as ties.

Every kind writes its own (:meth:`~tribrach.observations.base.Observations.start_ties`); here they
are brought together, and what only several of them say is added: shots from single values of a
frame, horizontal distances and rises from slope distances with zenith angles, and the rays of
levelled scanners.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite
from tribrach.network.network import Network
from tribrach.network.start.grouping import grouped_median
from tribrach.network.start.sights import CURVATURE
from tribrach.network.start.ties import Ties
from tribrach.observations.base import Use
from tribrach.observations.ties import (
    Faces,
    Fixes,
    Lengths,
    Links,
    Rays,
    Rises,
    ScannerShots,
    TieCollector,
    Vectors,
    Zeniths,
    xyz_of_polar,
)


def gather(network: Network, vectors: Array) -> Ties:
    """Ties of active observations and hard constraints; ``vectors`` (V, 3) are known ones [m]."""
    c = TieCollector(network.start, network.site, vectors)
    for o in [*network.observations, *(x.observations for x in network.constraints)]:
        rows = np.flatnonzero(o.use == Use.ACTIVE)
        if len(rows):
            o.start_ties(rows, c)
    _shots_in_frames(c)
    for start, end, value in c.north:
        c.add(Rays(np.full(len(start), c.n_sets), start, end, value))
    c.n_sets += 1
    _levelled_shots(c)
    return _ties(c)


def _shots_in_frames(c: TieCollector) -> None:
    """Shots of all (station, target) with x, y, z or with both angles and a distance."""
    if not c.in_frames:
        return
    parts = [np.concatenate(column) for column in zip(*c.in_frames, strict=True)]
    station, target, component, value, lift = parts
    pairs, group = np.unique(station * c.n_nodes + target, return_inverse=True)
    # x, y, z, angle around, elevation, distance, lift
    sheet = np.full((len(pairs), 7), np.nan)
    at, medians, _ = grouped_median(7 * group + component, value[:, None])
    sheet.reshape(-1)[at] = medians[:, 0]
    sheet[group, 6] = lift
    polar = xyz_of_polar(sheet[:, 5], sheet[:, 3], sheet[:, 4])
    u = np.where(np.isfinite(sheet[:, :3]), sheet[:, :3], polar)
    # the mark lies below the target, nearly along the axis of a standing instrument
    u[:, 2] -= sheet[:, 6]
    good = np.isfinite(u).all(axis=1)
    station, target = np.divmod(pairs[good], c.n_nodes)
    c.add(ScannerShots(station, target, u[good]))


def _ties(c: TieCollector) -> Ties:
    rays, zeniths = c.table(Rays), c.table(Zeniths)
    site = c.site
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
        shots=c.table(ScannerShots),
        links=c.table(Links),
        faces=c.table(Faces),
        fixes=c.table(Fixes),
        levelling=c.levelling,
        heading=c.heading,
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


def _levelled_shots(c: TieCollector) -> None:
    """Shots of levelled scanners are also rays, lengths and rises."""
    shots = c.table(ScannerShots)
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
