"""Planes and clouds in one network: what they share is not counted twice."""

from itertools import combinations

import numpy as np
import pytest

from tests.registration.plane_scenes import POSES, upright, yard_station
from tribrach.geometry.pose import Pose
from tribrach.job.cloud_pairs import contradicted, observable
from tribrach.job.tie import Tying
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.registration.clouds.graph import CloudEdge, observe
from tribrach.registration.planes.poses import information
from tribrach.registration.planes.stations import register_by_planes
from tribrach.registration.planes.ties import tie_planes
from tribrach.registration.pose_graph import Joint

NAMES = tuple(POSES)
C = np.diag([1e-3, 1e-3, 1e-3, 5e-5, 5e-5, 5e-5]) ** 2


@pytest.mark.parametrize("count", [2, 4, 7])
def test_all_pairs_of_clouds_know_no_more_than_a_single_pair(count):
    """Each scan has one error that all its pairs share: no average over pairs removes it."""
    names = [f"S{k}" for k in range(count)]
    same = Pose.identity()
    edges = [CloudEdge(a, b, same, 2 * C) for a, b in combinations(names, 2)]
    survey = Survey()
    for name in names:
        survey.station(
            name,
            translation=np.zeros(3),
            rotation=np.eye(3),
            free=np.full(6, name != "S0"),
        )
    observe(survey, observable(edges, dict.fromkeys(names)))
    adjustment = adjust(survey.network())
    for name in names[1:]:
        np.testing.assert_allclose(adjustment.covariance(name), 2 * C, rtol=1e-6, atol=1e-15)


def test_pairs_of_stations_that_were_not_placed_do_not_count():
    edges = [CloudEdge("A", "B", Pose.identity(), C), CloudEdge("B", "C", Pose.identity(), C)]
    (kept,) = observable(edges, dict.fromkeys(("A", "B")))
    np.testing.assert_allclose(kept.covariance, C)


def tying(scale):
    """The yard with clouds that know ``1 / scale`` of what the planes of each pair know."""
    stations = [yard_station(name) for name in NAMES]
    ties = tie_planes(stations, POSES)
    edges = []
    for (a, b), pairs in ties.pairs.items():
        one, two = (next(s for s in stations if s.name == n) for n in (a, b))
        between = POSES[a].inverse @ POSES[b]
        matrix, _ = information(one.planes, two.planes, pairs, between)
        edges.append(CloudEdge(a, b, between, scale * np.linalg.inv(matrix)))
    return Tying(lambda survey: survey.network(), None, None, stations, edges, [POSES]), ties


@pytest.mark.parametrize("scale", [1.0, 25.0, 0.04])
def test_planes_and_clouds_share_their_points(scale):
    """Equal ones count half each; the worse one hardly counts."""
    work, ties = tying(scale)
    planes, clouds = work._factors(ties, POSES)
    assert 1 / planes + 1 / clouds == pytest.approx(1.0)
    assert clouds / planes == pytest.approx(scale, rel=1e-6)


def test_planes_alone_keep_their_covariance():
    work, ties = tying(1.0)
    alone = Tying(work.network, work.site, None, work.stations, (), work.groups)
    assert alone._factors(ties, POSES) == (1.0, 1.0)


def test_a_cloud_that_contradicts_the_planes_takes_their_joint_with_it():
    stations = [yard_station(name) for name in ("S1", "S2")]
    true = POSES["S1"].inverse @ POSES["S2"]
    good = register_by_planes(stations, further=[Joint("S1", "S2", true, 100.0)])
    assert len(good.groups) == 1
    wrong = Pose(true.rotation, true.translation + np.array([2.0, 0, 0]))
    found = register_by_planes(stations, further=[Joint("S1", "S2", wrong, 1e6)])
    assert [len(g) for g in found.groups] == [1, 1]
    assert "contradict each other by 2.00 m" in found.sentences[0]


def test_a_pair_of_clouds_at_another_place_is_left_out():
    """Shifts along what clouds leave open contradict nothing; half turns do."""
    poses = {name: POSES[name] for name in ("S1", "S2")}
    true = POSES["S1"].inverse @ POSES["S2"]
    loose = np.array(C)
    loose[0, 0] = 8.0**2
    along = Pose(true.rotation, true.translation + np.array([6.0, 0, 0]))
    across = Pose(true.rotation, true.translation + np.array([6.0, 0.6, 0]))
    turned = Pose(true.rotation @ np.diag([-1.0, -1.0, 1.0]), true.translation)
    edges = [CloudEdge("S1", "S2", pose, loose) for pose in (true, along, across, turned)]
    wrong = [edge for edge, _ in contradicted(edges, poses, {})]
    assert [any(e is w for w in wrong) for e in edges] == [False, False, True, True]
    assert contradicted(edges, {"S1": POSES["S1"]}, {}) == []
    # a reference may lie elsewhere by what all of it is wrong by
    assert contradicted(edges[2:3], poses, {"S1": 1.0}) == []


def test_a_joint_that_targets_contradict_needs_a_loop():
    true = POSES["S1"].inverse @ POSES["S2"]
    wrong = {"S1": POSES["S1"], "S2": upright(0.4, (3.0, -2.0, 1.6))}
    stations = [yard_station(name) for name in ("S1", "S2")]
    good = register_by_planes(stations, known={name: POSES[name] for name in ("S1", "S2")})
    assert len(good.groups) == 1
    doubted = register_by_planes(stations, known=wrong)
    assert [len(g) for g in doubted.groups] == [1, 1]
    assert "too little to be believed" in doubted.sentences[0]
    confirmed = register_by_planes([yard_station(name) for name in NAMES], known=wrong)
    assert len(confirmed.groups[0]) == 3
    assert true.translation == pytest.approx(
        (confirmed.groups[0]["S1"].inverse @ confirmed.groups[0]["S2"]).translation, abs=0.01
    )
