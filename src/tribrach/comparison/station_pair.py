"""The covariance of one station relative to another, in which what both share cancels.

A point X that both stations see is displaced by ``d = J_2(X) e_2 - J_1(X) e_1`` between their
clouds, with e_1 and e_2 the errors of what the points of either scan share (method section 5.10):
its pose, ``dt + d x (X - t)``, and the effects of its scanner. With the joint covariance of both,
errors of the control that move both alike vanish. Of the poses alone the same displacement is ``d =
q_t + q_r x (X - X_0)`` of a relative pose q about any reference X_0, so that six numbers carry it
(method sections 5.1 and 9.5). Metres and radians; increments are left, about the axes of the world.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array, Index
from tribrach.cloud.placement import Placement
from tribrach.cloud.shared_part import SharedPart, angle_slopes, checked_covariance, slopes
from tribrach.errors import InputError
from tribrach.geometry.rotation import skew
from tribrach.network.given_values import common_values, through_given

if TYPE_CHECKING:
    from tribrach.network.adjustment import Adjustment


#: points whose displacements are in memory at a time
_BLOCK = 50_000
#: unknowns of two poses
_POSES = 12


@dataclass(frozen=True)
class PairSide:
    """One scan of a pair."""

    placement: Placement  #: where it stands, with its effects and its noise
    rows: Index  #: (6 + k,), rows of the covariance of the pair that move its points


@dataclass(frozen=True)
class StationPair:
    """Two stations with one covariance, which is tested for being one."""

    #: (3,), their places [m]
    first: Array
    second: Array
    #: (12 + k, 12 + k), of translation [m] and left rotation increment [rad] of the first, then of
    #: the second, then of the effects of their scanners
    covariance: Array
    #: both scans; None where nothing but their poses is known
    sides: tuple[PairSide, PairSide] | None = None
    alike: tuple[str, ...] = ()  #: of two results, what both were given alike

    def __post_init__(self) -> None:
        """Refuse a matrix that is not a covariance."""
        count = _POSES
        if self.sides is not None:
            count = 1 + max(int(side.rows.max()) for side in self.sides)
        checked_covariance(self.covariance, count, "two stations")

    @classmethod
    def of(cls, shared: SharedPart, first: str, second: str) -> StationPair:
        """Two scans of one result."""
        scans = shared.scan(first), shared.scan(second)
        if scans[0].station == scans[1].station:
            raise InputError(
                f"{first} and {second} are scans of one station, {scans[0].station}",
                cure="compare scans of two stations",
            )
        columns = [shared.columns[name] for name in (first, second)]
        poses = np.concatenate([rows[:6] for rows in columns])
        effects = np.unique(np.concatenate([rows[6:] for rows in columns]))
        order = np.concatenate([poses, effects])
        place = {int(row): k for k, row in enumerate(order)}
        one, two = (
            PairSide(scan, np.array([place[int(row)] for row in rows]))
            for scan, rows in zip(scans, columns, strict=True)
        )
        places = scans[0].pose.translation, scans[1].pose.translation
        return cls(*places, shared.covariance[np.ix_(order, order)], (one, two))

    @classmethod
    def of_results(cls, one: SharedPart, first: str, two: SharedPart, second: str) -> StationPair:
        """Two scans of two results: what both were given alike counts once. Section 12.7."""
        sides, order, sizes = [], [], [len(one.covariance), len(two.covariance)]
        for shared, name, begin in ((one, first, 0), (two, second, sizes[0])):
            order.append(begin + shared.columns[name])
            sides.append(shared.scan(name))
        joint, alike = joint_covariance(one, two)
        rows = np.concatenate([*(at[:6] for at in order), *(at[6:] for at in order)])
        place = {int(row): k for k, row in enumerate(rows)}
        pair = [
            PairSide(side, np.array([place[int(row)] for row in at]))
            for side, at in zip(sides, order, strict=True)
        ]
        here, there = (side.pose.translation for side in sides)
        return cls(here, there, joint[np.ix_(rows, rows)], (pair[0], pair[1]), alike)

    @classmethod
    def from_adjustment(
        cls, adjustment: Adjustment, first: str, second: str, *, posterior: bool = False
    ) -> StationPair:
        """Two stations of one adjustment."""
        names = (first, second)
        shared = SharedPart.of_adjustment(adjustment, stations=names, posterior=posterior)
        return cls.of(shared, *names)

    @classmethod
    def independent(cls, first: Placement, second: Placement) -> StationPair:
        """Two stations that share nothing, of two surveys for instance: nothing cancels."""
        sizes = [
            6 if p.calibration is None else 6 + len(p.calibration.own) for p in (first, second)
        ]
        joint = np.zeros((sum(sizes), sum(sizes)))
        sides, effects = [], _POSES
        for k, (place, size) in enumerate(zip((first, second), sizes, strict=True)):
            rows = np.concatenate([6 * k + np.arange(6), effects + np.arange(size - 6)])
            effects += size - 6
            joint[np.ix_(rows[:6], rows[:6])] = place.covariance
            if place.calibration is not None:
                joint[np.ix_(rows[:6], rows[6:])] = place.calibration.cross
                joint[np.ix_(rows[6:], rows[:6])] = place.calibration.cross.T
                joint[np.ix_(rows[6:], rows[6:])] = place.calibration.own
            sides.append(PairSide(place, rows))
        places = first.pose.translation, second.pose.translation
        return cls(*places, joint, (sides[0], sides[1]))

    def relative(self, reference: Array) -> Array:
        """Covariance (6, 6) of the relative pose q = (q_t, q_r) about a reference (3,)."""
        motion = np.zeros((6, 12))
        for half, place, sign in ((0, self.first, -1.0), (6, self.second, 1.0)):
            motion[:3, half : half + 3] = sign * np.eye(3)
            motion[:3, half + 3 : half + 6] = -sign * skew(reference - place)
            motion[3:, half + 3 : half + 6] = sign * np.eye(3)
        covariance: Array = motion @ self.covariance[:_POSES, :_POSES] @ motion.T
        return 0.5 * (covariance + covariance.T)

    def displacements(self, points: Array) -> Array:
        """Derivatives (m, 3, 12 + k) of points of the second cloud by the unknowns of the pair."""
        out = np.zeros((len(points), 3, len(self.covariance)))
        if self.sides is None:
            for half, place, sign in ((0, self.first, -1.0), (6, self.second, 1.0)):
                out[:, :, half : half + 3] = sign * np.eye(3)
                out[:, :, half + 3 : half + 6] = -sign * skew(points - place)
            return out
        for side, sign in zip(self.sides, (-1.0, 1.0), strict=True):
            out[:, :, side.rows] += sign * slopes(points, side.placement)
        return out

    def registration(self, points: Array) -> Array:
        """``C_reg(X)`` (m, 3, 3) [m^2]: covariance of the displacement between the clouds at X."""
        out = np.empty((len(points), 3, 3))
        for first in range(0, len(points), _BLOCK):
            part = slice(first, first + _BLOCK)
            moved = self.displacements(points[part])
            out[part] = moved @ self.covariance @ moved.transpose(0, 2, 1)
        return out

    def angles(self, points: Array) -> Array:
        """Covariance (m, 3, 3) [m^2] at X from the systematic angles of both scanners."""
        out = np.zeros((len(points), 3, 3))
        for side in self.sides or ():
            moved = angle_slopes(points, side.placement)
            out += moved @ moved.transpose(0, 2, 1)
        return out

    def mean_row(self, points: Array, normals: Array) -> Array:
        """What the unknowns do (12 + k,) to the mean distance along normals (m, 3) at points."""
        row = np.zeros(len(self.covariance))
        for first in range(0, len(points), _BLOCK):
            part = slice(first, first + _BLOCK)
            row += np.einsum("mi,mij->j", normals[part], self.displacements(points[part]))
        return row / len(points)

    def mean_angles(self, points: Array, normals: Array) -> float:
        """Largest sigma [m] that systematic angles give the mean distance along normals.

        As in method section 5.10: terms of one sign count as one error, those of either sign and of
        either scan as independent.
        """
        total = 0.0
        for side in self.sides or ():
            moved = np.einsum("mi,mik->mk", normals, angle_slopes(points, side.placement))
            for part in (np.maximum(moved, 0.0), np.minimum(moved, 0.0)):
                total += float((part.mean(axis=0) ** 2).sum())
        return float(np.sqrt(total))


def joint_covariance(one: SharedPart, two: SharedPart) -> tuple[Array, tuple[str, ...]]:
    """Joint covariance of two results, with the given values of both (section 12.7)."""
    n = len(one.covariance)
    joint = np.zeros((n + len(two.covariance),) * 2)
    joint[:n, :n], joint[n:, n:] = one.covariance, two.covariance
    a, b = one.given, two.given
    if a is None or b is None:
        return joint, ()
    i, j = common_values(a.keys, a.covariance, b.keys, b.covariance)
    mixed = through_given(a.cross[:, i], b.cross[:, j], a.covariance[np.ix_(i, i)])
    joint[:n, n:], joint[n:, :n] = mixed, mixed.T
    return joint, tuple(a.keys[k] for k in i)


def along_normals(points: Array, normals: Array, reference: Array) -> Array:
    """Rows ``a = [n ; (X - X_0) x n]`` (m, 6): what a relative pose does along the normals."""
    return np.concatenate([normals, np.cross(points - reference, normals)], axis=1)
