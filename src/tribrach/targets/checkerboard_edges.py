"""The edges of a checkerboard once its pattern is known: each from the points beside it.

What the least squares of :mod:`~tribrach.targets.checkerboard_pattern` gives is a start; where an
edge lies is then the posterior of :mod:`~tribrach.targets.board_edges` (section 8.2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.targets.board_edges import EdgePoints, locate_edge
from tribrach.targets.board_plane import BoardPlane
from tribrach.targets.checkerboard_pattern import Pattern, inside_board, pitch

__all__ = ["refine_edges"]

Array = NDArray[np.float64]

#: points that tell where an edge is, about; more than these say no more than its profile allows
_PLENTY = 400


def refine_edges(
    flat: Array, light: Array, solved: Pattern, scale: tuple[float, float, float], plane: BoardPlane
) -> Pattern:
    """Centre and turns from the posteriors of the two edges; ``solved`` if one has too few points.

    flat (n, 2) [m] in the plane, light (n,); scale : half the side, blur, error by the angles [m].
    """
    half, blur, jitter = scale
    p, covariance = solved.p.copy(), solved.covariance.copy()
    shift = 1.5 * pitch(solved.use, half) + 2 * float(np.hypot(blur, jitter))
    for _ in range(2):
        inside = inside_board(flat, p, half)
        widest = max(plane.stretch(np.array([np.cos(t), np.sin(t)])) for t in p[2:4])
        clear = min(3 * widest * float(np.hypot(blur, jitter)), 0.3 * half)
        p, noise = _levels(flat[inside], light[inside], p, clear)
        moves, cofactors = [], []
        for k in (0, 1):
            points = _near_edge(flat[inside], light[inside], p, k, scale, plane, noise, shift)
            if len(points.along) < 4:
                return solved
            move, cofactor = locate_edge(points, shift, 1.5 * shift / half)
            moves.append(move)
            cofactors.append(cofactor)
        normals = np.stack([np.cos(p[2:4]), np.sin(p[2:4])], axis=1)
        to_place = np.linalg.inv(normals)
        p[:2] += to_place @ [moves[0][0], moves[1][0]]
        p[2:4] += [moves[0][1], moves[1][1]]
        spread = np.diag([cofactors[0][0, 0], cofactors[1][0, 0]])
        covariance[:2, :2] = to_place @ spread @ to_place.T
    return Pattern(p, covariance, solved.use, noise)


def _near_edge(
    flat: Array,
    light: Array,
    p: Array,
    k: int,
    scale: tuple[float, float, float],
    plane: BoardPlane,
    noise: float,
    shift: float,
) -> EdgePoints:
    """The points that may tell where edge ``k`` is, none that the other edge may touch."""
    half, blur, jitter = scale
    blur = float(np.sqrt(max(blur**2 - jitter**2, blur**2 / 4)))
    d = flat - p[:2]
    normals = np.stack([np.cos(p[2:4]), np.sin(p[2:4])], axis=1)
    distance = d @ normals.T
    blur, jitter = (size * plane.stretch(normals[k]) for size in (blur, jitter))
    reach = 3 * float(np.hypot(blur, jitter))
    clear = np.abs(distance[:, 1 - k]) > reach + 0.03 * half
    near = np.flatnonzero(clear & (np.abs(distance[:, k]) < reach + 2 * shift))
    near = near[:: max(1, len(near) // _PLENTY)]
    sign = np.sign(distance[near, 1 - k])
    return EdgePoints(
        along=d[near] @ [-normals[k, 1], normals[k, 0]],
        across=distance[near, k],
        level=(light[near] - p[4]) / p[5] * sign,
        noise=noise / abs(p[5]),
        blur=blur,
        jitter=jitter,
    )


def _levels(flat: Array, light: Array, p: Array, clear: float) -> tuple[Array, float]:
    """Parameters with the levels of the plain parts of the quadrants, and the noise of light."""
    d = flat - p[:2]
    a, b = d @ [np.cos(p[2]), np.sin(p[2])], d @ [np.cos(p[3]), np.sin(p[3])]
    plain = np.minimum(np.abs(a), np.abs(b)) > clear
    sign = np.sign(a * b)
    high, low = light[plain & (sign > 0)], light[plain & (sign < 0)]
    if min(len(high), len(low)) < 6:
        return p, 0.005 * abs(p[5])
    out, ends = p.copy(), np.array([np.median(high), np.median(low)])
    out[4:6] = ends.mean(), (ends[0] - ends[1]) / 2
    left = np.concatenate([high - ends[0], low - ends[1]])
    return out, max(1.4826 * float(np.median(np.abs(left))), 0.005 * abs(out[5]))
