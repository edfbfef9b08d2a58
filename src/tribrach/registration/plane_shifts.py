"""Shifts between two stations under which, once turned, the offsets of their planes fall together.

Every pair of parallel planes proposes a shift along their normal. Along three independent
directions the proposals with most support are combined; all other planes then say which of the
combinations are good. Where the common planes have fewer than three independent directions, the
shift stays open along the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from tribrach.registration.plane_rotations import fitting_pairs, pair_weights
from tribrach.registration.plane_set import PlaneSet

__all__ = ["INDEPENDENT", "open_directions", "shifts"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: normals within this angle are one direction [rad]
_ONE = float(np.radians(8.0))
#: offsets of one surface agree within this while the turn is not yet sharp [m]
OFFSET = 0.1
#: proposals along one direction, directions that are combined, and shifts that are returned
_PEAKS, _AXES, _SHIFTS = 14, 5, 12
#: directions are independent if the smallest singular value of their unit vectors is above this
INDEPENDENT = 0.2


@dataclass(frozen=True)
class _Axis:
    """A direction that planes have in common: unit (3,), proposals (m,) [m] and their weights."""

    unit: Array
    values: Array
    weight: float


def shifts(first: PlaneSet, second: PlaneSet, rotation: Array) -> tuple[Array, Array]:
    """Shifts (t, 3) [m] ``first from second`` under a rotation, best first, and support (t,).

    None where the planes that the rotation brings together leave a direction open.
    """
    i, j = fitting_pairs(first, second, rotation)
    weight = pair_weights(first, second, i, j)
    wanted = first.offset[i] - second.offset[j]
    axes = _axes(first.normal[i], wanted, weight)[:_AXES]
    found: list[Array] = []
    for triple in combinations(axes, 3):
        units = np.array([axis.unit for axis in triple])
        if np.linalg.svd(units, compute_uv=False)[-1] < INDEPENDENT:
            continue
        values = np.array(list(product(*(axis.values for axis in triple))))
        found.append(values @ np.linalg.inv(units).T)
    if not found:
        return np.zeros((0, 3)), np.zeros(0)
    shift = np.concatenate(found)
    support = _support(shift, first.normal[i], wanted, weight, i)
    order = np.argsort(-support, kind="stable")
    kept: list[int] = []
    for k in order:
        if all(np.linalg.norm(shift[k] - shift[m]) > OFFSET for m in kept):
            kept.append(int(k))
        if len(kept) == _SHIFTS:
            break
    return shift[kept], support[kept]


def open_directions(normal: Array) -> Array:
    """Unit directions (f, 3) that normals (k, 3) leave open, none if they hold all three."""
    if len(normal) == 0:
        return np.eye(3)
    values, vectors = np.linalg.eigh(_directions(normal))
    return np.asarray(vectors[:, np.sqrt(np.maximum(values, 0)) < INDEPENDENT].T)


def _directions(normal: Array) -> Array:
    """Sum (3, 3) of the outer products of the different directions, each counted once."""
    units: list[Array] = []
    for n in normal:
        if all(abs(n @ u) < np.cos(_ONE) for u in units):
            units.append(n)
    directions = np.array(units)
    return np.asarray(directions.T @ directions)


def _axes(normal: Array, wanted: Array, weight: Array) -> list[_Axis]:
    """Directions of pairs (p, 3) with their best proposals, those of most weight first."""
    out: list[_Axis] = []
    left = np.ones(len(normal), dtype=bool)
    while left.any():
        head = normal[np.flatnonzero(left)[np.argmax(weight[left])]]
        cosine = normal @ head
        mine = left & (np.abs(cosine) > np.cos(_ONE))
        values = (wanted * np.sign(cosine))[mine]
        out.append(_Axis(head, _peaks(values, weight[mine]), float(weight[mine].sum())))
        left &= ~mine
    return sorted(out, key=lambda axis: -axis.weight)


def _peaks(values: Array, weight: Array) -> Array:
    """Values (m,) around which most weight lies, no two within the tolerance."""
    near = np.abs(values[:, None] - values[None]) < OFFSET / 2
    support = near @ weight
    kept: list[float] = []
    for k in np.argsort(-support, kind="stable"):
        # walls and what is let into them propose several values: the one in the middle of the area
        value = _median(values[near[k]], weight[near[k]])
        if all(abs(value - v) > OFFSET / 2 for v in kept):
            kept.append(value)
        if len(kept) == _PEAKS:
            break
    return np.array(kept)


def _median(values: Array, weight: Array) -> float:
    """The value with half of the weight on either side."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(total, total[-1] / 2)]])


def _support(shift: Array, normal: Array, wanted: Array, weight: Array, owner: Index) -> Array:
    """Weight (t,) of the first station's planes that have a counterpart under each shift."""
    starts = np.flatnonzero(np.r_[True, np.diff(owner) > 0])
    out = np.empty(len(shift))
    for a in range(0, len(shift), 2000):
        some = shift[a : a + 2000]
        good = np.abs(some @ normal.T - wanted) < OFFSET
        best = np.maximum.reduceat(np.where(good, weight, 0.0), starts, axis=1)
        out[a : a + 2000] = best.sum(axis=1)
    return out
