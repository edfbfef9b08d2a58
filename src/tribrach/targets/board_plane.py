"""The plane of a flat target, black and white print weighed by its own noise.

Dark print returns less light, ranges noisier, and by a constant longer or shorter, millimetres
where it is very dark. Each colour gets a sigma of its own and the dark one an offset; the plane is
that of the white print, both together give its tilt (method section 8.2). Points are carried along
their beams into the plane, so that range noise does not blur print.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["BoardPlane", "fit_board_plane"]

Array = NDArray[np.float64]

#: residuals beyond this many sigmas take no part
_TRIM = 3.0
#: fewest points of a plane
FEWEST = 12


@dataclass(frozen=True)
class BoardPlane:
    """Plane ``normal . x = offset`` of the scanner frame and its axes.

    normal (3,) towards the scanner; axes (2, 3) : across and up in the plane; origin (3,) in it;
    use (n,) : points that lie on it; sigma : of the offset at the origin [m]; rms : of the
    residuals along the beam [m]; split : white minus black along the beam [m].
    """

    normal: Array
    offset: float
    axes: Array
    origin: Array
    use: NDArray[np.bool_]
    sigma: float
    rms: float
    split: float

    def project(self, xyz: Array) -> Array:
        """Coordinates (n, 2) [m] in the plane of points (n, 3), along their beams."""
        beam = xyz * (self.offset / (xyz @ self.normal))[:, None]
        flat: Array = (beam - self.origin) @ self.axes.T
        return flat

    def at(self, flat: Array) -> Array:
        """The point (3,) of the plane with these coordinates (2,)."""
        point: Array = self.origin + flat @ self.axes
        return point


def fit_board_plane(
    xyz: Array, bright: NDArray[np.bool_], near: Array, spacing: float
) -> BoardPlane | None:
    """The plane through points (n, 3) [m] around a place (3,), None if there is none.

    bright (n,) : white print; spacing : distance [m] of points that are independent of each other.
    """
    use = np.ones(len(xyz), dtype=bool)
    unit = xyz / np.linalg.norm(xyz, axis=1, keepdims=True)
    weight = np.ones(len(xyz))
    normal, split = near / np.linalg.norm(near), 0.0
    for turn in range(8):
        if use.sum() < FEWEST:
            return None
        moved = xyz + unit * np.where(bright, 0.0, split)[:, None]
        normal, centre = _plane(moved[use], weight[use])
        slope = unit @ normal
        if np.abs(slope[use]).min() < 0.1:
            return None
        residual = ((xyz - centre) @ normal) / slope
        middle = np.median if turn == 0 else np.mean
        levels = [
            float(middle(residual[use & (bright == colour)]))
            if (use & (bright == colour)).any()
            else 0.0
            for colour in (False, True)
        ]
        split = levels[1] - levels[0] if all(levels) else 0.0
        residual -= levels[1]
        residual = residual + np.where(bright, 0.0, split)
        sigma = np.array([_spread(residual[use & (bright == colour)]) for colour in (False, True)])
        sigma = np.where(sigma > 0, sigma, max(sigma.max(), 1e-5))
        own = sigma[bright.astype(int)]
        weight = (slope / own) ** 2
        before, use = use, np.abs(residual) < _TRIM * own
        if (before == use).all():
            break
    centre = centre + levels[1] * near / np.linalg.norm(near)
    normal = -normal if normal @ centre > 0 else normal
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = np.cross(up, normal)
    across /= np.linalg.norm(across)
    axes = np.stack([across, np.cross(normal, across)])
    rms = float(np.sqrt(np.mean(residual[use] ** 2)))
    # the offset of the dark print is unknown, so only the white one tells the distance
    white = use & bright if (use & bright).any() else use
    information = (1 / own[white] ** 2).sum() * min(
        1.0, _independent(xyz[white], spacing) / white.sum()
    )
    offset = float(normal @ centre)
    origin = near * (offset / (near @ normal))
    sigma_offset = float(abs(np.mean(slope[use])) / np.sqrt(information))
    return BoardPlane(normal, offset, axes, origin, use, sigma_offset, rms, split)


def _plane(xyz: Array, weight: Array) -> tuple[Array, Array]:
    """Normal and centroid of weighted points."""
    centre = np.average(xyz, axis=0, weights=weight)
    d = xyz - centre
    normal: Array = np.linalg.eigh((d * weight[:, None]).T @ d)[1][:, 0]
    return normal, centre


def _spread(residual: Array) -> float:
    """Robust standard deviation."""
    if len(residual) < 4:
        return 0.0
    return float(1.4826 * np.median(np.abs(residual - np.median(residual))))


def _independent(xyz: Array, spacing: float) -> float:
    """Number of cells of this size that the points cover, a bound of independent ones."""
    if spacing <= 0:
        return float(len(xyz))
    cells = np.unique(np.floor(xyz / spacing).astype(np.int64), axis=0)
    return float(len(cells))
