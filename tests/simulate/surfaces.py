"""How far points are from the surfaces that a simulated scanner hit."""

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.simulate.scene import (
    CHECKERBOARD,
    CYLINDER,
    DISC,
    ELLIPSOID,
    RECTANGLE,
    SPHERE,
    Scene,
)

_FLAT = (RECTANGLE, CHECKERBOARD, DISC)


def distance_to_surface(scene: Scene, number: NDArray[np.int64], xyz: Array) -> Array:
    """Distance (n,) [m] of points from one primitive's surface each; of ellipsoids only nearby."""
    local = np.einsum("nij,nj->ni", scene.axes[number], xyz - scene.center[number])
    half, kind = scene.half[number], scene.kind[number]
    outside = np.linalg.norm(np.maximum(np.abs(local) - half, 0), axis=1)
    to_box = np.where(outside > 0, outside, np.min(np.abs(half - np.abs(local)), axis=1))
    to_sphere = np.abs(np.linalg.norm(local, axis=1) - half[:, 0])
    radial = np.hypot(local[:, 0], local[:, 1]) - half[:, 0]
    along = np.abs(local[:, 2]) - half[:, 2]
    beyond = np.hypot(np.maximum(radial, 0), np.maximum(along, 0))
    inside = np.minimum(np.abs(radial), np.abs(along))
    to_cylinder = np.where(beyond > 0, beyond, inside)
    flat = np.isin(kind, _FLAT)
    round_ = kind == ELLIPSOID
    axes = np.where(round_[:, None], half, 1.0)
    level, slope = np.linalg.norm(local / axes, axis=1), np.linalg.norm(local / axes**2, axis=1)
    to_ellipsoid = np.abs(level * (level - 1)) / np.maximum(slope, 1e-12)
    rest = np.select(
        [kind == SPHERE, kind == CYLINDER, round_], [to_sphere, to_cylinder, to_ellipsoid], to_box
    )
    return np.asarray(np.where(flat, outside, rest))
