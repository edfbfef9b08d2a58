"""Estimates the angular step of a cloud that has lost the scanner's rows and columns.

Around a number of points all neighbours within a small window of directions are gathered. The
nearest neighbours beside and above a point tell the steps of a scanner's grid; the density of the
window tells the mean spacing of a cloud that has none (merged, thinned).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.kernels import njit

#: windows, points that one should hold, and points kept at most in each
_WINDOWS, _AIM, _MOST = 24, 150, 600
#: points looked at, and points that a bin of H and V should hold, to guess the windows' width
_SAMPLE, _PER_BIN = 200_000, 8
#: a grid has about one point per product of its steps; with fewer it is not a grid
_REGULAR = 0.6
#: of a scanner's grid seen from the scanner, the gaps between rows, and between columns, make up
#: this share of a window in this share of the windows; chosen by hand on simulated and real scans
#: that were moved by decimetres (tests/io/scans/test_origin), no source
_IN_GAPS, _GRIDDED = 0.92, 0.6
#: fewer points and fewer windows tell no grid
_LEAST_POINTS, _LEAST_WINDOWS = 40, 12


def angular_step(xyz: Array) -> tuple[float, float]:
    """Estimate the steps in H and V between neighbouring points [rad]."""
    rng = np.random.default_rng(0)
    some = min(len(xyz), _SAMPLE)
    sample = xyz if some == len(xyz) else xyz[np.sort(rng.choice(len(xyz), some, shuffle=False))]
    density = _density(_angles(sample)) * len(xyz) / some
    seeds = _angles(xyz[np.sort(rng.integers(0, len(xyz), _WINDOWS))])
    half = 0.5 * np.sqrt(_AIM / density)
    offsets, counts = _gather(xyz, seeds, half, _MOST)
    steps = [_window_step(offsets[i, :n], half) for i, n in enumerate(counts) if n >= 8]
    steps = [s for s in steps if np.isfinite(s).all()]
    if not steps:
        side = float(1 / np.sqrt(density))
        if not np.isfinite(side) or side <= 0:
            raise InputError("too few points with a direction to tell the angular step")
        return side, side
    h, v = np.median(np.array(steps), axis=0)
    return float(h), float(v)


def on_lattice(xyz: Array) -> bool:
    """Tell whether points lie in rows and columns of directions, as seen from zero.

    From any other place the rows and columns of a scanner are bent and cut by what stands before
    something else.
    """
    directions = _angles(xyz)
    if len(directions) < _LEAST_POINTS * _LEAST_WINDOWS:
        return False
    rng = np.random.default_rng(0)
    seeds = directions[np.sort(rng.integers(0, len(directions), 2 * _WINDOWS))]
    half = 0.5 * np.sqrt(_AIM / _density(directions))
    offsets, counts = _gather(xyz, seeds, half, _MOST)
    windows = [o[:n] for o, n in zip(offsets, counts, strict=True) if n >= _LEAST_POINTS]
    gridded = [min(_in_gaps(o[:, 0]), _in_gaps(o[:, 1])) > _IN_GAPS for o in windows]
    return len(windows) >= _LEAST_WINDOWS and float(np.mean(gridded)) > _GRIDDED


def _in_gaps(values: Array) -> float:
    """Share of the extent of values that the largest gaps between them make up."""
    ordered = np.sort(values)
    gaps = np.sort(np.diff(ordered))
    most = int(2 * np.sqrt(len(values)))
    return float(gaps[-most:].sum() / max(ordered[-1] - ordered[0], 1e-30))


def _angles(xyz: Array) -> Array:
    """H and V (k, 2) [rad] of the points (n, 3) that have a direction."""
    flat = np.hypot(xyz[:, 0], xyz[:, 1])
    hv = np.stack([np.arctan2(xyz[:, 1], xyz[:, 0]), np.arctan2(flat, xyz[:, 2])], axis=1)
    return np.asarray(hv[np.isfinite(hv).all(axis=1) & (flat > 0)])


def _density(hv: Array) -> float:
    """Points per square radian of H and V where there are points: upper quartile of coarse bins."""
    if len(hv) < 2:
        raise InputError("too few points with a direction to tell the angular step")
    cell = max(float(np.ptp(hv, axis=0).max()) / 1000, 1e-7)
    for _ in range(40):
        keys = np.floor(hv / cell).astype(np.int64)
        _, counts = np.unique(keys[:, 0] * 2**31 + keys[:, 1], return_counts=True)
        if np.quantile(counts, 0.75) >= min(_PER_BIN, len(hv)):
            break
        cell *= 1.5
    return float(np.quantile(counts, 0.75)) / cell**2


@njit(cache=True, nogil=True)
def _gather(xyz: Array, seeds: Array, half: float, most: int) -> tuple[Array, NDArray[np.int64]]:
    """Differences (windows, most, 2) [rad] of H and V of points to the seeds, and their number.

    A seed's window is found by its direction cosines, so that no angle is computed outside it.
    """
    k = len(seeds)
    offsets, counts = np.empty((k, most, 2)), np.zeros(k, dtype=np.int64)
    wide = np.sqrt(2.0) * half
    near = np.cos(min(wide, 1.5))
    axes = np.empty((k, 3))
    for j in range(k):
        s = np.sin(seeds[j, 1])
        axes[j] = s * np.cos(seeds[j, 0]), s * np.sin(seeds[j, 0]), np.cos(seeds[j, 1])
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        r = np.sqrt(x * x + y * y + z * z)
        if not (np.isfinite(r) and r > 0):
            continue
        for j in range(k):
            if axes[j, 0] * x + axes[j, 1] * y + axes[j, 2] * z < near * r or counts[j] == most:
                continue
            dh = np.arctan2(y, x) - seeds[j, 0]
            dh -= 2 * np.pi * np.round(dh / (2 * np.pi))
            dv = np.arctan2(np.sqrt(x * x + y * y), z) - seeds[j, 1]
            if abs(dh) <= half and abs(dv) <= half:
                offsets[j, counts[j], 0], offsets[j, counts[j], 1] = dh, dv
                counts[j] += 1
    return offsets, counts


def _window_step(offsets: Array, half: float) -> tuple[float, float]:
    """Steps (H, V) of one window: those of the grid, or the mean spacing in their proportion."""
    d = np.abs(offsets[:, None, :] - offsets[None, :, :])
    d[np.arange(len(offsets)), np.arange(len(offsets))] = np.inf
    beside = np.where(d[..., 0] > d[..., 1], d[..., 0], np.inf).min(axis=1)
    above = np.where(d[..., 1] >= d[..., 0], d[..., 1], np.inf).min(axis=1)
    h = float(np.median(beside)) if len(offsets) else np.nan
    v = float(np.median(above)) if len(offsets) else np.nan
    box = np.ptp(offsets, axis=0)
    per_cell = len(offsets) * h * v / max(float(box[0] * box[1]), 1e-30)
    if not np.isfinite(per_cell) or per_cell <= 0:
        return np.nan, np.nan
    grow = 1.0 if per_cell > _REGULAR else np.sqrt(1 / per_cell)
    return h * grow, v * grow
