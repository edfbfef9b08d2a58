"""Surfaces in common: what is one is one, what is let into it is another."""

import numpy as np

from tests.registration.plane_scenes import POSES, look, upright, yard_station
from tribrach.geometry.pose import Pose
from tribrach.registration.planes.ties import tie_planes
from tribrach.simulate.scene import Scene, box, ground, rectangle

NAMES = ("S1", "S2", "S3")


def test_every_wall_of_the_yard_is_one_surface_of_all_stations():
    stations = [yard_station(name) for name in NAMES]
    ties = tie_planes(stations, POSES)
    vertical = [k for k, n in enumerate(ties.normal) if abs(n[2]) < 0.1 and ties.members[k] == 3]
    found = {tuple(np.round(ties.normal[k], 2) + 0.0): ties.offset[k] for k in vertical}
    for normal, offset in (((0, -1, 0), -10), ((0, 1, 0), -8), ((-1, 0, 0), -15), ((1, 0, 0), -15)):
        assert abs(found[tuple(float(x) for x in normal)] - offset) < 5e-3
    seen = {(s, int(k)) for s, k in zip(ties.station, ties.number, strict=True)}
    assert len(seen) == len(ties.surface)


def test_groups_are_tied_within_themselves_alone():
    stations = [yard_station(name) for name in NAMES]
    ties = tie_planes(stations, POSES, groups=[{"S1", "S2"}])
    assert set(ties.pairs) == {("S1", "S2")}
    assert set(ties.station) == {"S1", "S2"}


def panels():
    """A wall with panels 3 cm before it, each station before another part of it."""
    wall = [ground((0, 0, 0), 100), box((0, 10.5, 4), (60, 1, 8), 0.5)]
    wall += [rectangle((x, 9.97, 4.0), (0, -1, 0), 1.5, 2.5, 0.3) for x in (-7, -3.5, 3.5, 7)]
    return Scene.of(wall)


def test_a_panel_is_not_tied_to_its_wall_by_a_coarse_pose():
    places = {"S1": upright(0.1, (-5, 2, 1.6)), "S2": upright(0.7, (5, 1, 1.7))}
    stations = [look(name, panels(), pose, step=0.007) for name, pose in places.items()]
    wrong = Pose(places["S2"].rotation, places["S2"].translation + np.array([0, 0.015, 0]))
    ties = tie_planes(stations, {"S1": places["S1"], "S2": wrong}, 0.02)
    for surface in range(len(ties.normal)):
        mine = ties.surface == surface
        for station, pose in places.items():
            planes = next(s.planes for s in stations if s.name == station)
            at = [
                k
                for s, k, m in zip(ties.station, ties.number, mine, strict=True)
                if m and s == station
            ]
            heights = (pose @ planes.center[at])[:, 1]
            assert np.ptp(heights) < 0.01 if len(at) else True
