"""Seven sorts of sites, each different with every seed, and where scanners stand in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.coverage.world import Array, Solid, Terrain, ball, box, pole, turned

__all__ = ["SITES", "Site"]


@dataclass(frozen=True)
class Site:
    """What stands, and where scanners stand."""

    solids: list[Solid]
    terrain: Terrain | None
    #: places (n, 3) of scanners [m]
    stations: Array
    #: what moves or was moved between the scans, made anew for each
    passing: Callable[[np.random.Generator], list[Solid]]


Rng = np.random.Generator


def _above(place: Array, up: float) -> Array:
    """A place moved upwards."""
    return place + np.array([0.0, 0.0, up])


def _people(count: int, area: Array, rng: Rng, floor: Callable[[Array], float]) -> list[Solid]:
    """Persons who walk while the scan is taken, within an area [[x, y], [x, y]]."""
    out = []
    for _ in range(rng.integers(0, count + 1)):
        xy = rng.uniform(*area)
        speed = np.append(rng.normal(0, 0.01, 2), 0.0)
        foot = np.append(xy, floor(xy))
        body = pole(foot, 0.22, rng.uniform(1.3, 1.6), "cloth", velocity=speed)
        out += [body, ball(_above(foot, 2 * body.half[2] + 0.1), 0.12, "cloth", velocity=speed)]
    return out


def _windows(
    house: Solid, side: int, axis: int, rng: Rng, bay: float, sill: float = 0.9
) -> tuple[list[tuple[Array, Array]], list[Solid]]:
    """Openings in a wall of a box, and panes in them."""
    openings, panes = [], []
    along = 1 - axis
    storeys = max(int(2 * house.half[2] / 3.0), 1)
    bays = max(int(2 * house.half[along] / bay), 1)
    wide, high = rng.uniform(0.35, 0.55) * min(bay, 3.0), rng.uniform(1.0, 1.6)
    for storey in range(storeys):
        for k in range(bays):
            center = np.zeros(3)
            center[axis] = side * house.half[axis]
            center[along] = (k + 0.5 - bays / 2) * 2 * house.half[along] / bays
            center[2] = -house.half[2] + 3.0 * storey + sill + high / 2
            if center[2] + high / 2 > house.half[2]:
                continue
            half = np.zeros(3)
            half[axis], half[along], half[2] = 0.3, wide / 2, high / 2
            openings.append((center, half))
            size = 2 * half
            size[axis] = 0.01
            inset = center.copy()
            inset[axis] -= side * 0.12
            place = house.center + house.axes @ inset
            panes.append(replace(box(place, size, "glass"), axes=house.axes))
    return openings, panes


def _furniture(low: Array, high: Array, count: int, rng: Rng) -> list[Solid]:
    """Tables, cupboards, shelves and round things on the floor of a room."""
    out: list[Solid] = []
    for _ in range(count):
        xy = rng.uniform(low + 0.5, high - 0.5)
        sort, heading = rng.integers(4), rng.choice([0, np.pi / 2]) + rng.normal(0, 0.1)
        material = rng.choice(["wood", "paint", "black", "steel"])
        if sort == 0:
            out.append(box([*xy, 0.73], [1.4, 0.8, 0.04], material, heading))
            out += [
                pole([*(xy + turned(heading)[:2, :2] @ leg), 0], 0.03, 0.71, "steel")
                for leg in ([0.6, 0.3], [0.6, -0.3], [-0.6, 0.3], [-0.6, -0.3])
            ]
        elif sort == 3:
            out.append(pole([*xy, 0], rng.uniform(0.1, 0.4), rng.uniform(0.4, 1.5), material))
        else:
            size = rng.uniform([0.4, 0.4, 0.4], [1.6, 0.7, 2.0])
            out.append(box([*xy, size[2] / 2], size, material, heading))
    return out


def room(rng: Rng, count: int) -> Site:
    """Two rooms with a door between them; some of the rooms are bare and symmetric."""
    size = rng.uniform([6, 5, 2.5], [13, 9, 4.0])
    other = rng.uniform([4, size[1] * 0.6, size[2] - 0.2], [7, size[1], size[2]])
    thick = 0.15
    door = np.array([0.9, 2.1])
    bare = rng.random() < 0.15
    first = box([0, 0, size[2] / 2], size, "plaster")
    second_at = np.array([size[0] / 2 + thick + other[0] / 2, 0, other[2] / 2])
    second = box(second_at, other, "plaster")
    solids: list[Solid] = []
    openings, panes = ([], []) if bare else _windows(first, 1, 1, rng, rng.uniform(2, 3.5))
    y = rng.uniform(-0.3, 0.3) * other[1]
    if not bare:
        half = np.array([0.5, door[0] / 2, door[1] / 2])
        openings.append((np.array([size[0] / 2, y, (door[1] - size[2]) / 2 + 1e-3]), half))
        gap = (np.array([-other[0] / 2, y, (door[1] - other[2]) / 2 + 1e-3]), half)
        solids.append(replace(second, openings=(gap,)))
        solids += _furniture(second_at[:2] - other[:2] / 2, second_at[:2] + other[:2] / 2, 4, rng)
        solids += _furniture(-size[:2] / 2, size[:2] / 2, int(rng.integers(3, 10)), rng)
        # the house on the other side of the street
        solids.append(box([0, size[1] / 2 + 14, 3], [30, 6, 12], "brick"))
    solids += [replace(first, openings=tuple(openings)), *panes]
    xy = _apart(rng, count, -0.35 * size[:2], 0.35 * size[:2], 1.5)
    places = np.column_stack([xy, np.zeros(count)])
    if count == 3 and not bare:
        places[2] = second_at + rng.uniform(-0.2, 0.2, 3) * other
    places[:, 2] = rng.uniform(1.2, 1.8, count)
    area = np.array([-size[:2] / 2 + 0.4, size[:2] / 2 - 0.4])
    return Site(
        [s for s in solids if s.openings or s.material == "plaster" or _clear([s], places)],
        None,
        places,
        lambda r: [] if bare else _clear(_people(2, area, r, lambda xy: 0.0), places),
    )


def _ground(rng: Rng, material: str, size: float, edge: float = 80.0) -> Terrain:
    waves = np.column_stack(
        [rng.uniform(0.2, 1, 4) * size, rng.normal(0, 0.25, (4, 2)), rng.uniform(0, 6, 4)]
    )
    return Terrain(material, waves=waves, edge=edge)


def _on(terrain: Terrain, xy: Array, up: float = 0.0) -> Array:
    return np.append(xy, terrain.height(np.atleast_2d(xy))[0] + up)


def _tree(foot: Array, rng: Rng, leaves: bool = True) -> list[Solid]:
    """A trunk and a crown of foliage."""
    radius, height = rng.uniform(0.08, 0.3), rng.uniform(5, 14)
    lean = rng.uniform(0, 0.08), rng.uniform(0, 6.28)
    out = [pole(foot, radius, height, "bark", *lean)]
    for _ in range(2 if leaves else 0):
        off = _above(rng.normal(0, 0.8, 3), height)
        out.append(ball(foot + off, rng.uniform(0.8, 2.2), "leaf", porous=rng.uniform(0.6, 2)))
    return out


def _cars(places: list[Array], terrain: Terrain, heading: float, rng: Rng) -> list[Solid]:
    """Parked cars on some of the places."""
    out = []
    for xy in places:
        if rng.random() < 0.5:
            z = terrain.height(np.atleast_2d(xy))[0]
            paint = rng.choice(["paint", "black"])
            out.append(box([*xy, z + 0.6], [4.3, 1.8, 0.8], paint, heading))
            out.append(box([*xy, z + 1.2], [2.2, 1.6, 0.5], "black", heading))
    return out


def yard(rng: Rng, count: int) -> Site:
    """Houses of several sizes around a yard, with trees and cars."""
    terrain = _ground(rng, rng.choice(["asphalt", "gravel", "grass"]), 0.08, 60.0)
    solids: list[Solid] = []
    across = rng.uniform([12, 9], [22, 16])
    for k in range(int(rng.integers(5, 9))):
        turn = 2 * np.pi * k / 7 + rng.normal(0, 0.1)
        xy = across * [np.cos(turn), np.sin(turn)]
        size = rng.uniform([7, 5, 4], [13, 9, 12])
        wall = rng.choice(["plaster", "brick", "concrete"])
        house = box([*xy, size[2] / 2 - 0.3], size, wall, turn + np.pi / 2 + rng.normal(0, 0.2))
        openings: list[tuple[Array, Array]] = []
        for side in (-1, 1):
            some, panes = _windows(house, side, 1, rng, rng.uniform(2.0, 4.0))
            openings += some
            solids += panes
        solids.append(replace(house, openings=tuple(openings)))
    for xy in rng.uniform(-0.5, 0.5, (int(rng.integers(2, 7)), 2)) * across * 1.4:
        solids += _tree(_on(terrain, xy), rng)
    for xy in rng.uniform(-0.5, 0.5, (3, 2)) * across * 1.3:
        size = rng.uniform(0.5, 1.8, 3)
        solids.append(box(_on(terrain, xy, size[2] / 2), size, "concrete", rng.uniform(0, 3)))
    places = np.array(
        [_on(terrain, xy, 1.7) for xy in _apart(rng, count, -0.4 * across, 0.4 * across, 4.0)]
    )
    spaces = list(rng.uniform(-0.6, 0.6, (4, 2)) * across)
    area = np.array([-0.6 * across, 0.6 * across])

    def passing(r: Rng) -> list[Solid]:
        people = _people(4, area, r, lambda xy: float(_on(terrain, xy)[2]))
        return _clear(_cars(spaces, terrain, 0.3, r) + people, places)

    return Site(_clear(solids, places), terrain, places, passing)


def street(rng: Rng, count: int) -> Site:
    """Two rows of facades with bays that repeat themselves."""
    terrain = _ground(rng, "asphalt", 0.03, 70.0)
    wide, solids = rng.uniform(10, 18), list[Solid]()
    for side in (-1, 1):
        x = -45.0
        while x < 45:
            size = np.array([rng.uniform(9, 22), 8.0, rng.uniform(5, 15)])
            recess = rng.choice([0, 0, 0.3, 1.0])
            y = side * (wide / 2 + size[1] / 2 + recess)
            wall = rng.choice(["plaster", "brick", "concrete"])
            house = box([x + size[0] / 2, y, size[2] / 2 - 0.2], size, wall)
            openings, panes = _windows(house, -side, 1, rng, rng.uniform(2.0, 3.5))
            solids += [replace(house, openings=tuple(openings)), *panes]
            x += size[0] + rng.choice([0, 0, 0, 3.0])
        kerb = [0, side * (wide / 2 - 1), 0.02]
        solids.append(box(kerb, [90, 2, 0.24], "concrete"))
        for x in np.arange(-40 + rng.uniform(0, 15), 40, rng.uniform(12, 25)):
            solids.append(pole([x, side * (wide / 2 - 1.8), 0], 0.07, 6, "steel"))
    for x in rng.uniform(-30, 30, int(rng.integers(0, 6))):
        solids += _tree(np.array([x, rng.choice([-1, 1]) * (wide / 2 - 1.5), 0]), rng)
    gap = rng.uniform(5, 14)
    x = (np.arange(count) - count / 2) * gap + rng.normal(0, 1, count)
    places = np.column_stack([x, rng.normal(0, wide / 10, count), np.full(count, 1.75)])
    spaces = [np.array([k, s * (wide / 2 - 3)]) for k in np.arange(-36, 37, 6) for s in (-1, 1)]
    area = np.array([[-20, -wide / 2], [20, wide / 2]])

    def passing(r: Rng) -> list[Solid]:
        return _clear(_cars(spaces, terrain, 0, r) + _people(5, area, r, lambda xy: 0.0), places)

    return Site(_clear(solids, places), terrain, places, passing)


def forest(rng: Rng, count: int) -> Site:
    """Trunks on rough ground, with foliage that is elsewhere in each scan."""
    terrain = _ground(rng, rng.choice(["soil", "grass"]), rng.uniform(0.1, 0.5), 40.0)
    solids: list[Solid] = []
    for xy in rng.uniform(-28, 28, (int(rng.integers(60, 160)), 2)):
        solids += _tree(_on(terrain, xy, -0.2), rng, leaves=rng.random() < 0.5)
    for xy in rng.uniform(-20, 20, (int(rng.integers(5, 25)), 2)):
        bush = ball(_on(terrain, xy, 0.3), rng.uniform(0.4, 1.2), "leaf", porous=0.3)
        solids.append(bush)
    places = np.array([_on(terrain, xy, 1.6) for xy in _apart(rng, count, [-8, -8], [8, 8], 5.0)])
    return Site(_clear(solids, places), terrain, places, lambda r: [])


def tunnel(rng: Rng, count: int) -> Site:
    """A tube with a roadway; cables and niches tell where, and some tunnels have none."""
    radius, length = rng.uniform(3, 5.5), 120.0
    axes = turned(0, np.pi / 2, 0)  # along x
    shell = rng.choice(["concrete", "rock"], p=[0.7, 0.3])
    half = np.array([radius, radius, length / 2])
    solids = [
        Solid("cylinder", np.zeros(3), half, axes, shell, capped=False),
        box([0, 0, -0.5 * radius - 0.5], [length, 2 * radius, 1.0], "asphalt"),
    ]
    floor = -0.5 * radius
    for side in rng.choice([-1, 1], int(rng.integers(0, 3))):
        place = np.array([0, side * 0.92 * radius, rng.uniform(-0.1, 0.3) * radius])
        cable = np.array([0.05, 0.05, length / 2])
        solids.append(Solid("cylinder", place, cable, axes, "black"))
    if rng.random() < 0.75:
        for x in rng.uniform(-25, 25, int(rng.integers(4, 14))):
            size = rng.uniform([0.3, 0.2, 0.3], [1.2, 0.6, 2.0])
            y = rng.choice([-1, 1]) * (0.85 * radius - size[1] / 2)
            solids.append(box([x, y, floor + rng.uniform(0, 1) + size[2] / 2], size, "steel"))
    for x in np.arange(-55, 55, rng.uniform(5, 9)):
        solids.append(box([x, 0, 0.93 * radius], [1.2, 0.3, 0.12], "paint"))
    x = np.arange(count) * rng.uniform(4, 12) + rng.normal(0, 0.5, count) - 5
    places = np.column_stack([x, rng.normal(0, 0.5, count), np.full(count, floor + 1.7)])
    area = np.array([[-20, -0.5 * radius], [20, 0.5 * radius]])
    return Site(
        solids, None, places, lambda r: _clear(_people(2, area, r, lambda xy: floor), places)
    )


def plant(rng: Rng, count: int) -> Site:
    """A hall with tanks, pipes, beams and a vessel."""
    size = rng.uniform([18, 12, 6], [34, 22, 10])
    hall, solids = box([0, 0, size[2] / 2], size, "concrete"), list[Solid]()
    for x in np.arange(-size[0] / 2 + 3, size[0] / 2 - 1, rng.uniform(4, 6)):
        for side in (-1, 1):
            y = side * (size[1] / 2 - 0.3)
            solids.append(box([x, y, size[2] / 2], [0.3, 0.3, size[2]], "steel"))
        solids.append(box([x, 0, size[2] - 0.3], [0.25, size[1], 0.4], "steel"))
    for xy in rng.uniform(-0.42, 0.42, (int(rng.integers(2, 6)), 2)) * size[:2]:
        solids.append(pole([*xy, 0], rng.uniform(0.5, 1.5), rng.uniform(2, 5), "paint"))
    for _ in range(int(rng.integers(5, 20))):
        along, radius = rng.integers(2), rng.uniform(0.05, 0.25)
        place = rng.uniform([-0.45, -0.45, 0.15], [0.45, 0.45, 0.85]) * size
        place[along] = 0
        axes = turned(0, np.pi / 2, along * np.pi / 2)
        half = np.array([radius, radius, size[along] / 2])
        solids.append(Solid("cylinder", place, half, axes, rng.choice(["steel", "paint"])))
    vessel = rng.uniform([-0.35, -0.35, 0], [0.35, 0.35, 0]) * size
    solids.append(ball(_above(vessel, 1.8), rng.uniform(0.8, 1.4), "paint"))
    solids += _furniture(-size[:2] / 2, size[:2] / 2, 6, rng)
    xy = _apart(rng, count, -0.35 * size[:2], 0.35 * size[:2], 4.0)
    places = np.column_stack([xy, rng.uniform(1.4, 1.9, count)])
    area = np.array([-0.4 * size[:2], 0.4 * size[:2]])
    return Site(
        [hall, *_clear(solids, places)],
        None,
        places,
        lambda r: _clear(_people(3, area, r, lambda xy: 0.0), places),
    )


def heap(rng: Rng, count: int) -> Site:
    """Heaps of gravel or soil, seen from around them; some with a container and posts."""
    waves = _ground(rng, "soil", 0.1).waves
    number = int(rng.integers(2, 6))
    bells = np.column_stack(
        [rng.normal(0, 6, (number, 2)), rng.uniform(1, 4, number), rng.uniform(1.5, 4, number)]
    )
    small = np.column_stack(
        [rng.normal(0, 9, (10, 2)), rng.uniform(0.1, 0.5, 10), rng.uniform(0.4, 1.2, 10)]
    )
    terrain = Terrain(
        rng.choice(["gravel", "soil"]), np.concatenate([bells, small]), waves, edge=45.0
    )
    solids: list[Solid] = []
    if rng.random() < 0.6:
        place = _on(terrain, rng.uniform(-15, 15, 2), 1.2)
        solids.append(box(place, [6, 2.4, 2.6], "paint", rng.uniform(0, 3)))
        for xy in rng.uniform(-18, 18, (4, 2)):
            solids.append(pole(_on(terrain, xy, -0.2), 0.06, 2.5, "wood"))
    begin, apart = rng.uniform(0, 6.28), rng.uniform(0.5, 1.4)
    turns = begin + apart * np.arange(count)
    xy = rng.uniform(9, 14) * np.column_stack([np.cos(turns), np.sin(turns)])
    places = np.array([_on(terrain, one, 1.7) for one in xy])
    return Site(_clear(solids, places), terrain, places, lambda r: [])


def _apart(rng: Rng, count: int, low: object, high: object, gap: float) -> Array:
    """Places (n, 2) in a rectangle, apart from each other if there is room."""
    best, most = None, -1.0
    for _ in range(50):
        xy = rng.uniform(low, high, (count, 2))
        off = np.linalg.norm(xy[:, None] - xy[None], axis=2) + 1e9 * np.eye(count)
        if off.min() > most:
            best, most = xy, off.min()
        if most > gap:
            break
    assert best is not None
    return best


def _clear(solids: list[Solid], places: Array) -> list[Solid]:
    """Solids without those that stand on a scanner or around it."""

    def free(solid: Solid) -> bool:
        local = np.abs((places - solid.center) @ solid.axes)
        if solid.porous or solid.shape == "ball":
            return bool((np.linalg.norm(local, axis=1) > solid.half[0] + 0.5).all())
        return not bool((local < solid.half + 0.5).all(axis=1).any())

    return [s for s in solids if free(s)]


SITES: dict[str, Callable[[Rng, int], Site]] = {
    f.__name__: f for f in (room, yard, street, forest, tunnel, plant, heap)
}
