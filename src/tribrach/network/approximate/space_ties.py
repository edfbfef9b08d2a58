"""Ties of scanners, GNSS and coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np

from tribrach.network.approximate.collector import Collector
from tribrach.network.approximate.grouping import grouped_median
from tribrach.network.approximate.ties import Array, Faces, Fixes, Index, Links, Shots, Vectors

__all__ = ["READERS"]

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
    c.add(Shots(o.station[rows], nodes, c.vectors[o.lever_arm[rows]]))


def _mounted(c: Collector, o: Any, rows: Index) -> None:
    """What is mounted on a scanner is a target of it."""
    c.add(Shots(o.station[rows], o.point[rows], c.vectors[o.lever_arm[rows]]))


def _target_centres(c: Collector, o: Any, rows: Index) -> None:
    c.add(Shots(o.station[rows], o.target[rows], o.values[rows]))


def _xyz(r: Array, around: Array, elevation: Array) -> Array:
    flat = r * np.cos(elevation)
    return np.stack([flat * np.cos(around), flat * np.sin(around), r * np.sin(elevation)], axis=1)


def _scanner_polar(c: Collector, o: Any, rows: Index) -> None:
    r, around, zenith = o.values[rows].T
    c.add(Shots(o.station[rows], o.target[rows], _xyz(r, around, np.pi / 2 - zenith)))


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
        c.add(Shots(station, target, u[good]))

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

READERS = {
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
