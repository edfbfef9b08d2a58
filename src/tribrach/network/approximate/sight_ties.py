"""Ties of total stations, levels and the like: sights between two places."""

from __future__ import annotations

from typing import Any

import numpy as np

from tribrach.network.approximate.collector import Collector
from tribrach.network.approximate.ties import Array, Index, Lengths, Rays, Rises, Zeniths

__all__ = ["READERS"]


def _lift(o: Any, rows: Index) -> Array:
    out: Array = o.height_target[rows] - o.height_instrument[rows]
    return out


def _directions(c: Collector, o: Any, rows: Index) -> None:
    c.add(Rays(o.orientation[rows], o.start[rows], o.end[rows], o.values[rows, 0]))


def _azimuths(c: Collector, o: Any, rows: Index) -> None:
    offset = np.zeros(len(rows))
    has = o.offset[rows] >= 0
    offset[has] = np.nan_to_num(c.network.start.scalars[o.offset[rows][has]])
    c.north.append((o.start[rows], o.end[rows], o.values[rows, 0] + o.convergence[rows] + offset))


def _angles(c: Collector, o: Any, rows: Index) -> None:
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
        spread = True
        while spread:
            ahead = np.isfinite(reading[back]) & np.isnan(reading[fore])
            reading[fore[ahead]] = reading[back[ahead]] + value[ahead]
            behind = np.isfinite(reading[fore]) & np.isnan(reading[back])
            reading[back[behind]] = reading[fore[behind]] - value[behind]
            label[np.isfinite(reading) & (label < 0)] = c.n_sets
            spread = bool(ahead.any() or behind.any())
        c.n_sets += 1
    c.add(Rays(label, node // c.n_nodes, node % c.n_nodes, reading))


def _slope_distances(c: Collector, o: Any, rows: Index) -> None:
    value, unknown = o.values[rows, 0], np.full(len(rows), np.nan)
    c.add(Lengths(o.start[rows], o.end[rows], value, unknown, _lift(o, rows)))


def _horizontal_distances(c: Collector, o: Any, rows: Index) -> None:
    value = o.values[rows, 0] / o.reduction[rows]
    c.add(Lengths(o.start[rows], o.end[rows], value, value, np.zeros(len(rows))))


def _zeniths(c: Collector, o: Any, rows: Index) -> None:
    z = o.values[rows, 0]
    good = np.abs(np.sin(z)) > 1e-6
    rows, z = rows[good], z[good]
    c.add(Zeniths(o.start[rows], o.end[rows], np.cos(z) / np.abs(np.sin(z)), _lift(o, rows)))


def _height_differences(c: Collector, o: Any, rows: Index) -> None:
    over = (o.height_start - o.height_end + o.geoid_end - o.geoid_start)[rows]
    c.add(Rises(o.start[rows], o.end[rows], o.values[rows, 0] + over))


def _local_offsets(c: Collector, o: Any, rows: Index) -> None:
    """Two offsets of one pair are an azimuth and a length, which may be zero (a centring)."""
    key = o.start[rows] * c.n_nodes + o.end[rows]
    pairs, group = np.unique(key, return_inverse=True)
    a = np.stack([np.sin(o.azimuth[rows]), np.cos(o.azimuth[rows])], axis=1)
    normal, right = np.zeros((len(pairs), 2, 2)), np.zeros((len(pairs), 2))
    np.add.at(normal, group, a[:, :, None] * a[:, None, :])
    np.add.at(right, group, a * (o.values[rows, :1] / o.reduction[rows, None]))
    good = np.linalg.det(normal) > 0.01
    e, n = np.linalg.solve(normal[good], right[good][..., None])[..., 0].T
    start, end = pairs[good] // c.n_nodes, pairs[good] % c.n_nodes
    length = np.hypot(e, n)
    c.north.append((start, end, np.arctan2(e, n)))
    c.add(Lengths(start, end, length, length, np.zeros(len(length))))


READERS = {
    "direction": _directions,
    "azimuth": _azimuths,
    "angle": _angles,
    "slope_distance": _slope_distances,
    "distance": _slope_distances,
    "horizontal_distance": _horizontal_distances,
    "zenith": _zeniths,
    "height_difference": _height_differences,
    "local_offset": _local_offsets,
}
