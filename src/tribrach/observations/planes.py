"""Planes seen by scanner stations: fitted planes, and single points on planes.

A plane ``n . x = d`` of the work frame appears in a scan as ``n_s = R^T n`` with the offset
``d_s = d - n . t`` (method section 2.10).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geometry.rotation import skew
from tribrach.observations.base import Block, Observations, refers
from tribrach.observations.declaration import (
    SCANNED,
    End,
    KindFacts,
    Repetition,
    StartTie,
    shaped,
)
from tribrach.observations.ties import Faces, TieCollector
from tribrach.observations.unknowns import State, plane_basis

#: step over which the tilt of a plane is differentiated [m]
_STEP = 0.05


@dataclass(kw_only=True)
class FittedPlanes(Observations):
    """Planes fitted in a scan.

    A fitted plane is observed by two tangential components of its normal and by its offset anchored
    at the patch's centroid, which decorrelates them (method section 2.10). Values are the misfits
    of two normal components [rad] and of the offset at the centroid [m]; they are zero by
    construction and may be left at zero. The covariance is that of the fit in the tangent basis of
    the measured normal, whose sign must be that of the unknown plane.
    """

    station: Index = refers("pose", end=End.FROM)  #: (n,): poses
    plane: Index = refers("plane", end=End.TO)  #: (n,): planes
    normal: Array = shaped(3)  #: (n, 3): measured normals in the scanner frame
    centroid: Array = shaped(3)  #: (n, 3): of each patch in the scanner frame [m]
    kind: ClassVar[str] = "plane"
    units: ClassVar[tuple[str, ...]] = ("rad", "rad", "m")
    components: ClassVar[tuple[str, ...]] = ("normal 1", "normal 2", "offset")
    facts: ClassVar[KindFacts] = replace(
        SCANNED,
        title="plane",
        computed="normal and offset of a plane that several stations see",
        repeats=Repetition.SETS,
        start=StartTie.FACE,
        common_to_stations="planes",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        self.normal = self.normal / np.linalg.norm(self.normal, axis=1, keepdims=True)

    def predict(self, state: State) -> Array:
        """Tangential components of the plane's normal and its distance from the centroid."""
        r, t = state.pose_r[self.station], state.pose_t[self.station]
        n, d = state.plane_n[self.plane], state.plane_d[self.plane]
        seen = np.einsum("nji,nj->ni", r, n)
        tangent = np.einsum("nij,ni->nj", plane_basis(self.normal), seen)
        offset = d - np.einsum("ni,ni->n", n, t) - np.einsum("ni,ni->n", seen, self.centroid)
        values: Array = np.concatenate([tangent, offset[:, None]], axis=1)
        return values

    def jacobian(self, state: State) -> list[Block]:
        """``R^T [n]x`` by the rotation, ``R^T`` by the normal, and the offset's own terms."""
        layout = state.layout
        r, t = state.pose_r[self.station], state.pose_t[self.station]
        n = state.plane_n[self.plane]
        back = r.transpose(0, 2, 1)
        anchor = t + np.einsum("nij,nj->ni", r, self.centroid)
        basis = plane_basis(self.normal).transpose(0, 2, 1) @ back
        by_pose = np.zeros((len(self), 3, 6))
        by_pose[:, :2, 3:] = basis @ skew(n)
        by_pose[:, 2, :3] = -n
        # n . (R c) changes by the turn: d (n . exp(w) R c) = w . (R c x n)
        by_pose[:, 2, 3:] = -np.cross(anchor - t, n)
        by_n = np.concatenate([basis, -anchor[:, None, :]], axis=1)
        by_plane = np.zeros((len(self), 3, 3))
        by_plane[:, :, :2] = by_n @ plane_basis(n)
        by_plane[:, 2, 2] = 1.0
        return [
            Block(layout.columns("pose", self.station), by_pose),
            Block(layout.columns("plane", self.plane), by_plane),
        ]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Faces."""
        normal = self.normal[rows]
        offset = np.einsum("ni,ni->n", normal, self.centroid[rows])
        ties.add(Faces(self.station[rows], self.plane[rows], normal, offset))


@dataclass(kw_only=True)
class PointsOnPlanes(Observations):
    """Single scan points on planes: ``n . (t + R x_s) - d`` [m], observed as zero."""

    station: Index = refers("pose", end=End.FROM)  #: (n,): poses
    plane: Index = refers("plane", end=End.TO)  #: (n,): planes
    point: Array = shaped(
        3
    )  #: (n, 3): points ``x_s`` in the scanner frame [m] (method section 2.10)
    kind: ClassVar[str] = "point_on_plane"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = replace(
        SCANNED,
        title="point on plane",
        computed="distance of a scan point from a plane",
        repeats=Repetition.SETS,
        start=StartTie.FACE,
        common_to_stations="points on planes",
    )

    def _arm(self, state: State) -> Array:
        arm: Array = np.einsum("nij,nj->ni", state.pose_r[self.station], self.point)
        return arm

    def predict(self, state: State) -> Array:
        """Signed distances (n, 1)."""
        x = state.pose_t[self.station] + self._arm(state)
        distance = np.einsum("ni,ni->n", state.plane_n[self.plane], x)
        values: Array = (distance - state.plane_d[self.plane])[:, None]
        return values

    def jacobian(self, state: State) -> list[Block]:
        """``n`` by t, ``-n [R x]x`` by the rotation, ``x`` by the normal, -1 by the offset."""
        layout = state.layout
        n, arm = state.plane_n[self.plane], self._arm(state)
        x = state.pose_t[self.station] + arm
        by_pose = np.concatenate([n, np.cross(arm, n)], axis=1)[:, None, :]
        by_n = np.einsum("ni,nij->nj", x, plane_basis(n))
        by_plane = np.concatenate([by_n, np.full((len(self), 1), -1.0)], axis=1)[:, None, :]
        return [
            Block(layout.columns("pose", self.station), by_pose),
            Block(layout.columns("plane", self.plane), by_plane),
        ]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """The plane through all points that one scanner has on it."""
        base = ties.n_planes
        keys, group = np.unique(self.station[rows] * base + self.plane[rows], return_inverse=True)
        for number, key in enumerate(keys):
            points = self.point[rows[group == number]]
            centre = points.mean(axis=0)
            _, spread, axes = np.linalg.svd(points - centre)
            if len(points) >= 3 and spread[1] > 1e-3:
                # away from the scanner, the same sign for all who see it from one side
                normal = axes[2] * (1.0 if axes[2] @ centre >= 0 else -1.0)
                station, plane = np.divmod(np.array([key]), base)
                ties.add(Faces(station, plane, normal[None], np.array([normal @ centre])))


def moved_planes(normal: Array, centroid: Array, displacement: Callable[[Array], Array]) -> Array:
    """Tilts and offsets (n, 3) of planes whose points are displaced.

    A plane whose points move by D moves by n . D and tilts by what that changes by along it.

    Method section 2.10.

    ``normal``, ``centroid`` (n, 3): of the planes; ``displacement``: of places (n, 3).
    """
    step = _STEP * plane_basis(normal)

    def away(places: Array) -> Array:
        """Displacements along the normals."""
        return np.asarray(np.einsum("ni,ni->n", normal, displacement(places)))

    tilt = [away(centroid + step[:, :, k]) - away(centroid - step[:, :, k]) for k in (0, 1)]
    return np.column_stack([-tilt[0] / (2 * _STEP), -tilt[1] / (2 * _STEP), away(centroid)])
