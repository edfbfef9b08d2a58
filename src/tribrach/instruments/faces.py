"""Both faces of a total station: means, collimation and index error, and what is out of line.

Half the difference of the faces of target i is ``(H_F - H_B -+ pi) / 2 = c / sin V + t cot V`` for
directions, with the collimation error c and the tilt t of the trunnion axis, and
``(V_F + V_B - 2 pi) / 2 = i`` for zenith angles, with the index error i (method section 4.4;
Deumlich & Staiger, "Instrumentenkunde der Vermessungstechnik"). The mean of the faces is free of
all three.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.units import SEC

__all__ = ["AxisErrors", "axis_errors", "fold", "half_difference"]

Array = NDArray[np.float64]

#: face differences are out of line beyond so many robust standard deviations, and beyond this
LIMIT, FLOOR = 5.0, 20 * SEC
#: zenith angles spread at least so much where the tilt of the trunnion axis can be told apart
SPREAD = np.radians(30)


@dataclass(frozen=True)
class AxisErrors:
    """Axis errors of an instrument from n pairs of faces [rad].

    collimation, index with their sigmas; trunnion and its sigma, NaN where sights are too level;
    sigma_direction, sigma_zenith : of a reading in one face, from the scatter of the differences;
    residual_direction, residual_zenith (n,) of half differences; far_direction, far_zenith (n,)
    True where one is out of line, which is then left out of everything else; pairs : used.
    """

    collimation: float
    sigma_collimation: float
    trunnion: float
    sigma_trunnion: float
    index: float
    sigma_index: float
    sigma_direction: float
    sigma_zenith: float
    residual_direction: Array
    residual_zenith: Array
    far_direction: NDArray[np.bool_]
    far_zenith: NDArray[np.bool_]
    pairs: int


def fold(direction: Array, zenith: Array, face: NDArray[np.int8]) -> tuple[Array, Array]:
    """Readings (n,) as face 1 would give them: ``H - pi``, ``2 pi - V`` where the face is 2."""
    second = face == 2
    folded = np.where(second, direction - np.pi, direction) % (2 * np.pi)
    return folded, np.where(second, 2 * np.pi - zenith, zenith)


def half_difference(first: Array, second: Array) -> Array:
    """Half of face 1 less face 2 of folded readings (n,), within a quarter of a circle."""
    half: Array = ((first - second + np.pi) % (2 * np.pi) - np.pi) / 2
    return half


def axis_errors(half_direction: Array, half_zenith: Array, zenith: Array) -> AxisErrors:
    """Axis errors by least squares from half differences (n,) and zenith angles (n,) [rad].

    NaN half differences take no part. What is out of line is found from medians, beforehand.
    """
    slope = 1 / np.sin(zenith)
    known = np.isfinite(half_direction) & np.isfinite(slope)
    far_direction = _far(half_direction / slope, known)
    use = known & ~far_direction
    design = slope[:, None]
    if use.sum() > 3 and np.ptp(zenith[use]) > SPREAD:
        design = np.stack([slope, 1 / np.tan(zenith)], axis=1)
    estimate, sigma, residual_direction, s_direction = _fit(design, half_direction, use)
    level = np.isfinite(half_zenith)
    far_zenith = _far(half_zenith, level)
    mean, sigma_mean, residual_zenith, s_zenith = _fit(
        np.ones((len(half_zenith), 1)), half_zenith, level & ~far_zenith
    )
    tilted = design.shape[1] == 2
    return AxisErrors(
        collimation=float(estimate[0]),
        sigma_collimation=float(sigma[0]),
        trunnion=float(estimate[1]) if tilted else float("nan"),
        sigma_trunnion=float(sigma[1]) if tilted else float("nan"),
        index=float(mean[0]),
        sigma_index=float(sigma_mean[0]),
        # a half difference has half the variance of a reading
        sigma_direction=float(np.sqrt(2) * s_direction),
        sigma_zenith=float(np.sqrt(2) * s_zenith),
        residual_direction=residual_direction,
        residual_zenith=residual_zenith,
        far_direction=far_direction,
        far_zenith=far_zenith,
        pairs=int(use.sum()),
    )


def _far(values: Array, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Values (n,) that lie off the median by more than chance and any instrument explain."""
    far = np.zeros(len(values), dtype=bool)
    if known.sum() < 3:
        # with one or two pairs nothing says which is wrong, unless no instrument is so bad
        far[known] = np.abs(values[known]) > np.radians(0.5)
        return far
    off = np.abs(values - np.median(values[known]))
    spread = 1.4826 * np.median(off[known])
    far[known] = off[known] > max(LIMIT * spread, FLOOR)
    return far


def _fit(design: Array, values: Array, use: NDArray[np.bool_]) -> tuple[Array, Array, Array, float]:
    """Estimates (u,), their sigmas, residuals (n,) against the fit, sigma of a value."""
    u = design.shape[1]
    nothing = np.full(len(values), np.nan)
    if use.sum() < u:
        return np.full(u, np.nan), np.full(u, np.nan), nothing, float("nan")
    a, y = design[use], values[use]
    estimate = np.linalg.lstsq(a, y, rcond=None)[0]
    residual: Array = values - design @ estimate
    dof = len(y) - u
    s = float(np.sqrt(residual[use] @ residual[use] / dof)) if dof else float("nan")
    sigma = s * np.sqrt(np.diag(np.linalg.inv(a.T @ a)))
    return np.asarray(estimate, dtype=float), sigma, residual, s
