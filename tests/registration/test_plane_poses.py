"""Relative poses from planes alone: right, ambiguous, open or none, but never wrong."""

import numpy as np
import pytest

from tests.registration.plane_scenes import (
    POSES,
    WALLS,
    apart,
    corridor,
    facade,
    look,
    room,
    upright,
    yard,
    yard_station,
)
from tribrach.errors import RankDefect
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.planes import FittedPlanes
from tribrach.observations.unknowns import plane_basis
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.planes.poses import information, open_directions, pair_poses
from tribrach.registration.planes.stations import register_by_planes
from tribrach.simulate.scene import Scene, box, ground


@pytest.mark.parametrize(("a", "b"), [("S1", "S2"), ("S2", "S3")])
def test_levelled_stations_of_a_yard_find_each_other(a, b):
    found = pair_poses(yard_station(a), yard_station(b))
    assert found.sure
    distance, angle = apart(found.poses[0].pose, POSES[a].inverse @ POSES[b])
    assert distance < 0.005
    assert angle < 5e-4
    assert found.poses[0].seen.conflict < 0.01


def test_tilted_stations_find_each_other_from_any_attitude():
    """Prior-free in all six unknowns: 50 degrees and metres apart."""
    tilted = Pose(rotation.exp(np.array([0.5, -0.4, 0.9])), np.array([2.0, 1.0, 1.9]))
    upside = Pose(rotation.exp(np.array([2.8, 0.6, -0.3])), np.array([-6.0, -2.0, 2.2]))
    one = look("S1", yard(), tilted, levelled=False)
    two = look("S2", yard(), upside, levelled=False)
    found = pair_poses(one, two)
    assert found.sure
    distance, angle = apart(found.poses[0].pose, tilted.inverse @ upside)
    assert distance < 0.01
    assert angle < 1e-3


def test_an_empty_symmetric_room_is_not_guessed():
    scene = Scene.of(room())
    truth = [upright(0.2, (1.0, 0.5, 1.5)), upright(1.0, (-1.5, -0.3, 1.6))]
    found = pair_poses(*(look(f"S{k + 1}", scene, p, step=0.015) for k, p in enumerate(truth)))
    assert len(found.poses) == 2
    gaps = [apart(f.pose, truth[0].inverse @ truth[1])[0] for f in found.poses]
    assert min(gaps) < 0.005


def test_a_cupboard_decides_the_symmetric_room():
    scene = Scene.of(room(extra=[box((3.0, 2.0, 0.9), (0.6, 1.4, 1.8), 0.4)]))
    truth = [upright(0.2, (1.0, 0.5, 1.5)), upright(1.0, (-1.5, -0.3, 1.6))]
    found = pair_poses(*(look(f"S{k + 1}", scene, p, step=0.015) for k, p in enumerate(truth)))
    assert found.sure
    assert apart(found.poses[0].pose, truth[0].inverse @ truth[1])[0] < 0.005


def test_rooms_without_overlap_are_not_joined():
    scene = Scene.of([*room(), *room(30.0, (7.0, 5.0, 3.0), [box((31, 1, 0.5), (1, 1, 1), 0.5)])])
    one = look("S1", scene, upright(0.2, (1, 0.5, 1.5)), step=0.015)
    two = look("S2", scene, upright(1.0, (29, -0.3, 1.6)), step=0.015)
    assert pair_poses(one, two).poses == ()
    said = register_by_planes([one, two])
    assert [len(g) for g in said.groups] == [1, 1]
    assert "overlaps with none" in said.obstacles["S1"]


def test_a_corridor_stays_open_along_itself():
    places = [upright(0.2, (-5, 0.2, 1.5)), upright(1.0, (0, -0.3, 1.6))]
    stations = [look(f"S{k + 1}", corridor(), p, step=0.015) for k, p in enumerate(places)]
    found = pair_poses(*stations)
    assert found.poses == ()
    along = places[0].rotation.T @ np.array([1.0, 0.0, 0.0])
    assert abs(found.open[0] @ along) == pytest.approx(1.0, abs=1e-4)
    words = register_by_planes(stations).obstacles["S2"]
    assert "leave open the shift level along H = 136 gon" in words


def test_a_periodic_facade_is_ambiguous_until_its_end_is_seen():
    places = [upright(0.2, (-2.3, 0, 1.7)), upright(1.0, (3.1, 1.0, 1.6))]
    endless = [look(f"S{k + 1}", facade(160), p) for k, p in enumerate(places)]
    found = pair_poses(*endless)
    assert len(found.poses) > 2
    wrong = [apart(f.pose, places[0].inverse @ places[1])[0] for f in found.poses]
    assert np.abs(np.array(wrong) - 4.0 * np.round(np.array(wrong) / 4.0)).max() < 0.02
    assert "ways" in register_by_planes(endless).obstacles["S2"]
    ended = [look(f"S{k + 1}", facade(36), p) for k, p in enumerate(places)]
    found = pair_poses(*ended)
    assert found.sure
    assert apart(found.poses[0].pose, places[0].inverse @ places[1])[0] < 0.01


def test_three_stations_form_one_group_with_closing_loops():
    found = register_by_planes([yard_station(name) for name in POSES])
    assert len(found.groups) == 1
    assert found.obstacles == {}
    root = next(name for name, pose in found.groups[0].items() if (pose.translation == 0).all())
    for name, pose in found.groups[0].items():
        assert apart(pose, POSES[root].inverse @ POSES[name])[0] < 0.01


def test_a_station_that_only_several_others_hold_together():
    """Of S3's two walls S1 sees the one and S2 the other; either alone leaves a shift open."""
    shed = box((-9.0, -5.5, 1.0), (2.5, 2.0, 2.0), 0.4, 0.5)
    step = box((14.5, -1.5, 1.0), (1.0, 13.0, 2.0), 0.4)
    scene = Scene.of([ground((0, 0, 0), 200), shed, step, *(box(*wall, 0.5) for wall in WALLS)])
    windows = {"S1": (31, 340), "S2": (155, 390), "S3": (-20, 85)}
    stations = []
    for name, world in windows.items():
        heading = np.arctan2(POSES[name].rotation[1, 0], POSES[name].rotation[0, 0])
        window = tuple(np.radians(world) - heading)
        stations.append(look(name, scene, POSES[name], window=window))
    one, two, three = stations
    assert pair_poses(one, two).sure
    assert not pair_poses(one, three).sure
    assert not pair_poses(two, three).sure
    found = register_by_planes(stations)
    assert [len(g) for g in found.groups] == [3]
    assert any("S3 shares too few planes with any one" in text for text in found.sentences)
    (group,) = found.groups
    for name in POSES:
        at = group["S1"].inverse @ group[name]
        assert apart(at, POSES["S1"].inverse @ POSES[name])[0] < 0.01


@pytest.mark.parametrize("small_first", [True, False])
def test_the_tilt_of_a_small_patch_moves_nothing_far_from_it(small_first):
    """A patch 20 m off the middle of a wall, its normal wrong by a milliradian as it states."""
    tilted = rotation.exp(np.array([0.0, 0.0, 1e-3])) @ np.array([0.0, -1.0, 0.0])

    def one(normal, center, area, sigma):
        covariance = np.diag([sigma**2, sigma**2, 1e-8])
        sample = np.array([center], dtype=float)
        columns = (np.array([normal], dtype=float), sample.copy(), covariance[None])
        return PlaneSet(*columns, np.array([area]), (sample,), np.array([0.2]), ("s",))

    wall = one([0.0, -1.0, 0.0], [0.0, 10.0, 3.0], 400.0, 1e-6)
    patch = one(tilted, [20.0, 10.0, 3.0], 1.0, 1e-3)
    first, second = (patch, wall) if small_first else (wall, patch)
    matrix, right = information(first, second, np.array([[0, 0]]), Pose.identity())
    # the offset alone: 0.2 mm of shift across the wall is two sigmas, and nothing asks for any
    assert matrix[1, 1] == pytest.approx(1 / (2e-8 + 4e-10), rel=1e-6)
    assert abs(right[1] / matrix[1, 1]) < 1e-9
    moved = Pose(np.eye(3), np.array([0.0, 2e-4, 0.0]))
    matrix, right = information(first, second, np.array([[0, 0]]), moved)
    assert right[1] / matrix[1, 1] == pytest.approx(-2e-4, rel=1e-3)


def test_planes_of_a_group_keep_their_covariance_when_they_are_placed():
    """Sigma of the offset at any place of the plane is the same in every frame."""
    station = yard_station("S1")
    planes, pose = (
        station.planes,
        upright(1.1, (3, -4, 2)) @ Pose(rotation.exp(np.array([0.2, -0.4, 0.1])), np.zeros(3)),
    )
    moved = planes.placed(pose)
    place = np.array([s[0] for s in planes.samples])

    def sigma(p, x):
        tilt = np.einsum("kia,ki->ka", plane_basis(p.normal), x - p.center)
        row = np.column_stack([tilt, np.ones(len(p))])
        return np.einsum("ki,kij,kj->k", row, p.covariance, row)

    np.testing.assert_allclose(sigma(moved, pose @ place), sigma(planes, place), rtol=1e-9)


@pytest.mark.parametrize(
    ("normals", "rank"),
    [
        ([[0, 0, 1]], 3),
        ([[0, 0, 1], [1, 0, 0]], 5),
        ([[0, 0, 1], [1, 0, 0], [0.5, 0.5, 0.7]], 6),
        ([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0.6, 0.8, 0], [0, -1, 0]], 5),
    ],
)
def test_how_many_directions_planes_hold(normals, rank):
    """One plane three, two five, three six, any number of walls five (method section 2.10)."""
    n = np.array(normals, dtype=float)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    count = len(n)
    planes = PlaneSet(
        n,
        -5.0 * n,
        np.tile(np.diag([1e-8, 1e-8, 1e-6]), (count, 1, 1)),
        np.full(count, 10.0),
        (np.zeros((1, 3)),) * count,
        np.full(count, 0.2),
        ("scan",) * count,
    )
    pairs = np.stack([np.arange(count)] * 2, axis=1)
    matrix, _ = information(planes, planes, pairs, Pose.identity())
    assert np.linalg.matrix_rank(matrix, tol=1e-6 * np.linalg.norm(matrix)) == rank
    assert len(open_directions(n)) == 3 - np.linalg.matrix_rank(n)


def test_a_network_with_too_few_planes_says_what_stays_open():
    """Asked for without the search: the adjustment names the station and the direction."""
    survey = Survey(datum=Datum("free"))
    normals = np.array([[0, 0, 1], [0, 1, 0], [0, -1, 0]], dtype=float)
    for k, normal in enumerate(normals):
        survey.planes[f"P{k}"] = normal, -5.0
    for name, place in (("S1", [0.0, 0, 0]), ("S2", [3.0, 1, 0])):
        survey.station(name, translation=place, rotation=np.eye(3))
        survey.add(
            FittedPlanes,
            values=np.zeros((3, 3)),
            sigma=np.tile([1e-4, 1e-4, 1e-3], (3, 1)),
            station=[name] * 3,
            plane=["P0", "P1", "P2"],
            normal=normals,
            centroid=normals * (-5.0 - normals @ place)[:, None],
        )
    with pytest.raises(RankDefect) as caught:
        adjust(survey.network())
    assert "E of station S2" in str(caught.value)


def test_of_many_stations_the_pairs_that_promise_most_are_tried():
    """The same poses as from all pairs, from fewer."""
    places = [(x, y, 1.7) for x in (-9.0, -2.0, 4.5) for y in (-5.0, -1.0, 2.0)]
    truth = {f"S{k + 1}": upright(0.7 * k, place) for k, place in enumerate(places)}
    stations = [look(name, yard(), pose, step=0.02) for name, pose in truth.items()]
    tried = {}
    for choice in ("proposed", "all"):
        asked = []

        def pair(first, second, asked=asked):
            asked.append((first.name, second.name))
            return pair_poses(first, second)

        found = register_by_planes(stations, choice=choice, pair=pair)
        assert [len(group) for group in found.groups] == [9]
        assert len(set(asked)) == len(asked) == len(found.pairs)
        root, poses = next(iter(found.groups[0])), found.groups[0]
        for name, pose in poses.items():
            assert apart(poses[root].inverse @ pose, truth[root].inverse @ truth[name])[0] < 0.02
        tried[choice] = set(asked)
    assert len(tried["all"]) == 36
    assert len(tried["proposed"]) < 24
    assert tried["proposed"] < tried["all"]
