"""Scans of single bodies as a surveyor meets them: spheres on rods, and what is none.

Every draw has a scanner, a grid and surroundings of its own (``simulate``), the centre is exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate.instruments import PHASE, PULSED
from tribrach.simulate.scanner import ScanGrid, scan
from tribrach.simulate.scene import (
    ELLIPSOID,
    Primitive,
    Scene,
    box,
    cylinder,
    ellipsoid,
    frame_of_normal,
    ground,
    rectangle,
    sphere,
)
from tribrach.units import SEC

R = 0.0725
FLOOR = -1.7
IMPOSTORS = ("radius", "ellipsoid", "leaves", "corner")


@dataclass(frozen=True, eq=False)
class Draw:
    """A scanned body: points, rows and columns, its centre, the noise, and what it is."""

    xyz: np.ndarray
    row: np.ndarray
    column: np.ndarray
    center: np.ndarray
    noise: ScanNoise
    kind: str
    away: float
    visible: float
    facts: str = ""


def scanner_of(rng):
    """A scanner of today: phases or pulses, with noise of its own."""
    noise = ScanNoise(
        rng.uniform(0.4e-3, 1.5e-3),
        0.0,
        *np.full(2, rng.uniform(4, 12) * SEC),
        rng.uniform(2e-3, 4e-3),
        rng.uniform(0.15e-3, 0.3e-3),
    )
    kind = PHASE if rng.random() < 0.5 else PULSED
    speckle = rng.uniform(0.02, 0.08)
    return replace(kind, noise=noise, incidence=bool(rng.random() < 0.5), speckle=speckle)


def draw(seed, kind="sphere", away=(2.5, 8.0), step=(0.5e-3, 1.2e-3), visible=1.0, size=None):
    """Scan one body.

    Parameters
    ----------
    seed : int
        Of everything.
    kind : str
        "sphere", "made" (a sphere as it is made, with a tolerance) or one of :data:`IMPOSTORS`.
    away : tuple
        Bounds of its range [m].
    step : tuple
        Bounds of the step of the grid [rad].
    visible : float
        Share of the disc that a post in front leaves.
    size : float or None
        Radius of a ball over that of the sphere, drawn from 0.95 to 0.98 and 1.02 to 1.05 if None;
        for "made" the tolerance [m].
    """
    rng = np.random.default_rng(seed)
    scanner = scanner_of(rng)
    distance = rng.uniform(*away)
    h, height = rng.uniform(-np.pi, np.pi), rng.uniform(-0.4, 0.5)
    direction = np.array([np.cos(h), np.sin(h), 0.0])
    center = distance * direction
    center[2] = height
    bodies, facts = _body(rng, kind, center, direction, size)
    if kind in ("sphere", "made", "radius", "ellipsoid") or (
        kind == "leaves" and rng.random() < 0.5
    ):
        low = center[2] - 0.9 * R
        middle = np.array([center[0], center[1], (FLOOR + low) / 2])
        bodies.append(cylinder(middle, rng.uniform(0.008, 0.016), low - FLOOR, 0.4))
    behind = center + direction * rng.uniform(0.8, 4.0)
    bodies.append(rectangle(behind, -direction, 30.0, 20.0, 0.5))
    bodies.append(ground((0, 0, FLOOR), 60.0))
    if visible < 1:
        bodies.append(_post(rng, center, direction, visible))
    step = rng.uniform(*step)
    v = float(np.arctan2(distance, height))
    half = max(3 * R / distance, 0.05)
    grid = ScanGrid.window((h - half, h + half), (v - half, v + half), step)
    pose = Pose(np.eye(3), np.zeros(3))
    blocks = list(scan(Scene.of(bodies), pose, scanner, grid, seed))
    xyz, row, column = (
        np.concatenate([getattr(b, name) for b in blocks]) for name in ("xyz", "row", "column")
    )
    return Draw(xyz, row, column, center, scanner.noise, kind, distance, visible, facts)


def _body(rng, kind, center, direction, size):
    """The primitives of a body, and what it is in words."""
    if kind == "sphere":
        return [sphere(center, R)], ""
    if kind == "made":
        return [_made(rng, center, size)], ""
    if kind == "radius":
        share = 1 + rng.choice([-1, 1]) * rng.uniform(0.02, 0.05) if size is None else size
        return [sphere(center, share * R)], f"{share:.3f}"
    if kind == "ellipsoid":
        axis = rng.normal(size=3)
        return [ellipsoid(center, (0.090, 0.090, 0.074), axis=axis)], ""
    if kind == "leaves":
        return _leaves(rng, center)
    return _corner(rng, center, direction)


def _made(rng, center, tolerance):
    """A sphere whose radius has the tolerance as sigma, and an ellipsoid's form half of it."""
    # five coefficients of a symmetric matrix without trace, n^T M n of mean square one in all
    e = rng.normal(size=5) / 5**0.5
    a, b = (15 / 4) ** 0.5 * e[3], (5 / 4) ** 0.5 * e[4]
    xy, yz, xz = 15**0.5 / 2 * e[:3]
    form = np.array([[a - b, xy, xz], [xy, -a - b, yz], [xz, yz, 2 * b]])
    values, axes = np.linalg.eigh(form)
    half = R + tolerance * (rng.normal() + 0.5 * values)
    return Primitive(ELLIPSOID, np.asarray(center, float), axes.T, half, 0.85)


def _leaves(rng, center):
    """Leaves in a ball of the sphere's size: all through it, or in a shell along its surface."""
    count, half = int(rng.integers(150, 900)), rng.uniform(4e-3, 16e-3)
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shell = rng.random() < 0.5
    inner = rng.uniform(0.7, 0.95) if shell else 0.0
    depth = rng.uniform(inner**3, 1, count) ** (1 / 3)
    tilt = normal + rng.normal(size=(count, 3)) * (rng.uniform(0.2, 0.6) if shell else 3.0)
    places = center + R * depth[:, None] * normal
    leaves = [rectangle(p, t, 2 * half, 2 * half, 0.4) for p, t in zip(places, tilt, strict=True)]
    return leaves, f"{'shell' if shell else 'volume'} {count} {1e3 * half:.0f} mm"


def _corner(rng, center, direction):
    """A corner of a room, a box, or a tin of about the sphere's size."""
    turn = rng.uniform(0, 2 * np.pi)
    which = int(rng.integers(3))
    if which == 0:
        spread = frame_of_normal(-direction + 0.3 * rng.normal(size=3), turn)
        # three planes whose normals are alike inclined to the line of sight
        c, s = np.sqrt(1 / 3), np.sqrt(2 / 3)
        out = []
        for k in range(3):
            a = turn + 2 * np.pi * k / 3
            n = c * spread[2] + s * (np.cos(a) * spread[0] + np.sin(a) * spread[1])
            out.append(rectangle(center, n, 1.0, 1.0, 0.5))
        return out, "room"
    if which == 1:
        side = rng.uniform(1.2, 2.2) * R
        return [box(center, (side, side, side), 0.5, rng.uniform(0, np.pi))], "box"
    height = rng.uniform(1.5, 2.5) * R
    return [cylinder(center, R, height, 0.5, axis=rng.normal(size=3))], "tin"


def _post(rng, center, direction, visible):
    """A post nearer than a sphere that leaves a share of its disc to be seen."""
    away = np.linalg.norm(center[:2])
    near = min(rng.uniform(0.3, 1.0), 0.3 * away)
    # the chord beyond which the share of a disc lies, by bisection
    low, high = -1.0, 1.0
    for _ in range(50):
        middle = (low + high) / 2
        share = (np.arccos(middle) - middle * np.sqrt(1 - middle**2)) / np.pi
        low, high = (middle, high) if share > visible else (low, middle)
    side = np.cross(direction, [0.0, 0.0, 1.0]) * rng.choice([-1.0, 1.0])
    wide = 0.3
    edge = low * R * (away - near) / away
    place = center * (away - near) / away + side * (edge - wide / 2)
    return rectangle(place, -direction, wide, 2.0, 0.5)
