"""Scan grids of a station: a panorama of about so many points, and fine windows around targets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.polar import polar_from_xyz, xyz_from_polar
from tribrach.geometry.pose import Pose
from tribrach.simulate.ray_casting import SceneView
from tribrach.simulate.scanner import ScanGrid
from tribrach.simulate.scene import Scene
from tribrach.simulate.twin import TwinScan, TwinTarget

#: rays that tell which share of the directions meets anything
_PROBES = 20_000
#: pixels of the grid that holds the windows
_PIXELS = 4_000_000
#: a window reaches so many times as far as its target, and at least this far [m]
_MARGIN, _LEAST = 1.8, 0.25


def overview(
    name: str,
    scene: Scene,
    pose: Pose,
    points: int,
    v: tuple[float, float],
    h: tuple[float, float] | None = None,
) -> TwinScan:
    """A scan of about so many points, in ranges ``v`` and ``h`` [rad]; full circle if None."""
    view = SceneView(scene, pose.translation)
    low, high = (0.0, 2 * np.pi) if h is None else h
    rng = np.random.default_rng(1)
    angles = rng.uniform([low, v[0]], [high, v[1]], (_PROBES, 2))
    rays = xyz_from_polar(np.column_stack([np.ones(_PROBES), angles])) @ pose.rotation.T
    share = max(float((view.cast(rays).primitive >= 0).mean()), 0.02)
    beams = points / share
    if h is None:
        return TwinScan(name, name, ScanGrid.panorama(v, int(beams)))
    step = float(np.sqrt((high - low) * (v[1] - v[0]) / beams))
    return TwinScan(name, name, ScanGrid.window(h, v, step))


def fine_scan(
    station: str, pose: Pose, targets: Sequence[TwinTarget], step: float, name: str = ""
) -> TwinScan:
    """One scan of windows around targets on one grid, named by the station and "-targets" if ""."""
    if not targets:
        raise InputError(f"station {station} has no targets to scan")
    polar = polar_from_xyz(pose.inverse @ np.array([t.center for t in targets]))
    half = np.array([max(_MARGIN * t.reach, _LEAST) for t in targets]) / polar[:, 0]
    wide = half / np.sin(polar[:, 2])
    first_h, span = _arc(polar[:, 1], wide)
    low, high = float((polar[:, 2] - half).min()), float((polar[:, 2] + half).max())
    columns = round(2 * np.pi / step) if span > 1.9 * np.pi else int(span / step) + 2
    step = 2 * np.pi / columns if span > 1.9 * np.pi else step
    grid = ScanGrid(first_h, low, step, int((high - low) / step) + 2, columns)
    if len(grid) > _PIXELS:
        raise InputError(f"fine scan of {station} on {len(grid)} pixels", cure="widen its step")
    mask = np.zeros((grid.rows, grid.columns), dtype=bool)
    for (_, h, v), a, b in zip(polar, wide, half, strict=True):
        left, right = (h - first_h) % (2 * np.pi) - a, (h - first_h) % (2 * np.pi) + a
        across = np.arange(int(np.ceil(left / step)), int(right / step) + 1)
        if span > 1.9 * np.pi:
            across = across % columns
        down = slice(max(int((v - b - low) / step), 0), int((v + b - low) / step) + 1)
        mask[down, across[(across >= 0) & (across < columns)]] = True
    return TwinScan(name or f"{station}-targets", station, grid, mask)


def _arc(h: Array, half: Array) -> tuple[float, float]:
    """Start and length [rad] of the shortest arc that holds intervals around H."""
    order = np.argsort(h)
    gaps = np.diff(np.append(h[order], h[order[0]] + 2 * np.pi))
    start = h[order[(int(np.argmax(gaps)) + 1) % len(h)]]
    turned = (h - start + np.pi / 1e6) % (2 * np.pi)
    low, high = float((turned - half).min()), float((turned + half).max())
    if high - low > 1.9 * np.pi:
        return float(start), 2 * np.pi
    return float(start + low - np.pi / 1e6), high - low
