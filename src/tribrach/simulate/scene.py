"""A scene of primitives: rectangles, boxes, cylinders, round bodies, printed targets, ground.

Each primitive has a centre, axes (rows of a rotation: local from world), half extents along them
and two reflectances. Flat primitives lie in the local xy plane, their normal is the third axis.
World coordinates are metres. Every primitive is convex and lies in the box of its half extents.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose

RECTANGLE, BOX, CYLINDER, SPHERE, CHECKERBOARD, DISC, ELLIPSOID = range(7)
#: kinds that lie in the plane z = 0 of their own frame
#: reflectance of black print
_DARK = 0.08


@dataclass(frozen=True, eq=False)
class Primitive:
    """One convex surface."""

    kind: int  #: one of the constants of this module, such as :data:`BOX`
    center: Array  #: (3,), in the world [m]
    axes: Array  #: (3, 3), local axes in the world, as rows
    half: Array  #: (3,), half extents along the axes [m]
    reflectance: float  #: of the surface (0 to 1)
    pattern: float = 0.0  #: half the side of the quadrants, or the radius of the disc [m]
    second: float = 0.0  #: reflectance of the bright quadrants or the disc (0 to 1)


@dataclass(frozen=True, eq=False)
class Scene:
    """n primitives as arrays."""

    kind: NDArray[np.int64]  #: (n,), as in :class:`Primitive`
    center: Array  #: (n, 3), in the world [m]
    axes: Array  #: (n, 3, 3), local axes in the world, as rows
    half: Array  #: (n, 3), half extents [m]
    #: (n, 3), of the surface, of the bright quadrants or disc, of the dark quadrants
    reflectance: Array
    pattern: Array  #: (n,), half the side of the quadrants, or the radius of the disc [m]

    @classmethod
    def of(cls, primitives: Sequence[Primitive]) -> Scene:
        """The scene of some primitives, numbered in their order."""
        if not primitives:
            raise InputError("a scene takes at least one primitive")
        return cls(
            np.array([p.kind for p in primitives], dtype=np.int64),
            np.array([p.center for p in primitives], dtype=float),
            np.array([p.axes for p in primitives], dtype=float),
            np.array([p.half for p in primitives], dtype=float),
            np.array([[p.reflectance, p.second, _DARK] for p in primitives], dtype=float),
            np.array([p.pattern for p in primitives], dtype=float),
        )

    def __len__(self) -> int:
        return len(self.kind)

    def corners(self) -> Array:
        """Corners (n, 8, 3) [m] of the boxes that hold the primitives, in the world."""
        signs = np.array(
            [[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float
        )
        local = self.half[:, None, :] * signs
        return np.asarray(self.center[:, None, :] + np.einsum("nki,nck->nci", self.axes, local))


def frame_of_normal(normal: ArrayLike, turn: float = 0.0) -> Array:
    """Axes as rows: the third along a normal, the first level, then turned about the normal."""
    z = np.asarray(normal, dtype=float)
    z = z / np.linalg.norm(z)
    x = np.cross([0.0, 0.0, 1.0], z)
    x = np.array([1.0, 0.0, 0.0]) if np.linalg.norm(x) < 1e-9 else x / np.linalg.norm(x)
    y = np.cross(z, x)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * x + s * y, -s * x + c * y, z])


def rectangle(
    center: ArrayLike, normal: ArrayLike, width: float, height: float, reflectance: float
) -> Primitive:
    """A rectangle."""
    half = np.array([width / 2, height / 2, 0.0])
    axes = frame_of_normal(normal)
    return Primitive(RECTANGLE, np.asarray(center, float), axes, half, reflectance)


def ground(center: ArrayLike, side: float, reflectance: float = 0.35) -> Primitive:
    """Level ground, a square."""
    return rectangle(center, (0, 0, 1), side, side, reflectance)


def box(center: ArrayLike, size: ArrayLike, reflectance: float, heading: float = 0.0) -> Primitive:
    """A standing box."""
    c, s = np.cos(heading), np.sin(heading)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    half = np.asarray(size, dtype=float) / 2
    return Primitive(BOX, np.asarray(center, float), axes, half, reflectance)


def cylinder(
    center: ArrayLike,
    radius: float,
    height: float,
    reflectance: float,
    axis: ArrayLike = (0.0, 0.0, 1.0),
) -> Primitive:
    """A cylinder with both caps."""
    half = np.array([radius, radius, height / 2])
    axes = frame_of_normal(axis)
    return Primitive(CYLINDER, np.asarray(center, float), axes, half, reflectance)


def sphere(center: ArrayLike, radius: float, reflectance: float = 0.85) -> Primitive:
    """A sphere."""
    half = np.full(3, float(radius))
    return Primitive(SPHERE, np.asarray(center, float), np.eye(3), half, reflectance)


def ellipsoid(
    center: ArrayLike,
    half: ArrayLike,
    reflectance: float = 0.85,
    axis: ArrayLike = (0.0, 0.0, 1.0),
    turn: float = 0.0,
) -> Primitive:
    """An ellipsoid, the third of whose half axes lies along ``axis``."""
    return Primitive(
        ELLIPSOID,
        np.asarray(center, float),
        frame_of_normal(axis, turn),
        np.asarray(half, float),
        reflectance,
    )


def checkerboard(
    center: ArrayLike,
    normal: ArrayLike,
    side: float,
    *,
    turn: float = 0.0,
    margin: float = 0.0,
    bright: float = 0.85,
) -> Primitive:
    """Two black and two white quadrants, ``side`` together, on a board with a grey margin."""
    half = np.array([side / 2 + margin, side / 2 + margin, 0.0])
    axes = frame_of_normal(normal, turn)
    return Primitive(CHECKERBOARD, np.asarray(center, float), axes, half, 0.4, side / 2, bright)


def disc(
    center: ArrayLike, normal: ArrayLike, radius: float, side: float, bright: float = 0.85
) -> Primitive:
    """A white disc in the middle of a black board of a given side."""
    half = np.array([side / 2, side / 2, 0.0])
    axes = frame_of_normal(normal)
    return Primitive(DISC, np.asarray(center, float), axes, half, _DARK, radius, bright)


def carried(primitive: Primitive, motion: Pose) -> Primitive:
    """A primitive after a rigid motion."""
    axes = primitive.axes @ motion.rotation.T
    return replace(primitive, center=motion @ primitive.center, axes=axes)
