"""Rounds of angles: directions of several sets by least squares, zenith angles and distances.

Each set has an orientation of its own; sets need not be complete. Values are face means in a table
with a row for each set and a column for each target, NaN where a target was not read. For complete
sets the directions are the plain means of the sets reduced to one of them (Ghilani, "Adjustment
Computations"; ISO 17123-3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Repeats", "Rounds", "adjust_repeats", "adjust_rounds"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rounds:
    """Directions of t targets from s sets [rad].

    direction (t,) within [0, 2 pi), in the orientation of the first set; orientation (s,) of the
    sets against it; residual (s, t) observed less adjusted; sigma : of a direction in one set from
    the residuals, NaN without redundancy; sigma_mean (t,) of the adjusted ones; dof.
    """

    direction: Array
    orientation: Array
    residual: Array
    sigma: float
    sigma_mean: Array
    dof: int


@dataclass(frozen=True)
class Repeats:
    """Means (t,) of values that need no orientation; residual (s, t), sigma and dof as above."""

    mean: Array
    residual: Array
    sigma: float
    sigma_mean: Array
    dof: int


def wrapped(angle: Array) -> Array:
    """Angles within [-pi, pi)."""
    result: Array = (angle + np.pi) % (2 * np.pi) - np.pi
    return result


def adjust_rounds(directions: Array) -> Rounds:
    """Adjust directions (s, t) [rad]; sets that share no target stay apart."""
    known = np.isfinite(directions)
    orientation, direction = _approximate(directions, known)
    misclosure = np.where(
        known, wrapped(directions - direction[None, :] - orientation[:, None]), 0.0
    )
    # the longer side is eliminated, so that the equations stay as small as the shorter one
    if len(known) <= known.shape[1]:
        change, shift, rank = _solve(known, misclosure)
    else:
        shift, change, rank = _solve(known.T, misclosure.T)
    # the first set keeps its orientation
    base = change[0] if len(change) else 0.0
    direction, orientation = direction + shift + base, orientation + change - base
    residual = wrapped(directions - direction[None, :] - orientation[:, None])
    per_target = known.sum(axis=0)
    dof = int(known.sum()) - rank
    sigma = _sigma(residual, known, dof)
    weight = np.where(per_target > 0, 1 / np.maximum(per_target, 1), 0.0)
    direction = np.where(per_target > 0, direction % (2 * np.pi), np.nan)
    return Rounds(direction, orientation, residual, sigma, sigma * np.sqrt(weight), dof)


def _solve(known: NDArray[np.bool_], misclosure: Array) -> tuple[Array, Array, int]:
    """Unknowns of rows and of columns of ``l = row + column``, and the rank of the whole."""
    per_row, per_column = known.sum(axis=1), known.sum(axis=0)
    weight = np.where(per_column > 0, 1 / np.maximum(per_column, 1), 0.0)
    # columns eliminated: what is left are the rows
    normal = np.diag(per_row.astype(float)) - (known * weight) @ known.T
    right = misclosure.sum(axis=1) - (known * weight) @ misclosure.sum(axis=0)
    rows = np.linalg.pinv(normal, hermitian=True) @ right
    columns = weight * (misclosure - known * rows[:, None]).sum(axis=0)
    rank = int(np.linalg.matrix_rank(normal, hermitian=True)) + int((per_column > 0).sum())
    return rows, columns, rank


def adjust_repeats(values: Array) -> Repeats:
    """Means over sets of zenith angles or distances (s, t)."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    weight = np.where(count > 0, 1 / np.maximum(count, 1), 0.0)
    mean = np.where(count > 0, np.where(known, values, 0.0).sum(axis=0) * weight, np.nan)
    residual = values - mean[None, :]
    dof = int(known.sum()) - int((count > 0).sum())
    sigma = _sigma(residual, known, dof)
    return Repeats(mean, residual, sigma, sigma * np.sqrt(weight), dof)


def _sigma(residual: Array, known: NDArray[np.bool_], dof: int) -> float:
    return float(np.sqrt((residual[known] ** 2).sum() / dof)) if dof > 0 else float("nan")


def _approximate(directions: Array, known: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Orientations (s,) and directions (t,), from set to set through targets they share."""
    s, t = directions.shape
    orientation, direction = np.zeros(s), np.zeros(t)
    placed = np.zeros(t, dtype=bool)
    waiting = list(range(s))
    while waiting:
        # the first one that is left begins a part of its own
        linked = [waiting[0]]
        while linked:
            for k in linked:
                both = known[k] & placed
                if both.any():
                    turn = np.exp(1j * (directions[k, both] - direction[both]))
                    orientation[k] = np.angle(turn.mean())
                new = known[k] & ~placed
                direction[new] = directions[k, new] - orientation[k]
                placed |= known[k]
            done = set(linked)
            waiting = [k for k in waiting if k not in done]
            linked = [k for k in waiting if (known[k] & placed).any()]
    return orientation, direction
