"""Surfaces of simulated sites, and where beams meet them.

Nothing of this folder but ``programs/tribrach.py`` imports the program that is measured. A solid is
hit from outside or from inside (a room is a box, a tunnel a cylinder); openings are cut out of its
surface. Foliage is a ball in which a beam ends at a depth that is random each time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["MATERIALS", "Hits", "Material", "Solid", "Terrain", "World", "ball", "box", "pole"]

Array = NDArray[np.float64]
#: beams start at least this far from a surface [m]
_NEAREST = 0.05


@dataclass(frozen=True)
class Material:
    """What a surface does to a beam."""

    #: share of the light that comes back at right incidence
    reflectance: float
    #: standard deviation of the relief under single beams [m]
    roughness: float = 0.0005
    #: mean depth to which beams enter [m]
    depth: float = 0.0
    #: power of the cosine of the incidence: 1 for a matt surface, more for a shining one
    gloss: float = 1.0
    #: beams pass, and few come back
    glass: bool = False


MATERIALS = {
    "plaster": Material(0.75, 0.0007),
    "concrete": Material(0.45, 0.0012),
    "brick": Material(0.35, 0.002),
    "wood": Material(0.5, 0.0006),
    "asphalt": Material(0.15, 0.0018),
    "steel": Material(0.4, 0.0003, gloss=2.5),
    "paint": Material(0.6, 0.0003, gloss=1.8),
    "black": Material(0.06, 0.0004, gloss=1.5),
    "rock": Material(0.4, 0.012),
    "gravel": Material(0.35, 0.008, 0.003),
    "grass": Material(0.45, 0.015, 0.015),
    "soil": Material(0.3, 0.01, 0.004),
    "bark": Material(0.35, 0.004),
    "leaf": Material(0.45, 0.005),
    "cloth": Material(0.4, 0.004),
    "glass": Material(0.1, 0.0, glass=True),
}
NAMES = tuple(MATERIALS)


@dataclass(frozen=True, eq=False)
class Solid:
    """A box, a cylinder along its own z axis or a ball."""

    shape: Literal["box", "cylinder", "ball"]
    #: centre [m]
    center: Array
    #: half lengths of a box; radius, radius and half length of a cylinder; three times the radius
    half: Array
    #: columns are its own axes
    axes: Array
    material: str
    #: boxes (center, half) in its own frame within which it has no surface
    openings: tuple[tuple[Array, Array], ...] = ()
    #: has a cylinder ends?
    capped: bool = True
    #: mean way of a beam through foliage [m], zero for a body with a surface
    porous: float = 0.0
    #: while a scan is taken [m/s]
    velocity: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def reach(self) -> float:
        """Radius of the ball around it [m]."""
        return float(self.half[0] if self.shape == "ball" else np.linalg.norm(self.half))

    def hit(self, start: Array, along: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        """Ranges (n,), infinite where nothing is hit, and normals (n, 3) in the world."""
        o, d = (start - self.center) @ self.axes, along @ self.axes
        with np.errstate(divide="ignore", invalid="ignore"):
            near, far, normal_near, normal_far = _CROSSINGS[self.shape](o, d, self)
        if self.porous:
            begin = np.maximum(near, 0)
            near = begin + rng.exponential(self.porous, len(o))
            near[~(near < far)] = np.inf
            return near, (-d) @ self.axes.T
        t, normal = np.full(len(o), np.inf), np.zeros((len(o), 3))
        for ways, n in ((far, normal_far), (near, normal_near)):
            good = np.isfinite(ways) & (ways > _NEAREST)
            at = o[good] + ways[good, None] * d[good]
            kept = np.ones(len(at), dtype=bool)
            for center, half in self.openings:
                kept &= ~(np.abs(at - center) < half).all(axis=1)
            good[good] = kept
            t[good], normal[good] = ways[good], n[good]
        return t, normal @ self.axes.T


def _box(o: Array, d: Array, solid: Solid) -> tuple[Array, Array, Array, Array]:
    d = np.where(np.abs(d) < 1e-12, 1e-12, d)
    low, high = (-solid.half - o) / d, (solid.half - o) / d
    enter, leave = np.minimum(low, high), np.maximum(low, high)
    near, far = enter.max(axis=1), leave.min(axis=1)
    missed = near > far
    near[missed], far[missed] = np.inf, np.inf
    rows = np.arange(len(o))
    normals = []
    for k in (enter.argmax(axis=1), leave.argmin(axis=1)):
        n = np.zeros_like(o)
        n[rows, k] = 1.0
        normals.append(n)
    return near, far, normals[0], normals[1]


def _cylinder(o: Array, d: Array, solid: Solid) -> tuple[Array, Array, Array, Array]:
    radius, half = solid.half[0], solid.half[2]
    a = (d[:, :2] ** 2).sum(axis=1)
    b = (o[:, :2] * d[:, :2]).sum(axis=1)
    c = (o[:, :2] ** 2).sum(axis=1) - radius**2
    root = np.sqrt(b * b - a * c)  # NaN: missed
    ways = []
    side = (-b - root) / a, (-b + root) / a
    if solid.capped:
        dz = np.where(np.abs(d[:, 2]) < 1e-12, 1e-12, d[:, 2])
        caps = (-half - o[:, 2]) / dz, (half - o[:, 2]) / dz
        enter = np.maximum(side[0], np.minimum(*caps)), side[0] >= np.minimum(*caps)
        leave = np.minimum(side[1], np.maximum(*caps)), side[1] <= np.maximum(*caps)
        missed = ~(enter[0] <= leave[0])
        for t, round_ in (enter, leave):
            ways.append((np.where(missed, np.inf, t), round_))
    else:
        for t in side:
            inside = np.abs(o[:, 2] + t * d[:, 2]) <= half
            ways.append((np.where(inside, t, np.inf), np.ones(len(o), dtype=bool)))
    normals = []
    for t, round_ in ways:
        n = np.zeros_like(o)
        with np.errstate(invalid="ignore"):
            n[:, :2] = (o + t[:, None] * d)[:, :2] / radius
        n[~round_] = [0.0, 0.0, 1.0]
        normals.append(n)
    return ways[0][0], ways[1][0], normals[0], normals[1]


def _ball(o: Array, d: Array, solid: Solid) -> tuple[Array, Array, Array, Array]:
    b = (o * d).sum(axis=1)
    root = np.sqrt(b * b - (o * o).sum(axis=1) + solid.half[0] ** 2)
    near, far = np.nan_to_num(-b - root, nan=np.inf), np.nan_to_num(-b + root, nan=np.inf)
    normals = [
        (o + np.where(np.isfinite(t), t, 0)[:, None] * d) / solid.half[0] for t in (near, far)
    ]
    return near, far, normals[0], normals[1]


_CROSSINGS = {"box": _box, "cylinder": _cylinder, "ball": _ball}


def turned(heading: float, tilt: float = 0.0, towards: float = 0.0) -> Array:
    """Axes of a solid: its z axis leans by ``tilt`` towards a direction, after a heading [rad]."""

    def about_z(a: float) -> Array:
        return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1.0]])

    lean = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    return about_z(towards) @ lean @ about_z(heading - towards)


def box(center: object, size: object, material: str, heading: float = 0.0, **more: object) -> Solid:
    """A box with its full size [m]."""
    half = np.asarray(size, dtype=float) / 2
    return Solid("box", np.asarray(center, float), half, turned(heading), material, **more)


def pole(
    foot: object, radius: float, length: float, material: str,
    tilt: float = 0.0, towards: float = 0.0, **more: object,
) -> Solid:  # fmt: skip
    """A cylinder that stands at a place, or leans from it."""
    axes = turned(0.0, tilt, towards)
    center = np.asarray(foot, float) + axes[:, 2] * length / 2
    half = np.array([radius, radius, length / 2])
    return Solid("cylinder", center, half, axes, material, **more)


def ball(center: object, radius: float, material: str, **more: object) -> Solid:
    """A ball."""
    return Solid("ball", np.asarray(center, float), np.full(3, radius), np.eye(3), material, **more)


@dataclass(frozen=True, eq=False)
class Terrain:
    """Ground: a sum of bells and of waves over the plane."""

    material: str
    #: rows of x, y, height and width of bells [m]
    bells: Array = field(default_factory=lambda: np.zeros((0, 4)))
    #: rows of amplitude [m], wave numbers along x and y [rad/m] and phase
    waves: Array = field(default_factory=lambda: np.zeros((0, 4)))
    #: nothing is farther away [m]
    edge: float = 80.0

    def height(self, xy: Array) -> Array:
        """Heights (n,) at places (n, 2)."""
        return self._shape(xy)[0]

    def _shape(self, xy: Array) -> tuple[Array, Array]:
        z, slope = np.zeros(len(xy)), np.zeros((len(xy), 2))
        for x, y, height, width in self.bells:
            off = xy - [x, y]
            bell = height * np.exp(-(off**2).sum(axis=1) / (2 * width**2))
            z += bell
            slope -= bell[:, None] * off / width**2
        for amplitude, kx, ky, phase in self.waves:
            angle = xy @ [kx, ky] + phase
            z += amplitude * np.sin(angle)
            slope += amplitude * np.cos(angle)[:, None] * [kx, ky]
        return z, slope

    def hit(self, start: Array, along: Array) -> tuple[Array, Array]:
        """Ranges (n,) and normals (n, 3), by steps no longer than the steepest slope allows."""
        steepest = 0.61 * (np.abs(self.bells[:, 2]) / self.bells[:, 3]).sum()
        steepest += (self.waves[:, 0] * np.hypot(self.waves[:, 1], self.waves[:, 2])).sum()
        highest = np.abs(self.bells[:, 2]).sum() + np.abs(self.waves[:, 0]).sum()
        flat = np.hypot(along[:, 0], along[:, 1])
        falls = np.maximum(-along[:, 2], 0)
        t, out = np.zeros(len(start)), np.full(len(start), np.inf)
        active = np.arange(len(start))
        for _ in range(400):
            at = start[active] + t[active, None] * along[active]
            gap = at[:, 2] - self.height(at[:, :2])
            step = gap / np.maximum(steepest * flat[active] + falls[active], 0.02)
            t[active] += np.maximum(step, 1e-5)
            done = gap < 1e-6
            out[active[done]] = t[active[done]]
            gone = (t[active] > self.edge) | ((at[:, 2] > highest) & (along[active, 2] > 0))
            active = active[~done & ~gone]
            if not len(active):
                break
        normal = np.zeros((len(start), 3))
        met = np.isfinite(out)
        slope = self._shape((start[met] + out[met, None] * along[met])[:, :2])[1]
        n = np.column_stack([-slope, np.ones(len(slope))])
        normal[met] = n / np.linalg.norm(n, axis=1)[:, None]
        return out, normal


@dataclass(frozen=True)
class Hits:
    """What beams met."""

    #: ranges (n,) [m], infinite where there was nothing
    ranges: Array
    #: cosines (n,) of the incidence
    cosine: Array
    #: indices (n,) of materials in ``NAMES``
    material: NDArray[np.int64]
    #: numbers (n,) of the solids, -1 for the ground
    solid: NDArray[np.int64]
    #: normals (n, 3) in the world
    normal: Array
    #: true where the same place may be hit again: no leaf, person, or ghost
    firm: NDArray[np.bool_]


@dataclass(frozen=True)
class World:
    """A site while one scan is taken."""

    solids: tuple[Solid, ...]
    terrain: Terrain | None = None

    def cast(self, start: Array, along: Array, time: Array, rng: np.random.Generator) -> Hits:
        """First surfaces of beams; glass lets them pass, mirrors them or returns them."""
        hits = self._first(start, along, time, rng)
        pane = np.isfinite(hits.ranges) & (hits.material == NAMES.index("glass"))
        if not pane.any():
            return hits
        chance = rng.random(len(start))
        # returned at right incidence only; some see the mirror image; most see what is behind
        returned = pane & (hits.cosine > 0.995)
        ghost = pane & ~returned & (chance < 0.06)
        through = pane & ~returned & ~ghost & (chance < 0.8)
        rest = World(tuple(s for s in self.solids if not MATERIALS[s.material].glass), self.terrain)
        behind = rest._first(start[through], along[through], time[through], rng)
        _put(hits, through, behind, 0.0)
        n = hits.normal[ghost]
        d = along[ghost] - 2 * (along[ghost] * n).sum(axis=1)[:, None] * n
        way = hits.ranges[ghost]
        mirrored = rest._first(start[ghost] + way[:, None] * along[ghost], d, time[ghost], rng)
        _put(hits, ghost, mirrored, way)
        hits.firm[ghost | returned] = False
        hits.ranges[pane & ~returned & ~ghost & ~through] = np.inf
        return hits

    def _first(self, start: Array, along: Array, time: Array, rng: np.random.Generator) -> Hits:
        count = len(start)
        out = Hits(
            np.full(count, np.inf), np.ones(count), np.zeros(count, dtype=np.int64),
            np.full(count, -1), np.zeros((count, 3)), np.ones(count, dtype=bool),
        )  # fmt: skip
        if self.terrain is not None and count:
            out.ranges[:], out.normal[:] = self.terrain.hit(start, along)
            out.material[:] = NAMES.index(self.terrain.material)
        for number, solid in enumerate(self.solids):
            moves = bool(np.any(solid.velocity))
            to = solid.center - start
            away = np.linalg.norm(to, axis=1)
            # beams that pass the ball around it
            reach = solid.reach * 1.01 + (3.0 if moves else 0.0)
            along_it = (to * along).sum(axis=1)
            near = (away < reach) | ((along_it > 0) & (away**2 - along_it**2 < reach**2))
            if not near.any():
                continue
            origin = start[near] - solid.velocity * time[near, None] if moves else start[near]
            ways, normal = solid.hit(origin, along[near], rng)
            first = ways < out.ranges[near]
            at = np.flatnonzero(near)[first]
            out.ranges[at], out.normal[at] = ways[first], normal[first]
            out.material[at], out.solid[at] = NAMES.index(solid.material), number
            out.firm[at] = not (solid.porous or moves)
        out.cosine[:] = np.abs((out.normal * along).sum(axis=1))
        return out


def _put(hits: Hits, where: NDArray[np.bool_], other: Hits, further: Array | float) -> None:
    """Set what some beams met."""
    hits.ranges[where] = other.ranges + further
    for name in ("cosine", "material", "solid", "normal", "firm"):
        getattr(hits, name)[where] = getattr(other, name)
