"""Finds the spheres of known radii in a scan and lists the refused ones (method section 6.4).

Candidates come from free-standing components of the range image and from votes of the surface. Each
is fitted along the lines of sight and tested: fit, share of inliers, radius when it is left free,
form, and coverage of the pixels that should see it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.neighbours import SharedNoise
from tribrach.kernels import njit
from tribrach.scan.range_image import RangeImage
from tribrach.sentences import Sentence
from tribrach.targets.detection import Detection, Rejected, lies_on
from tribrach.targets.range_noise import estimate_range_noise
from tribrach.targets.spheres.fit import GATES as FIT
from tribrach.targets.spheres.fit import SphereFit, fit_sphere, fit_sphere_orthogonal, noise_doubt
from tribrach.targets.spheres.shape import shape_of
from tribrach.targets.spheres.votes import vote_for_centers
from tribrach.units import MM


@dataclass(frozen=True)
class SphereGates:
    """Which parts of a scan are candidates for spheres, and which tests a fit must pass.

    Chosen by hand with test_sphere_search, benchmarks/target_search.
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
    #: runs of what is partly hidden, and its least width and height, as multiples of the diameter
    hidden_diameters: tuple[float, float] = (0.08, 1.6)
    hidden_size: float = 0.1
    hidden_share: float = 0.25  #: least share of its runs that end at something nearer
    hidden_sigma_m: float = 2e-3  #: sigma of points that a first fit to their distances takes [m]
    #: things that are partly hidden and looked at, at most: bounds the time
    most_hidden: int = 2000
    filled_px: int = 2  #: holes up to this many pixels are filled
    #: jump of range [m] that parts a thing from its background, at most this and at most R
    jump_m: float = 0.05

    #: the window follows the centre in so many rounds, until it moves less than this [radii];
    #: a fit that moves farther than the other runs away
    window_rounds: int = 3
    window_settled_radii: float = 0.05
    lost_radii: float = 4.0
    widest_rad: float = 0.6  #: no window is wider than this [rad]

    #: residuals are those of the stated noise within this many sigmas of what it is known by
    #: (SphereFitGates.prior_range): a probability of 1e-4
    noise_sigmas: float = 3.72
    most_rms_share: float = 0.1  #: nor are they more than this share of the radius
    front_sigmas: float = 3.0  #: points are off the surface beyond this [sigmas]
    #: least share of the points behind the outline that lies on the sphere
    inlier_share: float = 0.7
    inside_share: float = 0.1  #: most points inside the ball, over those on it and in it
    #: least share of the pixels that should see the sphere, are not hidden and do
    open_share: float = 0.4
    cover_share: float = 0.03  #: least share of all pixels that look at it
    #: things of another size that are listed at most, those most like a sphere first
    most_listed: int = 50


GATES = SphereGates()
#: sigma of radius and form of a sphere as made, if not given [m]
TOLERANCE_M = 2e-4
#: noise of angles [rad] and beam of common scanners (``instruments/sheets``), if nothing is stated
USUAL_ANGLE = 4e-5
USUAL_BEAM = Beam(3e-3, 2.5e-4)

# compiled code reads constants of the module, not attributes of an object
_FEWEST_IN_RUN = GATES.fewest_in_run


@dataclass(frozen=True, eq=False)
class SphereSizedParts:
    """Free-standing components of about the sphere's size."""

    #: (n, 3), presumed centres, the radius behind the nearest points along the mean direction [m]
    center: Array
    #: (n,), sizes in multiples of the diameter
    width: Array
    height: Array
    fits: NDArray[np.bool_]  #: (n,), true where width and height are those of the sphere


def find_components(image: RangeImage, radius: float) -> SphereSizedParts:
    """Find the components of a range image that are about as large as a sphere.

    Rows are cut at jumps of range into runs. A run much narrower than the sphere (its pole or rod)
    or much wider (walls) is dropped; the others are joined with those above them into components,
    whose width and height must be those of the sphere.
    """
    ranges = image.filled(GATES.filled_px)
    frame = (image.first_h, image.first_v, image.step_h, image.step_v)
    jump = min(GATES.jump_m, radius)
    runs = _runs(ranges, frame, radius, jump, GATES.run_diameters)
    label = _joined(runs, ranges.shape[0], ranges.shape[1], image.wraps, jump)
    boxes = _boxes(runs, label, frame, ranges.shape[1], radius)
    width, height = boxes[:, 3], boxes[:, 4]
    low, high = GATES.reported_diameters
    near = (width > low) & (width < high) & (height > low) & (height < high)
    near &= boxes[:, 5] >= GATES.fewest_runs
    boxes, width, height = boxes[near], width[near], height[near]
    fits = (width > GATES.width_diameters[0]) & (width < GATES.width_diameters[1])
    fits &= (height > GATES.height_diameters[0]) & (height < GATES.height_diameters[1])
    return SphereSizedParts(boxes[:, :3], width, height, fits)


def find_hidden(xyz: Array, image: RangeImage, radius: float) -> Array:
    """Presumed centres of components that may be what a nearer thing leaves of a sphere.

    They lie the radius behind the middle of the points, along their normal.

    As in :func:`find_components`, with narrower runs; kept is what is narrower or lower than half
    a sphere and ends at something nearer.
    """
    ranges = image.filled(GATES.filled_px)
    frame = (image.first_h, image.first_v, image.step_h, image.step_v)
    jump = min(GATES.jump_m, radius)
    runs = _runs(ranges, frame, radius, jump, GATES.hidden_diameters)
    if not len(runs):
        return np.empty((0, 3))
    label = _joined(runs, ranges.shape[0], ranges.shape[1], image.wraps, jump)
    row, first, last = runs[:, :3].astype(np.int64).T
    nearest = runs[:, 4] - jump
    middle = (first + last) // 2
    ends, over = np.zeros((2, len(runs)), dtype=bool)
    for step in range(1, GATES.filled_px + 2):  # mixed pixels at the border may be lost
        for column in (first - step, last + step):
            ends |= _nearer(ranges, row, column, nearest, image.wraps)
        for level in (row - step, row + step):
            over |= _nearer(ranges, level, middle, nearest, image.wraps)
    _, part = np.unique(label, return_inverse=True)
    points = np.bincount(part, last - first + 1)
    count = np.bincount(part)
    width = np.zeros(len(count))
    np.maximum.at(width, part, runs[:, 5] / (2 * radius))
    away = np.bincount(part, runs[:, 3]) / count
    height = count * image.step_v * away / (2 * radius)
    sides = np.bincount(part, ends) >= GATES.hidden_share * count
    caps = np.bincount(part, over * (last - first + 1)) >= GATES.hidden_share * points / count
    small = (width < GATES.width_diameters[0]) | (height < GATES.height_diameters[0])
    small &= (width < GATES.width_diameters[1]) & (height < GATES.height_diameters[1])
    small &= np.minimum(width, height) > GATES.hidden_size
    chosen = np.flatnonzero(small & (sides | caps) & (points >= FIT.fewest_points))
    chosen = chosen[np.argsort(-points[chosen], kind="stable")][: GATES.most_hidden]
    order = np.argsort(part, kind="stable")
    begin = np.searchsorted(part[order], np.arange(len(count) + 1))
    centers = []
    for k in chosen:
        pixels = [
            image.index[row[m], first[m] : last[m] + 1] for m in order[begin[k] : begin[k + 1]]
        ]
        index = np.concatenate(pixels)
        index = index[index >= 0]
        if len(index) < FIT.fewest_points:
            continue
        around = xyz[index]
        center = around.mean(axis=0)
        normal = np.linalg.svd(around - center, full_matrices=False)[2][2]
        start = center + radius * normal * np.sign(normal @ center)
        try:  # the rim counts here, which the fit along the beams masks
            start = fit_sphere_orthogonal(around, start, radius, sigma=GATES.hidden_sigma_m).center
        except InputError:
            continue
        centers.append(start)
    return np.array(centers).reshape(-1, 3)


def _nearer(
    ranges: NDArray[np.float32], row: Index, column: Index, limit: Array, wraps: bool
) -> NDArray[np.bool_]:
    """True (n,) where pixels have a range below a limit (n,) [m]."""
    rows, columns = ranges.shape
    inside = (row >= 0) & (row < rows)
    if not wraps:
        inside &= (column >= 0) & (column < columns)
    found = ranges[np.clip(row, 0, rows - 1), column % columns]
    return np.asarray(inside & (found < limit))


@njit(cache=True, nogil=True)
def _runs(
    ranges: NDArray[np.float32],
    frame: tuple[float, float, float, float],
    radius: float,
    jump: float,
    diameters: tuple[float, float],
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
                low, high = diameters
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
    """Stated noise of points and spheres.

    range, angle : sigmas of one point [m] and [rad]; beam : None if the angle holds its footprint;
    tolerance : sigma of radius and form as made [m]; floor : of a centre [m]; shared : what
    neighbouring points share.
    """

    range: float
    angle: float
    beam: Beam | None
    tolerance: float
    floor: float
    shared: SharedNoise | None

    def spot(self, center: Array) -> float:
        """Diameter of the footprint at a place (3,) [m]."""
        away = np.array([np.linalg.norm(center)])
        return float((self.beam or USUAL_BEAM).diameter(away)[0])

    def at(self, center: Array) -> tuple[float, float]:
        """Sigmas of range and angle at a place (3,): the footprint depends on the range."""
        away = float(np.linalg.norm(center))
        spot = 0.0 if self.beam is None else self.spot(center) / away / 4
        return self.range, float(np.hypot(self.angle, spot))


def find_spheres(
    xyz: Array,
    image: RangeImage,
    radii: Sequence[float],
    *,
    sigma_range: float | None = None,
    sigma_angle: float | None = None,
    footprint: Beam | None = None,
    tolerance: float = TOLERANCE_M,
    floor: float = FIT.floor_m,
    shared: SharedNoise | None = None,
    scan: str = "",
) -> tuple[list[Detection], list[Rejected]]:
    """Find spheres of given radii in a scan (method section 6.4).

    Where the sigmas are None, that of ranges is estimated and that of angles is that of common
    scanners with their footprint. A footprint is None if the sigma of the angles holds it.
    """
    if not all(r > 0 for r in radii):
        raise InputError("the radius of a sphere must be positive")
    sigma = estimate_range_noise(image) if sigma_range is None else sigma_range
    if sigma_angle is None:
        sigma_angle, footprint = USUAL_ANGLE, footprint or USUAL_BEAM
    noise = _Noise(sigma, sigma_angle, footprint, tolerance, floor, shared)
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
    hidden = find_hidden(xyz, image, radius)
    for start in [*parts.center[parts.fits], *voted, *hidden]:
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
        size = Sentence(
            "{w:mm0} wide and {h:mm0} high is not the size of a sphere", w=w * MM, h=h * MM
        )
        reason = Sentence("{size} of {radius:mm0}", size=size, radius=2000.0 * radius * MM)
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
        view = _cone(image, center, radius, 1.0)
        points = xyz[view.index]
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
    return _tested(points, view, fit, image, noise, scan)


def _fitted(points: Array, start: Array, radius: float, noise: _Noise) -> SphereFit:
    """The fit along the lines of sight."""
    sigma_range, sigma_angle = noise.at(start)
    return fit_sphere(
        points,
        start,
        radius,
        sigma_range=sigma_range,
        sigma_angle=sigma_angle,
        floor=noise.floor,
        tolerance=noise.tolerance,
        shared=noise.shared,
    )


@dataclass(frozen=True, eq=False)
class _View:
    """Pixels that look at a sphere: their points (k,), rows and columns, and how many look."""

    index: NDArray[np.int32]
    row: NDArray[np.int64]
    column: NDArray[np.int64]
    pixels: int


def _cone(image: RangeImage, center: Array, radius: float, share: float) -> _View:
    """Pixels within ``share`` of the sphere's angular radius."""
    away = float(np.linalg.norm(center))
    angle = min(float(np.arcsin(min(share * radius / away, 1.0))), GATES.widest_rad)
    h, v = np.arctan2(center[1], center[0]), np.arctan2(np.hypot(center[0], center[1]), center[2])
    row, column = image.pixel(float(h), float(v))
    sine = max(float(np.sin(v)), np.sin(angle), 1e-3)
    half_v, half_h = int(angle / image.step_v) + 2, int(angle / (image.step_h * sine)) + 2
    rows = np.arange(max(0, int(row) - half_v), min(image.shape[0], int(row) + half_v + 2))
    columns = np.arange(int(column) - half_h, int(column) + half_h + 2)
    first = columns[0]
    period = round(2 * np.pi / image.step_h)
    columns = columns % (image.shape[1] if image.wraps else period)
    columns = np.unique(columns[columns < image.shape[1]])
    if not (len(rows) and len(columns)):
        none = np.empty(0, dtype=np.int64)
        return _View(none.astype(np.int32), none, none, 0)
    turn, v_of = image.h(columns), image.v(rows)
    cosine = np.cos(v) * np.cos(v_of)[:, None]
    cosine = cosine + np.sin(v) * np.sin(v_of)[:, None] * np.cos(turn - h)[None, :]
    inside = cosine > np.cos(angle)
    index = image.index[np.ix_(rows, columns)]
    i, j = np.nonzero(inside & (index >= 0))
    # neighbours across the seam stay neighbours
    beside = (columns - first) % (image.shape[1] if image.wraps else period)
    return _View(index[i, j], rows[i], beside[j], int(inside.sum()))


def _tested(
    points: Array, view: _View, fit: SphereFit, image: RangeImage, noise: _Noise, scan: str
) -> Detection | Rejected:
    """Acceptance of a fitted sphere."""
    seen = _Seen.of(points, fit, _cone(image, fit.center, fit.radius, np.sin(FIT.mask_rad)).pixels)
    reason = _first_reason(fit, seen, noise)
    if reason:
        return Rejected("sphere", fit.center, reason)
    sigma_range, sigma_angle = noise.at(fit.center)
    shape = shape_of(
        points,
        (view.row, view.column),
        fit,
        beam=noise.spot(fit.center),
        tolerance=noise.tolerance,
        sigma_range=sigma_range,
        sigma_angle=sigma_angle,
    )
    if shape.reason:
        return Rejected("sphere", fit.center, shape.reason)
    on = fit.inliers
    facts = {
        "s0": fit.s0,
        "free_radius_m": shape.radius,
        "sigma_free_radius_m": shape.sigma_radius,
        "form_m": shape.form,
        "inlier_share": seen.share,
        "noise_m": fit.noise[0],
        "correlation_factor": shape.like,
    }
    return Detection(
        kind="sphere",
        scan=scan,
        center=fit.center,
        covariance=fit.covariance
        + (shape.like / fit.alike - 1) * fit.random
        + fit.by_form * shape.other_radius**2,
        radius=fit.radius,
        rms=fit.rms,
        points=len(points),
        inliers=int(on.sum()),
        range=float(np.linalg.norm(fit.center)),
        incidence=float(np.mean(fit.incidence[on])),
        coverage=seen.cover,
        facts=facts,
        sentences=(*fit.sentences, *([shape.sentence] if shape.sentence else [])),
    )


@dataclass(frozen=True)
class _Seen:
    """Where the points within the mask of a fit lie, as shares.

    share : on the surface, of those on or behind it; inside : in the ball behind its surface, of
    those on or in it; cover : pixels with a point on the surface, of all that look at it; open :
    the same of those that no nearer thing hides.
    """

    share: float
    inside: float
    cover: float
    open: float

    @classmethod
    def of(cls, points: Array, fit: SphereFit, pixels: int) -> _Seen:
        """Of points (n, 3) of a fit, with the number of pixels within the mask."""
        on = int(fit.inliers.sum())
        sigma = np.hypot(fit.noise[0], fit.noise[1] * np.tan(fit.incidence))
        off = fit.masked & ~fit.inliers
        with np.errstate(invalid="ignore"):
            front = int((off & (fit.residuals < -GATES.front_sigmas * sigma)).sum())
            behind = off & (fit.residuals > GATES.front_sigmas * sigma)
            inside = int((behind & (fit.residuals < 2 * fit.radius * np.cos(fit.incidence))).sum())
        rest = int(fit.masked.sum()) - front
        return cls(
            on / max(rest, 1),
            inside / max(on + inside, 1),
            min(on / max(pixels, 1), 1.0),
            min(on / max(pixels - front, 1), 1.0),
        )


def _first_reason(fit: SphereFit, seen: _Seen, noise: _Noise) -> str:
    """Why the fit itself speaks against a sphere; empty if it does not."""
    most = np.exp(GATES.noise_sigmas * noise_doubt(int(fit.inliers.sum())) / 2)
    if fit.s0 > most:
        return Sentence(
            "residuals of {fit.rms:mm1} (root mean square) are {fit.s0:1} times what noise "
            "of {noise.range:mm1} along the beam, its width and its incidence explain, "
            "limit {most:1} times",
            fit=fit,
            noise=noise,
            most=most,
        )
    if fit.rms > GATES.most_rms_share * fit.radius:
        share = 100 * fit.rms / fit.radius
        return Sentence(
            "residuals of {fit.rms:mm1} (root mean square) are {share:%0} of the radius, "
            "limit {gates.most_rms_share:%0}",
            fit=fit,
            share=share * 0.01,
            gates=GATES,
        )
    if seen.inside > GATES.inside_share:
        return Sentence(
            "{seen.inside:%0} of its points lie inside the ball, behind its surface: "
            "leaves or a hollow, no closed surface",
            seen=seen,
        )
    if seen.share < GATES.inlier_share:
        return Sentence(
            "only {seen.share:%0} of the points behind its outline lie on the sphere", seen=seen
        )
    if seen.open < GATES.open_share:
        return Sentence(
            "only {seen.open:%0} of the pixels that should see the sphere do", seen=seen
        )
    if seen.cover < GATES.cover_share:
        return Sentence("only {seen.cover:%0} of the sphere is seen", seen=seen)
    return ""


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
            reason = Sentence("a radius of {rival.radius:mm1} fits better", rival=rival)
            beaten.append(Rejected("sphere", d.center, reason))
    return sorted(kept, key=lambda d: d.range), beaten
