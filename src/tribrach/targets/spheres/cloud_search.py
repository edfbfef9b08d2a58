"""Finds spheres in clouds whose scanner is unknown: merged, cleaned or exported ones.

Without lines of sight there is no range image: normals come from neighbours in space, both sides of
the surface vote for a centre, and distances to the centre are fitted. Such centres are pulled
towards the scanner under range noise (method section 6.3), which every detection says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pykdtree.kdtree import KDTree

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.sentences import Sentence
from tribrach.targets.detection import Detection, Rejected, lies_on
from tribrach.targets.spheres.fit import GATES as FIT
from tribrach.targets.spheres.fit import SphereFit, fit_sphere_orthogonal
from tribrach.targets.spheres.votes import apart, gather


@dataclass(frozen=True)
class CloudSphereGates:
    """Which fits are spheres in a cloud without lines of sight (by hand: test_sphere_cloud)."""

    voxel_radii: float = 0.125  #: one point per voxel of this many radii votes
    neighbours: int = 12  #: a normal comes from this many neighbours
    votes_share: float = 0.12  #: share of the votes of a half sphere that makes a candidate
    #: candidates at most, nearer to each other than this they are one [radii]
    most_candidates: int = 300
    apart_radii: float = 0.5
    #: points looked at lie within this many radii of the candidate, along every axis
    reach_radii: float = 1.5
    form_m: float = 3e-4  #: form of good spheres [m], added to the noise in tests
    fit_ratio: float = 2.5  #: largest ratio of residuals to noise
    inside_sigmas: float = 3.0  #: points lie inside the sphere if they do by this many sigmas
    inside_share: float = 0.15  #: largest number of points inside the sphere over those on it
    cover_share: float = 0.2  #: least share of the directions around the centre that is seen
    #: directions are counted in cells of about so many points, in rings within these bounds
    cover_points: int = 16
    cover_rings: tuple[int, int] = (3, 12)
    #: sigma added to centres [m]: range noise draws them towards a scanner that is not known
    floor_m: float = 3e-4
    #: a free radius may differ by this share of the radius or by so many sigmas
    radius_share: float = 0.08
    radius_sigmas: float = 4.0


GATES = CloudSphereGates()


def find_spheres_in_cloud(
    xyz: Array, radii: Sequence[float], *, scan: str = ""
) -> tuple[list[Detection], list[Rejected]]:
    """Find spheres of given radii [m] in a cloud whose scanner is unknown."""
    if not all(r > 0 for r in radii):
        raise InputError("the radius of a sphere must be positive")
    points = xyz[np.isfinite(xyz).all(axis=1)]
    if len(points) < FIT.fewest_points:
        raise InputError(
            f"the cloud has {len(points)} finite points, {FIT.fewest_points} are needed"
        )
    spheres: list[Detection] = []
    rejected: list[Rejected] = []
    for radius in radii:
        thin = _thinned(points, GATES.voxel_radii * radius)
        normal, thickness = _normals(thin)
        noise = float(np.median(thickness))
        for start in _candidates(thin, normal, radius):
            if lies_on(start, spheres):
                continue
            result = _judged(points, start, radius, noise, scan)
            if isinstance(result, Detection):
                spheres.append(result)
            else:
                rejected.append(result)
    return spheres, rejected


def _thinned(points: Array, cell: float) -> Array:
    """One point (m, 3) per voxel."""
    keys = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    size = keys.max(axis=0) + 1
    _, first = np.unique((keys[:, 0] * size[1] + keys[:, 1]) * size[2] + keys[:, 2], True)
    return np.asarray(points[first])


def _normals(points: Array) -> tuple[Array, Array]:
    """Normals (m, 3) of either sign and thickness (m,) [m] of the neighbourhoods of points."""
    count = min(GATES.neighbours, len(points))
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
    least_votes = GATES.votes_share * 2 * np.pi / GATES.voxel_radii**2
    enough = np.flatnonzero(counts >= least_votes)
    order = enough[np.argsort(-counts[enough], kind="stable")]
    return np.asarray(
        apart(peaks[order[: 4 * GATES.most_candidates]], GATES.apart_radii * radius)[
            : GATES.most_candidates
        ]
    )


def _judged(
    points: Array, start: Array, radius: float, sigma: float, scan: str
) -> Detection | Rejected:
    """The sphere at a candidate, or why it is none."""
    box = (np.abs(points - start) < GATES.reach_radii * radius).all(axis=1)
    around = points[box]
    try:
        fit = fit_sphere_orthogonal(around, start, radius, sigma=sigma, floor=GATES.floor_m)
        on = around[fit.inliers]
        free = fit_sphere_orthogonal(on, fit.center, radius, sigma=sigma, free_radius=True)
    except InputError as error:
        return Rejected("sphere", start, str(error).rstrip("."))
    away = np.linalg.norm(around - fit.center, axis=1)
    inside = float(
        np.sum(away < radius - GATES.inside_sigmas * max(fit.rms, sigma)) / max(len(on), 1)
    )
    cover = _cover((on - fit.center) / radius, len(on))
    reason = _reason(fit, free, inside, cover, sigma)
    if reason:
        return Rejected("sphere", fit.center, reason)
    return Detection(
        kind="sphere",
        scan=scan,
        center=fit.center,
        covariance=fit.covariance,
        radius=radius,
        rms=fit.rms,
        points=len(around),
        inliers=len(on),
        range=float("nan"),
        incidence=float("nan"),
        coverage=cover,
        facts={"s0": fit.s0, "free_radius_m": free.radius},
        sentences=fit.sentences,
    )


def _cover(directions: Array, count: int) -> float:
    """Share of the directions around the centre that points (n, 3) see, in about equal cells."""
    rings = int(np.clip(np.sqrt(count / GATES.cover_points), *GATES.cover_rings))
    z = np.clip((directions[:, 2] + 1) / 2 * rings, 0, rings - 1).astype(np.int64)
    turn = np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi) % 1.0
    cells = z * 2 * rings + (turn * 2 * rings).astype(np.int64) % (2 * rings)
    return len(np.unique(cells)) / (2 * rings**2)


def _reason(fit: SphereFit, free: SphereFit, inside: float, cover: float, sigma: float) -> str:
    """Reason why a fit is not a sphere; empty if it is one."""
    most = GATES.fit_ratio * np.hypot(sigma, GATES.form_m)
    if fit.rms > most:
        return Sentence(
            "residuals of {fit.rms:mm1} (root mean square) are above the limit {most:mm1}, "
            "with a noise of {sigma:mm1}",
            fit=fit,
            most=most,
            sigma=sigma,
        )
    if inside > GATES.inside_share:
        return Sentence("{inside:%0} as many points lie inside the sphere as on it", inside=inside)
    if cover < GATES.cover_share:
        return Sentence("only {cover:%0} of its surface is seen", cover=cover)
    if abs(free.radius - fit.radius) > max(
        GATES.radius_share * fit.radius, GATES.radius_sigmas * free.sigma_radius
    ):
        return Sentence(
            "its own radius is {free.radius:mm1}, not {fit.radius:mm1}", free=free, fit=fit
        )
    return ""
