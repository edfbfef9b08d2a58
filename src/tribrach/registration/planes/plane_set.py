"""Holds the planes of one station as arrays and tells how much of a plane another one covers.

Normals look towards the scanner, so that the two sides of a wall are two planes. Scanner frame,
metres and radians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.spatial import cKDTree

from tribrach._types import Array
from tribrach.geometry.polar import polar_from_xyz, xyz_by_polar
from tribrach.geometry.pose import Pose
from tribrach.observations.planes import moved_planes
from tribrach.observations.unknowns import plane_basis
from tribrach.targets.planes import Plane


@dataclass(frozen=True)
class SamePlaneGates:
    """When planes of two scans of one station are one surface (by hand: test_plane_poses)."""

    turn_rad: float = float(np.radians(1.0))  #: their normals differ by less than this [rad] ...
    offset_m: float = 0.01  #: ... and their offsets, where they overlap, by less than this [m]
    #: cells of two patches are the same place within this many widths of the wider ones
    cell_widths: float = 1.5
    overlap_share: float = 0.5  #: ... and this share of the cells of one lies on the other


GATES = SamePlaneGates()


@dataclass(frozen=True, eq=False)
class PlaneSet:
    """The k planes of a station."""

    normal: Array  #: (k, 3), unit normals towards the scanner
    center: Array  #: (k, 3), centres [m]
    #: (k, 3, 3), covariances of the tilts along the tangent basis of the normal
    #: (:func:`~tribrach.observations.unknowns.plane_basis`) [rad] and of the offset at the centre
    #: [m]
    covariance: Array
    area: Array  #: (k,), areas [m^2]
    #: for each plane the places (s, 3) that it covers, one for every cell [m]
    samples: tuple[Array, ...]
    spacing: Array  #: (k,), widths of the cells [m]
    scans: tuple[str, ...]  #: names of the scans

    @classmethod
    def of(cls, planes: Sequence[Plane]) -> PlaneSet:
        """Make the set of the planes of one scan."""
        kept = sorted(planes, key=lambda p: -p.area)
        normal = np.array([p.normal for p in kept]).reshape(-1, 3)
        tangents = np.array([p.tangents for p in kept]).reshape(-1, 2, 3)
        covariance = np.array([p.covariance for p in kept]).reshape(-1, 3, 3)
        return cls(
            normal,
            np.array([p.center for p in kept]).reshape(-1, 3),
            _in_basis(normal, tangents, covariance),
            np.array([p.area for p in kept], dtype=float),
            tuple(p.sample for p in kept),
            np.array([p.spacing for p in kept], dtype=float),
            tuple(p.detection.scan for p in kept),
        )

    @classmethod
    def joined(cls, sets: Sequence[PlaneSet]) -> PlaneSet:
        """Join planes of several scans of one station; what is wrong with a wall counts once."""
        whole = cls(
            np.concatenate([np.zeros((0, 3)), *(s.normal for s in sets)]),
            np.concatenate([np.zeros((0, 3)), *(s.center for s in sets)]),
            np.concatenate([np.zeros((0, 3, 3)), *(s.covariance for s in sets)]),
            np.concatenate([np.zeros(0), *(s.area for s in sets)]),
            tuple(sample for s in sets for sample in s.samples),
            np.concatenate([np.zeros(0), *(s.spacing for s in sets)]),
            tuple(scan for s in sets for scan in s.scans),
        )
        kept: list[int] = []
        for k in np.argsort(-whole.area, kind="stable").tolist():
            if not any(whole._doubles(k, other) for other in kept):
                kept.append(k)
        return whole.chosen(kept)

    def __len__(self) -> int:
        return len(self.normal)

    @cached_property
    def offset(self) -> Array:
        """Offsets (k,) of ``normal . x = offset`` [m]."""
        return np.asarray(np.einsum("ki,ki->k", self.normal, self.center))

    @cached_property
    def trees(self) -> tuple[cKDTree, ...]:
        """Search trees of places that planes cover: small, asked often, so in one thread."""
        return tuple(cKDTree(sample) for sample in self.samples)

    @cached_property
    def boxes(self) -> Array:
        """Corners (k, 2, 3) of the places that each plane covers [m], NaN without any."""
        blank = np.full((2, 3), np.nan)
        return np.array(
            [[s.min(axis=0), s.max(axis=0)] if len(s) else blank for s in self.samples]
        ).reshape(-1, 2, 3)

    def largest(self, count: int) -> PlaneSet:
        """Keep the largest planes."""
        return self.chosen(range(min(count, len(self))))

    def chosen(self, numbers: Sequence[int]) -> PlaneSet:
        """Some of the planes."""
        at = np.array(numbers, dtype=np.int64)
        return PlaneSet(
            self.normal[at],
            self.center[at],
            self.covariance[at],
            self.area[at],
            tuple(self.samples[k] for k in at),
            self.spacing[at],
            tuple(self.scans[k] for k in at),
        )

    def with_angles(self, sigma: Mapping[str, float]) -> PlaneSet:
        """Covariances with errors of both angles of a whole plane (method section 2.10)."""
        size = np.array([sigma.get(name, 0.0) for name in self.scans])
        out = self.covariance.copy()

        def displaced(places: Array, angle: int) -> Array:
            """What places move by with an angle."""
            return np.asarray(xyz_by_polar(polar_from_xyz(places))[:, :, angle])

        for angle in (1, 2):
            moved = moved_planes(self.normal, self.center, partial(displaced, angle=angle))
            by_angle = size[:, None] * moved
            out += by_angle[:, :, None] * by_angle[:, None, :]
        return replace(self, covariance=out)

    def placed(self, pose: Pose) -> PlaneSet:
        """Carry the planes into another frame; their covariance leaves out errors of the pose."""
        normal = self.normal @ pose.rotation.T
        tangents = plane_basis(self.normal).transpose(0, 2, 1) @ pose.rotation.T
        return replace(
            self,
            normal=normal,
            center=pose @ self.center,
            covariance=_in_basis(normal, tangents, self.covariance),
            samples=tuple(pose @ sample for sample in self.samples),
        )

    def _doubles(self, k: int, other: int) -> bool:
        """True if plane k of one scan is a plane that another scan of the station has."""
        if self.scans[k] == self.scans[other] or self.normal[k] @ self.normal[other] < 0:
            return False
        if np.linalg.norm(np.cross(self.normal[k], self.normal[other])) > GATES.turn_rad:
            return False
        if abs(self.normal[other] @ (self.center[k] - self.center[other])) > GATES.offset_m:
            return False
        near = GATES.cell_widths * max(self.spacing[k], self.spacing[other])
        distance, _ = self.trees[other].query(self.samples[k], distance_upper_bound=near)
        return bool(np.mean(distance < near) > GATES.overlap_share)


def overlap(first: PlaneSet, second: PlaneSet, i: int, j: int, first_from_second: Pose) -> float:
    """Area of a plane of one station that a plane of another one covers as well."""
    near = GATES.cell_widths * max(first.spacing[i], second.spacing[j])
    there = first_from_second.inverse @ first.samples[i]
    low, high = second.boxes[j]
    inside = ((there >= low - near) & (there <= high + near)).all(axis=1)
    if not inside.any():
        return 0.0
    distance, _ = second.trees[j].query(there[inside], distance_upper_bound=near)
    return float(first.area[i] * ((distance < near).sum() / len(there)))


def _in_basis(normal: Array, tangents: Array, covariance: Array) -> Array:
    """Covariances (k, 3, 3) turned from the patches' tangents (k, 2, 3) to the normal's basis."""
    turn = np.zeros((len(normal), 3, 3))
    if len(normal):
        turn[:, :2, :2] = np.einsum("kia,kbi->kab", plane_basis(normal), tangents)
    turn[:, 2, 2] = 1.0
    return np.asarray(turn @ covariance @ turn.transpose(0, 2, 1))
