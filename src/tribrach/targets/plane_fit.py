"""Planes through labelled pixels by least squares along the lines of sight, all in one pass each.

A plane is m . x = 1, so a beam d meets it at rho = 1 / (m . d). Residuals are ranges; the variance
of one is s_rho^2 + rho^2 s_ang^2 tan^2 psi; those beyond three sigmas are trimmed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tribrach.scan.range_image import RangeImage

__all__ = ["PlaneFits", "fit_planes", "joint", "taken_up"]

Array = NDArray[np.float64]
Labels = NDArray[np.int32]
Integers = NDArray[np.int64]

#: passes over some of the points, the first ones with a wide gate [m], then over all
_COARSE, _WIDE, _GATE, _FINE = 4, 2, 0.02, 2
#: points looked at in a coarse pass, about
_SOME = 1_000_000
#: standard deviation of a normal distribution cut at three sigmas
_CUT = 0.98658
#: residuals beyond this many sigmas are trimmed
_TRIM = 3.0
#: beams steeper to the surface than this [rad] are left out
_GRAZING = float(np.radians(80.0))


@dataclass(frozen=True, eq=False)
class PlaneFits:
    """Planes (k) and what their points say.

    m (k, 3) : m . x = 1 [1/m]; normal (k, 3, 3) : normal matrix of m; square (k,) : weighted sum of
    squared residuals; points (k,) : number of inliers; rms (k,) : along the line of sight [m];
    center (k, 3) : mean of the inliers [m]; area (k,) : [m^2] of the pixels; incidence (k,) : mean
    angle [rad].
    """

    m: Array
    normal: Array
    square: Array
    points: Array
    rms: Array
    center: Array
    area: Array
    incidence: Array

    @property
    def s0(self) -> Array:
        """Standard deviation of unit weight (k,)."""
        return np.asarray(np.sqrt(self.square / np.maximum(self.points - 3, 1)))


def fit_planes(
    xyz: Array,
    image: RangeImage,
    labels: Labels,
    count: int,
    noise: tuple[float, float],
    *,
    coarse: bool = False,
) -> PlaneFits:
    """Planes through the pixels of every label below ``count``.

    noise : sigma of range [m] and angle [rad]; coarse : some of the pixels will do; else ``labels``
    of trimmed pixels become -1.
    """
    m = np.full((count, 3), np.nan)
    s0 = np.full(count, np.nan)
    frame = (image.first_v, image.step_h, image.step_v)
    sums = np.zeros((count, 20))
    stride = max(1, round((labels.size / _SOME) ** 0.5))
    for k in range(_COARSE + (0 if coarse else _FINE)):
        step, final = (stride, False) if k < _COARSE else (1, k == _COARSE + _FINE - 1)
        sums = _pass(xyz, image.index, labels, m, s0, noise, frame, k < _WIDE, final, step)
        m, s0 = _updated(sums, m)
    n = np.maximum(sums[:, 9], 1.0)
    matrix = np.empty((count, 3, 3))
    upper = np.triu_indices(3)
    matrix[:, upper[0], upper[1]] = sums[:, :6]
    matrix[:, upper[1], upper[0]] = sums[:, :6]
    return PlaneFits(
        m,
        matrix,
        np.maximum(sums[:, 10], 0.0),
        sums[:, 9],
        np.sqrt(sums[:, 11] / n),
        sums[:, 12:15] / n[:, None],
        sums[:, 15],
        sums[:, 16] / n,
    )


def _updated(sums: Array, m: Array) -> tuple[Array, Array]:
    """Planes and unit sigmas after a pass; NaN where points determine no plane."""
    out, s0 = np.full_like(m, np.nan), np.full(len(m), np.nan)
    for k in np.flatnonzero(sums[:, 9] >= 10):
        a = np.empty((3, 3))
        a[np.triu_indices(3)] = sums[k, :6]
        a = np.triu(a) + np.triu(a, 1).T
        scale = np.sqrt(np.diag(a))
        if not scale.min() > 0 or np.linalg.cond(a / np.outer(scale, scale)) > 1e12:
            continue
        step = np.linalg.solve(a / np.outer(scale, scale), sums[k, 6:9] / scale) / scale
        out[k] = step if np.isnan(m[k, 0]) else m[k] + step
        s0[k] = np.sqrt(max(sums[k, 10], 0.0) / (sums[k, 9] - 3))
    return out, s0


@njit(cache=True, nogil=True)
def _pass(
    xyz: Array,
    index: NDArray[np.int32],
    labels: Labels,
    m: Array,
    s0: Array,
    noise: tuple[float, float],
    frame: tuple[float, float, float],
    wide: bool,
    final: bool,
    stride: int,
) -> Array:
    """Sums (k, 20) over the points of every label, of every ``stride``-th row and column.

    0-5 normal matrix, 6-8 right side, 9 points, 10 weighted squares, 11 squares, 12-14 coordinates,
    15 area, 16 incidence. Planes not yet known (NaN) are started from m . d = 1 / rho.
    """
    rows, columns = index.shape
    v0, step_h, step_v = frame
    out = np.zeros((len(m), 20))
    d = np.empty(3)
    for i in range(0, rows, stride):
        pixel = stride**2 * step_h * step_v * abs(np.sin(v0 + i * step_v))
        for j in range((i // stride) % stride, columns, stride):
            k = labels[i, j]
            if k < 0:
                continue
            x = xyz[index[i, j]]
            rho = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
            for c in range(3):
                d[c] = x[c] / rho
            s = out[k]
            p = m[k]
            if np.isnan(p[0]):
                # d(1/rho) = -d rho / rho^2: equal range noise for the start
                _add(s, d, 1 / rho, rho**2 / noise[0])
                s[9] += 1
                continue
            dot = p[0] * d[0] + p[1] * d[1] + p[2] * d[2]
            cosine = abs(dot) / np.sqrt(p[0] ** 2 + p[1] ** 2 + p[2] ** 2)
            if dot <= 0 or cosine < np.cos(_GRAZING):
                if final:
                    labels[i, j] = -1
                continue
            away = 1 / dot
            v = rho - away
            sigma = np.sqrt(noise[0] ** 2 + (rho * noise[1]) ** 2 * (1 / cosine**2 - 1))
            scale = 1.0 if np.isnan(s0[k]) else min(max(s0[k] / _CUT, 0.5), 3.0)
            kept = abs(v) * cosine < _GATE if wide else abs(v) < _TRIM * scale * sigma
            if not kept:
                if final:
                    labels[i, j] = -1
                continue
            # rho = 1 / (m . d): derivative -rho^2 d
            _add(s, d, -v / away**2, away**2 / sigma)
            s[9] += 1
            s[11] += v * v
            s[12] += x[0]
            s[13] += x[1]
            s[14] += x[2]
            s[15] += pixel * rho * rho / cosine
            s[16] += np.arccos(min(cosine, 1.0))
    return out


@njit(cache=True, nogil=True)
def _add(s: Array, d: Array, value: float, root: float) -> None:
    """Add the equation d . m = value with the square root of its weight to the sums."""
    w = root * root
    n = 0
    for a in range(3):
        for b in range(a, 3):
            s[n] += w * d[a] * d[b]
            n += 1
        s[6 + a] += w * d[a] * value
    s[10] += w * value * value


def joint(fits: PlaneFits, a: int, b: int) -> tuple[float, float]:
    """Variances of unit weight of two planes apart and as one plane (closed form)."""
    apart = fits.square[a] + fits.square[b]
    n = fits.points[a] + fits.points[b]
    both = np.linalg.inv(np.linalg.inv(fits.normal[a]) + np.linalg.inv(fits.normal[b]))
    difference = fits.m[a] - fits.m[b]
    together = apart + difference @ both @ difference
    return float(apart / max(n - 6, 1)), float(together / max(n - 3, 1))


def taken_up(labels: Labels, group: Integers) -> Labels:
    """Labels renamed by ``group`` (k,); -1 stays."""
    table = np.append(group, -1).astype(np.int32)
    return np.asarray(table[labels])
