"""Fits the plane of a flat target, with black and white print weighted each by its own noise.

Dark print returns less light: its ranges are noisier and by a constant longer or shorter, by
millimetres where it is very dark. Each colour gets a sigma of its own and the dark one an offset;
offset, two tilts and that difference are estimated together from residuals along the beams (method
section 8.2). Points are carried along their beams into the plane, so that range noise does not blur
the print.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.instruments.neighbours import SharedNoise
from tribrach.statistics import robust_sigma


@dataclass(frozen=True)
class PrintPlaneGates:
    """How the plane of a print is fitted (by hand: test_checkerboards)."""

    trim_sigmas: float = 3.0  #: residuals beyond this many sigmas take no part
    fewest_points: int = 12  #: fewest points of a plane
    rounds: int = 10  #: rounds of trimming at most
    settled_m: float = 1e-7  #: a smaller move of the plane ends the rounds [m]
    flattest_sine: float = 0.1  #: beams are not flatter to the plane than this sine
    colour_points: int = 3  #: a colour with fewer points gets no offset of its own
    noise_points: int = 4  #: a colour with fewer points gets the noise of the other
    least_sigma_m: float = 1e-5  #: least sigma of a range [m]
    condition: float = 1e10  #: largest condition number of the scaled normal matrix
    #: the first plane leaves out this share of the points, the farthest ones, in so many rounds
    first_strays_share: float = 0.2
    first_rounds: int = 4


GATES = PrintPlaneGates()


@dataclass(frozen=True)
class BoardPlane:
    """Plane ``normal . x = offset`` of the scanner frame, with axes in it."""

    normal: Array  #: (3,), unit normal towards the scanner
    offset: float  #: offset of the plane [m]
    axes: Array  #: (2, 3), unit vectors across and up in the plane
    origin: Array  #: (3,), origin of the coordinates in the plane [m]
    use: NDArray[np.bool_]  #: (n,), points that lie on it
    #: (3, 3), covariance of the plane's shift along the normal at the origin [m] and of its slopes
    #: along both axes
    cofactor: Array
    rms: float  #: root mean square of the residuals along the beam [m]
    split: float  #: white minus black along the beam [m]

    def project(self, xyz: Array) -> Array:
        """Carry points (n, 3) along their beams into the plane (n, 2)."""
        beam = xyz * (self.offset / (xyz @ self.normal))[:, None]
        flat: Array = (beam - self.origin) @ self.axes.T
        return flat

    def at(self, flat: Array) -> Array:
        """The point of the plane with given coordinates."""
        point: Array = self.origin + flat @ self.axes
        return point

    def sigma(self, flat: Array) -> float:
        """Standard deviation [m] of the plane along its normal, at a place in it."""
        row = np.array([1.0, *flat])
        return float(np.sqrt(row @ self.cofactor @ row))

    def stretch(self, direction: Array) -> float:
        """Length of a footprint along a direction of the plane over its diameter."""
        beam = self.axes @ self.origin / abs(self.normal @ self.origin)
        return float(np.sqrt(1 + (beam @ direction) ** 2))


def fit_board_plane(
    xyz: Array,
    bright: NDArray[np.bool_],
    near: Array,
    spacing: float,
    shared: SharedNoise | None = None,
) -> BoardPlane | None:
    """Fit a print's plane around a place; ``spacing`` [m] of independent points if not known."""
    use = np.ones(len(xyz), dtype=bool)
    unit = xyz / np.linalg.norm(xyz, axis=1, keepdims=True)
    normal = _principal(xyz)
    normal = -normal if normal @ near > 0 else normal
    offset, dark = float(np.median(xyz @ normal)), 0.0
    for turn in range(GATES.rounds):
        if abs(normal @ near) < GATES.flattest_sine * np.linalg.norm(near):
            return None
        origin, axes, slope = near * (offset / (near @ normal)), _axes(normal), unit @ normal
        residual = (xyz @ normal - offset) / slope - np.where(bright, 0.0, dark)
        own = _noise(residual, use, bright)
        before, use = (
            use,
            (np.abs(residual) < GATES.trim_sigmas * own) & (slope < -GATES.flattest_sine),
        )
        if use.sum() < GATES.fewest_points:
            return None
        # where the beams meet the plane: places of measured points would follow their noise
        flat = (unit * (offset / slope)[:, None] - origin) @ axes.T
        step = _step(flat[use], residual[use], slope[use], bright[use], own[use])
        if step is None:
            return None
        move, cofactor, rows = step
        dark += move[3]
        normal = normal - move[1:3] @ axes
        normal = normal / np.linalg.norm(normal)
        offset = float(normal @ (origin + move[0] * normal))
        if turn and (before == use).all() and abs(move[0]) < GATES.settled_m:
            break
    rms = float(np.sqrt(np.mean(residual[use] ** 2)))
    if shared is None:
        cofactor = cofactor * max(1.0, use.sum() / _independent(flat[use], spacing))
    else:
        pairs = shared.at(float(np.linalg.norm(near))).summed(unit[use], rows)
        cofactor = cofactor + cofactor @ pairs @ cofactor
    origin = near * (offset / (near @ normal))
    return BoardPlane(normal, offset, _axes(normal), origin, use, cofactor[:3, :3], rms, -dark)


def _step(
    flat: Array, residual: Array, slope: Array, bright: NDArray[np.bool_], own: Array
) -> tuple[Array, Array, Array] | None:
    """Correct the plane and the range offset of dark print by residuals along the beams.

    The plane is ``shift + slope_x x + slope_y y`` above the present one. Returned are shift, both
    slopes and the offset of dark print along the beam, the cofactors of all, or of the first three
    if there is no dark print, and the rows (n, u) of the equations over their sigmas; None if the
    points do not determine them.
    """
    least = GATES.colour_points
    both = least <= bright.sum() <= len(bright) - least
    a = np.column_stack([np.ones(len(flat)), flat, np.where(bright, 0.0, slope)])
    a = (a if both else a[:, :3]) / (own * np.abs(slope))[:, None]
    n = a.T @ a
    size = np.sqrt(np.diag(n))
    if not size.min() > 0 or np.linalg.cond(n / np.outer(size, size)) > GATES.condition:
        return None
    q = np.asarray(np.linalg.inv(n), dtype=float)
    move = q @ (a.T @ (residual * np.sign(slope) / own))
    return np.append(move, np.zeros(4 - len(move))), q, a


def _noise(residual: Array, use: NDArray[np.bool_], bright: NDArray[np.bool_]) -> Array:
    """Sigma (n,) of each point's range, that of its colour [m]."""
    sigma = np.array([_spread(residual[use & (bright == colour)]) for colour in (False, True)])
    sigma = np.where(sigma > 0, sigma, max(sigma.max(), GATES.least_sigma_m))
    out: Array = sigma[bright.astype(int)]
    return out


def _principal(xyz: Array) -> Array:
    """Normal (3,) of the plane of least distances, proof against a fifth of strays."""
    use = np.ones(len(xyz), dtype=bool)
    for _ in range(GATES.first_rounds):
        d = xyz - xyz[use].mean(axis=0)
        normal: Array = np.linalg.eigh(d[use].T @ d[use])[1][:, 0]
        away = np.abs(d @ normal - np.median(d[use] @ normal))
        use = away <= np.quantile(away, 1 - GATES.first_strays_share)
    return normal


def _axes(normal: Array) -> Array:
    """Axes (2, 3) across and up in a plane."""
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = np.cross(up, normal)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(normal, across)])


def _spread(residual: Array) -> float:
    """Robust standard deviation, 0 from very few."""
    return robust_sigma(residual) if len(residual) >= GATES.noise_points else 0.0


def _independent(flat: Array, spacing: float) -> float:
    """Number of cells of this size that the points cover, a bound of independent ones."""
    if spacing <= 0:
        return float(len(flat))
    cells = np.unique(np.floor(flat / spacing).astype(np.int64), axis=0)
    return float(len(cells))
