"""Finds relative poses of two stations by their planes, without approximate values.

Turns and shifts that bring many planes together are refined over all planes that then lie on each
other and overlap; what the views of the two stations contradict is dropped. What is left is one
pose, several between which nothing decides (periodic facades, symmetric rooms), or none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from weakref import WeakKeyDictionary

import numpy as np

from tribrach._types import Array, Index
from tribrach.geometry import rotation as turns
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import skew
from tribrach.observations.unknowns import plane_basis
from tribrach.registration.alternatives import symmetric_places
from tribrach.registration.planes.plane_set import PlaneSet, overlap
from tribrach.registration.views import Agreement, Surroundings, seen


@dataclass(frozen=True)
class PlanePairGates:
    """How the relative pose of two stations is sought by their planes, and when it is decided.

    Chosen by hand with test_plane_poses, benchmarks/plane_registration.
    """

    #: normals of one surface differ by less than this, and so do the angles between two [rad]
    turn_rad: float = float(np.radians(1.0))
    #: turns that differ by less than this are one [rad]
    turns_apart_rad: float = float(np.radians(2.0))
    heading_step: float = 0.25  #: steps of headings that are proposed, over ``turn_rad``
    #: proposals of turns that are followed: of levelled stations, of others
    levelled_turns: int = 24
    free_turns: int = 40
    #: largest planes whose pairs propose a turn in space, and proposals that are weighed
    turning_planes: int = 24
    weighed_turns: int = 4000
    wall_sine: float = 0.3  #: planes whose normals are flatter than this sine propose no heading
    #: planes nearer to parallel than this propose no turn [rad]
    crossing_rad: float = float(np.radians(20.0))
    #: areas beyond this count no more [m^2]: one facade does not outweigh all else
    most_area_m2: float = 100.0

    #: normals within this angle are one direction [rad]
    direction_rad: float = float(np.radians(8.0))
    #: offsets of one surface agree within this while the turn is not yet sharp [m]
    offset_m: float = 0.1
    #: proposals along one direction, directions that are combined, and shifts that are returned
    peaks: int = 14
    combined_directions: int = 5
    most_shifts: int = 12
    #: directions are independent if the least singular value of their unit vectors is above this
    independent: float = 0.2

    #: largest planes that take part in the search, and poses that are looked at closely
    most_planes: int = 60
    close_looks: int = 80
    #: planes are one surface if normals agree within this [rad] and offsets within this [m], from
    #: the first fit to the last
    stages: tuple[tuple[float, float], ...] = ((0.0175, 0.1), (0.009, 0.04), (0.0045, 0.02))
    #: parts of one surface differ by less than this where there is something nearer [m]
    nearest_m: float = 0.004
    #: area [m^2] and share of the smaller plane that two patches have in common; half suffices
    common_m2: float = 0.2
    common_share: float = 0.05
    common_half: float = 0.5
    #: sigmas that no plane falls below in the fit of two stations [rad], [m]; tilt of levelled ones
    least_turn_rad: float = 2e-4
    least_offset_m: float = 1e-3
    levelled_rad: float = 3e-4
    #: sigmas of the start of a step [m], [rad], and along directions that the planes leave open [m]
    start_m: float = 0.3
    start_rad: float = 0.03
    still_m: float = 1e-4
    #: poses within this [m] and [rad] are the same
    same_m: float = 0.3
    same_rad: float = 0.03
    #: a pose is possible with at most this share of points in empty space ...
    most_conflict: float = 0.12
    least_overlap: float = 0.08  #: ... and this overlap in one direction at least
    #: a rival has at most so many times the points in empty space of the best pose, or more by
    #: this share of the points that agree there ...
    rival_times: float = 2.5
    rival_more: float = 0.012
    rival_agrees: float = 0.6  #: ... and at least this share of its agreement
    #: of two poses with like conflict the one that agrees more is the best, by this weight
    agreement_weight: float = 0.05
    #: a station lies on itself with at most this share of points in empty space
    own_conflict: float = 0.06
    own_most: int = 4  #: motions that lay a station on itself, at most


GATES = PlanePairGates()


def rotations(first: PlaneSet, second: PlaneSet, levelled: bool) -> Array:
    """Rotations ``first from second`` that bring normals together, best supported first.

    Levelled stations differ by one angle about the plumb line, and every pair of walls proposes
    one; others differ by three, and every pair of planes that enclose the same angle in both scans
    proposes them (method section 8.4: angles between normals do not change).
    """
    if len(first) == 0 or len(second) == 0:
        return np.zeros((0, 3, 3))
    proposed = _headings(first, second) if levelled else _turns(first, second)
    if len(proposed) == 0:
        return proposed
    support = np.array([_support(first, second, r) for r in proposed])
    out: list[Array] = []
    for k in np.argsort(-support, kind="stable"):
        if support[k] <= 0:
            break
        turn = _refined(first, second, proposed[k], levelled)
        if all(_angle(turn, other) > GATES.turns_apart_rad for other in out):
            out.append(turn)
        if len(out) == (GATES.levelled_turns if levelled else GATES.free_turns):
            break
    return np.array(out).reshape(-1, 3, 3)


def fitting_pairs(first: PlaneSet, second: PlaneSet, rotation: Array) -> tuple[Index, Index]:
    """Pairs of planes whose normals a rotation brings together."""
    cosine = first.normal @ (second.normal @ rotation.T).T
    i, j = np.nonzero(cosine > np.cos(GATES.turn_rad))
    return i, j


def pair_weights(first: PlaneSet, second: PlaneSet, i: Index, j: Index) -> Array:
    """Weights of pairs of planes by the smaller area."""
    return np.asarray(
        np.sqrt(np.minimum(np.minimum(first.area[i], second.area[j]), GATES.most_area_m2))
    )


def _headings(first: PlaneSet, second: PlaneSet) -> Array:
    """Turns (h, 3, 3) about the third axis, one for every pair of walls that lean alike."""
    flat = [np.linalg.norm(s.normal[:, :2], axis=1) > GATES.wall_sine for s in (first, second)]
    a, b = first.normal[flat[0]], second.normal[flat[1]]
    alike = np.abs(a[:, None, 2] - b[None, :, 2]) < GATES.turn_rad
    heading = np.arctan2(a[:, 1], a[:, 0])[:, None] - np.arctan2(b[:, 1], b[:, 0])[None]
    step = GATES.heading_step * GATES.turn_rad
    heading = np.unique(np.round(np.remainder(heading[alike], 2 * np.pi) / step))
    heading = heading * step
    out = np.zeros((len(heading), 3, 3))
    out[:, 0, 0] = out[:, 1, 1] = np.cos(heading)
    out[:, 1, 0], out[:, 0, 1] = np.sin(heading), -np.sin(heading)
    out[:, 2, 2] = 1.0
    return out


def _turns(first: PlaneSet, second: PlaneSet) -> Array:
    """Turns (h, 3, 3) that bring two planes of one station onto two of the other."""
    a, b = first.normal[: GATES.turning_planes], second.normal[: GATES.turning_planes]
    i, k = np.triu_indices(len(a), 1)
    j, m = np.nonzero(~np.eye(len(b), dtype=bool))
    angles_a = np.arccos(np.clip(np.einsum("ni,ni->n", a[i], a[k]), -1, 1))
    angles_b = np.arccos(np.clip(np.einsum("ni,ni->n", b[j], b[m]), -1, 1))
    wide = (angles_a > GATES.crossing_rad) & (angles_a < np.pi - GATES.crossing_rad)
    p, q = np.nonzero((np.abs(angles_a[:, None] - angles_b[None]) < GATES.turn_rad) & wide[:, None])
    area = np.minimum(
        np.minimum(first.area[i[p]], first.area[k[p]]),
        np.minimum(second.area[j[q]], second.area[m[q]]),
    )
    best = np.argsort(-area, kind="stable")[: GATES.weighed_turns]
    p, q = p[best], q[best]
    return np.asarray(_axes(a[i[p]], a[k[p]]) @ _axes(b[j[q]], b[m[q]]).transpose(0, 2, 1))


def _axes(one: Array, two: Array) -> Array:
    """Right-handed axes (n, 3, 3), by columns, of two directions (n, 3) each."""
    middle, across = one + two, one - two
    x = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    y = across / np.linalg.norm(across, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)


def _support(first: PlaneSet, second: PlaneSet, rotation: Array) -> float:
    """How much of the second station's planes has a counterpart."""
    i, j = fitting_pairs(first, second, rotation)
    if len(i) == 0:
        return 0.0
    best = np.zeros(len(second))
    np.maximum.at(best, j, pair_weights(first, second, i, j))
    return float(best.sum())


def _refined(first: PlaneSet, second: PlaneSet, rotation: Array, levelled: bool) -> Array:
    """The rotation that fits all normals that it brings together."""
    i, j = fitting_pairs(first, second, rotation)
    weight = pair_weights(first, second, i, j) ** 2
    a, b = first.normal[i], second.normal[j]
    if levelled:
        turned = b @ rotation.T
        sine = np.sum(weight * (turned[:, 0] * a[:, 1] - turned[:, 1] * a[:, 0]))
        angle = np.arctan2(sine, np.sum(weight * (turned[:, :2] * a[:, :2]).sum(axis=1)))
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    u, _, vt = np.linalg.svd((weight[:, None] * a).T @ b)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def _angle(one: Array, two: Array) -> float:
    """Angle [rad] between two rotations."""
    return float(np.arccos(np.clip((np.trace(one.T @ two) - 1) / 2, -1, 1)))


@dataclass(frozen=True)
class _Axis:
    """A direction that planes have in common: unit (3,), proposals (m,) [m] and their weights."""

    unit: Array
    values: Array
    weight: float


def shifts(first: PlaneSet, second: PlaneSet, rotation: Array) -> tuple[Array, Array]:
    """Propose shifts that bring the offsets of the planes together under a rotation, best first.

    None where the planes that the rotation brings together leave a direction open.

    Every pair of parallel planes proposes a shift along their normal. Along three independent
    directions the proposals with most support are combined; all other planes then decide which of
    the combinations are good.
    """
    i, j = fitting_pairs(first, second, rotation)
    weight = pair_weights(first, second, i, j)
    offsets_between = first.offset[i] - second.offset[j]
    axes = _shift_axes(first.normal[i], offsets_between, weight)[: GATES.combined_directions]
    proposals: list[Array] = []
    for triple in combinations(axes, 3):
        units = np.array([axis.unit for axis in triple])
        if np.linalg.svd(units, compute_uv=False)[-1] < GATES.independent:
            continue
        values = np.array(list(product(*(axis.values for axis in triple))))
        proposals.append(values @ np.linalg.inv(units).T)
    if not proposals:
        return np.zeros((0, 3)), np.zeros(0)
    shift = np.concatenate(proposals)
    support = _shift_support(shift, first.normal[i], offsets_between, weight, i)
    order = np.argsort(-support, kind="stable")
    kept: list[int] = []
    for k in order:
        if all(np.linalg.norm(shift[k] - shift[m]) > GATES.offset_m for m in kept):
            kept.append(int(k))
        if len(kept) == GATES.most_shifts:
            break
    return shift[kept], support[kept]


def open_directions(normal: Array) -> Array:
    """Unit directions that planes leave open, none if they hold all three."""
    if len(normal) == 0:
        return np.eye(3)
    values, vectors = np.linalg.eigh(_directions(normal))
    return np.asarray(vectors[:, np.sqrt(np.maximum(values, 0)) < GATES.independent].T)


def _directions(normal: Array) -> Array:
    """Sum (3, 3) of the outer products of the different directions, each counted once."""
    units: list[Array] = []
    for n in normal:
        if all(abs(n @ u) < np.cos(GATES.direction_rad) for u in units):
            units.append(n)
    directions = np.array(units)
    return np.asarray(directions.T @ directions)


def _shift_axes(normal: Array, offsets_between: Array, weight: Array) -> list[_Axis]:
    """Directions of pairs (p, 3) with their best proposals, those of most weight first."""
    out: list[_Axis] = []
    left = np.ones(len(normal), dtype=bool)
    while left.any():
        head = normal[np.flatnonzero(left)[np.argmax(weight[left])]]
        cosine = normal @ head
        alike = left & (np.abs(cosine) > np.cos(GATES.direction_rad))
        values = (offsets_between * np.sign(cosine))[alike]
        out.append(_Axis(head, _peaks(values, weight[alike]), float(weight[alike].sum())))
        left &= ~alike
    return sorted(out, key=lambda axis: -axis.weight)


def _peaks(values: Array, weight: Array) -> Array:
    """Values (m,) around which most weight lies, no two within the tolerance."""
    near = np.abs(values[:, None] - values[None]) < GATES.offset_m / 2
    support = near @ weight
    kept: list[float] = []
    for k in np.argsort(-support, kind="stable"):
        # walls and what is let into them propose several values: the one in the middle of the area
        value = _median(values[near[k]], weight[near[k]])
        if all(abs(value - v) > GATES.offset_m / 2 for v in kept):
            kept.append(value)
        if len(kept) == GATES.peaks:
            break
    return np.array(kept)


def _median(values: Array, weight: Array) -> float:
    """The value with half of the weight on either side."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(total, total[-1] / 2)]])


def _shift_support(
    shift: Array, normal: Array, offsets_between: Array, weight: Array, owner: Index
) -> Array:
    """Weight (t,) of the first station's planes that have a counterpart under each shift."""
    starts = np.flatnonzero(np.r_[True, np.diff(owner) > 0])
    out = np.empty(len(shift))
    for a in range(0, len(shift), 2000):
        some = shift[a : a + 2000]
        good = np.abs(some @ normal.T - offsets_between) < GATES.offset_m
        best = np.maximum.reduceat(np.where(good, weight, 0.0), starts, axis=1)
        out[a : a + 2000] = best.sum(axis=1)
    return out


@dataclass(frozen=True, eq=False)
class PlanePose:
    """A possible relative pose of two stations."""

    pose: Pose  #: first from second
    pairs: Index  #: (p, 2), numbers of the common planes
    rms: float  #: root mean square of their offsets [m]
    seen: Agreement  #: how points of either station stand in the view of the other
    overlap: float  #: the lesser share of points that the other station sees
    most_overlap: float  #: the larger one
    #: (f, 3), directions of the first frame along which the common planes hold nothing, so that
    #: the shift is that of the search
    open: Array


@dataclass(frozen=True, eq=False)
class PairPoses:
    """What the planes of two stations say about their relative pose."""

    #: names of the stations
    first: str
    second: str
    poses: tuple[PlanePose, ...]  #: possible poses, best first; more than one where nothing decides
    open: Array  #: (f, 3), directions that the planes leave open, if that is the obstacle
    #: name of the station in whose frame they are, empty if there is no such obstacle
    lacking: str = ""

    @property
    def ends(self) -> frozenset[str]:
        """Names of both stations."""
        return frozenset((self.first, self.second))

    @property
    def sure(self) -> bool:
        """True if exactly one pose is possible."""
        return len(self.poses) == 1


def pair_poses(first: Surroundings, second: Surroundings) -> PairPoses:
    """Find the possible relative poses of two stations."""
    for one in (first, second):
        lacking = open_directions(one.planes.normal)
        if len(lacking):
            return PairPoses(first.name, second.name, (), lacking, one.name)
    fits = _fits(first, second)
    good = decided(fits)
    if good and len(good[0].open):
        return PairPoses(first.name, second.name, (), good[0].open, first.name)
    good = tuple(f for f in good if len(f.open) == 0)
    found = PairPoses(first.name, second.name, good, np.zeros((0, 3)))
    if not good:
        return found
    own, other = symmetries(first), symmetries(second)
    return with_rivals(first, second, found, symmetric_places(good[0].pose, own, other))


def with_rivals(
    first: Surroundings, second: Surroundings, found: PairPoses, places: Sequence[Pose]
) -> PairPoses:
    """Add the poses at further places that nothing excludes, where one repeats itself for instance.

    Such a place may have less overlap than the best and be right all the same: what the stations
    saw is the same thing twice. Only what lies in empty space speaks against it.
    """
    out = list(found.poses)
    for place in places:
        fit = _fit(first, second, place)
        if fit is None or any(_same(fit.pose, other.pose) for other in out):
            continue
        if fit.seen.agree and not contradicted(out[0], fit):
            out.append(fit)
    return replace(found, poses=tuple(out))


def _fits(first: Surroundings, second: Surroundings) -> list[PlanePose]:
    """Possible poses at all places that the planes propose."""
    levelled = first.levelled and second.levelled
    planes_a = first.planes.largest(GATES.most_planes)
    planes_b = second.planes.largest(GATES.most_planes)
    trials: list[tuple[float, Pose]] = []
    for turn in rotations(planes_a, planes_b, levelled):
        shift, support = shifts(planes_a, planes_b, turn)
        trials += [(float(s), Pose(turn, t)) for s, t in zip(support, shift, strict=True)]
    trials.sort(key=lambda trial: -trial[0])
    fits: list[PlanePose] = []
    for _, start in trials[: GATES.close_looks]:
        if any(_same(start, other.pose) for other in fits):
            continue
        fit = refined(first, second, start)
        if fit is not None and not any(_same(fit.pose, other.pose) for other in fits):
            fits.append(fit)
    return fits


#: symmetries of stations that are at hand
_SYMMETRIES: WeakKeyDictionary[Surroundings, tuple[Pose, ...]] = WeakKeyDictionary()


def symmetries(station: Surroundings) -> tuple[Pose, ...]:
    """Turns and shifts that lay a station on itself, looked for once, the best first."""
    if station not in _SYMMETRIES:
        fits = [f for f in _fits(station, station) if f.seen.conflict <= GATES.own_conflict]
        fits = [f for f in fits if len(f.open) == 0 and not _same(f.pose, Pose.identity())]
        fits.sort(key=lambda f: f.seen.conflict)
        _SYMMETRIES[station] = tuple(f.pose for f in fits[: GATES.own_most])
    return _SYMMETRIES[station]


def contradicted(best: PlanePose, other: PlanePose) -> bool:
    """True if clearly more lies in empty space than at the best pose."""
    few, more = (f.seen.through + f.seen.sky for f in (best, other))
    return more > max(GATES.rival_times * few, few + GATES.rival_more * best.seen.agree)


def refined(first: Surroundings, second: Surroundings, start: Pose) -> PlanePose | None:
    """Fit a relative pose to all common planes; None if too little or too much speaks of it."""
    fit = _fit(first, second, start)
    if fit is None or fit.seen.conflict > GATES.most_conflict:
        return None
    return fit if fit.most_overlap >= GATES.least_overlap else None


def _fit(first: Surroundings, second: Surroundings, start: Pose) -> PlanePose | None:
    """The same, whatever speaks of it; None if hardly a plane is common."""
    levelled = first.levelled and second.levelled
    pose = start
    pairs = np.zeros((0, 2), dtype=np.int64)
    for turn, offset in GATES.stages:
        pairs = common_planes(first.planes, second.planes, pose, turn, offset)
        if len(pairs) < 2:
            return None
        pose = _fitted(first.planes, second.planes, pairs, pose, levelled)
    held = open_directions(first.planes.normal[pairs[:, 0]])
    both, there, back = seen(first, second, pose)
    i, j = pairs.T
    off = offsets(first.planes, second.planes, i, j, pose)
    rms = float(np.sqrt(np.mean(off**2)))
    return PlanePose(pose, pairs, rms, both, min(there, back), max(there, back), held)


def common_planes(
    first: PlaneSet, second: PlaneSet, pose: Pose, turn: float, offset: float
) -> Index:
    """Planes that are one surface under a pose: alike and overlapping."""
    cosine = first.normal @ (second.normal @ pose.rotation.T).T
    i, j = np.nonzero(cosine > np.cos(turn))
    away = np.abs(offsets(first, second, i, j, pose))
    i, j, away = i[away < offset], j[away < offset], away[away < offset]
    size = np.minimum(first.area[i], second.area[j])
    shared = np.array(
        [overlap(first, second, a, b, pose) for a, b in zip(i.tolist(), j.tolist(), strict=True)]
    )
    good = shared > np.minimum(
        np.maximum(GATES.common_m2, GATES.common_share * size), GATES.common_half * size
    )
    i, j, away = i[good], j[good], away[good]
    # a wall and what is let into it: each belongs to the nearest of the other's
    least = np.full((2, max(len(first), len(second))), np.inf)
    np.minimum.at(least[0], i, away)
    np.minimum.at(least[1], j, away)
    nearest = away <= np.minimum(least[0][i], least[1][j]) + GATES.nearest_m
    return np.stack([i[nearest], j[nearest]], axis=1)


def offsets(first: PlaneSet, second: PlaneSet, i: Index, j: Index, pose: Pose) -> Array:
    """Offsets [m] of paired planes of the two stations, the smaller of those at either centre."""
    there = pose @ second.center[j]
    here = np.einsum("pi,pi->p", first.normal[i], there) - first.offset[i]
    normal = second.normal[j] @ pose.rotation.T
    back = np.einsum("pi,pi->p", normal, there - first.center[i])
    # the centre of a large patch lies far off where the turn is not sharp yet
    return np.asarray(np.where(np.abs(here) < np.abs(back), here, back))


def information(
    first: PlaneSet,
    second: PlaneSet,
    pairs: Index,
    pose: Pose,
    floor: tuple[float, float] = (0.0, 0.0),
) -> tuple[Array, Array]:
    """Normal matrix and right side of a relative pose from common planes.

    ``floor``: sigmas [rad], [m] that no plane falls below.

    The unknowns are the shift [m] and the left turn [rad] of the second station in the frame of the
    first, about its origin.
    """
    i, j = pairs.T
    normal, anchor = first.normal[i], pose @ second.center[j]
    turned = second.normal[j] @ pose.rotation.T
    basis = plane_basis(normal).transpose(0, 2, 1)
    joint = first.covariance[i] + second.covariance[j]
    tilt = 1 / np.sqrt(np.einsum("pkk->pk", joint)[:, :2] + floor[0] ** 2)
    # a turn by d about the first station's origin moves normals by d x n, points by d x X
    by_turn = -basis @ skew(turned)
    rows = np.concatenate([np.zeros_like(by_turn), by_turn], axis=2) * tilt[:, :, None]
    right = np.einsum("pki,pi->pk", basis, normal - turned) * tilt
    # the middle of the smaller patch lies on the larger plane, whose tilt is known better: the
    # normal of a small patch says nothing of places far from it
    here = first.area[i] < second.area[j]
    gap = first.center[i] - anchor
    place = np.where(here[:, None], first.center[i], anchor)
    across = np.where(here[:, None], turned, normal)
    by_pose = np.concatenate([across, np.cross(place, across)], axis=1)
    off = np.einsum("pi,pi->p", across, gap)
    by_first, by_second = (_swung(first, i, -gap), _swung(second, j, gap @ pose.rotation))
    swung = np.where(here[:, None], by_second, by_first)
    spread = joint[:, 2, 2] + floor[1] ** 2 + swung[:, 0] + swung[:, 1] * floor[0] ** 2
    away = 1 / np.sqrt(spread)
    design = np.concatenate([rows.reshape(-1, 6), by_pose * away[:, None]])
    values = np.concatenate([right.ravel(), off * away])
    return design.T @ design, design.T @ values


def _swung(planes: PlaneSet, numbers: Index, lever: Array) -> Array:
    """What tilts add to the variance of offsets, and the squared levers along the planes [m^2]."""
    along = np.einsum("kia,ki->ka", plane_basis(planes.normal[numbers]), lever)
    c = planes.covariance[numbers]
    by_tilt = np.einsum("ka,kab,kb->k", along, c[:, :2, :2], along)
    shared = np.einsum("ka,ka->k", along, c[:, :2, 2])
    return np.stack([by_tilt - 2 * shared, (along**2).sum(axis=1)], axis=1)


def _fitted(first: PlaneSet, second: PlaneSet, pairs: Index, pose: Pose, levelled: bool) -> Pose:
    """The pose with least squares of tilts and offsets of common planes, one step."""
    normal, right = information(
        first, second, pairs, pose, (GATES.least_turn_rad, GATES.least_offset_m)
    )
    normal = normal + np.diag(1 / np.repeat([GATES.start_m, GATES.start_rad], 3) ** 2)
    # what the planes hardly hold, by the noise of their normals alone, stays where it is
    lacking = open_directions(first.normal[pairs[:, 0]])
    normal[:3, :3] += lacking.T @ lacking / GATES.still_m**2
    if levelled:
        # the turn brings the third axis of the second station onto that of the first
        up = pose.rotation[:, 2]
        normal[[3, 4], [3, 4]] += 1 / GATES.levelled_rad**2
        right[3:5] += np.array([up[1], -up[0]]) / GATES.levelled_rad**2
    scale = 1 / np.sqrt(np.diag(normal))
    step = scale * np.linalg.solve(normal * scale[:, None] * scale, scale * right)
    turn = turns.exp(step[None, 3:])[0]
    return Pose(turn @ pose.rotation, turn @ pose.translation + step[:3])


def _same(one: Pose, other: Pose) -> bool:
    """True if two poses are the same."""
    cosine = (np.trace(one.rotation.T @ other.rotation) - 1) / 2
    near = float(np.linalg.norm(one.translation - other.translation)) < GATES.same_m
    return near and bool(np.arccos(np.clip(cosine, -1, 1)) < GATES.same_rad)


def decided(fits: Sequence[PlanePose]) -> tuple[PlanePose, ...]:
    """The best of several poses and those that are nearly as good."""
    if not fits:
        return ()
    most = max(f.seen.agree for f in fits)
    good = [f for f in fits if f.seen.agree >= GATES.rival_agrees * most]
    best = min(good, key=lambda f: f.seen.conflict - GATES.agreement_weight * f.seen.agree / most)
    rivals = [f for f in good if f is not best and not contradicted(best, f)]
    rivals.sort(key=lambda f: f.seen.conflict)
    return (best, *rivals)
