"""Finds the spheres of known radii in a scan and lists the refused ones (method section 6.4).

Candidates come from free-standing components of the range image and from votes of the surface. Each
is fitted along the lines of sight and tested: fit, share of inliers, radius when it is left free,
form, and coverage of the pixels that should see it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.scan.range_image import RangeImage
from tribrach.targets.detection import Detection, Rejected, lies_on
from tribrach.targets.range_noise import estimate_range_noise
from tribrach.targets.spheres.fit import GATES as FIT
from tribrach.targets.spheres.fit import SphereFit, fit_sphere
from tribrach.targets.spheres.votes import vote_for_centers

__all__ = ["find_spheres"]


@dataclass(frozen=True)
class SphereGates:
    """Which parts of a scan are candidates for spheres, and which tests a fit must pass.

    Notes
    -----
    Chosen by hand on simulated halls with balls of other sizes, columns, leaves and machinery, and
    on the raw files of NIST, so that all spheres pass and nothing else (method section 6.4,
    tests/targets/test_sphere_search, benchmarks/target_search); where a number has a source, it is
    named.
    """

    #: runs of pixels are kept whose width is within these multiples of the diameter
    run_diameters: tuple[float, float] = (0.25, 1.6)
    #: fewest pixels of a run, and runs of a component
    fewest_in_run: int = 3
    fewest_runs: int = 3
    #: widths and heights of spheres, as multiples of the diameter
    width_diameters: tuple[float, float] = (0.5, 1.25)
    height_diameters: tuple[float, float] = (0.5, 1.6)
    #: things within these multiples of the diameter are reported when they are no sphere
    reported_diameters: tuple[float, float] = (0.33, 2.0)
    #: holes up to this many pixels are filled
    filled_px: int = 2
    #: jump of range [m] that parts a thing from its background, at most this and at most R
    jump_m: float = 0.05

    #: the window follows the centre in so many rounds, until it moves less than this [radii];
    #: a fit that moves farther than the other runs away
    window_rounds: int = 3
    window_settled_radii: float = 0.05
    lost_radii: float = 4.0
    #: no window is wider than this [rad]
    widest_rad: float = 0.6

    #: form errors of good spheres [m], added to the noise in tests
    form_m: float = 3e-4
    #: largest ratio of residuals to noise
    fit_ratio: float = 2.5
    #: points are behind the outline if they lie no farther in front of the surface [sigmas]
    front_sigmas: float = 3.0
    #: least share of the points behind the outline that lies on the sphere
    inlier_share: float = 0.7
    #: least share of the pixels that should see the sphere and do
    cover_share: float = 0.4
    #: a free radius may differ by the less of these [m, radii], or by so many sigmas ...
    free_radius_m: float = 6e-3
    free_radius_share: float = 0.08
    allowed_sigmas: float = 4.0
    #: ... the form by this share of the radius or as many sigmas ...
    form_share: float = 0.03
    #: ... but never by more than these shares of the radius, noise or not
    most_radius_share: float = 0.1
    most_form_share: float = 0.05
    most_rms_share: float = 0.1
    #: directions of form that are weaker than this share of the strongest are left out
    form_singular_share: float = 1e-3
    #: things of another size that are listed at most, those most like a sphere first
    most_listed: int = 50


GATES = SphereGates()

# compiled code reads constants of the module, not attributes of an object
_RUN_DIAMETERS = GATES.run_diameters
_FEWEST_IN_RUN = GATES.fewest_in_run


@dataclass(frozen=True, eq=False)
class SphereSizedParts:
    """Free-standing components of about the sphere's size.

    Attributes
    ----------
    center : array (n, 3)
        Presumed centres, the radius behind the nearest points along the mean direction [m].
    width, height : array (n,)
        Sizes in multiples of the diameter.
    fits : array of bool (n,)
        True where width and height are those of the sphere.
    """

    center: Array
    width: Array
    height: Array
    fits: NDArray[np.bool_]


def find_components(image: RangeImage, radius: float) -> SphereSizedParts:
    """Find the components of a range image that are about as large as a sphere.

    Parameters
    ----------
    image : RangeImage
        The range image.
    radius : float
        Radius of the sphere [m].

    Returns
    -------
    SphereSizedParts
        Components that may be the sphere, and those nearly of its size.

    Notes
    -----
    Rows are cut at jumps of range into runs. A run much narrower than the sphere (its pole or rod)
    or much wider (walls) is dropped; the others are joined with those above them into components,
    whose width and height must be those of the sphere.
    """
    ranges = image.filled(GATES.filled_px)
    frame = (image.first_h, image.first_v, image.step_h, image.step_v)
    runs = _runs(ranges, frame, radius, min(GATES.jump_m, radius))
    label = _joined(runs, ranges.shape[0], ranges.shape[1], image.wraps, min(GATES.jump_m, radius))
    boxes = _boxes(runs, label, frame, ranges.shape[1], radius)
    width, height = boxes[:, 3], boxes[:, 4]
    low, high = GATES.reported_diameters
    near = (width > low) & (width < high) & (height > low) & (height < high)
    near &= boxes[:, 5] >= GATES.fewest_runs
    boxes, width, height = boxes[near], width[near], height[near]
    fits = (width > GATES.width_diameters[0]) & (width < GATES.width_diameters[1])
    fits &= (height > GATES.height_diameters[0]) & (height < GATES.height_diameters[1])
    return SphereSizedParts(boxes[:, :3], width, height, fits)


@njit(cache=True, nogil=True)
def _runs(
    ranges: NDArray[np.float32],
    frame: tuple[float, float, float, float],
    radius: float,
    jump: float,
) -> Array:
    """Runs (n, 6) of the rows: row, first and last column, mean and least range, width [m]."""
    rows, columns = ranges.shape
    _, v0, step_h, step_v = frame
    count = 0
    out = np.empty((1024, 6))
    for i in range(rows):
        pitch = step_h * abs(np.sin(v0 + i * step_v))
        start = 0
        total, least = 0.0, np.inf
        for j in range(columns + 1):
            here = ranges[i, j] if j < columns else np.float32(np.nan)
            if j > start and not abs(here - ranges[i, j - 1]) < jump:
                n = j - start
                mean = total / n
                width = n * pitch * mean
                low, high = _RUN_DIAMETERS
                if 2 * low * radius < width < 2 * high * radius and n >= _FEWEST_IN_RUN:
                    if count == len(out):
                        grown = np.empty((2 * count, 6))
                        grown[:count] = out
                        out = grown
                    out[count] = np.array([i, start, j - 1, mean, least, width])
                    count += 1
                start, total, least = j, 0.0, np.inf
            if np.isnan(here):
                start = j + 1
                total, least = 0.0, np.inf
            else:
                total += float(here)
                least = min(least, float(here))
    return out[:count]


@njit(cache=True, nogil=True)
def _root(parent: Index, k: int) -> int:
    """Representative of a set, its path shortened."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@njit(cache=True, nogil=True)
def _joined(runs: Array, rows: int, columns: int, wraps: bool, jump: float) -> Index:
    """Number of the component (n,) of every run: overlapping runs of neighbouring rows."""
    n = len(runs)
    parent = np.arange(n)
    first = np.full(rows + 1, n, dtype=np.int64)
    for k in range(n - 1, -1, -1):
        first[int(runs[k, 0])] = k
    for i in range(rows - 1, -1, -1):
        first[i] = min(first[i], first[i + 1])
    for i in range(1, rows):
        a = first[i - 1]
        for b in range(first[i], first[i + 1]):
            while a < first[i] and runs[a, 2] < runs[b, 1]:
                a += 1
            k = a
            while k < first[i] and runs[k, 1] <= runs[b, 2]:
                if abs(runs[k, 3] - runs[b, 3]) < jump:
                    parent[_root(parent, b)] = _root(parent, k)
                k += 1
    if wraps:
        for i in range(rows):
            a, b = first[i], first[i + 1] - 1
            ends = a < b and runs[a, 1] == 0 and runs[b, 2] == columns - 1
            if ends and abs(runs[a, 3] - runs[b, 3]) < jump:
                parent[_root(parent, b)] = _root(parent, a)
    for k in range(n):
        parent[k] = _root(parent, k)
    return parent


@njit(cache=True, nogil=True)
def _boxes(
    runs: Array,
    label: Index,
    frame: tuple[float, float, float, float],
    columns: int,
    radius: float,
) -> Array:
    """Centre, width and height in diameters, number of runs (k, 6) of every component."""
    h0, v0, step_h, step_v = frame
    n = len(runs)
    out = np.zeros((n, 6))
    low, high = np.full(n, np.inf), np.full(n, -np.inf)
    least, weight = np.full(n, np.inf), np.zeros(n)
    anchor = np.full(n, -1.0)
    for k in range(n):
        c = label[k]
        i = runs[k, 0]
        length = runs[k, 2] - runs[k, 1] + 1
        middle = 0.5 * (runs[k, 1] + runs[k, 2])
        if anchor[c] < 0:
            anchor[c] = middle
        middle -= columns * np.round((middle - anchor[c]) / columns)
        out[c, 0] += length * middle
        out[c, 1] += length * i
        weight[c] += length
        out[c, 3] = max(out[c, 3], runs[k, 5])
        out[c, 5] += 1
        low[c], high[c] = min(low[c], i), max(high[c], i)
        least[c] = min(least[c], runs[k, 4])
    count = 0
    for c in range(n):
        if weight[c] == 0:
            continue
        h = h0 + step_h * out[c, 0] / weight[c]
        v = v0 + step_v * out[c, 1] / weight[c]
        away = least[c] + radius
        out[count, 4] = (high[c] - low[c] + 1) * step_v * away / (2 * radius)
        out[count, 3] = out[c, 3] / (2 * radius)
        out[count, 5] = out[c, 5]
        out[count, 0] = away * np.sin(v) * np.cos(h)
        out[count, 1] = away * np.sin(v) * np.sin(h)
        out[count, 2] = away * np.cos(v)
        count += 1
    return out[:count]


@dataclass(frozen=True)
class _Noise:
    """Sigmas of one point: range [m] and angle [rad]; floor of a centre [m]."""

    range: float
    angle: float
    floor: float = FIT.floor_m


def find_spheres(
    xyz: Array,
    image: RangeImage,
    radii: Sequence[float],
    *,
    sigma_range: float | None = None,
    sigma_angle: float = 2e-5,
    floor: float = FIT.floor_m,
    scan: str = "",
) -> tuple[list[Detection], list[Rejected]]:
    """Find spheres of given radii in a scan.

    Parameters
    ----------
    xyz : array (n, 3)
        Points in the scanner frame [m].
    image : RangeImage
        Range image of the same points.
    radii : sequence of float
        Radii of the spheres [m].
    sigma_range : float or None
        Sigma of one range, estimated from the scan if None [m].
    sigma_angle : float
        Sigma of the angles of one point [rad].
    floor : float
        Sigma added to each coordinate of a centre [m].
    scan : str
        Name of the scan.

    Returns
    -------
    detections : list of Detection
        Spheres. A place that fits several radii becomes one sphere, of the radius that fits best.
    rejections : list of Rejected
        Candidates that are no spheres, with reasons.

    Raises
    ------
    InputError
        If a radius is not positive.
    """
    if not all(r > 0 for r in radii):
        raise InputError("the radius of a sphere must be positive")
    sigma = estimate_range_noise(image) if sigma_range is None else sigma_range
    noise = _Noise(sigma, sigma_angle, floor)
    spheres: list[Detection] = []
    rejected: list[Rejected] = []
    for radius in radii:
        good, bad = _of_radius(xyz, image, radius, noise, scan)
        spheres += good
        rejected += bad
    spheres, beaten = _best_radius(spheres)
    rejected = [r for r in rejected if not lies_on(r.center, spheres)]
    return spheres, rejected + beaten


def _of_radius(
    xyz: Array, image: RangeImage, radius: float, noise: _Noise, scan: str
) -> tuple[list[Detection], list[Rejected]]:
    """Spheres of one radius."""
    parts = find_components(image, radius)
    voted = vote_for_centers(xyz, image, radius, noise.range)
    spheres: list[Detection] = []
    rejected: list[Rejected] = []
    for start in [*parts.center[parts.fits], *voted]:
        if lies_on(start, spheres):
            continue
        result = _judged(xyz, image, start, radius, noise, scan)
        if isinstance(result, Detection):
            if not lies_on(result.center, spheres):
                spheres.append(result)
        elif not any(np.linalg.norm(r.center - result.center) < radius for r in rejected):
            rejected.append(result)
    unlike = np.abs(np.log(parts.width)) + np.abs(np.log(parts.height))
    for k in [k for k in np.argsort(unlike, kind="stable") if not parts.fits[k]][
        : GATES.most_listed
    ]:
        w, h = 2e3 * radius * parts.width[k], 2e3 * radius * parts.height[k]
        size = f"{w:.0f} mm wide and {h:.0f} mm high is not the size of a sphere"
        reason = f"{size} of {2e3 * radius:.0f} mm"
        if not any(np.linalg.norm(r.center - parts.center[k]) < radius for r in rejected):
            rejected.append(Rejected("sphere", parts.center[k], reason))
    return spheres, [r for r in rejected if not lies_on(r.center, spheres)]


def _judged(
    xyz: Array, image: RangeImage, start: Array, radius: float, noise: _Noise, scan: str
) -> Detection | Rejected:
    """The sphere at a candidate, or why it is none."""
    center = np.asarray(start, dtype=float)
    fit: SphereFit | None = None
    for _ in range(GATES.window_rounds):  # the window follows the centre
        window = _window(image, center, radius)
        points = xyz[window]
        if len(points) < FIT.fewest_points:
            return Rejected(
                "sphere", center, f"only {len(points)} points, {FIT.fewest_points} are needed"
            )
        try:
            fit = _fitted(points, center, radius, noise)
        except InputError as error:
            return Rejected("sphere", center, str(error).rstrip("."))
        moved = float(np.linalg.norm(fit.center - center))
        if moved > GATES.lost_radii * radius:
            return Rejected("sphere", center, "the fit runs away from the candidate")
        center = fit.center
        if moved < GATES.window_settled_radii * radius:
            break
    assert fit is not None
    return _tested(points, fit, image, noise, scan)


def _fitted(
    points: Array, start: Array, radius: float, noise: _Noise, free: bool = False
) -> SphereFit:
    """The fit along the lines of sight."""
    return fit_sphere(
        points,
        start,
        radius,
        sigma_range=noise.range,
        sigma_angle=noise.angle,
        floor=noise.floor,
        free_radius=free,
    )


def _window(
    image: RangeImage, center: Array, radius: float, share: float = 1.0
) -> NDArray[np.int32]:
    """Points (k,) of pixels within ``share`` of the sphere's angular radius."""
    return np.asarray(_cone(image, center, radius, share)[0])


def _cone(
    image: RangeImage, center: Array, radius: float, share: float
) -> tuple[NDArray[np.int32], int]:
    """Points of the pixels that look at the sphere, and the number of these pixels."""
    away = float(np.linalg.norm(center))
    angle = min(float(np.arcsin(min(share * radius / away, 1.0))), GATES.widest_rad)
    h, v = np.arctan2(center[1], center[0]), np.arctan2(np.hypot(center[0], center[1]), center[2])
    row, column = image.pixel(float(h), float(v))
    sine = max(float(np.sin(v)), np.sin(angle), 1e-3)
    half_v, half_h = int(angle / image.step_v) + 2, int(angle / (image.step_h * sine)) + 2
    rows = np.arange(max(0, int(row) - half_v), min(image.shape[0], int(row) + half_v + 2))
    columns = np.arange(int(column) - half_h, int(column) + half_h + 2)
    period = round(2 * np.pi / image.step_h)
    columns = columns % (image.shape[1] if image.wraps else period)
    columns = np.unique(columns[columns < image.shape[1]])
    turn, v_of = image.h(columns), image.v(rows)
    cosine = np.cos(v) * np.cos(v_of)[:, None]
    cosine = cosine + np.sin(v) * np.sin(v_of)[:, None] * np.cos(turn - h)[None, :]
    inside = cosine > np.cos(angle)
    index = image.index[np.ix_(rows, columns)] if len(rows) and len(columns) else np.empty((0, 0))
    chosen = index[inside]
    return np.asarray(chosen[chosen >= 0], dtype=np.int32), int(inside.sum())


def _tested(
    points: Array, fit: SphereFit, image: RangeImage, noise: _Noise, scan: str
) -> Detection | Rejected:
    """Acceptance of a fitted sphere."""
    sigma = np.hypot(noise.range, GATES.form_m)
    on = fit.inliers
    behind = fit.masked & (on | (fit.residuals > -GATES.front_sigmas * _spread(fit, noise)))
    inliers = float(on.sum() / max(behind.sum(), 1))
    pixels = _cone(image, fit.center, fit.radius, float(np.sin(FIT.mask_rad)))[1]
    cover = float(min(on.sum() / max(pixels, 1), 1.0))
    variance = sigma**2 + (noise.angle * np.linalg.norm(points[on], axis=1)) ** 2 * (
        np.tan(fit.incidence[on]) ** 2
    )
    ratio = float(np.sqrt(np.mean(fit.residuals[on] ** 2 / variance)))
    reason = _first_reason(ratio, inliers, cover, fit, noise)
    free, form = fit.radius, 0.0
    if not reason:
        reason, free, form = _form_reason(points, fit, noise)
    if reason:
        return Rejected("sphere", fit.center, reason)
    facts = {"s0": fit.s0, "free_radius_m": free, "form_m": form, "inlier_share": inliers}
    return Detection(
        kind="sphere",
        scan=scan,
        center=fit.center,
        covariance=fit.covariance,
        radius=fit.radius,
        rms=fit.rms,
        points=len(points),
        inliers=int(on.sum()),
        range=float(np.linalg.norm(fit.center)),
        incidence=float(np.mean(fit.incidence[on])),
        coverage=cover,
        facts=facts,
        sentences=fit.sentences,
    )


def _spread(fit: SphereFit, noise: _Noise) -> float:
    """Standard deviation of residuals that tells points in front of the sphere [m]."""
    return float(max(fit.rms, noise.range, GATES.form_m))


def _first_reason(ratio: float, inliers: float, cover: float, fit: SphereFit, noise: _Noise) -> str:
    """Why the fit itself speaks against a sphere; empty if it does not."""
    if ratio > GATES.fit_ratio:
        return (
            f"residuals of {1e3 * fit.rms:.1f} mm are {ratio:.1f} times the noise of "
            f"{1e3 * noise.range:.1f} mm"
        )
    if fit.rms > GATES.most_rms_share * fit.radius:
        share = 100 * fit.rms / fit.radius
        return f"residuals of {1e3 * fit.rms:.1f} mm are {share:.0f} % of the radius"
    if inliers < GATES.inlier_share:
        return f"only {100 * inliers:.0f} % of the points behind its outline lie on the sphere"
    if cover < GATES.cover_share:
        return f"only {100 * cover:.0f} % of the pixels that should see the sphere do"
    return ""


def _form_reason(points: Array, fit: SphereFit, noise: _Noise) -> tuple[str, float, float]:
    """Why radius or form speak against the sphere (empty if not), free radius and form [m]."""
    try:
        free = _fitted(points[fit.inliers], fit.center, fit.radius, noise, free=True)
    except InputError:
        return "its radius cannot be determined from its points", fit.radius, 0.0
    off = abs(free.radius - fit.radius)
    allowed = min(GATES.free_radius_m, GATES.free_radius_share * fit.radius)
    if off > min(
        max(allowed, GATES.allowed_sigmas * free.sigma_radius), GATES.most_radius_share * fit.radius
    ):
        what = f"its own radius is {1e3 * free.radius:.1f} mm, not {1e3 * fit.radius:.1f} mm"
        return what, free.radius, 0.0
    form, sigma_form = _form(points, fit)
    if form > min(
        max(GATES.form_share * fit.radius, GATES.allowed_sigmas * sigma_form),
        GATES.most_form_share * fit.radius,
    ):
        what = f"its surface departs from a sphere by {1e3 * form:.1f} mm: it is longer one way"
        return what, free.radius, form
    return "", free.radius, form


def _form(points: Array, fit: SphereFit) -> tuple[float, float]:
    """Root mean square of the second-degree form that the residuals show, and its sigma [m].

    Notes
    -----
    Normal residuals are explained by centre, radius and an ellipsoid; what the ellipsoid adds to
    centre and radius is the form.
    """
    on = fit.inliers
    n = (points[on] - fit.center) / fit.radius
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    normal = fit.residuals[on] * np.cos(fit.incidence[on])
    sphere = np.column_stack([np.ones(len(n)), n])
    second = np.column_stack(
        [n[:, 0] * n[:, 1], n[:, 0] * n[:, 2], n[:, 1] * n[:, 2],
         n[:, 0] ** 2 - n[:, 1] ** 2, n[:, 2] ** 2]
    )  # fmt: skip
    q, _ = np.linalg.qr(sphere)
    second = second - q @ (q.T @ second)
    u, size, _ = np.linalg.svd(second, full_matrices=False)
    u = u[:, size > GATES.form_singular_share * size[0]] if size[0] > 0 else u[:, :0]
    parts = u.T @ normal
    rest = normal - q @ (q.T @ normal) - u @ parts
    freedom = max(len(n) - 9, 1)
    sigma = float(np.sqrt(rest @ rest / freedom))
    return float(np.sqrt(parts @ parts / len(n))), sigma * float(np.sqrt(u.shape[1] / len(n)))


def _best_radius(spheres: list[Detection]) -> tuple[list[Detection], list[Rejected]]:
    """One sphere per place: the one whose free radius is nearest to what was asked for."""
    ranked = sorted(spheres, key=lambda d: abs(d.facts["free_radius_m"] - d.radius) / d.radius)
    kept: list[Detection] = []
    beaten: list[Rejected] = []
    for d in ranked:
        rival = next((k for k in kept if np.linalg.norm(k.center - d.center) < k.radius), None)
        if rival is None:
            kept.append(d)
        else:
            reason = f"a radius of {1e3 * rival.radius:.1f} mm fits better"
            beaten.append(Rejected("sphere", d.center, reason))
    return sorted(kept, key=lambda d: d.range), beaten
