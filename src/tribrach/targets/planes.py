"""A whole scan in planes, each with the covariance of its normal and offset (method section 8.3).

Regions are grown in the range image, fitted along the lines of sight, joined where they are one
plane, fitted again and kept if large and flat enough.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from tribrach.scan.range_image import RangeImage
from tribrach.targets.detection import Detection, Rejected
from tribrach.targets.plane_fit import PlaneFits, fit_planes, joint, taken_up
from tribrach.targets.plane_growing import grow_planes
from tribrach.targets.range_noise import estimate_range_noise

__all__ = ["Plane", "find_planes"]

Array = NDArray[np.float64]
Labels = NDArray[np.int32]

#: smallest area [m^2], largest rms in sigmas of the range
AREA, _FLAT = 0.5, 2.5
#: waves of good surfaces [m], added to the noise when flatness is tested
_WAVES = 1e-3
#: a surface is curved if its radius is below this [m] and the bow above this [m] and 4 sigma
_RADIUS, _BOW = 50.0, 5e-4
#: neighbouring points share errors of the surface: one independent point per square of this [m]
_CELL = 0.05
#: sigma of what no fit sees of a surface [m]: waves, paint, the scanner's zero error
FLOOR = 3e-4
#: planes that may be one: angle [rad], offset [m], growth of the variance when joined
_ANGLE, _OFFSET, _GROWTH = float(np.radians(0.3)), 5e-3, 1.5
#: points that the outline is made of, at most
_OUTLINE = 20_000
#: parts that residuals are summed over to see how they hang together, along either side
_PARTS = 8
#: cells that stand for the patch where it is compared with others, about; least width [m]
_CELLS, _WIDTH = 400, 0.1


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane patch: normal . (x - center) = 0.

    normal (3,) : towards the scanner; center (3,) : on the plane, at the centroid [m]; tangents
    (2, 3) : in-plane unit vectors; covariance (3, 3) : of the tilt of the normal along both
    tangents [rad] and of the offset along the normal at the centre [m], floor included; area :
    [m^2] that the scan sees; outline (k, 3) : convex outline [m]; sample (s, 3) : one place on the
    plane for every occupied cell of width ``spacing`` [m]; detection : the same for lists of
    targets.
    """

    normal: Array
    center: Array
    tangents: Array
    covariance: Array
    area: float
    outline: Array
    sample: Array
    spacing: float
    detection: Detection

    def to_dict(self) -> dict[str, Any]:
        """JSON form: that of the detection with normal, tangents, their covariance, outline."""
        return {
            **self.detection.to_dict(),
            "normal": [float(x) for x in self.normal],
            "tangents": [[float(x) for x in t] for t in self.tangents],
            "plane_covariance": [[float(x) for x in row] for row in self.covariance],
            "area": float(self.area),
            "outline": [[float(x) for x in p] for p in self.outline],
        }


def find_planes(
    xyz: Array,
    image: RangeImage,
    *,
    sigma_range: float | None = None,
    sigma_angle: float = 2e-5,
    least_area: float = AREA,
    floor: float = FLOOR,
    scan: str = "",
) -> tuple[list[Plane], list[Rejected]]:
    """Planes among points (n, 3) [m] of the scanner frame, largest first.

    image : of the same points; sigma_range [m] : of one range, from the scan itself if None;
    sigma_angle [rad]; least_area [m^2]; floor [m] : sigma added to the offset, and over the
    patch's radius to the tilt; scan : its name. Regions below half the least area
    are not worth a rejection.
    """
    sigma = estimate_range_noise(image) if sigma_range is None else sigma_range
    noise = (float(sigma), float(sigma_angle))
    labels, count = grow_planes(xyz, image, sigma)
    fits = fit_planes(xyz, image, labels, count, noise, coarse=True)
    group = _groups(fits)
    labels = taken_up(labels, group)
    fits = fit_planes(xyz, image, labels, int(group.max(initial=-1)) + 1, noise)
    planes: list[Plane] = []
    rejected: list[Rejected] = []
    order = np.argsort(-np.nan_to_num(fits.area), kind="stable")
    wanted = [k for k in order if fits.area[k] > 0.5 * least_area and np.isfinite(fits.m[k, 0])]
    members = _members(image, labels, np.array(wanted, dtype=np.int64), len(fits.m))
    for k, member in zip(wanted, members, strict=True):
        points = xyz[member]
        some = points[:: max(1, len(points) // _OUTLINE)]
        reason = _reason(fits, k, sigma, least_area) or _curved(fits.m[k], some)
        if reason:
            rejected.append(Rejected("plane", fits.center[k], reason))
        else:
            planes.append(_plane(fits, k, points, floor, scan))
    return planes, rejected


def _reason(fits: PlaneFits, k: int, sigma: float, least_area: float) -> str:
    """Why a region is not kept; empty if it is."""
    if fits.area[k] < least_area:
        return f"its area of {fits.area[k]:.2f} m2 is below {least_area:g} m2"
    allowed = _FLAT * float(np.hypot(sigma, _WAVES))
    normal_rms = fits.rms[k] * np.cos(fits.incidence[k])
    if normal_rms > allowed:
        return f"its residuals of {1e3 * normal_rms:.1f} mm are above {1e3 * allowed:.1f} mm"
    return ""


def _curved(m: Array, points: Array) -> str:
    """Why points (n, 3) are on a curved surface and not on the plane m; empty if they are not.

    Columns and vaults are flat in narrow strips; a quadric through the distances to the plane
    tells them by its bow.
    """
    size = float(np.linalg.norm(m))
    center = points.mean(axis=0)
    u, v = (points - center) @ _tangents(m / size).T, (points @ m - 1) / size
    flat = np.column_stack([np.ones(len(u)), u])
    bent = np.column_stack([u[:, 0] ** 2, u[:, 0] * u[:, 1], u[:, 1] ** 2])
    q, _ = np.linalg.qr(flat)
    bent = bent - q @ (q.T @ bent)
    rest = v - q @ (q.T @ v)
    quadric, *_ = np.linalg.lstsq(bent, rest, rcond=None)
    bow = bent @ quadric
    sigma = float(np.std(rest - bow)) * np.sqrt(3 / max(len(v), 4))
    matrix = np.array([[2 * quadric[0], quadric[1]], [quadric[1], 2 * quadric[2]]])
    radius = 1 / max(float(np.abs(np.linalg.eigvalsh(matrix)).max()), 1e-9)
    height = float(np.sqrt(np.mean(bow**2)))
    if radius < _RADIUS and height > max(_BOW, 4 * sigma):
        return f"it is curved with a radius of {radius:.2f} m"
    return ""


def _groups(fits: PlaneFits) -> NDArray[np.int64]:
    """Number of the group (k,) of every plane: planes that are one are joined, largest first."""
    normal = fits.m / np.linalg.norm(fits.m, axis=1, keepdims=True)
    offset = 1 / np.linalg.norm(fits.m, axis=1)
    group = np.full(len(normal), -1, dtype=np.int64)
    heads: list[int] = []
    for k in np.argsort(-np.nan_to_num(fits.area), kind="stable"):
        if not np.isfinite(fits.m[k, 0]):
            continue
        near = np.array(heads, dtype=np.int64)
        if len(near):
            turn = np.linalg.norm(np.cross(normal[near], normal[k]), axis=1)
            here = np.abs(normal[near] @ fits.center[k] - offset[near])
            there = np.abs(fits.center[near] @ normal[k] - offset[k])
            same = (turn < _ANGLE) & (np.maximum(here, there) < _OFFSET)
            near = near[same & ((normal[near] @ normal[k]) > 0)]
        for head in near:
            apart, together = joint(fits, int(head), int(k))
            if together < _GROWTH * max(apart, 1.0):
                group[k] = group[head]
                break
        if group[k] < 0:
            group[k] = len(heads)
            heads.append(int(k))
    return group


def _members(
    image: RangeImage, labels: Labels, wanted: NDArray[np.int64], count: int
) -> list[NDArray[np.int32]]:
    """Numbers (n,) of the points of every wanted region."""
    rank = np.full(count + 1, -1, dtype=np.int64)
    rank[wanted] = np.arange(len(wanted))
    flat = rank[labels.ravel()]
    chosen = np.flatnonzero(flat >= 0)
    chosen = chosen[np.argsort(flat[chosen], kind="stable")]
    ends = np.searchsorted(flat[chosen], np.arange(len(wanted) + 1))
    index = image.index.ravel()
    return [index[chosen[a:b]] for a, b in pairwise(ends)]


def _plane(fits: PlaneFits, k: int, points: Array, floor: float, scan: str) -> Plane:
    """The patch of one fitted region with its points (n, 3).

    Looking back at the scanner reverses tilts and offset alike and leaves their covariance.
    """
    size = float(np.linalg.norm(fits.m[k]))
    outward = fits.m[k] / size
    center = fits.center[k] + (1 / size - outward @ fits.center[k]) * outward
    tangents = _tangents(outward)
    # m + dm: the normal tilts by its tangential part, the plane at the centre moves by -dm . c
    rows = np.vstack([tangents, -center]) / size
    flat, away = (points - center) @ tangents.T, (points - center) @ outward
    shared = max(fits.points[k] * _CELL**2 / fits.area[k], _correlation(flat, away))
    independent = max(fits.points[k] / shared, 4.0)
    enlarged = max(1.0, fits.s0[k] ** 2) * fits.points[k] / independent
    covariance = rows @ np.linalg.inv(fits.normal[k]) @ rows.T * enlarged
    spread = floor / np.sqrt(fits.area[k] / np.pi)
    covariance = covariance + np.diag([spread, spread, floor]) ** 2
    hull = ConvexHull(flat[:: max(1, len(flat) // _OUTLINE)])
    outline = center + hull.points[hull.vertices] @ tangents
    spacing = max(float(np.sqrt(fits.area[k] / _CELLS)), _WIDTH)
    low = np.floor(flat.min(axis=0) / spacing)
    cells = np.floor(flat / spacing).astype(np.int64) - low.astype(np.int64)
    taken = np.zeros(cells.max(axis=0) + 1, dtype=bool)
    taken[cells[:, 0], cells[:, 1]] = True
    sample = center + spacing * (np.argwhere(taken) + low + 0.5) @ tangents
    facts = {"effective_points": float(independent)}
    detection = _detection(fits, k, center, outward, covariance[2, 2], hull, facts, scan)
    area = float(fits.area[k])
    return Plane(-outward, center, tangents, covariance, area, outline, sample, spacing, detection)


def _correlation(flat: Array, away: Array) -> float:
    """How many points count as one, at least 1: places (n, 2) and residuals (n,) [m].

    Sums of the residuals' pulls on the plane over parts of the patch vary as the sums of so many
    points do if the points are independent, and more if waves of the surface or the scanner's
    errors run through neighbours (the sandwich estimator of White 1980, in clusters).
    """
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    part = np.minimum((flat - low) / np.maximum(size, 1e-9) * _PARTS, _PARTS - 1).astype(np.int64)
    number = part[:, 0] * _PARTS + part[:, 1]
    middle = flat.mean(axis=0)
    pull = np.column_stack([np.ones(len(flat)), flat - middle])
    plane = np.linalg.lstsq(pull.T @ pull, pull.T @ away, rcond=None)[0]
    pull *= (away - pull @ plane)[:, None]
    used = np.bincount(number, minlength=_PARTS**2) > 0
    sums = np.stack([np.bincount(number, c, minlength=_PARTS**2) for c in pull.T], axis=1)[used]
    alone = pull.T @ pull
    if len(sums) < 8 or np.linalg.cond(alone) > 1e15:
        return 1.0
    together = sums.T @ sums * len(sums) / (len(sums) - 3)
    return max(1.0, float(np.trace(np.linalg.solve(alone, together))) / 3)


def _tangents(normal: Array) -> Array:
    """Two unit vectors (2, 3) across a normal, the first one horizontal where it can be."""
    across = np.cross([0.0, 0.0, 1.0], normal)
    if np.linalg.norm(across) < 1e-3:
        across = np.cross([0.0, 1.0, 0.0], normal)
    across = across / np.linalg.norm(across)
    return np.stack([across, np.cross(normal, across)])


def _detection(
    fits: PlaneFits,
    k: int,
    center: Array,
    normal: Array,
    variance: float,
    hull: ConvexHull,
    facts: dict[str, float],
    scan: str,
) -> Detection:
    """The patch as a target; along the surface its centre is only known to the patch's size."""
    radius = float(np.sqrt(fits.area[k] / np.pi))
    across = np.outer(normal, normal)
    covariance = variance * across + (0.5 * radius) ** 2 * (np.eye(3) - across)
    return Detection(
        "plane",
        scan,
        center,
        covariance,
        radius,
        float(fits.rms[k]),
        int(fits.points[k]),
        int(fits.points[k]),
        float(np.linalg.norm(center)),
        float(fits.incidence[k]),
        float(min(fits.area[k] / max(hull.volume, 1e-12), 1.0)),
        {"s0": float(fits.s0[k]), "area_m2": float(fits.area[k]), **facts},
    )
