"""Turns between two stations under which the normals of their planes fall together.

Levelled stations differ by one angle about the plumb line, and every pair of walls proposes one;
others differ by three, and every pair of planes that enclose the same angle in both scans proposes
them (method section 8.4: angles between normals do not change). What many planes propose comes
first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.registration.plane_set import PlaneSet

__all__ = ["fitting_pairs", "rotations"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: normals of one surface differ by less than this [rad], and so do the angles between two
TURN = float(np.radians(1.0))
#: turns that differ by less than this are one [rad]
_APART = float(np.radians(2.0))
#: proposals that are followed, of levelled stations and of others
_LEVELLED, _FREE = 24, 40
#: planes whose pairs propose a turn in space, and proposals that are weighed
_PLANES, _WEIGHED = 24, 4000
#: planes flatter than this propose no heading, and planes nearer to parallel no turn
_WALL, _ANGLE = 0.3, float(np.radians(20.0))
#: areas beyond this count no more [m^2]
_LARGE = 100.0


def rotations(first: PlaneSet, second: PlaneSet, levelled: bool) -> Array:
    """Rotations (r, 3, 3) ``first from second``, those that most planes support first."""
    if len(first) == 0 or len(second) == 0:
        return np.zeros((0, 3, 3))
    proposed = _headings(first, second) if levelled else _turns(first, second)
    if len(proposed) == 0:
        return proposed
    support = np.array([_support(first, second, r) for r in proposed])
    out: list[Array] = []
    for k in np.argsort(-support, kind="stable"):
        if support[k] <= 0:
            break
        turn = _refined(first, second, proposed[k], levelled)
        if all(_angle(turn, other) > _APART for other in out):
            out.append(turn)
        if len(out) == (_LEVELLED if levelled else _FREE):
            break
    return np.array(out).reshape(-1, 3, 3)


def fitting_pairs(first: PlaneSet, second: PlaneSet, rotation: Array) -> tuple[Index, Index]:
    """Numbers (p,), (p,) of planes whose normals a rotation brings together."""
    cosine = first.normal @ (second.normal @ rotation.T).T
    i, j = np.nonzero(cosine > np.cos(TURN))
    return i, j


def pair_weights(first: PlaneSet, second: PlaneSet, i: Index, j: Index) -> Array:
    """Weights (p,) of pairs of planes by the smaller area."""
    return np.asarray(np.sqrt(np.minimum(np.minimum(first.area[i], second.area[j]), _LARGE)))


def _headings(first: PlaneSet, second: PlaneSet) -> Array:
    """Turns (h, 3, 3) about the third axis, one for every pair of walls that lean alike."""
    flat = [np.linalg.norm(s.normal[:, :2], axis=1) > _WALL for s in (first, second)]
    a, b = first.normal[flat[0]], second.normal[flat[1]]
    alike = np.abs(a[:, None, 2] - b[None, :, 2]) < TURN
    heading = np.arctan2(a[:, 1], a[:, 0])[:, None] - np.arctan2(b[:, 1], b[:, 0])[None]
    heading = np.unique(np.round(np.remainder(heading[alike], 2 * np.pi) / (TURN / 4)))
    heading = heading * (TURN / 4)
    out = np.zeros((len(heading), 3, 3))
    out[:, 0, 0] = out[:, 1, 1] = np.cos(heading)
    out[:, 1, 0], out[:, 0, 1] = np.sin(heading), -np.sin(heading)
    out[:, 2, 2] = 1.0
    return out


def _turns(first: PlaneSet, second: PlaneSet) -> Array:
    """Turns (h, 3, 3) that bring two planes of one station onto two of the other."""
    a, b = first.normal[:_PLANES], second.normal[:_PLANES]
    i, k = np.triu_indices(len(a), 1)
    j, m = np.nonzero(~np.eye(len(b), dtype=bool))
    mine = np.arccos(np.clip(np.einsum("ni,ni->n", a[i], a[k]), -1, 1))
    theirs = np.arccos(np.clip(np.einsum("ni,ni->n", b[j], b[m]), -1, 1))
    wide = (mine > _ANGLE) & (mine < np.pi - _ANGLE)
    p, q = np.nonzero((np.abs(mine[:, None] - theirs[None]) < TURN) & wide[:, None])
    area = np.minimum(
        np.minimum(first.area[i[p]], first.area[k[p]]),
        np.minimum(second.area[j[q]], second.area[m[q]]),
    )
    best = np.argsort(-area, kind="stable")[:_WEIGHED]
    p, q = p[best], q[best]
    return np.asarray(_axes(a[i[p]], a[k[p]]) @ _axes(b[j[q]], b[m[q]]).transpose(0, 2, 1))


def _axes(one: Array, two: Array) -> Array:
    """Right-handed axes (n, 3, 3), by columns, of two directions (n, 3) each."""
    middle, across = one + two, one - two
    x = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    y = across / np.linalg.norm(across, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)


def _support(first: PlaneSet, second: PlaneSet, rotation: Array) -> float:
    """How much of the second station's planes has a counterpart."""
    i, j = fitting_pairs(first, second, rotation)
    if len(i) == 0:
        return 0.0
    best = np.zeros(len(second))
    np.maximum.at(best, j, pair_weights(first, second, i, j))
    return float(best.sum())


def _refined(first: PlaneSet, second: PlaneSet, rotation: Array, levelled: bool) -> Array:
    """The rotation that fits all normals that it brings together."""
    i, j = fitting_pairs(first, second, rotation)
    weight = pair_weights(first, second, i, j) ** 2
    a, b = first.normal[i], second.normal[j]
    if levelled:
        turned = b @ rotation.T
        sine = np.sum(weight * (turned[:, 0] * a[:, 1] - turned[:, 1] * a[:, 0]))
        angle = np.arctan2(sine, np.sum(weight * (turned[:, :2] * a[:, :2]).sum(axis=1)))
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    u, _, vt = np.linalg.svd((weight[:, None] * a).T @ b)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def _angle(one: Array, two: Array) -> float:
    """Angle [rad] between two rotations."""
    return float(np.arccos(np.clip((np.trace(one.T @ two) - 1) / 2, -1, 1)))
