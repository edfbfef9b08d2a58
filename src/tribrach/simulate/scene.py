"""A scene of primitives: rectangles, boxes, cylinders, spheres, printed targets, ground.

Each primitive has a centre, axes (rows of a rotation: local from world), half extents along them
and two reflectances. Flat primitives lie in the local xy plane, their normal is the third axis.
World coordinates are metres. Every primitive is convex and lies in the box of its half extents.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tribrach._types import Array
from tribrach.errors import InputError

__all__ = [
    "BOX",
    "CHECKERBOARD",
    "CYLINDER",
    "DISC",
    "RECTANGLE",
    "SPHERE",
    "Primitive",
    "Scene",
    "box",
    "checkerboard",
    "cylinder",
    "disc",
    "distance_to_surface",
    "frame_of_normal",
    "ground",
    "rectangle",
    "sphere",
]


RECTANGLE, BOX, CYLINDER, SPHERE, CHECKERBOARD, DISC = range(6)
#: kinds that lie in the plane z = 0 of their own frame
_FLAT = (RECTANGLE, CHECKERBOARD, DISC)


@dataclass(frozen=True, eq=False)
class Primitive:
    """One convex surface.

    center (3,), axes (3, 3) rows local axes in the world, half (3,) extents.

    Attributes
    ----------
    pattern
        Half the side of the quadrants, or the radius of the disc.
    reflectance, second
        Of the surface and of the bright quadrants or the disc (0 to 1).
    """

    kind: int
    center: Array
    axes: Array
    half: Array
    reflectance: float
    pattern: float = 0.0
    second: float = 0.0


@dataclass(frozen=True, eq=False)
class Scene:
    """Primitives as arrays.

    kind (n,), center (n, 3), axes (n, 3, 3), half (n, 3), reflectance (n, 3) : surface, bright
    quadrants or disc, dark quadrants; pattern (n,).
    """

    kind: NDArray[np.int64]
    center: Array
    axes: Array
    half: Array
    reflectance: Array
    pattern: Array

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
        """Corners (n, 8, 3) of the boxes that hold the primitives, world."""
        signs = np.array(
            [[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float
        )
        local = self.half[:, None, :] * signs
        return np.asarray(self.center[:, None, :] + np.einsum("nki,nck->nci", self.axes, local))


#: reflectance of black print
_DARK = 0.08


def frame_of_normal(normal: ArrayLike, turn: float = 0.0) -> Array:
    """Axes (3, 3) by rows: the third along ``normal`` (3,), the first level, then turned [rad]."""
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
    """A rectangle, ``width`` level and ``height`` across it [m]."""
    half = np.array([width / 2, height / 2, 0.0])
    axes = frame_of_normal(normal)
    return Primitive(RECTANGLE, np.asarray(center, float), axes, half, reflectance)


def ground(center: ArrayLike, side: float, reflectance: float = 0.35) -> Primitive:
    """Level ground, a square of this side [m]."""
    return rectangle(center, (0, 0, 1), side, side, reflectance)


def box(center: ArrayLike, size: ArrayLike, reflectance: float, heading: float = 0.0) -> Primitive:
    """A standing box of size (3,) [m], turned by ``heading`` [rad] counter-clockwise."""
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
    """A cylinder with both caps around its centre [m]."""
    half = np.array([radius, radius, height / 2])
    axes = frame_of_normal(axis)
    return Primitive(CYLINDER, np.asarray(center, float), axes, half, reflectance)


def sphere(center: ArrayLike, radius: float, reflectance: float = 0.85) -> Primitive:
    """A sphere [m]."""
    half = np.full(3, float(radius))
    return Primitive(SPHERE, np.asarray(center, float), np.eye(3), half, reflectance)


def checkerboard(
    center: ArrayLike,
    normal: ArrayLike,
    side: float,
    *,
    turn: float = 0.0,
    margin: float = 0.0,
    bright: float = 0.85,
) -> Primitive:
    """Two black and two white quadrants on a board of this side, with a grey margin around [m]."""
    half = np.array([side / 2 + margin, side / 2 + margin, 0.0])
    axes = frame_of_normal(normal, turn)
    return Primitive(CHECKERBOARD, np.asarray(center, float), axes, half, 0.4, side / 2, bright)


def disc(
    center: ArrayLike, normal: ArrayLike, radius: float, side: float, bright: float = 0.85
) -> Primitive:
    """A white disc in the middle of a black square board [m]."""
    half = np.array([side / 2, side / 2, 0.0])
    axes = frame_of_normal(normal)
    return Primitive(DISC, np.asarray(center, float), axes, half, _DARK, radius, bright)


def distance_to_surface(scene: Scene, number: NDArray[np.int64], xyz: Array) -> Array:
    """Distance (n,) [m] of world points (n, 3) from the surface of one primitive each (n,)."""
    local = np.einsum("nij,nj->ni", scene.axes[number], xyz - scene.center[number])
    half, kind = scene.half[number], scene.kind[number]
    outside = np.linalg.norm(np.maximum(np.abs(local) - half, 0), axis=1)
    to_box = np.where(outside > 0, outside, np.min(np.abs(half - np.abs(local)), axis=1))
    to_sphere = np.abs(np.linalg.norm(local, axis=1) - half[:, 0])
    radial = np.hypot(local[:, 0], local[:, 1]) - half[:, 0]
    along = np.abs(local[:, 2]) - half[:, 2]
    beyond = np.hypot(np.maximum(radial, 0), np.maximum(along, 0))
    inside = np.minimum(np.abs(radial), np.abs(along))
    to_cylinder = np.where(beyond > 0, beyond, inside)
    flat = np.isin(kind, _FLAT)
    rest = np.where(kind == SPHERE, to_sphere, np.where(kind == CYLINDER, to_cylinder, to_box))
    return np.asarray(np.where(flat, outside, rest))
