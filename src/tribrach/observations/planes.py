"""Planes seen by scanner stations: fitted planes, and single points on planes.

A plane ``n . x = d`` of the work frame appears in a scan as ``n_s = R^T n`` with the offset
``d_s = d - n . t``. A fitted plane is observed by two tangential components of its normal and by
its offset anchored at the patch's centroid, which decorrelates them (method section 2.10).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geometry.rotation import skew
from tribrach.observations.base import Block, Observations, refers
from tribrach.observations.unknowns import Layout, State, plane_basis

__all__ = ["FittedPlanes", "PointsOnPlanes"]


def _ends(layout: Layout, station: Index, plane: Index) -> list[tuple[str, str]]:
    poses, planes = layout.names["pose"], layout.names["plane"]
    return [(poses[i], planes[j]) for i, j in zip(station, plane, strict=True)]


@dataclass(kw_only=True)
class FittedPlanes(Observations):
    """Planes fitted in a scan.

    normal (n, 3) and centroid (n, 3) [m] of each patch in the scanner frame. Values (n, 3) are
    the misfits of two normal components [rad] and of the offset at the centroid [m]; they are
    zero by construction and may be left at zero. The covariance (n, 3, 3) is that of the fit in
    the tangent basis of the measured normal. The normal's sign must be that of the unknown plane.
    """

    station: Index = refers("pose")
    plane: Index = refers("plane")
    normal: Array = field()
    centroid: Array = field()
    kind: ClassVar[str] = "plane"
    units: ClassVar[tuple[str, ...]] = ("rad", "rad", "m")
    components: ClassVar[tuple[str, ...]] = ("normal 1", "normal 2", "offset")

    def __post_init__(self) -> None:
        super().__post_init__()
        self.normal = np.asarray(self.normal, dtype=float).reshape(-1, 3)
        self.normal = self.normal / np.linalg.norm(self.normal, axis=1, keepdims=True)
        self.centroid = np.asarray(self.centroid, dtype=float).reshape(-1, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Station and plane."""
        return _ends(layout, self.station, self.plane)

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


@dataclass(kw_only=True)
class PointsOnPlanes(Observations):
    """Single scan points on planes: ``n . (t + R x_s) - d`` (n, 1) [m], observed as zero.

    point (n, 3) [m] in the scanner frame.
    """

    station: Index = refers("pose")
    plane: Index = refers("plane")
    point: Array = field()
    kind: ClassVar[str] = "point_on_plane"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.point = np.asarray(self.point, dtype=float).reshape(-1, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Station and plane."""
        return _ends(layout, self.station, self.plane)

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
