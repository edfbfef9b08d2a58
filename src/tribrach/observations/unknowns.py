"""What is unknown, by which name, and where it sits in the parameter vector.

Five families of unknowns share one tangent vector, in this order:

=========  ======  =====================================================================
family     columns tangent
=========  ======  =====================================================================
point      3       E, N, U of the work frame [m]
pose       6       translation E, N, U [m], then left rotation increments d_E, d_N, d_U [rad]
plane      3       two turns of the normal in its tangent basis [rad], offset d [m]
vector     3       three components [m] (lever arm, common GNSS shift)
scalar     1       anything else: orientation unknown, EDM zero and scale, refraction,
                   instrument height, calibration parameter (unit by its name)
=========  ======  =====================================================================

A *position* is a point or the translation of a pose; observation kinds that join two places
take position indices (points first, then poses), so that a levelled total station on a mark
and a scanner with six unknowns are measured to and from in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.geometry import rotation

FAMILIES = ("point", "pose", "plane", "vector", "scalar")


WIDTH = {"point": 3, "pose": 6, "plane": 3, "vector": 3, "scalar": 1}


_COMPONENTS = {
    "point": ("E", "N", "U"),
    "pose": ("E", "N", "U", "tilt about E", "tilt about N", "heading"),
    "plane": ("normal 1", "normal 2", "offset"),
    "vector": ("x", "y", "z"),
    "scalar": ("",),
}


class Layout:
    """Names of all unknowns and their columns in the full tangent vector."""

    def __init__(
        self,
        points: Sequence[str] = (),
        poses: Sequence[str] = (),
        planes: Sequence[str] = (),
        vectors: Sequence[str] = (),
        scalars: Sequence[str] = (),
    ) -> None:
        self.names: dict[str, tuple[str, ...]] = dict(
            zip(FAMILIES, map(tuple, (points, poses, planes, vectors, scalars)), strict=True)
        )
        self._index = {
            family: {name: i for i, name in enumerate(names)}
            for family, names in self.names.items()
        }
        for family, names in self.names.items():
            if len(self._index[family]) != len(names):
                raise ValueError(f"names of family {family} are not unique")
        self._name_arrays: dict[str, NDArray[np.object_]] = {}
        self.offset: dict[str, int] = {}
        self.size = 0
        for family, names in self.names.items():
            self.offset[family] = self.size
            self.size += WIDTH[family] * len(names)

    def count(self, family: str) -> int:
        """Number of unknowns of a family."""
        return len(self.names[family])

    def index(self, family: str, name: str) -> int:
        """Index of a name within its family; KeyError if there is none."""
        return self._index[family][name]

    def numbers(self, family: str) -> dict[str, int]:
        """Index of each name of a family; of positions, points first."""
        if family != "position":
            return self._index[family]
        points = self._index["point"]
        poses = {name: len(points) + index for name, index in self._index["pose"].items()}
        return {**poses, **points}

    def has(self, family: str, name: str) -> bool:
        """True if the family has an unknown of this name."""
        return name in self._index[family]

    def find(self, name: str) -> tuple[str, int]:
        """Family and index of a name, whatever its family; KeyError if there is none."""
        for family in FAMILIES:
            if name in self._index[family]:
                return family, self._index[family][name]
        raise KeyError(name)

    def columns(self, family: str, index: Index | int) -> Index:
        """Columns (..., width) of unknowns; a negative index gives columns -1 (absent)."""
        index = np.asarray(index, dtype=np.int64)
        width = WIDTH[family]
        columns = self.offset[family] + width * index[..., None] + np.arange(width)
        return np.where(index[..., None] < 0, -1, columns)

    def position_index(self, name: str) -> int:
        """Position index of a point or, failing that, of a pose; KeyError if there is neither."""
        if name in self._index["point"]:
            return self._index["point"][name]
        return self.count("point") + self._index["pose"][name]

    def position_name(self, index: int) -> str:
        """Name of a position."""
        points = self.names["point"]
        return points[index] if index < len(points) else self.names["pose"][index - len(points)]

    def name_array(self, family: str) -> NDArray[np.object_]:
        """Names (n,) of a family, or of all positions, points first."""
        if family not in self._name_arrays:
            positions = (*self.names["point"], *self.names["pose"])
            names = positions if family == "position" else self.names[family]
            column = np.empty(len(names), dtype=object)
            column[:] = names
            self._name_arrays[family] = column
        return self._name_arrays[family]

    def position_columns(self, index: Index) -> Index:
        """Columns (..., 3) of positions."""
        index = np.asarray(index, dtype=np.int64)
        points = self.count("point")
        start = np.where(index < points, 3 * index, self.offset["pose"] + 6 * (index - points))
        return start[..., None] + np.arange(3)

    def describe(self, column: int) -> tuple[str, str, str]:
        """Family, name and component of a column of the full tangent vector."""
        for family in reversed(FAMILIES):
            if column >= self.offset[family] and self.count(family):
                index, component = divmod(column - self.offset[family], WIDTH[family])
                return family, self.names[family][index], _COMPONENTS[family][component]
        raise IndexError(column)

    def label(self, column: int) -> str:
        """A column in words, such as ``heading of station S1`` or ``E of point A``."""
        family, name, component = self.describe(column)
        if family == "scalar":
            return name
        if family == "vector":
            # its name says what it is: the common shift of a session, a lever arm
            return f"{component} of {name}"
        noun = {"pose": "station"}.get(family, family)
        return f"{component} of {noun} {name}"


def plane_basis(normal: Array) -> Array:
    """Two unit tangents (n, 3, 2) of unit normals (n, 3), smooth around each normal."""
    helper = np.zeros_like(normal)
    helper[np.arange(len(normal)), np.argmin(np.abs(normal), axis=1)] = 1.0
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=2)


@dataclass(frozen=True)
class State:
    """Values of all unknowns: metres and radians in the work frame. NaN means not yet known.

    points (P, 3); pose_t (S, 3) and pose_r (S, 3, 3), ``x_world = pose_r @ x_scanner + pose_t``;
    plane_n (L, 3) unit normals and plane_d (L,) with ``n . x = d``; vectors (V, 3); scalars (K,).
    """

    layout: Layout
    points: Array
    pose_t: Array
    pose_r: Array
    plane_n: Array
    plane_d: Array
    vectors: Array
    scalars: Array

    @classmethod
    def blank(cls, layout: Layout) -> State:
        """All NaN, except scalars and vectors, which start at zero."""
        p, s, n, v, k = (layout.count(family) for family in FAMILIES)
        return cls(
            layout,
            np.full((p, 3), np.nan),
            np.full((s, 3), np.nan),
            np.full((s, 3, 3), np.nan),
            np.full((n, 3), np.nan),
            np.full(n, np.nan),
            np.zeros((v, 3)),
            np.zeros(k),
        )

    @cached_property
    def positions(self) -> Array:
        """Points, then pose translations, (P + S, 3)."""
        return np.concatenate([self.points, self.pose_t])

    @property
    def sizes(self) -> Array:
        """Size (size,) of what each column of a tangent vector is added to; 1 for turns."""
        turn = np.ones((len(self.pose_t), 3)), np.ones((len(self.plane_d), 2))
        parts = (
            self.points,
            np.concatenate([self.pose_t, turn[0]], axis=1),
            np.concatenate([turn[1], self.plane_d[:, None]], axis=1),
            self.vectors,
            self.scalars,
        )
        sizes: Array = np.abs(np.concatenate([part.ravel() for part in parts]))
        return sizes

    def scalar(self, index: Index, default: Array | float = 0.0) -> Array:
        """Scalars at indices (n,); where an index is negative, the default."""
        if len(self.scalars) == 0:
            return np.broadcast_to(np.asarray(default, dtype=float), np.shape(index)).copy()
        return np.where(index < 0, default, self.scalars[np.maximum(index, 0)])

    def retract(self, delta: Array) -> State:
        """The state moved by a full tangent vector (size,), on the manifold."""
        layout = self.layout

        def part(family: str) -> Array:
            start = layout.offset[family]
            width = WIDTH[family]
            return delta[start : start + width * layout.count(family)].reshape(-1, width)

        pose, plane = part("pose"), part("plane")
        normal = self.plane_n
        if len(normal):
            turn = np.einsum("nij,nj->ni", plane_basis(normal), plane[:, :2])
            angle = np.linalg.norm(turn, axis=1, keepdims=True)
            # sin(a)/a without the singularity
            normal = np.cos(angle) * normal + np.sinc(angle / np.pi) * turn
        return replace(
            self,
            points=self.points + part("point"),
            pose_t=self.pose_t + pose[:, :3],
            pose_r=rotation.exp(pose[:, 3:]) @ self.pose_r,
            plane_n=normal,
            plane_d=self.plane_d + plane[:, 2],
            vectors=self.vectors + part("vector"),
            scalars=self.scalars + part("scalar")[:, 0],
        )

    def missing(self) -> list[tuple[str, str]]:
        """Family and name of every unknown that has no value yet."""
        bad = {
            "point": np.isnan(self.points).any(axis=1),
            "pose": np.isnan(self.pose_t).any(axis=1) | np.isnan(self.pose_r).any(axis=(1, 2)),
            "plane": np.isnan(self.plane_n).any(axis=1) | np.isnan(self.plane_d),
            "vector": np.isnan(self.vectors).any(axis=1),
            "scalar": np.isnan(self.scalars),
        }
        return [
            (family, self.layout.names[family][i])
            for family in FAMILIES
            for i in np.flatnonzero(bad[family])
        ]
