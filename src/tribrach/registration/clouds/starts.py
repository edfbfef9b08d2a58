"""Proposes poses of one scan in another, without approximate values.

Plans of upright scans are correlated at every heading and shift. Where it is installed
(``pip install tribrach[kiss]``), kiss-matcher (Lim et al. 2025) proposes one more, whatever the
attitude of the scans: local shapes are matched and the largest consistent set gives the pose.
Proposals are judged by the clouds before they are believed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.registration.clouds.surfels import Surfels


@dataclass(frozen=True)
class PlanSearchGates:
    """How the plan of one scan is searched in that of another, and which places are kept.

    Chosen by hand with test_pair, benchmarks/registration.
    """

    cells: int = 256  #: cells of the plan along an edge
    least_cell_m: float = 0.4  #: their least size [m]
    within_quantile: float = 0.97  #: part of the surfels that the plan reaches out to
    fewest_surfels: int = 20  #: fewer walls, or fewer surfaces that look up, propose nothing
    #: places kept per heading and in all
    per_heading: int = 3
    most_places: int = 16
    #: places with less than this share of the best correlation are not kept
    best_share: float = 0.45
    #: a heading turns the outer part of the plan by a cell, which lies at this share of the radius
    heading_radii: float = 0.7
    #: headings between these steps [rad]
    finest_rad: float = float(np.radians(1.0))
    coarsest_rad: float = float(np.radians(3.0))
    #: places nearer than this many cells and headings than this many steps are one
    same_cells: float = 3.0
    same_steps: float = 2.5
    #: normals: of walls below, of floors and ceilings above, of slopes below [sine of the slope]
    wall_sine: float = 0.5
    level_sine: float = 0.9
    slope_sine: float = 0.985
    #: a scan with a larger share of walls is not searched by slopes: its walls say more
    walls_share: float = 0.1
    #: floors lean by so much, no more and no less [rad]
    least_tilt_rad: float = float(np.radians(3.0))
    most_tilt_rad: float = float(np.radians(60.0))
    alike_rad: float = float(np.radians(4.0))  #: normals of a floor are alike within this [rad]
    floor_seeds: int = 300  #: surfaces that are tried as floor, about
    height_class_m: float = 0.15  #: width of the classes of differences of height [m]
    #: heights that are kept of a place, and the share of the weight of the first that each needs
    heights: int = 2
    second_height_share: float = 0.5
    #: a scan on itself: other places have less in common with it than it has with itself
    own_best_share: float = 0.15
    own_places: int = 16
    own_heights: int = 4
    own_height_share: float = 0.03
    most_level: int = 20_000  #: level surfaces that are compared, about: bounds the time
    levels: int = 4  #: levels of a cell of the plan that are compared

    kiss_voxel_sizes: float = 1.5  #: size of the cubes of kiss-matcher [sizes of the surfels]
    kiss_fewest: int = 50  #: fewer surfels are not matched by it
    #: its rotations are none if their rows depart from orthonormal by more
    kiss_skewed: float = 1e-3


GATES = PlanSearchGates()


@dataclass(frozen=True)
class Kept:
    """How many places of a plan are kept, and how many heights of each."""

    #: places, and the share of the best correlation that each needs
    places: int = GATES.most_places
    share: float = GATES.best_share
    #: heights of a place, and the share of the weight of the first that each needs
    heights: int = GATES.heights
    height_share: float = GATES.second_height_share


#: of two scans, and of a scan that is laid on itself
_PAIR = Kept()
_OWN = Kept(GATES.own_places, GATES.own_best_share, GATES.own_heights, GATES.own_height_share)

Plan = NDArray[np.complex64]


def own_poses(a: Surfels) -> list[Pose]:
    """Propose poses at which a scan lies on itself: turns, mirrored ends, storeys, bays."""
    return _upright_poses(a, a, _OWN) or _upright_poses(a, a, _OWN, GATES.slope_sine)


def plan_poses(a: Surfels, b: Surfels, kept: Kept = _PAIR) -> list[Pose]:
    """Propose poses of one upright scan in another, by trying every heading and shift of its plan.

    Walls are drawn into a plan as vectors: the horizontal normal of each surfel as a complex
    number, so that walls that face each other cancel instead of matching. For each heading one
    Fourier transform correlates the plans of both scans at all shifts; the height follows from
    level surfaces. Nothing is sampled by chance: a second place that fits as well is found like the
    first (method section 2.11 asks for no confident wrong pose).

    Scans are taken as upright, and once more levelled by what seems to be their floor if that leans
    by more than three degrees.
    """
    out = _upright_poses(a, b, kept)
    level = [_levelling(x) for x in (a, b)]
    if level[0] is None and level[1] is None:
        return out
    one, two = (Pose.identity() if x is None else x for x in level)
    poses = _upright_poses(a.placed(one), b.placed(two), kept)
    return out + [one.inverse @ pose @ two for pose in poses]


def slope_poses(a: Surfels, b: Surfels) -> list[Pose]:
    """Propose poses by the slopes of bare ground and heaps, where there are hardly any walls.

    The plan of walls, drawn with all that is not level: the horizontal part of a normal is the
    longer the steeper the slope is.
    """
    steep = [x.area[np.abs(x.normal[:, 2]) < GATES.wall_sine].sum() / x.area.sum() for x in (a, b)]
    if min(steep) > GATES.walls_share:
        return []
    one, two = (_levelling(x) or Pose.identity() for x in (a, b))
    poses = _upright_poses(a.placed(one), b.placed(two), _PAIR, GATES.slope_sine)
    return [one.inverse @ pose @ two for pose in poses]


def levelled_pose(a: Surfels, b: Surfels) -> Pose | None:
    """The pose of one frame after both scans are levelled by their floors; None if they are."""
    one, two = (_levelling(x) for x in (a, b))
    if one is None and two is None:
        return None
    return (one or Pose.identity()).inverse @ (two or Pose.identity())


def _levelling(s: Surfels) -> Pose | None:
    """The turn that makes the largest set of upward surfaces level; None if it is, or has none."""
    up = s.subset(s.normal[:, 2] > np.cos(GATES.most_tilt_rad))
    if len(up) < GATES.fewest_surfels:
        return None
    seeds = up.normal[:: max(1, len(up) // GATES.floor_seeds)]
    near = seeds @ up.normal.T > np.cos(GATES.alike_rad)
    best = int(np.argmax(near @ up.area))
    floor = up.area[near[best]] @ up.normal[near[best]]
    floor /= np.linalg.norm(floor)
    lean = float(np.arccos(np.clip(floor[2], -1, 1)))
    if lean < GATES.least_tilt_rad:
        return None
    axis = np.cross(floor, [0.0, 0.0, 1.0])
    return Pose(exp(lean * axis / np.linalg.norm(axis)), np.zeros(3))


def _upright_poses(a: Surfels, b: Surfels, kept: Kept, sine: float = GATES.wall_sine) -> list[Pose]:
    """The same for scans whose z axes are upright, by surfaces steeper than a sine."""
    walls = [x.subset(np.abs(x.normal[:, 2]) < sine) for x in (a, b)]
    if min(map(len, walls)) < GATES.fewest_surfels:
        return []
    radius = [
        float(np.quantile(np.hypot(w.center[:, 0], w.center[:, 1]), GATES.within_quantile))
        for w in walls
    ]
    cell = max(GATES.least_cell_m, 2 * sum(radius) / GATES.cells)
    step = float(
        np.clip(cell / (GATES.heading_radii * radius[1]), GATES.finest_rad, GATES.coarsest_rad)
    )
    count = int(np.ceil(2 * np.pi / step))
    base = np.conj(fft.fft2(_blurred(_drawn(walls[0], 0.0, cell, radius[0]))))
    peaks = []
    for number in range(count):
        heading = 2 * np.pi * number / count
        moved = fft.fft2(_drawn(walls[1], heading, cell, radius[1]))
        score = np.real(fft.ifft2(base * moved))
        peaks += [(s, heading, x, y) for s, x, y in _peaks(score, cell)]
    distinct = _distinct(peaks, cell, 2 * np.pi / count, kept)
    # the correlation puts a at b shifted by (x, y): b lies in a at the opposite
    return [pose for _, h, x, y in distinct for pose in _raised(a, b, (h, -x, -y), kept)]


def _drawn(walls: Surfels, heading: float, cell: float, radius: float) -> Plan:
    """The plan (n, n) of walls turned by a heading."""
    turn = np.exp(1j * heading)
    at = (walls.center[:, 0] + 1j * walls.center[:, 1]) * turn
    normal = (walls.normal[:, 0] + 1j * walls.normal[:, 1]) * turn
    near = np.abs(at) <= radius
    at, normal = at[near], normal[near] * walls.area[near]
    column = np.floor(at.real / cell).astype(np.int64) % GATES.cells
    row = np.floor(at.imag / cell).astype(np.int64) % GATES.cells
    place = row * GATES.cells + column
    size = GATES.cells * GATES.cells
    plan = np.bincount(place, normal.real, size) + 1j * np.bincount(place, normal.imag, size)
    # high walls count more than low ones, but not as much more as they are higher
    strength = np.sqrt(np.maximum(np.abs(plan), 1e-12))
    return (plan / strength).astype(np.complex64).reshape(GATES.cells, GATES.cells)


def _blurred(plan: Plan) -> Plan:
    """The plan with every cell also in its neighbours, by half."""
    out = plan.copy()
    for axis in (0, 1):
        out = 0.5 * out + 0.25 * (np.roll(out, 1, axis) + np.roll(out, -1, axis))
    return out.astype(np.complex64)


def _peaks(score: NDArray[np.float32], cell: float) -> list[tuple[float, float, float]]:
    """Best places of one heading: score, x, y [m]."""
    out = []
    score = score.copy()
    for _ in range(GATES.per_heading):
        best = int(np.argmax(score))
        row, column = divmod(best, GATES.cells)
        value = float(score[row, column])
        if value <= 0:
            break
        x, y = (k - GATES.cells if k >= GATES.cells // 2 else k for k in (column, row))
        out.append((value, x * cell, y * cell))
        near = np.arange(-2, 3)
        score[np.ix_((row + near) % GATES.cells, (column + near) % GATES.cells)] = 0
    return out


def _distinct(
    peaks: list[tuple[float, float, float, float]], cell: float, step: float, kept: Kept
) -> list[tuple[float, float, float, float]]:
    """The best places, each far enough from all better ones."""
    table = np.array(sorted(peaks, reverse=True))
    if len(table) == 0:
        return []
    out: list[int] = []
    for k in range(len(table)):
        other = table[out]
        turn = np.abs(np.angle(np.exp(1j * (other[:, 1] - table[k, 1]))))
        apart = np.hypot(other[:, 2] - table[k, 2], other[:, 3] - table[k, 3])
        if not ((turn < GATES.same_steps * step) & (apart < GATES.same_cells * cell)).any():
            out.append(k)
        if len(out) == kept.places or table[k, 0] < kept.share * table[0, 0]:
            break
    return [tuple(map(float, row)) for row in table[out]]  # type: ignore[misc]


def _raised(a: Surfels, b: Surfels, place: tuple[float, float, float], kept: Kept) -> list[Pose]:
    """A place of the plan (heading, x, y) with its heights."""
    heading, x, y = place
    flat = Pose(exp(np.array([0.0, 0.0, heading])), np.array([x, y, 0.0]))
    heights = _heights(a, b.placed(flat), kept)
    return [Pose(flat.rotation, np.array([x, y, z])) for z in heights]


def _heights(a: Surfels, b: Surfels, kept: Kept) -> list[float]:
    """How much b must be raised: the most frequent differences of level surfaces, or zero."""
    differences = [_level_differences(a, b, side) for side in (1.0, -1.0)]
    value = np.concatenate([d[0] for d in differences])
    weight = np.concatenate([d[1] for d in differences])
    if len(value) == 0:
        return [0.0]
    low = value.min()
    number = np.floor((value - low) / GATES.height_class_m).astype(np.int64)
    tally = np.convolve(np.bincount(number, weight), [0.5, 1.0, 0.5], mode="same")
    out: list[float] = []
    most = float(tally.max())
    for _ in range(kept.heights):
        best = int(np.argmax(tally))
        if tally[best] < kept.height_share * most:
            break
        near = (
            np.abs(value - low - (best + 0.5) * GATES.height_class_m) < 1.5 * GATES.height_class_m
        )
        out.append(float(np.average(value[near], weights=weight[near])) if near.any() else low)
        tally[max(best - 3, 0) : best + 4] = 0
    return out


def _level_differences(a: Surfels, b: Surfels, side: float) -> tuple[Array, Array]:
    """Differences (n,) of heights of level surfaces in the same cell of the plan, weights (n,)."""
    size = 2 * float(max(np.median(a.size), np.median(b.size)))
    tables = []
    for x in (a, b):
        level = np.flatnonzero(side * x.normal[:, 2] > GATES.level_sine)
        level = level[:: max(1, len(level) // GATES.most_level)]
        cell = np.floor(x.center[level, :2] / size).astype(np.int64)
        key = (cell[:, 0] + (1 << 30)) * (1 << 31) + cell[:, 1] + (1 << 30)
        order = np.argsort(key, kind="stable")
        tables.append((key[order], x.center[level, 2][order]))
    (key_a, z_a), (key_b, z_b) = tables
    # every level of a cell of b against up to four levels of the same cell of a
    first, last = np.searchsorted(key_a, key_b), np.searchsorted(key_a, key_b, side="right")
    values, weights = [], []
    for k in range(GATES.levels):
        some = first + k < last
        values.append(z_a[first[some] + k] - z_b[some])
        weights.append(1.0 / np.minimum(last[some] - first[some], GATES.levels))
    return np.concatenate(values), np.concatenate(weights)


try:
    import kiss_matcher
except ImportError:
    kiss_matcher = None


def kiss_poses(a: Surfels, b: Surfels) -> list[Pose]:
    """Propose a pose by kiss-matcher."""
    if kiss_matcher is None or min(len(a), len(b)) < GATES.kiss_fewest:
        return []
    size = float(max(np.median(x.size) for x in (a, b)))
    matcher = kiss_matcher.KISSMatcher(
        kiss_matcher.KISSMatcherConfig(GATES.kiss_voxel_sizes * size)
    )
    estimate = matcher.estimate(*(list(x.center.astype(np.float32)) for x in (b, a)))
    rotation = np.asarray(estimate.rotation, dtype=np.float64)
    if not estimate.valid or np.abs(rotation @ rotation.T - np.eye(3)).max() > GATES.kiss_skewed:
        return []
    u, _, vt = np.linalg.svd(rotation)
    if np.linalg.det(u @ vt) < 0:
        return []
    return [Pose(u @ vt, np.asarray(estimate.translation, dtype=np.float64).reshape(3))]
