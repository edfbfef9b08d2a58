"""Small scenes, scanned and searched for planes: what two stations know of each other."""

from functools import cache

import numpy as np

from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.views import Surroundings, view_of
from tribrach.scan.range_image import organise
from tribrach.simulate.scanner import ScanGrid, Scanner, scan
from tribrach.simulate.scene import Scene, box, ground
from tribrach.targets.planes import find_planes
from tribrach.units import SEC

NOISE = ScanNoise(0.001, 1e-5, 10 * SEC, 10 * SEC, 0.002, 0.0002)
STEP = 0.009
V = (np.radians(35.0), np.radians(130.0))


def upright(heading, place):
    return Pose(rotation.exp(np.array([[0.0, 0.0, heading]]))[0], np.array(place, dtype=float))


def look(name, scene, pose, *, levelled=True, seed=1, step=STEP, window=(-np.pi, np.pi)):
    """A station in a scene: its planes and its view, within a window of its H [rad]."""
    columns = round((window[1] - window[0]) / step)
    grid = ScanGrid(window[0], V[0], step, round((V[1] - V[0]) / step), columns)
    blocks = list(scan(scene, pose, Scanner(NOISE), grid, (seed, 2, int(name[1:]))))
    xyz = np.concatenate([b.xyz for b in blocks])
    rows = np.concatenate([b.row for b in blocks])
    columns = np.concatenate([b.column for b in blocks])
    image = organise(xyz, rows, columns)
    planes, _ = find_planes(
        xyz, image, sigma_range=0.001, sigma_angle=6e-5, floor=0.0, scan=f"scan {name}"
    )
    return Surroundings.of(name, PlaneSet.of(planes), view_of(xyz, image), levelled)


#: middle and size of the blocks around a yard [m]
WALLS = (
    ((0, 12.5, 4), (30, 5, 8)),
    ((0, -10.5, 3), (30, 5, 6)),
    ((17.5, 0, 2.5), (5, 30, 5)),
    ((-17.5, 0, 3.5), (5, 30, 7)),
)


def yard():
    """A yard between four walls of different heights, and a shed."""
    return Scene.of(
        [
            ground((0, 0, 0), 200),
            *(box(*wall, 0.5) for wall in WALLS),
            box((6.0, 5.0, 1.5), (3.0, 2.0, 3.0), 0.4, 0.4),
        ]
    )


def room(x=0.0, size=(8.0, 6.0, 3.0), extra=()):
    """A closed room around (x, 0)."""
    a, b, h = size
    return [
        box((x, 0, -0.5), (a, b, 1), 0.5),
        box((x, 0, h + 0.5), (a, b, 1), 0.5),
        box((x + a / 2 + 0.5, 0, h / 2), (1, b, h), 0.5),
        box((x - a / 2 - 0.5, 0, h / 2), (1, b, h), 0.5),
        box((x, b / 2 + 0.5, h / 2), (a, 1, h), 0.5),
        box((x, -b / 2 - 0.5, h / 2), (a, 1, h), 0.5),
        *extra,
    ]


def corridor():
    """A corridor along x whose ends nobody sees."""
    return Scene.of(
        [
            box((0, 0, -0.5), (400, 4, 1), 0.5),
            box((0, 0, 3.5), (400, 4, 1), 0.5),
            box((0, 2.5, 1.5), (400, 1, 4), 0.5),
            box((0, -2.5, 1.5), (400, 1, 4), 0.5),
        ]
    )


def facade(length):
    """A facade along x with a pilaster every 4 m, and the ground before it."""
    out = [ground((0, 0, 0), 400), box((0, 10.5, 5), (length, 1, 10), 0.5)]
    for x in np.arange(-length / 2 + 2, length / 2 - 1, 4.0):
        out.append(box((x, 9.0, 3), (1.2, 2.0, 6), 0.5))
    return Scene.of(out)


POSES = {
    "S1": upright(0.3, (-6.0, -2.0, 1.7)),
    "S2": upright(2.1, (2.0, 1.0, 1.6)),
    "S3": upright(-1.2, (9.0, -4.0, 1.8)),
}


@cache
def yard_station(name, seed=1):
    """A station of the yard."""
    return look(name, yard(), POSES[name], seed=seed)


def apart(pose, truth):
    """Distance [m] and angle [rad] between two poses."""
    turn = rotation.log((truth.rotation.T @ pose.rotation)[None])[0]
    return float(np.linalg.norm(pose.translation - truth.translation)), float(np.linalg.norm(turn))
