"""The axis that several circles have in common, through points in space."""

from __future__ import annotations

import numpy as np

from tribrach._types import Array, Index


def common_axis(points: Array, circle: Index) -> tuple[Array, Array]:
    """The axis about which points stand on circles, near enough for a start.

    The direction is the one across which all chords of one circle lie (smallest singular vector);
    in its plane all circles have one centre, which is linear in ``|x|^2 = 2 c.x + k_i``.

    The point of the axis is the one closest to the middle of all points.
    """
    number = np.unique(circle, return_inverse=True)[1]
    count = np.bincount(number)
    middles = np.stack([np.bincount(number, x) for x in points.T], axis=1) / count[:, None]
    normal = np.linalg.svd(points - middles[number])[2][2]
    across = np.linalg.svd(normal[None])[2][1:]
    middle = points.mean(axis=0)
    flat = (points - middle) @ across.T
    own = np.eye(len(count))[number]
    design = np.hstack([2 * flat, own])
    centre = np.linalg.lstsq(design, (flat**2).sum(axis=1), rcond=None)[0][:2]
    return middle + centre @ across, normal
