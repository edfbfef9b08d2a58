"""Spheres in clouds that do not know where their scanner stood: merged, cleaned, exported.

Without lines of sight there is no range image: normals come from neighbours in space, both sides
of the surface vote for a centre, and distances to the centre are fitted. Such centres are drawn
towards the scanner under range noise (method section 6.3), which every detection says.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pykdtree.kdtree import KDTree

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.targets.detection import Detection, Rejected
from tribrach.targets.spheres.fit import FEWEST, SphereFit, fit_sphere_orthogonal
from tribrach.targets.spheres.votes import apart, gather

__all__ = ["find_spheres_in_cloud"]


#: one point per voxel of this many radii votes, its normal from this many neighbours
_THIN, _NEIGHBOURS = 0.125, 12


#: share of the votes of a half sphere that makes a candidate, and candidates at most
_SHARE, _CANDIDATES = 0.12, 300


#: residuals over noise, points inside the sphere, directions that must be seen, free radius
_FIT, _INSIDE, _COVER, _RADIUS = 2.5, 0.15, 0.2, 0.08


#: form of good spheres [m]
_FORM = 3e-4


def find_spheres_in_cloud(
    xyz: Array, radii: Sequence[float], *, sigma: float | None = None, scan: str = ""
) -> tuple[list[Detection], list[Rejected]]:
    """Spheres of the given radii [m] among points (n, 3) [m] whose scanner is unknown.

    sigma : of one point along the normal [m], from the neighbours of each point if None.

    Raises
    ------
    InputError : a radius that is not positive, or fewer than 30 finite points.
    """
    if not all(r > 0 for r in radii):
        raise InputError("the radius of a sphere must be positive")
    points = xyz[np.isfinite(xyz).all(axis=1)]
    if len(points) < FEWEST:
        raise InputError(f"the cloud has {len(points)} finite points, {FEWEST} are needed")
    found: list[Detection] = []
    rejected: list[Rejected] = []
    for radius in radii:
        thin = _thinned(points, _THIN * radius)
        normal, thickness = _normals(thin)
        noise = float(np.median(thickness)) if sigma is None else sigma
        for start in _candidates(thin, normal, radius):
            if any(np.linalg.norm(d.center - start) < d.radius for d in found):
                continue
            result = _judged(points, start, radius, noise, scan)
            if isinstance(result, Detection):
                found.append(result)
            else:
                rejected.append(result)
    return found, rejected


def _thinned(points: Array, cell: float) -> Array:
    """One point (m, 3) per voxel."""
    keys = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    size = keys.max(axis=0) + 1
    _, first = np.unique((keys[:, 0] * size[1] + keys[:, 1]) * size[2] + keys[:, 2], True)
    return np.asarray(points[first])


def _normals(points: Array) -> tuple[Array, Array]:
    """Normals (m, 3) of either sign and thickness (m,) [m] of the neighbourhoods of points."""
    count = min(_NEIGHBOURS, len(points))
    _, near = KDTree(points).query(points, k=count)
    normal, thickness = np.empty_like(points), np.empty(len(points))
    for a in range(0, len(points), 200_000):  # bounds the memory of the neighbours
        part = points[near[a : a + 200_000]]
        part = part - part.mean(axis=1, keepdims=True)
        values, vectors = np.linalg.eigh(np.einsum("nka,nkb->nab", part, part))
        normal[a : a + 200_000] = vectors[:, :, 0]
        freedom = max(count - 3, 1)
        thickness[a : a + 200_000] = np.sqrt(np.maximum(values[:, 0], 0) / freedom)
    return normal, thickness


def _candidates(points: Array, normal: Array, radius: float) -> Array:
    """Centres (k, 3) with many votes, most votes first."""
    votes = np.concatenate([points + radius * normal, points - radius * normal])
    peaks, counts = gather(votes, radius)
    wanted = _SHARE * 2 * np.pi / _THIN**2
    enough = np.flatnonzero(counts >= wanted)
    order = enough[np.argsort(-counts[enough], kind="stable")]
    return np.asarray(apart(peaks[order[: 4 * _CANDIDATES]], 0.5 * radius)[:_CANDIDATES])


def _judged(
    points: Array, start: Array, radius: float, sigma: float, scan: str
) -> Detection | Rejected:
    """The sphere at a candidate, or why it is none."""
    box = (np.abs(points - start) < 1.5 * radius).all(axis=1)
    around = points[box]
    try:
        fit = fit_sphere_orthogonal(around, start, radius, sigma=sigma)
        on = around[fit.inliers]
        free = fit_sphere_orthogonal(on, fit.center, radius, sigma=sigma, free_radius=True)
    except InputError as error:
        return Rejected("sphere", start, str(error).rstrip("."))
    away = np.linalg.norm(around - fit.center, axis=1)
    inside = float(np.sum(away < radius - 3 * max(fit.rms, sigma)) / max(len(on), 1))
    cover = _cover((on - fit.center) / radius, len(on))
    reason = _reason(fit, free, inside, cover, sigma)
    if reason:
        return Rejected("sphere", fit.center, reason)
    return Detection(
        "sphere",
        scan,
        fit.center,
        fit.covariance,
        radius,
        fit.rms,
        len(around),
        len(on),
        float("nan"),
        float("nan"),
        cover,
        {"s0": fit.s0, "free_radius_m": free.radius},
        fit.sentences,
    )


def _cover(directions: Array, count: int) -> float:
    """Share of the directions around the centre that points (n, 3) see, in about equal cells."""
    rings = int(np.clip(np.sqrt(count / 16), 3, 12))
    z = np.clip((directions[:, 2] + 1) / 2 * rings, 0, rings - 1).astype(np.int64)
    turn = np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi) % 1.0
    cells = z * 2 * rings + (turn * 2 * rings).astype(np.int64) % (2 * rings)
    return len(np.unique(cells)) / (2 * rings**2)


def _reason(fit: SphereFit, free: SphereFit, inside: float, cover: float, sigma: float) -> str:
    """Why a fit is no sphere; empty if it is one."""
    if fit.rms > _FIT * np.hypot(sigma, _FORM):
        return f"residuals of {1e3 * fit.rms:.1f} mm are above the noise of {1e3 * sigma:.1f} mm"
    if inside > _INSIDE:
        return f"{100 * inside:.0f} % as many points lie inside the sphere as on it"
    if cover < _COVER:
        return f"only {100 * cover:.0f} % of its surface is seen"
    if abs(free.radius - fit.radius) > max(_RADIUS * fit.radius, 4 * free.sigma_radius):
        return f"its own radius is {1e3 * free.radius:.1f} mm, not {1e3 * fit.radius:.1f} mm"
    return ""
