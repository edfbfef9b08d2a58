"""Fits the centre of a sphere to scan points along their lines of sight (method section 6.3).

The scanner measures ranges along directions it knows well, so the residual is the measured range
minus the range at which the beam meets the sphere. Fitting distances to the centre instead pulls
the centre towards the scanner under range noise; that model only serves clouds whose scanner origin
is unknown, and its results say so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Mask
from tribrach.errors import InputError
from tribrach.instruments.neighbours import SharedNoise
from tribrach.kernels import njit
from tribrach.statistics import MAD_TO_SIGMA
from tribrach.targets.spheres.forms import second_degree


@dataclass(frozen=True)
class SphereFitGates:
    """How a sphere is fitted to points (by hand: test_sphere_fit)."""

    #: incidence beyond this is left out [rad]: mixed pixels and edge effects (method section 6.3)
    mask_rad: float = float(np.radians(60.0))
    #: fewer points are refused, on fewer than the second number the fit says so
    fewest_points: int = 30
    few_points: int = 100
    #: sigma of what neither points nor the tolerance of the sphere tell of its centre [m]: none is
    #: needed (method section 6.5)
    floor_m: float = 0.0
    #: residuals beyond this many robust standard deviations are trimmed ...
    trim_sigmas: float = 3.0
    kept_sigmas: float = 0.3  #: ... but none within this many sigmas of a single point
    #: residuals that take part at first, in the first steps and later, over the radius
    first_gate_radii: float = 0.5
    gate_radii: float = 1.0
    first_steps: int = 5
    #: steps at most; the set of points is held after the second number, so that the fit settles
    most_steps: int = 60
    held_after: int = 40
    solvable_points: int = 6  #: fewer points end the fit
    #: a longer step means that the fit runs away, longer moves than the second are cut [radii]
    lost_radii: float = 10.0
    most_move_radii: float = 0.5
    settled_m: float = 1e-7  #: a shorter step ends the fit [m]
    determinant: float = 1e-12  #: least determinant of the scaled normal matrix
    #: how well the stated noise is known: standard deviation of the logarithm of the variance of
    #: ranges (0.5 is a quarter of the sigma, what data sheets are good for) and of that across the
    #: surface, which holds footprint, angles and how the instrument takes oblique surfaces
    prior_range: float = 0.5
    prior_across: float = 1.0
    #: root mean square of ellipsoidal departures over the sigma of the radius (method section 6.5)
    form_share: float = 0.5
    noise_rounds: int = 3  #: rounds of fit and noise


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
    """A fitted sphere and how well the points determine it."""

    center: Array  #: (3,), centre in the scanner frame [m]
    covariance: Array  #: (3, 3), its covariance, floor included [m^2]
    formal: Array  #: (3, 3), its covariance without the floor [m^2]
    #: (3, 3), what of it comes from the noise of points, without the tolerance of the radius [m^2]
    random: Array
    by_form: Array  #: (3, 3), what a radius of sigma one and a form of half of that make of it
    #: what is known of neighbours multiplies its variances with; 1 for independent points
    alike: float
    radius: float  #: radius [m]
    sigma_radius: float  #: sigma of the radius, 0 for a given radius [m]
    rms: float  #: root mean square of the residuals along the line of sight [m]
    s0: float  #: standard deviation of unit weight against the stated noise
    #: sigma of a range straight on the surface, and what is added across it times the tangent of
    #: the incidence angle, as estimated from the residuals [m]
    noise: tuple[float, float]
    masked: Mask  #: (n,), points within the mask of incidence
    inliers: Mask  #: (n,), those of them that were not trimmed
    incidence: Array  #: (n,), angles of incidence [rad], NaN beside the sphere
    residuals: Array  #: (n,), residuals [m], NaN beside the sphere
    sentences: tuple[str, ...] = ()  #: what was odd about the fit


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
    tolerance: float = 0.0,
    shared: SharedNoise | None = None,
) -> SphereFit:
    """Fit a sphere along the lines of sight (method section 6.3).

    The start is good to about a third of the radius; the residuals correct both sigmas. ``mask`` is
    the largest angle of incidence [rad]; ``tolerance`` [m] the sigma of a given radius, and
    ellipsoidal departures have half of that as root mean square.
    """
    if not np.linalg.norm(start) > radius > 0:
        raise InputError("the scanner would be inside the sphere")
    stated = float(sigma_range), float(sigma_angle) * float(np.linalg.norm(start))
    points, noise, begin, known = np.ascontiguousarray(xyz), stated, start, radius
    for _ in range(GATES.noise_rounds):
        more = (*noise, stated[1] ** 2 / 2)
        state = _los(points, begin, known, free_radius, more, float(np.cos(mask)))
        unknowns, _, residuals, cosine, _, keep, settled = state
        if not settled or np.isfinite(residuals[keep]).sum() < GATES.fewest_points:
            break
        noise = _noise_of(residuals[keep], cosine[keep], stated, 4 if free_radius else 3)
        begin, known = unknowns[:3], float(unknowns[3])
    return _conclude(
        state,
        floor,
        free_radius,
        noise=noise,
        points=points,
        stated=stated,
        tolerance=tolerance,
        shared=shared,
    )


def noise_doubt(points: int) -> float:
    """Sigma of the logarithm of ``s0^2`` of a fit: of the stated value and its estimate."""
    return float(np.sqrt(GATES.prior_range**2 + 2 / points))


def _noise_of(
    residuals: Array, cosine: Array, stated: tuple[float, float], unknowns: int
) -> tuple[float, float]:
    """Sigmas [m] straight on the surface and across it, from residuals and what is stated.

    Most probable logarithms of the two variances of ``A + B tan^2 psi`` for normal residuals, with
    normal priors around the logarithms of what is stated (Fisher scoring).
    """
    scale = len(residuals) / max(len(residuals) - unknowns, 1)
    square, tangent2 = scale * residuals**2, 1 / cosine**2 - 1
    prior = 2 * np.log(np.maximum(stated, 1e-6))
    weight = np.diag([GATES.prior_range**-2, GATES.prior_across**-2])
    logs = prior.copy()
    for _ in range(20):
        parts = np.exp(logs)[:, None] * np.stack([np.ones_like(tangent2), tangent2])
        variance = parts.sum(axis=0)
        shares = parts / variance
        gradient = 0.5 * shares @ (square / variance - 1) - weight @ (logs - prior)
        step = np.linalg.solve(0.5 * shares @ shares.T + weight, gradient)
        logs = logs + np.clip(step, -1, 1)
        if np.abs(step).max() < 1e-3:
            break
    sigmas = np.exp(logs / 2)
    return float(sigmas[0]), float(sigmas[1])


def fit_sphere_orthogonal(
    xyz: Array,
    start: Array,
    radius: float,
    *,
    sigma: float,
    free_radius: bool = False,
    floor: float = GATES.floor_m,
) -> SphereFit:
    """Fit a sphere by distances from a start within a third of its radius; no scanner is known."""
    state = _orthogonal(np.ascontiguousarray(xyz), start, radius, free_radius, float(sigma))
    sentences = (
        "the origin of the scanner is unknown: distances to the centre were fitted, whose centre "
        "is drawn towards the scanner under range noise",
    )
    return _conclude(state, floor, free_radius, sentences, noise=(sigma, 0.0), points=xyz)


State = tuple[Array, Array, Array, Array, Mask, Mask, bool]


def _conclude(
    state: State,
    floor: float,
    free: bool,
    sentences: tuple[str, ...] = (),
    *,
    noise: tuple[float, float],
    points: Array,
    stated: tuple[float, float] | None = None,
    tolerance: float = 0.0,
    shared: SharedNoise | None = None,
) -> SphereFit:
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
    if stated is None:
        enlarged = max(1.0, s0**2)
    else:
        # the noise is estimated: what that estimate itself is uncertain by
        freedom = count - u + 2 / GATES.prior_range**2
        enlarged = freedom / (freedom - 2)
        tangent2 = 1 / cosine[keep] ** 2 - 1
        s0 = float(
            np.sqrt(np.sum(residuals[keep] ** 2 / (stated[0] ** 2 + stated[1] ** 2 * tangent2)))
            / np.sqrt(count - u)
        )
    cofactor = np.linalg.inv(normal[:u, :u])
    alike = 1.0
    if shared is not None:
        pairs = _of_pairs(points[keep], cosine[keep], unknowns, noise, shared)[:u, :u]
        added = cofactor @ pairs @ cofactor
        alike = 1 + float(np.trace(added[:3, :3]) / np.trace(cofactor[:3, :3]))
        cofactor = cofactor + added
    cofactor = cofactor * enlarged
    random = np.asarray(cofactor[:3, :3], dtype=float)
    by_form = np.zeros((3, 3))
    if stated is not None and not free:
        by_form = _by_form(points[keep], residuals[keep], cosine[keep], unknowns, noise)
    formal = random + by_form * tolerance**2
    sigma_radius = float(np.sqrt(cofactor[3, 3])) if free else 0.0
    with np.errstate(invalid="ignore"):
        incidence = np.arccos(cosine)
    return SphereFit(
        center=unknowns[:3],
        covariance=formal + floor**2 * np.eye(3),
        formal=formal,
        random=random,
        by_form=by_form,
        alike=alike,
        radius=float(unknowns[3]),
        sigma_radius=sigma_radius,
        rms=rms,
        s0=s0,
        noise=noise,
        masked=masked,
        inliers=keep,
        incidence=incidence,
        residuals=residuals,
        sentences=sentences,
    )


def _of_pairs(
    points: Array, cosine: Array, unknowns: Array, noise: tuple[float, float], shared: SharedNoise
) -> Array:
    """What correlated ranges of neighbours add to the normal matrix (4, 4) of centre and radius.

    Neighbours share a part of the noise of the range, not of the places of their echoes across it.
    """
    away = float(np.linalg.norm(unknowns[:3]))
    beams = points / np.linalg.norm(points, axis=1, keepdims=True)
    b = beams @ unknowns[:3]
    root = cosine * unknowns[3]
    design = beams - (b[:, None] * beams - unknowns[:3]) / root[:, None]
    rows = np.column_stack([design, -unknowns[3] / root])
    variance = noise[0] ** 2 + noise[1] ** 2 * (1 / cosine**2 - 1)
    return shared.at(away).summed(beams, rows * (noise[0] / variance)[:, None])


def _by_form(
    points: Array, residuals: Array, cosine: Array, unknowns: Array, noise: tuple[float, float]
) -> Array:
    """Covariance (3, 3) of a centre by a radius of sigma 1 and an ellipsoid of half of that.

    A surface that stands out by f is met earlier by ``f/cos psi``; the fit takes f for a move of
    the centre.
    """
    beams = points / np.linalg.norm(points, axis=1, keepdims=True)
    n = (points - beams * residuals[:, None] - unknowns[:3]) / unknowns[3]
    variance = noise[0] ** 2 + noise[1] ** 2 * (1 / cosine**2 - 1)
    weighted = n / (variance * cosine**2)[:, None]
    share = GATES.form_share / 5**0.5
    forms = np.column_stack([np.ones(len(n)), share * second_degree(n)])
    moves = np.linalg.solve(weighted.T @ n, weighted.T @ forms)
    return np.asarray(moves @ moves.T)


@njit(cache=True, nogil=True)
def _los(
    xyz: Array,
    start: Array,
    radius: float,
    free: bool,
    noise: tuple[float, float, float],
    cos_mask: float,
) -> State:
    """Gauss-Newton along the lines of sight, with trimming.

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
    noise: tuple[float, float, float],
    design: Array,
    residuals: Array,
    sigma: Array,
    cosine: Array,
) -> None:
    """Residual, its sigma and derivatives of every beam; NaN where a beam misses the sphere.

    The beam meets the sphere at ``rho = b - sqrt(R^2 - |c|^2 + b^2)`` with ``b = d . c``; the
    variance of the residual is ``A + B tan^2 psi``. A beam that wanders by s across is met later on
    the average, by ``s^2/(2 R) (1/cos^3 psi + 1/cos psi)``. The noise holds the roots of A and B,
    and ``s^2/2``.
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
        cosine[i] = min(root / x[3], 1.0)
        tangent2 = 1 / cosine[i] ** 2 - 1
        longer = noise[2] / x[3] * (2 + tangent2) / cosine[i]
        residuals[i] = rho - (b - root + longer)
        sigma[i] = np.sqrt(noise[0] ** 2 + noise[1] ** 2 * tangent2)
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
    """Step (4,) of the first ``u`` unknowns by Cholesky; NaN where they are not determined."""
    scale, lower, half = np.zeros(4), np.zeros((4, 4)), np.zeros(4)
    determinant = 1.0
    for a in range(u):
        if not normal[a, a] > 0:
            return np.full(4, np.nan)
        scale[a] = np.sqrt(normal[a, a])
        for b in range(a + 1):
            left = normal[a, b] / (scale[a] * scale[b])
            for k in range(b):
                left -= lower[a, k] * lower[b, k]
            if b < a:
                lower[a, b] = left / lower[b, b]
            elif left > 0:
                lower[a, a] = np.sqrt(left)
                determinant *= left
            else:
                return np.full(4, np.nan)
        half[a] = normal[a, 4] / scale[a]
        for k in range(a):
            half[a] -= lower[a, k] * half[k]
        half[a] /= lower[a, a]
    if not _DETERMINANT < determinant < np.inf:
        return np.full(4, np.nan)
    out = np.zeros(4)
    for a in range(u - 1, -1, -1):
        for k in range(a + 1, u):
            half[a] -= lower[k, a] * out[k] * scale[k]
        out[a] = half[a] / lower[a, a] / scale[a]
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
