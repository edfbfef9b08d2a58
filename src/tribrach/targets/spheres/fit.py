"""Fits the centre of a sphere to scan points along their lines of sight (method section 6.3).

The scanner measures ranges along directions it knows well, so the residual is the measured range
minus the range at which the beam meets the sphere. Fitting distances to the centre instead pulls
the centre towards the scanner under range noise; that model only serves clouds whose scanner origin
is unknown, and its results say so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tribrach._types import Array, Mask
from tribrach.errors import InputError
from tribrach.statistics import MAD_TO_SIGMA

__all__ = ["GATES", "SphereFit", "SphereFitGates", "fit_sphere", "fit_sphere_orthogonal"]


@dataclass(frozen=True)
class SphereFitGates:
    """How a sphere is fitted to points.

    Notes
    -----
    Chosen by hand on simulated spheres (tests/targets/test_sphere_fit: errors as large as their
    covariances say, and equal to the closed forms of method section 6.3); where a number has a
    source, it is named.
    """

    #: incidence beyond this is left out [rad]: mixed pixels and edge effects (method section 6.3)
    mask_rad: float = float(np.radians(60.0))
    #: fewer points are refused, on fewer than the second number the fit says so
    fewest_points: int = 30
    few_points: int = 100
    #: sigma of what no fit sees of a target [m]: form, mount, material
    floor_m: float = 3e-4
    #: residuals beyond this many robust standard deviations are trimmed ...
    trim_sigmas: float = 3.0
    #: ... but none within this many sigmas of a single point
    kept_sigmas: float = 0.3
    #: residuals that take part at first, in the first steps and later, over the radius
    first_gate_radii: float = 0.5
    gate_radii: float = 1.0
    first_steps: int = 5
    #: steps at most; the set of points is held after the second number, so that the fit settles
    most_steps: int = 60
    held_after: int = 40
    #: fewer points end the fit
    solvable_points: int = 6
    #: a longer step means that the fit runs away, longer moves than the second are cut [radii]
    lost_radii: float = 10.0
    most_move_radii: float = 0.5
    #: a shorter step ends the fit [m]
    settled_m: float = 1e-7
    #: least determinant of the scaled normal matrix
    determinant: float = 1e-12


GATES = SphereFitGates()

# compiled code reads constants of the module, not attributes of an object
_TRIM_SIGMAS = GATES.trim_sigmas
_KEPT_SIGMAS = GATES.kept_sigmas
_FIRST_GATE_RADII = GATES.first_gate_radii
_GATE_RADII = GATES.gate_radii
_FIRST_STEPS = GATES.first_steps
_MOST_STEPS = GATES.most_steps
_HELD_AFTER = GATES.held_after
_SOLVABLE_POINTS = GATES.solvable_points
_LOST_RADII = GATES.lost_radii
_MOST_MOVE_RADII = GATES.most_move_radii
_SETTLED_M = GATES.settled_m
_DETERMINANT = GATES.determinant


@dataclass(frozen=True, eq=False)
class SphereFit:
    """A fitted sphere and how well the points determine it.

    Attributes
    ----------
    center : array (3,)
        Centre in the scanner frame [m].
    covariance : array (3, 3)
        Its covariance, floor included [m^2].
    formal : array (3, 3)
        Its covariance without the floor [m^2].
    radius : float
        Radius [m].
    sigma_radius : float
        Sigma of the radius, 0 for a given radius [m].
    rms : float
        Root mean square of the residuals along the line of sight [m].
    s0 : float
        Standard deviation of unit weight.
    masked : array of bool (n,)
        Points within the mask of incidence.
    inliers : array of bool (n,)
        Those of them that were not trimmed.
    incidence : array (n,)
        Angles of incidence [rad], NaN beside the sphere.
    residuals : array (n,)
        Residuals [m], NaN beside the sphere.
    sentences : tuple of str
        What was odd about the fit.
    """

    center: Array
    covariance: Array
    formal: Array
    radius: float
    sigma_radius: float
    rms: float
    s0: float
    masked: Mask
    inliers: Mask
    incidence: Array
    residuals: Array
    sentences: tuple[str, ...] = ()


def fit_sphere(
    xyz: Array,
    start: Array,
    radius: float,
    *,
    sigma_range: float,
    sigma_angle: float,
    free_radius: bool = False,
    mask: float = GATES.mask_rad,
    floor: float = GATES.floor_m,
) -> SphereFit:
    """Fit a sphere along the lines of sight.

    Parameters
    ----------
    xyz : array (n, 3)
        Points in the scanner frame [m].
    start : array (3,)
        Start value of the centre, good to about a third of the radius [m].
    radius : float
        The radius, or its start value with ``free_radius`` [m].
    sigma_range : float
        Sigma of the range of one point [m].
    sigma_angle : float
        Sigma of the angles of one point [rad].
    free_radius : bool
        True to estimate the radius as well.
    mask : float
        Largest angle of incidence [rad].
    floor : float
        Sigma added to the covariance in each direction [m].

    Returns
    -------
    SphereFit
        The sphere.

    Raises
    ------
    InputError
        If fewer than 30 points are left, the scanner is inside the sphere, or there is no solution.
    """
    if not np.linalg.norm(start) > radius > 0:
        raise InputError("the scanner would be inside the sphere")
    noise = (float(sigma_range), float(sigma_angle))
    state = _los(np.ascontiguousarray(xyz), start, radius, free_radius, noise, float(np.cos(mask)))
    return _conclude(state, floor, free_radius)


def fit_sphere_orthogonal(
    xyz: Array,
    start: Array,
    radius: float,
    *,
    sigma: float,
    free_radius: bool = False,
    floor: float = GATES.floor_m,
) -> SphereFit:
    """Fit a sphere by distances to the centre, for points whose scanner is unknown.

    Parameters
    ----------
    xyz : array (n, 3)
        Points [m].
    start : array (3,)
        Start value of the centre, good to about a third of the radius [m].
    radius : float
        The radius, or its start value with ``free_radius`` [m].
    sigma : float
        Sigma of one point along the normal [m].
    free_radius : bool
        True to estimate the radius as well.
    floor : float
        Sigma added to the covariance in each direction [m].

    Returns
    -------
    SphereFit
        The sphere. Incidence is unknown (NaN) and nothing is masked.

    Raises
    ------
    InputError
        If fewer than 30 points are left or there is no solution.
    """
    state = _orthogonal(np.ascontiguousarray(xyz), start, radius, free_radius, float(sigma))
    sentences = (
        "the origin of the scanner is unknown: distances to the centre were fitted, whose centre "
        "is drawn towards the scanner under range noise",
    )
    return _conclude(state, floor, free_radius, sentences)


State = tuple[Array, Array, Array, Array, Mask, Mask, bool]


def _conclude(state: State, floor: float, free: bool, sentences: tuple[str, ...] = ()) -> SphereFit:
    """Numbers of the fit from its last iteration."""
    unknowns, normal, residuals, cosine, masked, keep, settled = state
    keep = keep & np.isfinite(residuals)
    count, u = int(keep.sum()), 4 if free else 3
    if count < GATES.fewest_points:
        raise InputError(f"only {count} points lie on the sphere, {GATES.fewest_points} are needed")
    if not settled or not np.isfinite(unknowns).all():
        raise InputError("the fit of the sphere does not settle")
    if count < GATES.few_points:
        sentences = (*sentences, f"only {count} points determine the centre")
    rms = float(np.sqrt(np.mean(residuals[keep] ** 2)))
    s0 = float(np.sqrt(normal[4, 4] / (count - u)))
    cofactor = np.linalg.inv(normal[:u, :u]) * max(1.0, s0**2)
    formal = np.asarray(cofactor[:3, :3], dtype=float)
    sigma_radius = float(np.sqrt(cofactor[3, 3])) if free else 0.0
    with np.errstate(invalid="ignore"):
        incidence = np.arccos(cosine)
    return SphereFit(
        center=unknowns[:3],
        covariance=formal + floor**2 * np.eye(3),
        formal=formal,
        radius=float(unknowns[3]),
        sigma_radius=sigma_radius,
        rms=rms,
        s0=s0,
        masked=masked,
        inliers=keep,
        incidence=incidence,
        residuals=residuals,
        sentences=sentences,
    )


@njit(cache=True, nogil=True)
def _los(
    xyz: Array,
    start: Array,
    radius: float,
    free: bool,
    noise: tuple[float, float],
    cos_mask: float,
) -> State:
    """Gauss-Newton along the lines of sight, with trimming.

    Notes
    -----
    The returned normal matrix (5, 5) holds the unknowns x, y, z, R and last the sum of squares. The
    last returned element is True if the iteration settled.
    """
    n = len(xyz)
    x = np.array([start[0], start[1], start[2], radius])
    masked, keep = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    residuals, cosine = np.full(n, np.nan), np.full(n, np.nan)
    design, sigma = np.zeros((n, 4)), np.ones(n)
    normal = np.zeros((5, 5))
    settled = False
    for iteration in range(_MOST_STEPS):
        _beams(xyz, x, noise, design, residuals, sigma, cosine)
        if iteration < _HELD_AFTER:
            masked = cosine >= cos_mask
            keep = _trimmed(
                residuals,
                sigma,
                masked,
                radius * (_FIRST_GATE_RADII if iteration < _FIRST_STEPS else _GATE_RADII),
            )
        normal = _normal_matrix(design, residuals, sigma, keep)
        if settled or keep.sum() < _SOLVABLE_POINTS:
            break
        step = _solved(normal, 4 if free else 3)
        size = np.sqrt((step**2).sum())
        if not size < _LOST_RADII * radius:
            break
        x += step * min(1.0, _MOST_MOVE_RADII * radius / max(size, 1e-12))
        settled = size < _SETTLED_M and iteration > _FIRST_STEPS and x[3] > 0
    return x, normal, residuals, cosine, masked, keep, settled


@njit(cache=True, nogil=True)
def _beams(
    xyz: Array,
    x: Array,
    noise: tuple[float, float],
    design: Array,
    residuals: Array,
    sigma: Array,
    cosine: Array,
) -> None:
    """Residual, its sigma and derivatives of every beam; NaN where a beam misses the sphere.

    Notes
    -----
    The beam meets the sphere at ``rho = b - sqrt(R^2 - |c|^2 + b^2)`` with ``b = d . c``; the
    variance of the residual is ``s_rho^2 + rho^2 s_ang^2 tan^2 psi``.
    """
    outside = x[0] ** 2 + x[1] ** 2 + x[2] ** 2
    for i in range(len(xyz)):
        rho = np.sqrt(xyz[i, 0] ** 2 + xyz[i, 1] ** 2 + xyz[i, 2] ** 2)
        b = (xyz[i, 0] * x[0] + xyz[i, 1] * x[1] + xyz[i, 2] * x[2]) / rho
        square = x[3] ** 2 - outside + b * b
        if not square > 0:
            residuals[i] = cosine[i] = np.nan
            continue
        root = np.sqrt(square)
        residuals[i], cosine[i] = rho - (b - root), min(root / x[3], 1.0)
        tangent2 = 1 / cosine[i] ** 2 - 1
        sigma[i] = np.sqrt(noise[0] ** 2 + rho**2 * noise[1] ** 2 * tangent2)
        for k in range(3):
            d = xyz[i, k] / rho
            design[i, k] = d - (b * d - x[k]) / root
        design[i, 3] = -x[3] / root


@njit(cache=True, nogil=True)
def _trimmed(residuals: Array, sigma: Array, masked: Mask, gate: float) -> Mask:
    """Points within three robust standard deviations of those nearer than ``gate`` [m]."""
    t = np.abs(residuals / sigma)
    near = masked & (np.abs(residuals) <= gate)
    if near.sum() < _SOLVABLE_POINTS:
        return near
    scale = MAD_TO_SIGMA * np.median(t[near])
    kept: Mask = near & (t <= max(_TRIM_SIGMAS * scale, _KEPT_SIGMAS))
    return kept


@njit(cache=True, nogil=True)
def _normal_matrix(design: Array, residuals: Array, sigma: Array, keep: Mask) -> Array:
    """Weighted normal matrix, its right side in column 4, the sum of squares at (4, 4)."""
    out = np.zeros((5, 5))
    row = np.zeros(5)
    for i in range(len(design)):
        if keep[i] and np.isfinite(residuals[i]):
            for a in range(4):
                row[a] = design[i, a] / sigma[i]
            row[4] = residuals[i] / sigma[i]
            for a in range(5):
                for b in range(5):
                    out[a, b] += row[a] * row[b]
    return out


@njit(cache=True, nogil=True)
def _solved(normal: Array, u: int) -> Array:
    """Step (4,) of the first ``u`` unknowns; NaN where they are not determined."""
    out = np.zeros(4)
    scale = np.sqrt(np.diag(normal)[:u].copy())
    if not scale.min() > 0:
        return np.full(4, np.nan)
    scaled = normal[:u, :u] / np.outer(scale, scale)
    if not np.isfinite(scaled.sum()):
        return np.full(4, np.nan)
    if not np.linalg.det(scaled) > _DETERMINANT:
        return np.full(4, np.nan)
    out[:u] = np.linalg.solve(scaled, normal[:u, 4] / scale) / scale
    return out


@njit(cache=True, nogil=True)
def _orthogonal(xyz: Array, start: Array, radius: float, free: bool, sigma: float) -> State:
    """Like ``_los`` for the model |P - c| = R."""
    n = len(xyz)
    x = np.array([start[0], start[1], start[2], radius])
    keep, masked = np.zeros(n, dtype=np.bool_), np.ones(n, dtype=np.bool_)
    residuals, design, sigmas = np.zeros(n), np.zeros((n, 4)), np.full(n, sigma)
    normal = np.zeros((5, 5))
    settled = False
    for iteration in range(_MOST_STEPS):
        for i in range(n):
            d = xyz[i] - x[:3]
            size = np.sqrt((d**2).sum())
            residuals[i] = size - x[3]
            design[i, :3] = d / size
            design[i, 3] = 1.0
        if iteration < _HELD_AFTER:
            keep = _trimmed(residuals, sigmas, masked, _FIRST_GATE_RADII * radius)
        normal = _normal_matrix(design, residuals, sigmas, keep)
        if settled or keep.sum() < _SOLVABLE_POINTS:
            break
        step = _solved(normal, 4 if free else 3)
        if not np.sqrt((step**2).sum()) < _LOST_RADII * radius:
            break
        x += step
        settled = np.sqrt((step**2).sum()) < _SETTLED_M and iteration > _FIRST_STEPS and x[3] > 0
    return x, normal, residuals, np.full(n, np.nan), masked, keep, settled
