"""Writes the active observations of a network as ties.

Kinds are told apart by their names and read by their fields, so that a kind adds itself to the
table at the end of this file.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tribrach.network.approximate.grouping import grouped_median
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
    Table,
    Ties,
    Vectors,
    Zeniths,
)
from tribrach.network.network import Network
from tribrach.network.observations.base import Use

__all__ = ["gather"]

#: radius [m] of the Earth's curvature where verticals are not parallel
EARTH_RADIUS = 6371000.0
_REFRACTION = 0.13


class _Collector:
    """Parts of the ties while the observations are read."""

    def __init__(self, network: Network) -> None:
        layout = network.start.layout
        self.network = network
        self.n_points = layout.count("point")
        self.n_poses = layout.count("pose")
        self.n_nodes = self.n_points + self.n_poses
        self.n_scalars = layout.count("scalar")
        self.n_sets = self.n_scalars + self.n_poses
        self.levelling = np.full((self.n_poses, 3, 3), np.nan)
        none, nothing, vectors = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 3))
        self.parts: dict[type[Table], list[Any]] = {
            Rays: [Rays(none, none, none, nothing)],
            Lengths: [Lengths(none, none, nothing, nothing, nothing)],
            Rises: [Rises(none, none, nothing)],
            Zeniths: [Zeniths(none, none, nothing, nothing)],
            Vectors: [Vectors(none, none, vectors)],
            Shots: [Shots(none, none, vectors)],
            Links: [Links(none, none, vectors, np.zeros((0, 3, 3)))],
            Faces: [Faces(none, none, vectors, nothing)],
            Fixes: [Fixes(none, vectors)],
        }
        self.north: list[tuple[Index, Index, Array]] = []

    def add(self, part: Table) -> None:
        """One more part of a table."""
        self.parts[type(part)].append(part)

    def table(self, kind: type[Any]) -> Any:
        """All parts of a table."""
        return kind.joined(self.parts[kind])


def gather(network: Network) -> Ties:
    """The ties of all active observations and of the hard constraints."""
    c = _Collector(network)
    tables = [*network.observations, *(x.observations for x in network.constraints)]
    for observations in tables:
        read = READERS.get(observations.kind)
        rows = np.flatnonzero(observations.use == Use.ACTIVE)
        if read is not None and len(rows):
            read(c, observations, rows)
    _azimuths(c)
    _levelled_shots(c)
    rays, zeniths = c.table(Rays), c.table(Zeniths)
    lengths, rises = _reduce(c.table(Lengths), zeniths)
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


def _reduce(lengths: Lengths, zeniths: Zeniths) -> tuple[Lengths, Rises]:
    """Horizontal distances of slope distances that have a zenith angle, and trigonometric rises.

    A zenith angle of the other direction serves as well: its slope is the opposite.
    """
    ends = (lengths.start, lengths.end, zeniths.start, zeniths.end)
    n = 1 + max(int(a.max(initial=0)) for a in ends)
    key = np.concatenate([zeniths.start * n + zeniths.end, zeniths.end * n + zeniths.start])
    slope = np.concatenate([zeniths.slope, -zeniths.slope])
    lift = np.concatenate([zeniths.lift, -zeniths.lift])
    keys, values, _ = grouped_median(key, np.stack([slope, lift], axis=1))
    wanted = lengths.start * n + lengths.end
    at = np.minimum(np.searchsorted(keys, wanted), max(len(keys) - 1, 0))
    known = np.zeros(len(wanted), dtype=bool) if len(keys) == 0 else keys[at] == wanted
    cotangent = np.zeros(len(wanted))
    cotangent[known] = values[at[known], 0]
    # the height of the sight over the target's mark is the length's own, if it has one
    lifted = np.zeros(len(wanted))
    lifted[known] = values[at[known], 1]
    by_zenith = lengths.value / np.sqrt(1 + cotangent**2)
    flat = np.where(np.isnan(lengths.flat) & known, by_zenith, lengths.flat)
    curve = (1 - _REFRACTION) / (2 * EARTH_RADIUS) * flat[known] ** 2
    rises = Rises(
        lengths.start[known],
        lengths.end[known],
        flat[known] * cotangent[known] - lifted[known] + curve,
    )
    return Lengths(lengths.start, lengths.end, lengths.value, flat, lengths.lift), rises


def _azimuths(c: _Collector) -> None:
    """Azimuths form the last set."""
    for start, end, value in c.north:
        c.add(Rays(np.full(len(start), c.n_sets), start, end, value))
    c.n_sets += 1


def _levelled_shots(c: _Collector) -> None:
    """Shots of levelled scanners are also rays, lengths and rises."""
    shots = c.table(Shots)
    shots = shots[np.isfinite(c.levelling[shots.pose, 0, 0])]
    if len(shots) == 0:
        return
    start = c.n_points + shots.pose
    v = np.einsum("nij,nj->ni", c.levelling[shots.pose], shots.u)
    flat = np.hypot(v[:, 0], v[:, 1])
    steep = flat > 1e-6
    reading = np.arctan2(v[:, 0], v[:, 1])
    c.add(Rays(c.n_scalars + shots.pose, start, shots.target, reading)[steep])
    zero = np.zeros(len(v))
    c.add(Lengths(start, shots.target, np.linalg.norm(v, axis=1), flat, zero)[steep])
    c.add(Rises(start, shots.target, v[:, 2]))


def _lift(o: Any, rows: Index) -> Array:
    out: Array = o.height_target[rows] - o.height_instrument[rows]
    return out


def _directions(c: _Collector, o: Any, rows: Index) -> None:
    c.add(Rays(o.orientation[rows], o.start[rows], o.end[rows], o.values[rows, 0]))


def _azimuth(c: _Collector, o: Any, rows: Index) -> None:
    scalars = c.network.start.scalars
    offset = np.zeros(len(rows))
    has = o.offset[rows] >= 0
    offset[has] = np.nan_to_num(scalars[o.offset[rows][has]])
    c.north.append((o.start[rows], o.end[rows], o.values[rows, 0] + o.convergence[rows] + offset))


def _angles(c: _Collector, o: Any, rows: Index) -> None:
    """Angles at one instrument that share targets form a set; readings run from one to the next."""
    start, value = o.start[rows], o.values[rows, 0]
    targets = np.concatenate([o.end[rows], o.foresight[rows]])
    node, inverse = np.unique(np.tile(start, 2) * c.n_nodes + targets, return_inverse=True)
    back, fore = inverse[: len(rows)], inverse[len(rows) :]
    reading = np.full(len(node), np.nan)
    label = np.full(len(node), -1)
    while np.isnan(reading).any():
        first = int(np.argmax(np.isnan(reading)))
        reading[first], label[first] = 0.0, c.n_sets
        while True:
            ahead = (label[back] == c.n_sets) & np.isnan(reading[fore])
            behind = (label[fore] == c.n_sets) & np.isnan(reading[back])
            if not (ahead.any() or behind.any()):
                break
            reading[fore[ahead]] = reading[back[ahead]] + value[ahead]
            behind &= np.isnan(reading[back])
            reading[back[behind]] = reading[fore[behind]] - value[behind]
            label[np.isfinite(reading) & (label < 0)] = c.n_sets
        c.n_sets += 1
    c.add(Rays(label, node // c.n_nodes, node % c.n_nodes, reading))


def _slope_distances(c: _Collector, o: Any, rows: Index) -> None:
    value = o.values[rows, 0]
    c.add(
        Lengths(o.start[rows], o.end[rows], value, np.full(len(rows), np.nan), _lift(o, rows))
    )


def _horizontal_distances(c: _Collector, o: Any, rows: Index) -> None:
    value = o.values[rows, 0] / o.reduction[rows]
    zero = np.zeros(len(rows))
    c.add(Lengths(o.start[rows], o.end[rows], value, value, zero))


def _zeniths(c: _Collector, o: Any, rows: Index) -> None:
    z = o.values[rows, 0]
    good = np.abs(np.sin(z)) > 1e-6
    rows, z = rows[good], z[good]
    c.add(Zeniths(o.start[rows], o.end[rows], np.cos(z) / np.abs(np.sin(z)), _lift(o, rows)))


def _height_differences(c: _Collector, o: Any, rows: Index) -> None:
    over = (o.height_start - o.height_end + o.geoid_end - o.geoid_start)[rows]
    c.add(Rises(o.start[rows], o.end[rows], o.values[rows, 0] + over))


def _baselines(c: _Collector, o: Any, rows: Index) -> None:
    value = o.values[rows].copy()
    # antenna heights along the mean vertical are near enough for a start
    value[:, 2] += o.height_start[rows] - o.height_end[rows]
    c.add(Vectors(o.start[rows], o.end[rows], value))


def _coordinates(c: _Collector, o: Any, rows: Index) -> None:
    c.add(Fixes(o.position[rows], o.values[rows]))


def _coordinate(c: _Collector, o: Any, rows: Index) -> None:
    xyz = np.full((len(rows), 3), np.nan)
    xyz[np.arange(len(rows)), o.axis[rows]] = o.values[rows, 0]
    c.add(Fixes(o.position[rows], xyz))


def _gnss_positions(c: _Collector, o: Any, rows: Index) -> None:
    antenna = o.values[rows]
    up = c.network.site.axes(antenna)[:, 2]
    c.add(Fixes(o.position[rows], antenna - o.antenna_height[rows, None] * up))


def _target_centres(c: _Collector, o: Any, rows: Index) -> None:
    c.add(Shots(o.station[rows], o.target[rows], o.values[rows]))


READERS: dict[str, Callable[[_Collector, Any, Index], None]] = {
    "direction": _directions,
    "azimuth": _azimuth,
    "angle": _angles,
    "slope_distance": _slope_distances,
    "horizontal_distance": _horizontal_distances,
    "zenith": _zeniths,
    "height_difference": _height_differences,
    "gnss_baseline": _baselines,
    "coordinates": _coordinates,
    "coordinate": _coordinate,
    "gnss_position": _gnss_positions,
    "target_centre": _target_centres,
}
