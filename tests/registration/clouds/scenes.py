"""Scenes for the registration of clouds: a yard, facades, corridors, rooms."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.simulate.scanner import ScanGrid, Scanner, scan
from tribrach.simulate.scene import Primitive, Scene, box, cylinder, ground, rectangle
from tribrach.simulate.setups import levelled, tilted
from tribrach.units import SEC

NOISE = ScanNoise(0.001, 1e-5, 10 * SEC, 10 * SEC, 0.002, 0.0002)
#: a base of 8 m in the grove
GROVE_PLACES = ((-4.0, 0.0, 0.4), (4.0, 0.0, -2.1))
_V = (np.radians(35.0), np.radians(135.0))


def yard(*more: Primitive) -> Scene:
    """Houses of different sizes around a yard, some things in it, and more."""
    return Scene.of(
        [
            ground((0, 0, 0), 200),
            box((2, 17, 4), (26, 8, 8), 0.5),
            box((-19, 3, 3), (8, 21, 6), 0.5),
            box((18, -1, 5), (7, 17, 10), 0.5, 0.15),
            box((-3, -15, 2.5), (20, 6, 5), 0.5, -0.1),
            box((6, 4, 0.6), (2.0, 1.0, 1.2), 0.4, 0.4),
            box((-6, -4, 1.0), (1.2, 2.0, 2.0), 0.4, 1.0),
            cylinder((1, -6, 2), 0.2, 4, 0.4),
            *more,
        ]
    )


def grove(seed: int, square: bool = False) -> Scene:
    """Trees and poles on level ground, round or square; nothing else holds the way of the base."""
    rng = np.random.default_rng((7, seed))
    parts: list[Primitive] = [ground((0, 0, 0), 200)]
    places = [np.array(place[:2]) for place in GROVE_PLACES]
    radii: list[float] = []
    while len(radii) < 20:
        # poles stand anywhere, trunks not close to each other
        pole = len(radii) >= 16
        place = rng.uniform((-13, -9), (13, 9))
        if min(np.linalg.norm(place - other) for other in places) < (0.6 if pole else 1.6):
            continue
        places.append(place)
        radii.append(0.04 + 0.01 * (len(radii) - 16) if pole else float(rng.uniform(0.08, 0.3)))
        height = 4.0 if pole else float(rng.uniform(4, 7))
        center = (place[0], place[1], height / 2)
        if square:
            size = (2 * radii[-1], 2 * radii[-1], height)
            parts.append(box(center, size, 0.4, float(rng.uniform(0, 3))))
        else:
            parts.append(cylinder(center, radii[-1], height, 0.4))
    return Scene.of(parts)


def facade() -> Scene:
    """A facade with a pillar every 3 m, longer than a scanner sees."""
    wall = rectangle((0, 12, 5), (0, -1, 0), 400, 10, 0.5)
    parts: list[Primitive] = [ground((0, 0, 0), 400), wall]
    parts += [box((x, 11.7, 5.0), (0.8, 1.0, 10.0), 0.3) for x in np.arange(-99.0, 100.0, 3.0)]
    return Scene.of(parts)


def corridor() -> Scene:
    """Floor, ceiling and two walls that go on for ever."""
    return Scene.of(
        [
            ground((0, 0, 0), 400),
            rectangle((0, 0, 2.8), (0, 0, -1), 400, 400, 0.5),
            rectangle((0, 1.1, 1.4), (0, -1, 0), 400, 2.8, 0.5),
            rectangle((0, -1.3, 1.4), (0, 1, 0), 400, 2.8, 0.5),
        ]
    )


def windows(period: float = 3.0) -> Scene:
    """A facade of equal windows in three storeys, 15 cm deep, longer than a scanner sees."""
    parts: list[Primitive] = [
        ground((0, 0, 0), 400),
        rectangle((0, 12.15, 5), (0, -1, 0), 400, 10, 0.25),
    ]
    for low, high in ((0.0, 1.0), (2.6, 4.2), (5.8, 7.4), (9.0, 10.0)):
        parts.append(box((0, 12.15, (low + high) / 2), (400, 0.3, high - low), 0.5))
    places = period * np.arange(-40, 41)
    parts += [box((x, 12.15, 5.0), (period - 1.2, 0.3, 10.0), 0.5) for x in places]
    return Scene.of(parts)


def doors(period: float = 4.0) -> Scene:
    """A corridor that goes on for ever, with doors on both sides, 12 cm deep."""
    parts: list[Primitive] = [
        ground((0, 0, 0), 400),
        rectangle((0, 0, 2.8), (0, 0, -1), 400, 400, 0.5),
    ]
    for side, wall in ((-1, 1.1), (1, -1.3)):
        middle = wall - 0.12 * side
        parts.append(rectangle((0, middle, 1.4), (0, side, 0), 400, 2.8, 0.3))
        parts.append(box((0, middle, 2.4), (400, 0.24, 0.8), 0.5))
        places = period * np.arange(-25, 26)
        parts += [box((x, middle, 1.4), (period - 0.95, 0.24, 2.8), 0.5) for x in places]
    return Scene.of(parts)


def rooms() -> Scene:
    """Two rooms without a door between them."""
    parts: list[Primitive] = []
    for x, (width, depth, height) in ((0.0, (7.0, 5.0, 2.6)), (30.0, (9.0, 11.0, 3.4))):
        parts += [
            rectangle((x, 0, 0), (0, 0, 1), width, depth, 0.5),
            rectangle((x, 0, height), (0, 0, -1), width, depth, 0.5),
            rectangle((x - width / 2, 0, height / 2), (1, 0, 0), depth, height, 0.5),
            rectangle((x + width / 2, 0, height / 2), (-1, 0, 0), depth, height, 0.5),
            rectangle((x, depth / 2, height / 2), (0, -1, 0), width, height, 0.5),
            rectangle((x, -depth / 2, height / 2), (0, 1, 0), width, height, 0.5),
            box((x + 1.2, depth / 2 - 0.4, 0.9), (1.6, 0.5, 1.8), 0.4),
            box((x - 2.0, -0.8, 0.4), (0.8, 1.4, 0.8), 0.4, 0.5),
        ]
    return Scene.of(parts)


def empty_room(width: float = 9.0, depth: float = 6.0) -> Scene:
    """Four walls, a floor and a ceiling."""
    return Scene.of(
        [
            rectangle((0, 0, 0), (0, 0, 1), width, depth, 0.5),
            rectangle((0, 0, 3.0), (0, 0, -1), width, depth, 0.5),
            rectangle((-width / 2, 0, 1.5), (1, 0, 0), depth, 3.0, 0.5),
            rectangle((width / 2, 0, 1.5), (-1, 0, 0), depth, 3.0, 0.5),
            rectangle((0, depth / 2, 1.5), (0, -1, 0), width, 3.0, 0.5),
            rectangle((0, -depth / 2, 1.5), (0, 1, 0), width, 3.0, 0.5),
        ]
    )


def storeys(height: float = 3.0, count: int = 5) -> Scene:
    """Equal storeys about an open well, a block at one side of each, floors numbered from -2."""
    parts: list[Primitive] = []
    low, high = -(count // 2) * height, (count - count // 2) * height
    middle, whole = (low + high) / 2, high - low
    for center, normal, width in (
        ((-2.5, 0, middle), (1, 0, 0), 6.0),
        ((2.5, 0, middle), (-1, 0, 0), 6.0),
        ((0, 3.0, middle), (0, -1, 0), 5.0),
        ((0, -3.0, middle), (0, 1, 0), 5.0),
    ):
        parts.append(rectangle(center, normal, width, whole, 0.5))
    for level in np.arange(count + 1) * height + low:
        # a gallery of 1.6 m about the well, 0.2 m thick, and what stands on it
        parts += [
            box((0, 2.2, level - 0.1), (5.0, 1.6, 0.2), 0.5),
            box((0, -2.2, level - 0.1), (5.0, 1.6, 0.2), 0.5),
            box((-1.9, 0, level - 0.1), (1.2, 2.8, 0.2), 0.5),
            box((2.2, 2.6, level + 0.5), (0.5, 0.6, 1.0), 0.4),
            box((-2.2, -1.0, level + 1.0), (0.4, 0.9, 2.0), 0.4),
        ]
    return Scene.of(parts)


def deck(bay: float = 6.0) -> Scene:
    """A bridge of two parapets and equal lamps on either side, longer than a scanner sees."""
    parts: list[Primitive] = [rectangle((0, 0, 0), (0, 0, 1), 300, 9.0, 0.3)]
    for side in (-1.0, 1.0):
        parts.append(box((0, 4.4 * side, 0.5), (300, 0.2, 1.0), 0.4))
        parts += [box((x, 4.0 * side, 2.5), (0.3, 0.3, 5.0), 0.4) for x in bay * np.arange(-25, 26)]
    return Scene.of(parts)


def points_of(scene: Scene, pose: Pose, points: int, seed: int, farthest: float = 60.0) -> Array:
    """A scan (n, 3) in its scanner's frame [m]."""
    scanner = Scanner(NOISE, farthest=farthest)
    blocks = scan(scene, pose, scanner, ScanGrid.panorama(_V, points), seed)
    return np.concatenate([block.xyz for block in blocks])


def scanned(
    scene: Scene,
    places: Sequence[tuple[float, float, float]],
    *,
    points: int = 60_000,
    seed: int = 1,
    farthest: float = 60.0,
    tilt: float = 0.0,
    zero: float = 0.0,
) -> tuple[list[PreparedScan], list[Pose]]:
    """Scans from places (x, y, heading), 1.7 m above the ground, and their true poses.

    ``zero`` is by how much all ranges are too long [m].
    """
    rng = np.random.default_rng(seed)
    scans, poses = [], []
    for number, (x, y, heading) in enumerate(places):
        place = (x, y, 1.6 + 0.05 * number)
        if tilt:
            pose = tilted(place, heading, tilt, rng)
        else:
            pose = levelled(place, heading, 10 * SEC, rng)
        xyz = points_of(scene, pose, points, 100 * seed + number, farthest)
        longer = xyz * (1 + zero / np.linalg.norm(xyz, axis=1))[:, None]
        scans.append(prepare(f"S{number + 1}", [longer]))
        poses.append(pose)
    return scans, poses


@lru_cache(maxsize=1)
def yard_scans() -> tuple[tuple[PreparedScan, ...], tuple[Pose, ...]]:
    """Three scans of the yard, made once."""
    places = ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5), (2.0, 8.0, -1.4))
    scans, poses = scanned(yard(), places)
    return tuple(scans), tuple(poses)


def error(found: Pose, true: Pose) -> tuple[float, float]:
    """Shift [m] and turn [rad] between two poses."""
    turn = found.rotation @ true.rotation.T
    cosine = np.clip((np.trace(turn) - 1) / 2, -1, 1)
    return float(np.linalg.norm(found.translation - true.translation)), float(np.arccos(cosine))
