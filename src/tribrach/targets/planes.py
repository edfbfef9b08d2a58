"""Finds the planes of a scan, with covariances of normal and offset (method section 8.3).

Regions are grown in the range image, fitted along the lines of sight, joined where they are one
plane, fitted again and kept if large and flat enough.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from tribrach._types import Array, Index
from tribrach.instruments.neighbours import SharedNoise
from tribrach.kernels import njit
from tribrach.scan.range_image import RangeImage
from tribrach.sentences import Sentence
from tribrach.targets.detection import Detection, Rejected
from tribrach.targets.range_noise import estimate_range_noise


@dataclass(frozen=True)
class PlaneGates:
    """How plane regions grow, are fitted and joined, and which of them are kept.

    Chosen by hand with test_planes, benchmarks/plane_registration.
    """

    #: a block of pixels has about this edge on a surface at the median range [m] ...
    block_m: float = 0.08
    block_px: tuple[int, int] = (5, 48)  #: ... within these bounds
    #: a block is flat if its thickness is below this many sigmas of the range ...
    block_thickness_sigmas: float = 2.0
    block_filled_share: float = 0.6  #: ... and its points fill this share of it
    #: blocks get a plane if so much of them is filled, with so many points
    block_fitted_share: float = 0.5
    block_fewest_points: int = 6
    #: a block lies in a region's plane: its centre within these sigmas of range plus this [m] ...
    joins_sigmas: float = 1.0
    joins_m: float = 2e-3
    joins_rad: float = float(np.radians(12.0))  #: ... and its normal within this [rad]
    fewest_blocks: int = 4  #: smaller regions are dropped
    #: pixels lie in a plane within these sigmas of the range plus this [m]
    pixel_sigmas: float = 3.0
    pixel_m: float = 1e-3

    #: passes of the fit over some of the points, the first ones with a wide gate, then over all
    coarse_passes: int = 4
    wide_passes: int = 2
    fine_passes: int = 2
    wide_gate_m: float = 0.02  #: the wide gate, along the normal [m]
    coarse_points: int = 1_000_000  #: points looked at in a coarse pass, about: bounds the time
    trim_sigmas: float = 3.0  #: residuals beyond this many sigmas are trimmed
    #: standard deviation of a normal variable that is cut there (closed form for three sigmas)
    trimmed_normal_sigma: float = 0.98658
    #: the trimming follows the unit sigma of the last pass within these bounds
    least_unit_sigma: float = 0.5
    most_unit_sigma: float = 3.0
    #: beams steeper to the surface than this [rad] are left out
    grazing_rad: float = float(np.radians(80.0))
    #: fewest points of a plane, largest condition number of its scaled normal matrix
    fewest_points: int = 10
    condition: float = 1e12

    #: planes that may be one: angle [rad], offset [m], growth of the variance when joined
    same_rad: float = float(np.radians(0.3))
    same_m: float = 5e-3
    same_growth: float = 1.5

    least_area_m2: float = 0.5  #: smallest area if nobody says otherwise [m^2]
    #: regions below this share of the least area are not worth a rejection
    listed_area_share: float = 0.5
    #: largest rms along the normal, in sigmas of the range and of the waves of good surfaces [m]
    rms_sigmas: float = 2.5
    waves_m: float = 1e-3
    #: a surface is curved if its radius is below this [m] and its bow above this [m] ...
    curved_radius_m: float = 50.0
    bow_m: float = 5e-4
    bow_sigmas: float = 4.0  #: ... and above so many sigmas

    #: neighbours share errors of the surface: one independent point in a square of this edge [m]
    independent_m: float = 0.05
    fewest_independent: float = 4.0  #: fewest independent points that a plane counts as
    #: parts that residuals are summed over to see how they hang together, along either side, and
    #: how many of them tell it
    parts: int = 8
    fewest_parts: int = 8
    #: sigma of what no fit sees of a surface [m]: waves, paint, the scanner's zero error
    floor_m: float = 3e-4
    outline_points: int = 20_000  #: largest number of points for the outline and the bow
    #: cells that stand for the patch where it is compared with others, about; their least width [m]
    sample_cells: int = 400
    least_cell_m: float = 0.1


GATES = PlaneGates()

# compiled code reads constants of the module, not attributes of an object
_BLOCK_FITTED_SHARE = GATES.block_fitted_share
_BLOCK_FEWEST_POINTS = GATES.block_fewest_points
_JOINS_SIGMAS = GATES.joins_sigmas
_JOINS_M = GATES.joins_m
_JOINS_RAD = GATES.joins_rad
_FEWEST_BLOCKS = GATES.fewest_blocks
_PIXEL_SIGMAS = GATES.pixel_sigmas
_PIXEL_M = GATES.pixel_m
_WIDE_GATE_M = GATES.wide_gate_m
_TRIM_SIGMAS = GATES.trim_sigmas
_TRIMMED_NORMAL_SIGMA = GATES.trimmed_normal_sigma
_LEAST_UNIT_SIGMA = GATES.least_unit_sigma
_MOST_UNIT_SIGMA = GATES.most_unit_sigma
_GRAZING_RAD = GATES.grazing_rad


@dataclass(frozen=True, eq=False)
class PlaneFits:
    """Planes fitted to the k regions of a scan."""

    m: Array  #: (k, 3), planes as ``m . x = 1`` [1/m].
    normal: Array  #: (k, 3, 3), normal matrices of ``m``
    square: Array  #: (k,), weighted sums of squared residuals
    points: Array  #: (k,), numbers of inliers
    rms: Array  #: (k,), root mean squares of the residuals along the line of sight [m]
    center: Array  #: (k, 3), means of the inliers [m]
    area: Array  #: (k,), areas of the pixels [m^2]
    incidence: Array  #: (k,), mean angles between beam and normal [rad]

    @property
    def s0(self) -> Array:
        """Standard deviation of unit weight (k,)."""
        return np.asarray(np.sqrt(self.square / np.maximum(self.points - 3, 1)))


def fit_planes(
    xyz: Array,
    image: RangeImage,
    labels: Labels,
    count: int,
    noise: tuple[float, float],
    *,
    coarse: bool = False,
) -> PlaneFits:
    """Fit planes through the pixels of every label, along the lines of sight.

    Trimmed pixels get the label -1, unless ``coarse``, which fits to a part of the pixels only.

    A plane is ``m . x = 1``, so a beam d meets it at ``rho = 1 / (m . d)``. Residuals are ranges;
    the variance of one is ``s_rho^2 + rho^2 s_ang^2 tan^2 psi``; those beyond three sigmas are
    trimmed.
    """
    m = np.full((count, 3), np.nan)
    s0 = np.full(count, np.nan)
    frame = (image.first_v, image.step_h, image.step_v)
    sums = np.zeros((count, 20))
    stride = max(1, round((labels.size / GATES.coarse_points) ** 0.5))
    for k in range(GATES.coarse_passes + (0 if coarse else GATES.fine_passes)):
        step, final = (
            (stride, False)
            if k < GATES.coarse_passes
            else (1, k == GATES.coarse_passes + GATES.fine_passes - 1)
        )
        sums = _pass(
            xyz, image.index, labels, m, s0, noise, frame, k < GATES.wide_passes, final, step
        )
        m, s0 = _updated(sums, m)
    n = np.maximum(sums[:, 9], 1.0)
    matrix = np.empty((count, 3, 3))
    upper = np.triu_indices(3)
    matrix[:, upper[0], upper[1]] = sums[:, :6]
    matrix[:, upper[1], upper[0]] = sums[:, :6]
    return PlaneFits(
        m=m,
        normal=matrix,
        square=np.maximum(sums[:, 10], 0.0),
        points=sums[:, 9],
        rms=np.sqrt(sums[:, 11] / n),
        center=sums[:, 12:15] / n[:, None],
        area=sums[:, 15],
        incidence=sums[:, 16] / n,
    )


def _updated(sums: Array, m: Array) -> tuple[Array, Array]:
    """Planes and unit sigmas after a pass; NaN where points determine no plane."""
    out, s0 = np.full_like(m, np.nan), np.full(len(m), np.nan)
    for k in np.flatnonzero(sums[:, 9] >= GATES.fewest_points):
        a = np.empty((3, 3))
        a[np.triu_indices(3)] = sums[k, :6]
        a = np.triu(a) + np.triu(a, 1).T
        scale = np.sqrt(np.diag(a))
        if not scale.min() > 0 or np.linalg.cond(a / np.outer(scale, scale)) > GATES.condition:
            continue
        step = np.linalg.solve(a / np.outer(scale, scale), sums[k, 6:9] / scale) / scale
        out[k] = step if np.isnan(m[k, 0]) else m[k] + step
        s0[k] = np.sqrt(max(sums[k, 10], 0.0) / (sums[k, 9] - 3))
    return out, s0


@njit(cache=True, nogil=True)
def _pass(
    xyz: Array,
    index: NDArray[np.int32],
    labels: Labels,
    m: Array,
    s0: Array,
    noise: tuple[float, float],
    frame: tuple[float, float, float],
    wide: bool,
    final: bool,
    stride: int,
) -> Array:
    """Sums (k, 20) over the points of every label, of every ``stride``-th row and column.

    Columns: 0-5 normal matrix, 6-8 right side, 9 points, 10 weighted squares, 11 squares, 12-14
    coordinates, 15 area, 16 incidence. Planes not yet known (NaN) are started from
    ``m . d = 1 / rho``.
    """
    rows, columns = index.shape
    v0, step_h, step_v = frame
    out = np.zeros((len(m), 20))
    d = np.empty(3)
    for i in range(0, rows, stride):
        pixel = stride**2 * step_h * step_v * abs(np.sin(v0 + i * step_v))
        for j in range((i // stride) % stride, columns, stride):
            k = labels[i, j]
            if k < 0:
                continue
            x = xyz[index[i, j]]
            rho = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
            for c in range(3):
                d[c] = x[c] / rho
            s = out[k]
            p = m[k]
            if np.isnan(p[0]):
                # d(1/rho) = -d rho / rho^2: equal range noise for the start
                _add(s, d, 1 / rho, rho**2 / noise[0])
                s[9] += 1
                continue
            dot = p[0] * d[0] + p[1] * d[1] + p[2] * d[2]
            cosine = abs(dot) / np.sqrt(p[0] ** 2 + p[1] ** 2 + p[2] ** 2)
            if dot <= 0 or cosine < np.cos(_GRAZING_RAD):
                if final:
                    labels[i, j] = -1
                continue
            away = 1 / dot
            v = rho - away
            sigma = np.sqrt(noise[0] ** 2 + (rho * noise[1]) ** 2 * (1 / cosine**2 - 1))
            scale = (
                1.0
                if np.isnan(s0[k])
                else min(max(s0[k] / _TRIMMED_NORMAL_SIGMA, _LEAST_UNIT_SIGMA), _MOST_UNIT_SIGMA)
            )
            kept = abs(v) * cosine < _WIDE_GATE_M if wide else abs(v) < _TRIM_SIGMAS * scale * sigma
            if not kept:
                if final:
                    labels[i, j] = -1
                continue
            # rho = 1 / (m . d): derivative -rho^2 d
            _add(s, d, -v / away**2, away**2 / sigma)
            s[9] += 1
            s[11] += v * v
            s[12] += x[0]
            s[13] += x[1]
            s[14] += x[2]
            s[15] += pixel * rho * rho / cosine
            s[16] += np.arccos(min(cosine, 1.0))
    return out


@njit(cache=True, nogil=True)
def _add(s: Array, d: Array, value: float, root: float) -> None:
    """Add the equation d . m = value with the square root of its weight to the sums."""
    w = root * root
    n = 0
    for a in range(3):
        for b in range(a, 3):
            s[n] += w * d[a] * d[b]
            n += 1
        s[6 + a] += w * d[a] * value
    s[10] += w * value * value


def joint(fits: PlaneFits, a: int, b: int) -> tuple[float, float]:
    """Variances of unit weight of two planes apart and as one plane, in closed form."""
    apart = fits.square[a] + fits.square[b]
    n = fits.points[a] + fits.points[b]
    both = np.linalg.inv(np.linalg.inv(fits.normal[a]) + np.linalg.inv(fits.normal[b]))
    difference = fits.m[a] - fits.m[b]
    together = apart + difference @ both @ difference
    return float(apart / max(n - 6, 1)), float(together / max(n - 3, 1))


def taken_up(labels: Labels, group: Index) -> Labels:
    """Rename labels by the groups that regions were joined into; -1 stays."""
    table = np.append(group, -1).astype(np.int32)
    return np.asarray(table[labels])


def grow_planes(xyz: Array, image: RangeImage, sigma: float) -> tuple[Labels, int]:
    """Grow plane regions in the image: the region of every pixel (-1: none), and their number.

    The image is cut into blocks. A block whose points are flat is a seed, or joins the region
    beside it if it lies in its plane; the region's plane follows from sums over its blocks. At the
    end pixels of blocks across edges are given to the region in whose plane they lie (method
    section 8.3).
    """
    edge = _block_edge(image)
    sums = _block_sums(xyz, image.index, edge)
    fits = _block_planes(sums, edge * edge)
    flat = (fits[..., 6] <= GATES.block_thickness_sigmas * sigma) & (
        sums[..., 0] >= GATES.block_filled_share * edge * edge
    )
    order = np.argsort(np.where(flat, fits[..., 6], np.inf), axis=None)[: int(flat.sum())]
    blocks, planes = _grown(sums, fits, flat, order, image.wraps, sigma)
    labels = _pixels(xyz, image.index, blocks, planes, edge, image.wraps, sigma)
    return labels, len(planes)


def _block_edge(image: RangeImage) -> int:
    """Pixels along a block: about 8 cm on surfaces at the median range."""
    typical = float(np.nanmedian(image.range[:: max(1, image.shape[0] // 200)]))
    pixels = GATES.block_m / max(typical * np.sqrt(image.step_h * image.step_v), 1e-9)
    return int(np.clip(round(pixels), *GATES.block_px))


@njit(cache=True, nogil=True)
def _block_sums(xyz: Array, index: NDArray[np.int32], edge: int) -> Array:
    """Number, sums and products (10) of the points of every block."""
    rows, columns = index.shape
    high, wide = (rows + edge - 1) // edge, (columns + edge - 1) // edge
    out = np.zeros((high, wide, 10))
    for i in range(rows):
        for j in range(columns):
            k = index[i, j]
            if k < 0:
                continue
            s = out[i // edge, j // edge]
            x, y, z = xyz[k, 0], xyz[k, 1], xyz[k, 2]
            s[0] += 1
            s[1] += x
            s[2] += y
            s[3] += z
            s[4] += x * x
            s[5] += x * y
            s[6] += x * z
            s[7] += y * y
            s[8] += y * z
            s[9] += z * z
    return out


@njit(cache=True, nogil=True)
def _seed_plane(s: Array) -> Array:
    """Centre, normal towards the scanner, thickness (7) of the points with these sums."""
    out = np.empty(7)
    c = s[1:4] / s[0]
    m = np.empty((3, 3))
    m[0, 0] = s[4] / s[0] - c[0] * c[0]
    m[0, 1] = m[1, 0] = s[5] / s[0] - c[0] * c[1]
    m[0, 2] = m[2, 0] = s[6] / s[0] - c[0] * c[2]
    m[1, 1] = s[7] / s[0] - c[1] * c[1]
    m[1, 2] = m[2, 1] = s[8] / s[0] - c[1] * c[2]
    m[2, 2] = s[9] / s[0] - c[2] * c[2]
    values, vectors = np.linalg.eigh(m)
    normal = np.ascontiguousarray(vectors[:, 0])
    if (normal * c).sum() > 0:
        normal = -normal
    out[:3], out[3:6], out[6] = c, normal, np.sqrt(max(values[0], 0.0))
    return out


@njit(cache=True, nogil=True)
def _block_planes(sums: Array, full: int) -> Array:
    """Planes (high, wide, 7) of blocks that are at least half full; thickness inf of others."""
    high, wide = sums.shape[:2]
    out = np.full((high, wide, 7), np.inf)
    for i in range(high):
        for j in range(wide):
            if sums[i, j, 0] >= max(_BLOCK_FITTED_SHARE * full, _BLOCK_FEWEST_POINTS):
                out[i, j] = _seed_plane(sums[i, j])
    return out


@njit(cache=True, nogil=True)
def _joins(block: Array, plane: Array, sigma: float) -> bool:
    """True if a flat block lies in the plane of a region."""
    turn = (block[3:6] * plane[3:6]).sum()
    if turn < np.cos(_JOINS_RAD):
        return False
    off = ((block[:3] - plane[:3]) * plane[3:6]).sum()
    return bool(abs(off) < _JOINS_SIGMAS * sigma + _JOINS_M)


@njit(cache=True, nogil=True)
def _grown(
    sums: Array,
    fits: Array,
    flat: NDArray[np.bool_],
    order: NDArray[np.int64],
    wraps: bool,
    sigma: float,
) -> tuple[Labels, Array]:
    """Region (high, wide) of every block and planes (regions, 7), from the flattest blocks on."""
    high, wide = flat.shape
    region = np.full((high, wide), -1, dtype=np.int32)
    planes = np.empty((64, 7))
    stack = np.empty((high * wide, 2), dtype=np.int32)
    count = 0
    for at in order:
        if region[at // wide, at % wide] >= 0:
            continue
        region[at // wide, at % wide] = count
        stack[0, 0], stack[0, 1] = at // wide, at % wide
        first, last, update = 0, 1, 3
        total = sums[at // wide, at % wide].copy()
        plane = fits[at // wide, at % wide].copy()
        while first < last:
            i, j = stack[first, 0], stack[first, 1]
            first += 1
            for di, dj in ((0, 1), (0, -1), (1, 0), (-1, 0)):
                a, b = i + di, j + dj
                if wraps:
                    b %= wide
                if a < 0 or a >= high or b < 0 or b >= wide or region[a, b] >= 0:
                    continue
                if not flat[a, b] or not _joins(fits[a, b], plane, sigma):
                    continue
                region[a, b] = count
                stack[last, 0], stack[last, 1] = a, b
                last += 1
                total += sums[a, b]
                if last >= update:  # the plane follows its blocks, ever less often
                    plane, update = _seed_plane(total), last + max(1, last // 8)
        if last < _FEWEST_BLOCKS:
            for k in range(last):
                region[stack[k, 0], stack[k, 1]] = -2
            continue
        if count == len(planes):
            grown = np.empty((2 * count, 7))
            grown[:count] = planes
            planes = grown
        planes[count] = _seed_plane(total)
        count += 1
    return region, planes[:count]


@njit(cache=True, nogil=True)
def _pixels(
    xyz: Array,
    index: NDArray[np.int32],
    region: Labels,
    planes: Array,
    edge: int,
    wraps: bool,
    sigma: float,
) -> Labels:
    """Region of every pixel: the plane that it is nearest to, of its block and those around."""
    rows, columns = index.shape
    high, wide = region.shape
    out = np.full((rows, columns), -1, dtype=np.int32)
    allowed = _PIXEL_SIGMAS * sigma + _PIXEL_M
    near = np.empty(9, dtype=np.int32)
    for bi in range(high):
        for bj in range(wide):
            n = 0
            for di in range(-1, 2):
                for dj in range(-1, 2):
                    a, b = bi + di, bj + dj
                    if wraps:
                        b %= wide
                    if a < 0 or a >= high or b < 0 or b >= wide or region[a, b] < 0:
                        continue
                    fresh = True
                    for m in range(n):
                        fresh = fresh and near[m] != region[a, b]
                    if fresh:
                        near[n] = region[a, b]
                        n += 1
            if n == 0:
                continue
            for i in range(bi * edge, min(rows, (bi + 1) * edge)):
                for j in range(bj * edge, min(columns, (bj + 1) * edge)):
                    if index[i, j] >= 0:
                        out[i, j] = _nearest(xyz[index[i, j]], near[:n], planes, allowed)
    return out


@njit(cache=True, nogil=True)
def _nearest(point: Array, near: Labels, planes: Array, allowed: float) -> int:
    """The region whose plane is nearest to a point and within ``allowed`` [m], else -1."""
    best, region = allowed, -1
    for k in near:
        p = planes[k]
        off = abs((point[0] - p[0]) * p[3] + (point[1] - p[1]) * p[4] + (point[2] - p[2]) * p[5])
        if off < best:
            best, region = off, k
    return region


Labels = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane patch, ``normal . (x - center) = 0``."""

    normal: Array  #: (3,), unit normal towards the scanner
    center: Array  #: (3,), place on the plane at the centroid [m]
    tangents: Array  #: (2, 3), unit vectors in the plane
    #: (3, 3), covariance of the tilt of the normal along both tangents [rad] and of the offset
    #: along the normal at the centre [m], floor included
    covariance: Array
    area: float  #: area that the scan sees [m^2]
    outline: Array  #: (k, 3), convex outline [m]
    sample: Array  #: (s, 3), one place on the plane for every occupied cell [m]
    spacing: float  #: width of the cells [m]
    detection: Detection  #: the same patch for lists of targets


def find_planes(
    xyz: Array,
    image: RangeImage,
    *,
    sigma_range: float | None = None,
    sigma_angle: float = 2e-5,
    least_area: float = GATES.least_area_m2,
    floor: float = GATES.floor_m,
    shared: SharedNoise | None = None,
    scan: str = "",
) -> tuple[list[Plane], list[Rejected]]:
    """Find planes of an area [m^2] or more; ``floor`` [m] adds to offset and tilt."""
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
    large = [
        k
        for k in order
        if fits.area[k] > GATES.listed_area_share * least_area and np.isfinite(fits.m[k, 0])
    ]
    members = _members(image, labels, np.array(large, dtype=np.int64), len(fits.m))
    for k, member in zip(large, members, strict=True):
        points = xyz[member]
        some = points[:: max(1, len(points) // GATES.outline_points)]
        reason = _reason(fits, k, sigma, least_area) or _curved(fits.m[k], some)
        if reason:
            rejected.append(Rejected("plane", fits.center[k], reason))
        else:
            known = 1.0 if shared is None else _known(fits.center[k], image, shared)
            planes.append(_plane(fits, k, points, floor, known, scan))
    return planes, rejected


def _reason(fits: PlaneFits, k: int, sigma: float, least_area: float) -> str:
    """Why a region is not kept; empty if it is."""
    if fits.area[k] < least_area:
        return Sentence(
            "its area of {fits:2} m2 is below {least_area:g} m2",
            fits=fits.area[k],
            least_area=least_area,
        )
    allowed = GATES.rms_sigmas * float(np.hypot(sigma, GATES.waves_m))
    normal_rms = fits.rms[k] * np.cos(fits.incidence[k])
    if normal_rms > allowed:
        return Sentence(
            "its residuals of {normal_rms:mm1} (root mean square) are above the limit "
            "{allowed:mm1}",
            normal_rms=normal_rms,
            allowed=allowed,
        )
    return ""


def _curved(m: Array, points: Array) -> str:
    """Tell why points lie on a curved surface and not on the plane ``m . x = 1``; empty if not.

    Columns and vaults are flat in narrow strips; a quadric through the distances to the plane shows
    them by its bow.
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
    if radius < GATES.curved_radius_m and height > max(GATES.bow_m, GATES.bow_sigmas * sigma):
        return Sentence("it is curved with a radius of {radius:m2}", radius=radius)
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
            same = (turn < GATES.same_rad) & (np.maximum(here, there) < GATES.same_m)
            near = near[same & ((normal[near] @ normal[k]) > 0)]
        for head in near:
            apart, together = joint(fits, int(head), int(k))
            if together < GATES.same_growth * max(apart, 1.0):
                group[k] = group[head]
                break
        if group[k] < 0:
            group[k] = len(heads)
            heads.append(int(k))
    return group


def _members(
    image: RangeImage, labels: Labels, regions: NDArray[np.int64], count: int
) -> list[NDArray[np.int32]]:
    """Numbers (n,) of the points of every wanted region."""
    rank = np.full(count + 1, -1, dtype=np.int64)
    rank[regions] = np.arange(len(regions))
    flat = rank[labels.ravel()]
    chosen = np.flatnonzero(flat >= 0)
    chosen = chosen[np.argsort(flat[chosen], kind="stable")]
    ends = np.searchsorted(flat[chosen], np.arange(len(regions) + 1))
    index = image.index.ravel()
    return [index[chosen[a:b]] for a, b in pairwise(ends)]


def _plane(fits: PlaneFits, k: int, points: Array, floor: float, known: float, scan: str) -> Plane:
    """The patch of one fitted region; ``known`` of its points count as one by the scanner.

    A normal turned towards the scanner reverses tilts and offset alike and leaves their covariance.
    """
    size = float(np.linalg.norm(fits.m[k]))
    outward = fits.m[k] / size
    center = fits.center[k] + (1 / size - outward @ fits.center[k]) * outward
    tangents = _tangents(outward)
    # m + dm: the normal tilts by its tangential part, the plane at the centre moves by -dm . c
    rows = np.vstack([tangents, -center]) / size
    flat, away = (points - center) @ tangents.T, (points - center) @ outward
    surface = fits.points[k] * GATES.independent_m**2 / fits.area[k]
    shared = max(surface, _correlation(flat, away), known)
    independent = max(fits.points[k] / shared, GATES.fewest_independent)
    enlarged = max(1.0, fits.s0[k] ** 2) * fits.points[k] / independent
    covariance = rows @ np.linalg.inv(fits.normal[k]) @ rows.T * enlarged
    spread = floor / np.sqrt(fits.area[k] / np.pi)
    covariance = covariance + np.diag([spread, spread, floor]) ** 2
    hull = ConvexHull(flat[:: max(1, len(flat) // GATES.outline_points)])
    outline = center + hull.points[hull.vertices] @ tangents
    spacing = max(float(np.sqrt(fits.area[k] / GATES.sample_cells)), GATES.least_cell_m)
    low = np.floor(flat.min(axis=0) / spacing)
    cells = np.floor(flat / spacing).astype(np.int64) - low.astype(np.int64)
    taken = np.zeros(cells.max(axis=0) + 1, dtype=bool)
    taken[cells[:, 0], cells[:, 1]] = True
    sample = center + spacing * (np.argwhere(taken) + low + 0.5) @ tangents
    facts = {"effective_points": float(independent)}
    detection = _detection(fits, k, center, outward, covariance[2, 2], hull, facts, scan)
    return Plane(
        normal=-outward,
        center=center,
        tangents=tangents,
        covariance=covariance,
        area=float(fits.area[k]),
        outline=outline,
        sample=sample,
        spacing=spacing,
        detection=detection,
    )


def _known(center: Array, image: RangeImage, shared: SharedNoise) -> float:
    """Number of neighbouring points around a place (3,) that count as one by what they share."""
    away = float(np.linalg.norm(center))
    sine = max(float(np.hypot(center[0], center[1])) / away, 1e-3)
    return shared.at(away).factor(image.step_h * sine, image.step_v)


def _correlation(flat: Array, away: Array) -> float:
    """Number of correlated points that count as one, at least 1.

    Sums of the residuals' pulls on the plane over parts of the patch vary as the sums of so many
    points do if the points are independent, and more if waves of the surface or the scanner's
    errors run through neighbours (the sandwich estimator of White 1980, in clusters).
    """
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    part = np.minimum((flat - low) / np.maximum(size, 1e-9) * GATES.parts, GATES.parts - 1).astype(
        np.int64
    )
    number = part[:, 0] * GATES.parts + part[:, 1]
    middle = flat.mean(axis=0)
    pull = np.column_stack([np.ones(len(flat)), flat - middle])
    plane = np.linalg.lstsq(pull.T @ pull, pull.T @ away, rcond=None)[0]
    pull *= (away - pull @ plane)[:, None]
    used = np.bincount(number, minlength=GATES.parts**2) > 0
    sums = np.stack([np.bincount(number, c, minlength=GATES.parts**2) for c in pull.T], axis=1)[
        used
    ]
    alone = pull.T @ pull
    if len(sums) < GATES.fewest_parts or np.linalg.cond(alone) > 1e15:
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
        kind="plane",
        scan=scan,
        center=center,
        covariance=covariance,
        radius=radius,
        rms=float(fits.rms[k]),
        points=int(fits.points[k]),
        inliers=int(fits.points[k]),
        range=float(np.linalg.norm(center)),
        incidence=float(fits.incidence[k]),
        coverage=float(min(fits.area[k] / max(hull.volume, 1e-12), 1.0)),
        facts={"s0": float(fits.s0[k]), "area_m2": float(fits.area[k]), **facts},
    )
