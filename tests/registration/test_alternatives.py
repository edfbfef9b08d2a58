"""Places that look alike, by planes: none is taken, unless something decides between them."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.registration.clouds.scenes import storeys
from tests.registration.plane_scenes import apart, look, upright, yard_station
from tribrach.geometry.pose import Pose
from tribrach.io.scans.formats import read_scans
from tribrach.registration.alternatives import ApproximateSigma, OpenPair, Witnesses, by_loops
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.planes.poses import pair_poses
from tribrach.registration.planes.stations import register_by_planes
from tribrach.registration.views import Surroundings, view_of
from tribrach.scan.loading import laid_out
from tribrach.targets.planes import find_planes

#: the second stands one storey above the others
TRUTH = {
    "S1": upright(0.1, (-1.6, 1.9, 1.5)),
    "S2": upright(0.5, (-1.4, 2.1, 4.6)),
    "S3": upright(2.0, (1.5, 2.2, 1.6)),
}
BETWEEN = TRUTH["S1"].inverse @ TRUTH["S2"]


@cache
def _station(name: str) -> Surroundings:
    return look(name, storeys(), TRUTH[name], step=0.015)


def test_a_storey_is_not_taken_for_the_next() -> None:
    found = pair_poses(_station("S1"), _station("S2"))
    assert len(found.poses) >= 2
    assert min(apart(f.pose, BETWEEN)[0] for f in found.poses) < 0.005
    # the wrong place agrees more
    assert apart(found.poses[0].pose, BETWEEN)[0] > 2.9


def test_storeys_do_not_confirm_each_other() -> None:
    found = register_by_planes([_station(name) for name in TRUTH])
    assert [len(group) for group in found.groups] == [1, 1, 1]


#: a corner of the floor in the well, which both see
_CORNER = np.array([1.9, -1.3, 3.0])
_NEAR = {
    "S1": Pose.identity(),
    "S2": Pose(BETWEEN.rotation, BETWEEN.translation + np.array([0.2, 0.1, 0.3])),
}
WITNESSES = {
    "an approximate pose": Witnesses(_NEAR, ApproximateSigma(0.3)),
    "a named target": Witnesses(
        targets={n: {"T": TRUTH[n].inverse @ _CORNER} for n in ("S1", "S2")},
    ),
    "two known points": Witnesses(
        targets={
            "S1": {"T": TRUTH["S1"].inverse @ _CORNER},
            "S2": {"U": TRUTH["S2"].inverse @ np.array([1.0, 2.0, 8.0])},
        },
        points=lambda: {"T": _CORNER, "U": np.array([1.0, 2.0, 8.0])},
    ),
}


@pytest.mark.parametrize("what", WITNESSES)
def test_something_decides(what: str) -> None:
    stations = [_station("S1"), _station("S2")]
    found = register_by_planes(stations, witnesses=WITNESSES[what])
    (group,) = found.groups
    assert apart(group["S1"].inverse @ group["S2"], BETWEEN)[0] < 0.005


def test_an_approximate_pose_between_two_storeys_decides_nothing() -> None:
    middle = Pose(BETWEEN.rotation, BETWEEN.translation - np.array([0.0, 0.0, 1.5]))
    witnesses = Witnesses({"S1": Pose.identity(), "S2": middle}, ApproximateSigma(1.0))
    found = register_by_planes([_station("S1"), _station("S2")], witnesses=witnesses)
    assert len(found.groups) == 2


def test_two_open_pairs_decide_each_other_where_one_choice_closes() -> None:
    right, other = upright(0.3, (4.0, 1.0, 0.0)), upright(0.3, (9.0, 1.0, 0.0))
    between = upright(-0.4, (2.0, 2.0, 0.0))
    groups = ({"S1": Pose.identity(), "S2": between}, {"S3": Pose.identity()})
    one = OpenPair("S1", "S3", (other, right))
    two = OpenPair("S3", "S2", ((between.inverse @ right).inverse, upright(2.0, (1.0, 0.0, 0.0))))
    assert [pose for _, pose in by_loops(groups, (one, two))] == [right, two.poses[0]]
    both = OpenPair("S3", "S2", tuple((between.inverse @ p).inverse for p in (right, other)))
    assert by_loops(groups, (one, both)) == []


def test_planes_exclude_a_place_that_clouds_leave_open() -> None:
    stations = [yard_station("S1"), yard_station("S2")]
    sure = pair_poses(*stations).poses[0].pose
    off = Pose(sure.rotation, sure.translation + np.array([5.0, 0.0, 0.0]))
    excluded = register_by_planes(stations, doubtful=[OpenPair("S1", "S2", (sure, off))])
    assert len(excluded.groups) == 1


def test_planes_of_the_stairwell_of_others(shared_data: Path) -> None:
    folder = shared_data / "faults" / "worlds" / "01-stairwell-one-storey-off"
    stations = []
    for name in ("S1", "S2"):
        cloud, image = laid_out(read_scans(folder / f"{name}.laz")[0])
        planes, _ = find_planes(cloud.xyz, image, sigma_range=0.0015, sigma_angle=4e-5, scan=name)
        view = view_of(cloud.xyz, image)
        stations.append(Surroundings.of(name, PlaneSet.of(planes), view, levelled=True))
    found = pair_poses(*stations)
    assert len(found.poses) >= 2
    true = np.array([0.20367, 0.19433, 3.05626])
    assert min(np.linalg.norm(f.pose.translation - true) for f in found.poses) < 0.01
