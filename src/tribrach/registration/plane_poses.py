"""Relative poses of two stations from their planes, found without approximate values.

Turns and shifts that bring many planes together are refined over all planes that then lie on each
other and overlap; what the views of the two stations contradict is dropped. What is left is one
pose, several between which nothing decides (periodic facades, symmetric rooms), or none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.geometry import rotation as turns
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import skew
from tribrach.network.unknowns import plane_basis
from tribrach.registration.plane_rotations import rotations
from tribrach.registration.plane_set import PlaneSet, overlap
from tribrach.registration.plane_shifts import open_directions, shifts
from tribrach.registration.station_view import Agreement
from tribrach.registration.surroundings import Surroundings, seen

__all__ = [
    "PairPoses",
    "PlanePose",
    "common_planes",
    "decided",
    "information",
    "offsets",
    "pair_poses",
    "refined",
]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: largest planes that take part in the search, and poses that are looked at closely
_PLANES, _CLOSE = 60, 80
#: planes are one surface if their normals agree within this [rad] and the offsets within this [m],
#: from the first fit to the last
_STAGES = ((0.0175, 0.1), (0.009, 0.04), (0.0045, 0.02))
#: parts of one surface differ by less than this where there is something nearer [m]
_ALIKE = 0.004
#: area [m^2] and share of the smaller plane that two patches have in common
_COMMON, _SHARE = 0.2, 0.05
#: sigmas that no plane falls below in the fit of two stations [rad], [m]; tilt of levelled ones
_TURN, _OFFSET, _TILT = 2e-4, 1e-3, 3e-4
#: sigmas of the start of a step [m], [rad], and along directions that the planes leave open [m]
_START, _STILL = np.repeat([0.3, 0.03], 3), 1e-4
#: poses within this [m] and [rad] are the same
_SAME_PLACE, _SAME_TURN = 0.3, 0.03
#: a pose is possible with at most this share of points in empty space, and this overlap
_CONFLICT, _OVERLAP = 0.12, 0.08
#: a rival has at most so many times the conflict of the best pose, or so much more of it, and at
#: least this share of its agreement
_TIMES, _MORE, _AGREES = 2.5, 0.012, 0.6


@dataclass(frozen=True, eq=False)
class PlanePose:
    """A possible relative pose.

    pose : first from second; pairs (p, 2) : numbers of the common planes; rms : of their offsets
    [m]; seen : how points of either stand in the view of the other; overlap : the lesser share of
    points that the other sees; open : directions (f, 3) of the first frame along which the common
    planes hold nothing, so that the shift is that of the search.
    """

    pose: Pose
    pairs: Index
    rms: float
    seen: Agreement
    overlap: float
    open: Array


@dataclass(frozen=True, eq=False)
class PairPoses:
    """What the planes of two stations say about their relative pose.

    poses : possible ones, best first, more than one where nothing decides; open : directions
    (f, 3) that the planes leave open if that is the obstacle; lacking : name of the station in
    whose frame they are, "" if there is no such obstacle.
    """

    first: str
    second: str
    poses: tuple[PlanePose, ...]
    open: Array
    lacking: str = ""

    @property
    def sure(self) -> bool:
        """True if exactly one pose is possible."""
        return len(self.poses) == 1


def pair_poses(first: Surroundings, second: Surroundings) -> PairPoses:
    """Possible relative poses of two stations."""
    levelled = first.levelled and second.levelled
    mine, theirs = first.planes.largest(_PLANES), second.planes.largest(_PLANES)
    for one in (first, second):
        lacking = open_directions(one.planes.normal)
        if len(lacking):
            return PairPoses(first.name, second.name, (), lacking, one.name)
    trials: list[tuple[float, Pose]] = []
    for turn in rotations(mine, theirs, levelled):
        shift, support = shifts(mine, theirs, turn)
        trials += [(float(s), Pose(turn, t)) for s, t in zip(support, shift, strict=True)]
    trials.sort(key=lambda trial: -trial[0])
    found: list[PlanePose] = []
    for _, start in trials[:_CLOSE]:
        if any(_same(start, other.pose) for other in found):
            continue
        fit = refined(first, second, start)
        if fit is not None and not any(_same(fit.pose, other.pose) for other in found):
            found.append(fit)
    good = decided(found)
    if good and len(good[0].open):
        return PairPoses(first.name, second.name, (), good[0].open, first.name)
    good = tuple(f for f in good if len(f.open) == 0)
    return PairPoses(first.name, second.name, good, np.zeros((0, 3)))


def refined(first: Surroundings, second: Surroundings, start: Pose) -> PlanePose | None:
    """A pose fitted to all common planes; None if there are none or the views contradict it."""
    levelled = first.levelled and second.levelled
    pose = start
    pairs = np.zeros((0, 2), dtype=np.int64)
    for turn, offset in _STAGES:
        pairs = common_planes(first.planes, second.planes, pose, turn, offset)
        if len(pairs) < 2:
            return None
        pose = _fitted(first.planes, second.planes, pairs, pose, levelled)
    held = open_directions(first.planes.normal[pairs[:, 0]])
    both, there, back = seen(first, second, pose)
    if both.conflict > _CONFLICT or max(there, back) < _OVERLAP:
        return None
    i, j = pairs.T
    off = offsets(first.planes, second.planes, i, j, pose)
    return PlanePose(pose, pairs, float(np.sqrt(np.mean(off**2))), both, min(there, back), held)


def common_planes(
    first: PlaneSet, second: PlaneSet, pose: Pose, turn: float, offset: float
) -> Index:
    """Numbers (p, 2) of planes that are one surface under a pose: alike and overlapping."""
    cosine = first.normal @ (second.normal @ pose.rotation.T).T
    i, j = np.nonzero(cosine > np.cos(turn))
    away = np.abs(offsets(first, second, i, j, pose))
    i, j, away = i[away < offset], j[away < offset], away[away < offset]
    size = np.minimum(first.area[i], second.area[j])
    shared = np.array(
        [overlap(first, second, a, b, pose) for a, b in zip(i.tolist(), j.tolist(), strict=True)]
    )
    good = shared > np.minimum(np.maximum(_COMMON, _SHARE * size), 0.5 * size)
    i, j, away = i[good], j[good], away[good]
    # a wall and what is let into it: each belongs to the nearest of the other's
    least = np.full((2, max(len(first), len(second))), np.inf)
    np.minimum.at(least[0], i, away)
    np.minimum.at(least[1], j, away)
    nearest = away <= np.minimum(least[0][i], least[1][j]) + _ALIKE
    return np.stack([i[nearest], j[nearest]], axis=1)


def offsets(first: PlaneSet, second: PlaneSet, i: Index, j: Index, pose: Pose) -> Array:
    """Offsets (p,) [m] of planes j over planes i at the centre of either, the smaller one."""
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
    """Normal matrix (6, 6) and right side (6,) of a relative pose from common planes (p, 2).

    Of the shift [m] and the left turn [rad] of the second station in the frame of the first, about
    its origin. floor : sigmas [rad], [m] that no plane falls below.
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
    mine, theirs = (_swung(first, i, -gap), _swung(second, j, gap @ pose.rotation))
    swung = np.where(here[:, None], theirs, mine)
    spread = joint[:, 2, 2] + floor[1] ** 2 + swung[:, 0] + swung[:, 1] * floor[0] ** 2
    away = 1 / np.sqrt(spread)
    design = np.concatenate([rows.reshape(-1, 6), by_pose * away[:, None]])
    values = np.concatenate([right.ravel(), off * away])
    return design.T @ design, design.T @ values


def _swung(planes: PlaneSet, numbers: Index, lever: Array) -> Array:
    """What tilts add to the variance of offsets at levers (p, 3) from the centres [m^2], and the
    squared levers along the planes [m^2] (p, 2).
    """
    along = np.einsum("kia,ki->ka", plane_basis(planes.normal[numbers]), lever)
    c = planes.covariance[numbers]
    by_tilt = np.einsum("ka,kab,kb->k", along, c[:, :2, :2], along)
    shared = np.einsum("ka,ka->k", along, c[:, :2, 2])
    return np.stack([by_tilt - 2 * shared, (along**2).sum(axis=1)], axis=1)


def _fitted(first: PlaneSet, second: PlaneSet, pairs: Index, pose: Pose, levelled: bool) -> Pose:
    """The pose with least squares of tilts and offsets of common planes, one step."""
    normal, right = information(first, second, pairs, pose, (_TURN, _OFFSET))
    normal = normal + np.diag(1 / _START**2)
    # what the planes hardly hold, by the noise of their normals alone, stays where it is
    lacking = open_directions(first.normal[pairs[:, 0]])
    normal[:3, :3] += lacking.T @ lacking / _STILL**2
    if levelled:
        # the turn brings the third axis of the second station onto that of the first
        up = pose.rotation[:, 2]
        normal[[3, 4], [3, 4]] += 1 / _TILT**2
        right[3:5] += np.array([up[1], -up[0]]) / _TILT**2
    scale = 1 / np.sqrt(np.diag(normal))
    step = scale * np.linalg.solve(normal * scale[:, None] * scale, scale * right)
    turn = turns.exp(step[None, 3:])[0]
    return Pose(turn @ pose.rotation, turn @ pose.translation + step[:3])


def _same(one: Pose, other: Pose) -> bool:
    """Are two poses one?"""
    cosine = (np.trace(one.rotation.T @ other.rotation) - 1) / 2
    near = float(np.linalg.norm(one.translation - other.translation)) < _SAME_PLACE
    return near and bool(np.arccos(np.clip(cosine, -1, 1)) < _SAME_TURN)


def decided(found: Sequence[PlanePose]) -> tuple[PlanePose, ...]:
    """The best of several poses and those that are nearly as good, by what contradicts them."""
    if not found:
        return ()
    most = max(f.seen.agree for f in found)
    good = [f for f in found if f.seen.agree > _AGREES * most]
    best = min(good, key=lambda f: f.seen.conflict - 0.05 * f.seen.agree / most)
    limit = max(_TIMES * best.seen.conflict, best.seen.conflict + _MORE)
    rivals = [f for f in good if f is not best and f.seen.conflict <= limit]
    rivals.sort(key=lambda f: f.seen.conflict)
    return (best, *rivals)
