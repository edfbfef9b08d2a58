"""Joints between stations: loops tell the wrong ones, and doubt is not decided by chance."""

from itertools import combinations

import numpy as np
import pytest

from tests.registration.plane_scenes import apart
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.registration import pose_graph
from tribrach.registration.pose_graph import Joint, join


def poses(count, seed=1):
    rng = np.random.default_rng(seed)
    return {
        f"S{k}": Pose(rotation.exp(rng.normal(0, 1, 3)), rng.normal(0, 10, 3)) for k in range(count)
    }


def joint(truth, a, b, rng, *, wrong=0.0, strength=1.0, alone=True):
    noise = Pose(rotation.exp(rng.normal(0, 1e-4, 3)), rng.normal(0, 2e-3, 3))
    pose = truth[a].inverse @ truth[b] @ noise
    shifted = Pose(pose.rotation, pose.translation + np.array([wrong, 0, 0]))
    return Joint(a, b, shifted, strength, alone)


def check(group, truth):
    root = next(name for name, p in group.items() if (p.translation == 0).all())
    for name, pose in group.items():
        assert apart(pose, truth[root].inverse @ truth[name])[0] < 0.1


@pytest.mark.parametrize("strength", [0.5, 5.0])
def test_one_wrong_joint_among_all_pairs_is_named(strength):
    """However strong it looks."""
    truth, rng = poses(5), np.random.default_rng(2)
    joints = [
        joint(truth, a, b, rng, wrong=4.0, strength=strength)
        if (a, b) == ("S1", "S3")
        else joint(truth, a, b, rng)
        for a, b in combinations(truth, 2)
    ]
    graph = join(list(truth), joints)
    assert len(graph.groups) == 1
    check(graph.groups[0], truth)
    assert len(graph.joints) == 9
    assert "S1 - S3 is not used" in graph.sentences[0]


def test_a_single_ring_that_does_not_close_is_left_apart():
    """One of four is wrong, and nothing tells which."""
    truth, rng = poses(4), np.random.default_rng(3)
    ring = [("S0", "S1"), ("S1", "S2"), ("S2", "S3"), ("S0", "S3")]
    joints = [joint(truth, a, b, rng, wrong=4.0 * (k == 2)) for k, (a, b) in enumerate(ring)]
    graph = join(list(truth), joints)
    assert [len(g) for g in graph.groups] == [1, 1, 1, 1]
    assert "does not close by 4.0" in graph.sentences[0]


def test_a_ring_that_closes_joins_all():
    truth, rng = poses(4), np.random.default_rng(4)
    ring = [("S0", "S1"), ("S1", "S2"), ("S2", "S3"), ("S0", "S3")]
    graph = join(list(truth), [joint(truth, a, b, rng) for a, b in ring])
    check(graph.groups[0], truth)
    assert len(graph.groups[0]) == 4


def test_a_weak_joint_needs_a_loop():
    truth, rng = poses(4), np.random.default_rng(5)
    weak = joint(truth, "S2", "S3", rng, alone=False)
    others = [joint(truth, a, b, rng) for a, b in (("S0", "S1"), ("S1", "S2"), ("S0", "S2"))]
    graph = join(list(truth), [*others, weak])
    assert sorted(len(g) for g in graph.groups) == [1, 3]
    assert "too little to be believed" in graph.sentences[0]
    confirmed = join(list(truth), [*others, weak, joint(truth, "S1", "S3", rng, alone=False)])
    assert len(confirmed.groups[0]) == 4


def test_an_open_loop_costs_the_joint_that_cannot_stand_alone():
    truth, rng = poses(3), np.random.default_rng(4)
    good = [joint(truth, "S0", "S1", rng), joint(truth, "S1", "S2", rng)]
    found = join(list(truth), [*good, joint(truth, "S0", "S2", rng, wrong=2.0, alone=False)])
    assert len(found.groups) == 1
    assert "S0 - S2 is not used" in found.sentences[0]
    check(found.groups[0], truth)


def test_stations_without_joints_stay_alone():
    graph = join(["A", "B"], [])
    assert [list(g) for g in graph.groups] == [["A"], ["B"]]


@pytest.mark.parametrize("share", [0.15, 0.4, 1.0])
def test_triangles_are_those_of_all_triples(share):
    """Found by neighbours, in the order in which triples of names come."""
    truth, rng = poses(14), np.random.default_rng(7)
    pairs = [pair for pair in combinations(truth, 2) if rng.random() < share]
    joints = [joint(truth, *pair, rng) for pair in pairs]
    ends = {j.ends for j in joints}
    expected = [
        three
        for three in combinations(sorted({name for j in joints for name in j.ends}), 3)
        if all(frozenset(side) in ends for side in combinations(three, 2))
    ]
    loops = pose_graph._loops(joints)
    found = [
        tuple(sorted({name for j in loop.joints for name in j.ends}))
        for loop in loops
        if len(loop.joints) == 3
    ]
    assert found[: len(expected)] == expected
    # the others are closed by one joint over the strongest tree: one for each that is not in it
    assert len(loops) - len(expected) <= max(len(joints) - 13, 0) + 13
    for loop in loops:
        assert loop.gap < 0.5
