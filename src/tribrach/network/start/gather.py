"""Writes the active observations of a network as ties.

Kinds are told apart by their names; :mod:`sight_ties` and :mod:`space_ties` read their fields.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite
from tribrach.network.network import Network
from tribrach.network.start.grouping import grouped_median
from tribrach.network.start.sights import CURVATURE
from tribrach.network.start.ties import (
    Faces,
    Fixes,
    Lengths,
    Links,
    Rays,
    Rises,
    ScannerShots,
    Ties,
    TieTable,
    Vectors,
    Zeniths,
)
from tribrach.observations.base import Use

__all__ = ["gather"]

# Parts of the ties while the observations of a network are read one kind after another.


class Collector:
    """Tables in parts, and the numbers of nodes and sets so far.

    ``vectors`` (V, 3) lever arms; ``levelling`` (S, 3, 3) as in the ties; ``north`` rays of
    azimuths, which become the last set.
    """

    def __init__(self, network: Network, vectors: Array) -> None:
        layout = network.start.layout
        self.network = network
        self.vectors = vectors
        self.n_points = layout.count("point")
        self.n_poses = layout.count("pose")
        self.n_nodes = self.n_points + self.n_poses
        self.n_scalars = layout.count("scalar")
        self.n_sets = self.n_scalars + self.n_poses
        self.levelling = np.full((self.n_poses, 3, 3), np.nan)
        self.north: list[tuple[Index, Index, Array]] = []
        index, number, triple = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 3))
        self.parts: dict[type[TieTable], list[Any]] = {
            Rays: [Rays(index, index, index, number)],
            Lengths: [Lengths(index, index, number, number, number)],
            Rises: [Rises(index, index, number)],
            Zeniths: [Zeniths(index, index, number, number)],
            Vectors: [Vectors(index, index, triple)],
            ScannerShots: [ScannerShots(index, index, triple)],
            Links: [Links(index, index, triple, np.zeros((0, 3, 3)))],
            Faces: [Faces(index, index, triple, number)],
            Fixes: [Fixes(index, triple)],
        }

    def add(self, part: TieTable) -> None:
        """One more part of a table."""
        self.parts[type(part)].append(part)

    def table(self, kind: type[Any]) -> Any:
        """All parts of a table."""
        return kind.joined(self.parts[kind])


# Ties of total stations, levels and the like: sights between two places.


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


SIGHT_READERS = {
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


# Ties of scanners, GNSS and coordinates.


#: a scanner with a tilt known worse than this [rad] is not levelled
_LEVELLED = 0.02


def _baselines(c: Collector, o: Any, rows: Index) -> None:
    value = o.values[rows].copy()
    # antenna heights along the mean vertical are near enough for a start
    value[:, 2] += o.height_start[rows] - o.height_end[rows]
    c.add(Vectors(o.start[rows], o.end[rows], value))


def _offsets(c: Collector, o: Any, rows: Index) -> None:
    value = o.values[rows].copy()
    value[:, 2] += o.height_instrument[rows] - o.height_target[rows]
    c.add(Vectors(o.start[rows], o.end[rows], value))


def _coordinates(c: Collector, o: Any, rows: Index) -> None:
    c.add(Fixes(o.position[rows], o.values[rows]))


def _coordinate(c: Collector, o: Any, rows: Index) -> None:
    xyz = np.full((len(rows), 3), np.nan)
    xyz[np.arange(len(rows)), o.axis[rows]] = o.values[rows, 0]
    c.add(Fixes(o.position[rows], xyz))


def _heights(c: Collector, o: Any, rows: Index) -> None:
    xyz = np.full((len(rows), 3), np.nan)
    xyz[:, 2] = o.values[rows, 0]
    c.add(Fixes(o.position[rows], xyz))


def _gnss_positions(c: Collector, o: Any, rows: Index) -> None:
    antenna = o.values[rows]
    up = c.network.site.axes(antenna)[:, 2]
    c.add(Fixes(o.position[rows], antenna - o.antenna_height[rows, None] * up))


def _antennas(c: Collector, o: Any, rows: Index) -> None:
    """An antenna is a target of its scanner with known coordinates."""
    nodes = c.n_nodes + np.arange(len(rows))
    c.n_nodes += len(rows)
    c.add(Fixes(nodes, o.values[rows]))
    c.add(ScannerShots(o.station[rows], nodes, c.vectors[o.lever_arm[rows]]))


def _mounted(c: Collector, o: Any, rows: Index) -> None:
    """What is mounted on a scanner is a target of it."""
    c.add(ScannerShots(o.station[rows], o.point[rows], c.vectors[o.lever_arm[rows]]))


def _target_centres(c: Collector, o: Any, rows: Index) -> None:
    c.add(ScannerShots(o.station[rows], o.target[rows], o.values[rows]))


def _xyz(r: Array, around: Array, elevation: Array) -> Array:
    flat = r * np.cos(elevation)
    return np.stack([flat * np.cos(around), flat * np.sin(around), r * np.sin(elevation)], axis=1)


def _scanner_polar(c: Collector, o: Any, rows: Index) -> None:
    r, around, zenith = o.values[rows].T
    c.add(ScannerShots(o.station[rows], o.target[rows], _xyz(r, around, np.pi / 2 - zenith)))


def _inclinations(c: Collector, o: Any, rows: Index) -> None:
    """The shortest turn that brings the plumb line (i_x, i_y, 1) onto the third axis."""
    rows = rows[o.sigma[rows].max(axis=1) < _LEVELLED]
    q = np.concatenate([o.values[rows], np.ones((len(rows), 1))], axis=1)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    half = q + np.array([0.0, 0.0, 1.0])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    # a half turn about the bisector, then one about the axis itself
    turn = 2 * half[:, :, None] * half[:, None, :] - np.eye(3)
    c.levelling[o.station[rows]] = np.diag([-1.0, -1.0, 1.0]) @ turn


def _relative_poses(c: Collector, o: Any, rows: Index) -> None:
    c.add(Links(o.start[rows], o.end[rows], o.values[rows, :3], o.rotation[rows]))


def _planes(c: Collector, o: Any, rows: Index) -> None:
    normal = o.normal[rows]
    offset = np.einsum("ni,ni->n", normal, o.centroid[rows])
    c.add(Faces(o.station[rows], o.plane[rows], normal, offset))


def _points_on_planes(c: Collector, o: Any, rows: Index) -> None:
    """The plane through all points that one scanner has on it."""
    base = c.network.start.layout.count("plane")
    keys, group = np.unique(o.station[rows] * base + o.plane[rows], return_inverse=True)
    for number, key in enumerate(keys):
        points = o.point[rows[group == number]]
        centre = points.mean(axis=0)
        _, spread, axes = np.linalg.svd(points - centre)
        if len(points) >= 3 and spread[1] > 1e-3:
            # away from the scanner, the same sign for all who see it from one side
            normal = axes[2] * (1.0 if axes[2] @ centre >= 0 else -1.0)
            station, plane = np.divmod(np.array([key]), base)
            c.add(Faces(station, plane, normal[None], np.array([normal @ centre])))


class _FrameSights:
    """Single values of targets in a station's frame, collected until three make a shot."""

    #: columns: x, y, z, angle around, elevation, distance
    columns = 6

    @classmethod
    def read(cls, c: Collector, tables: list[tuple[Any, Index]]) -> None:
        """Shots of all (station, target) with x, y, z or with both angles and a distance."""
        keys, cells, values, lifts = [], [], [], []
        for o, rows in tables:
            keys.append(o.station[rows] * c.n_nodes + o.target[rows])
            cells.append(cls._cell(o, rows))
            values.append(o.values[rows, 0])
            lifts.append(o.height_target[rows])
        if not keys:
            return
        pairs, group = np.unique(np.concatenate(keys), return_inverse=True)
        sheet = np.full((len(pairs), cls.columns + 1), np.nan)
        cell = group * (cls.columns + 1) + np.concatenate(cells)
        at, medians, _ = grouped_median(cell, np.concatenate(values)[:, None])
        sheet.reshape(-1)[at] = medians[:, 0]
        sheet[group, cls.columns] = np.concatenate(lifts)
        polar = _xyz(sheet[:, 5], sheet[:, 3], sheet[:, 4])
        u = np.where(np.isfinite(sheet[:, :3]), sheet[:, :3], polar)
        # the mark lies below the target, nearly along the axis of a standing instrument
        u[:, 2] -= sheet[:, cls.columns]
        good = np.isfinite(u).all(axis=1)
        station, target = np.divmod(pairs[good], c.n_nodes)
        c.add(ScannerShots(station, target, u[good]))

    @staticmethod
    def _cell(o: Any, rows: Index) -> Index:
        if o.kind == "frame_coordinate":
            out: Index = o.axis[rows]
        elif o.kind == "frame_angle":
            out = 3 + o.circle[rows]
        else:
            out = np.full(len(rows), 5)
        return out


read_frame_sights = _FrameSights.read


SPACE_READERS = {
    "gnss_baseline": _baselines,
    "offset": _offsets,
    "coordinates": _coordinates,
    "coordinate": _coordinate,
    "height": _heights,
    "gnss_position": _gnss_positions,
    "antenna": _antennas,
    "mounted_point": _mounted,
    "target_centre": _target_centres,
    "scanner_polar": _scanner_polar,
    "inclination": _inclinations,
    "relative_pose": _relative_poses,
    "plane": _planes,
    "point_on_plane": _points_on_planes,
}


_READERS = SIGHT_READERS | SPACE_READERS


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
    read_frame_sights(c, in_frames)
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
        shots=c.table(ScannerShots),
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
