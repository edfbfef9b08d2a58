"""Lines of sight: what hides, what is too far, too steep, too near a pole; places on surfaces."""

import numpy as np

from tribrach.simulate.scene import Scene, box, rectangle, sphere
from tribrach.simulate.sight_lines import sight_lines, surface_places

ORIGIN = np.zeros((1, 3))


def test_what_stands_between_hides():
    scene = Scene.of([box((5.0, 0, 0), (1, 2, 2), 0.5), sphere((0, 6.0, 0), 0.5)])
    places = np.array([[10.0, 0, 0], [10.0, 5, 0], [4.0, 0, 0], [0, 10.0, 0], [0, 10.0, 2]])
    lines = sight_lines(ORIGIN, places, scene)
    assert lines.hidden[0].tolist() == [True, False, False, True, False]
    assert lines.seen[0].tolist() == [False, True, True, False, True]
    np.testing.assert_allclose(lines.length[0], np.linalg.norm(places, axis=1))


def test_a_room_is_seen_from_inside_and_ends_at_its_walls():
    scene = Scene.of([box((0, 0, 0), (10, 8, 3), 0.5)])
    places = np.array([[5.0, 1, 0], [6.0, 1, 0], [0, 0.5, 1.5], [0, 3.9, 1.49]])
    lines = sight_lines(ORIGIN, places, scene)
    assert lines.seen[0].tolist() == [True, False, True, True]
    # on the wall x = 5 at y = 1 the incidence is atan(1 / 5)
    assert abs(lines.steep[0, 0] - np.arctan2(1, 5)) < 1e-9
    flat = sight_lines(ORIGIN, places, scene, steepest=np.radians(60))
    # near the edge of the ceiling the incidence is atan(3.9 / 1.5)
    assert flat.seen[0].tolist() == [True, False, True, False]


def test_reach_and_poles():
    places = np.array([[0.2, 0, 0], [50.0, 0, 0], [150.0, 0, 0], [0, 0, 5.0], [0.1, 0, 5.0]])
    lines = sight_lines(ORIGIN, places, longest=100.0)
    assert lines.seen[0].tolist() == [False, True, False, False, True]
    assert np.isnan(lines.steep).all()


def test_places_lie_on_surfaces_that_are_seen():
    scene = Scene.of(
        [rectangle((4.0, 0, 0), (-1, 0, 0), 6, 3, 0.5), box((2.0, 0, 0), (0.2, 1.0, 4), 0.5)]
    )
    origins = np.array([[0.0, 0, 0], [0.0, 2.0, 0]])
    places = surface_places(scene, origins, 0.5, longest=20.0, steepest=np.radians(70))
    wall = np.abs(places[:, 0] - 4) < 1e-6
    block = np.abs(np.abs(places[:, 0] - 2) - 0.1) < 1e-6
    assert (wall | block | (np.abs(np.abs(places[:, 1]) - 0.5) < 1e-6)).all()
    lines = sight_lines(origins, places, scene, longest=20.0, steepest=np.radians(70))
    count = lines.seen.sum(axis=0)
    assert (count >= 1).all()
    # those that both see come first
    assert (np.diff(count) <= 0).all()
    # one in each half metre of the wall that is seen, 12 x 6 cells of it
    assert 40 < wall.sum() <= 2 * 13 * 7
