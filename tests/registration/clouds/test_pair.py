"""Two scans from nothing: the right pose, or a sentence."""

import numpy as np
import pytest

from tests.registration.clouds.scenes import (
    corridor,
    error,
    facade,
    rooms,
    scanned,
    yard,
    yard_scans,
)
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.registration.clouds.pair import register_pair
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.simulate.twins import sphere_courtyard


def test_a_yard_without_approximate_values() -> None:
    (a, b, _), (first, second, _) = yard_scans()
    true = first.inverse @ second
    found = register_pair(a, b)
    assert found.fit is not None, found.sentences
    shift, turn = error(found.fit.pose, true)
    assert shift < 5e-4
    assert turn < np.radians(0.005)
    assert found.fit.precision.rank == 6
    assert max(found.fit.verdict.overlap) > 0.4
    assert found.sentences == ()


def test_a_wrong_approximate_pose_is_said_to_be_wrong() -> None:
    """Fifty degrees and ten metres off."""
    (a, b, _), (first, second, _) = yard_scans()
    true = first.inverse @ second
    turn = exp(np.array([0, 0, np.radians(50)]))
    wrong = Pose(turn @ true.rotation, true.translation + np.array([8, 6, 0]))
    found = register_pair(a, b, wrong)
    assert found.fit is not None
    assert error(found.fit.pose, true)[0] < 5e-4
    assert "the approximate pose of S2 in S1 is wrong by 10.0 m and 50 degrees" in " ".join(
        found.sentences
    )


def test_a_good_approximate_pose_is_not_mentioned() -> None:
    (a, b, _), (first, second, _) = yard_scans()
    true = first.inverse @ second
    near = Pose(true.rotation, true.translation + np.array([0.2, -0.2, 0.0]))
    found = register_pair(a, b, near)
    assert found.fit is not None
    assert found.sentences == ()


def test_a_facade_that_repeats_itself_leaves_its_direction_open() -> None:
    """A few sides of pillars are all that the scans share along it; nothing tells which pillars."""
    scans, poses = scanned(facade(), ((0.0, 0.0, 0.4), (7.0, 1.5, 2.0)), farthest=30.0)
    found = register_pair(*scans)
    assert found.fit is not None
    assert found.fit.precision.rank == 5
    assert "does not hold a shift along" in found.sentences[0]
    along = poses[0].rotation.T @ [1.0, 0.0, 0.0]
    off = found.fit.pose.translation - (poses[0].inverse @ poses[1]).translation
    assert np.linalg.norm(off - (off @ along) * along) < 1e-3


@pytest.fixture(scope="module")
def in_corridor() -> tuple[list[PreparedScan], list[Pose]]:
    """Two scans in a corridor that ends nowhere."""
    return scanned(corridor(), ((0.0, 0.0, 0.2), (3.0, 0.2, 0.9)), farthest=25.0)


def test_of_places_that_fit_alike_the_approximate_pose_decides(
    in_corridor: tuple[list[PreparedScan], list[Pose]],
) -> None:
    """A corridor and its half turn; the way along it stays open, and is not said to be wrong."""
    scans, poses = in_corridor
    assert register_pair(*scans).fit is None
    true = poses[0].inverse @ poses[1]
    along = poses[0].rotation.T @ [1.0, 0.0, 0.0]
    near = Pose(true.rotation, true.translation + 1.5 * along + np.array([0.1, 0.1, 0.1]))
    found = register_pair(*scans, near)
    assert found.fit is not None
    off = found.fit.pose.translation - true.translation
    assert np.linalg.norm(off - (off @ along) * along) < 1e-3
    assert "the approximate pose speaks for is taken" in found.sentences[0]
    assert not any("is wrong by" in text for text in found.sentences)


def test_a_corridor_leaves_the_way_along_it_open(
    in_corridor: tuple[list[PreparedScan], list[Pose]],
) -> None:
    scans, poses = in_corridor
    found = register_pair(*scans, poses[0].inverse @ poses[1])
    assert found.fit is not None
    # the corridor runs along the world's x axis; in the first scanner's frame:
    along = poses[0].rotation.T @ [1.0, 0.0, 0.0]
    off = found.fit.pose.translation - (poses[0].inverse @ poses[1]).translation
    assert found.fit.precision.rank == 5
    sigma = np.sqrt(along @ found.fit.precision.local[:3, :3] @ along)
    # where it is along the corridor is what the approximate pose says of it
    assert abs(off @ along) < 1e-3 < sigma
    assert np.linalg.norm(off - (off @ along) * along) < 5e-3
    assert "does not hold a shift along" in " ".join(found.sentences)


def test_rooms_without_a_door_do_not_overlap() -> None:
    scans, _ = scanned(rooms(), ((0.5, 0.3, 0.2), (30.4, 1.0, 1.0)))
    found = register_pair(*scans)
    assert found.fit is None
    assert found.rivals == ()


def test_scans_that_nobody_levelled() -> None:
    """Leaning by up to 28 degrees."""
    scans, poses = scanned(yard(), ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5)), tilt=0.5)
    found = register_pair(*scans)
    assert found.fit is not None, found.sentences
    shift, turn = error(found.fit.pose, poses[0].inverse @ poses[1])
    assert shift < 5e-4
    assert turn < np.radians(0.005)


@pytest.mark.parametrize(
    ("a", "b"), [("S5", "S6"), pytest.param("S6", "S7", marks=pytest.mark.slow)]
)
def test_a_place_that_is_seen_through_does_not_win_by_its_area(a: str, b: str) -> None:
    """A partial station fits the opposite wall in a larger area, but for what stands before it."""
    twin = sphere_courtyard.build(100_000, 1)
    scans, poses = {}, {}
    for number, one in enumerate(twin.scans):
        if one.name in (a, b):
            blocks = (block.xyz for block in twin.measure(number))
            scans[one.name] = prepare(one.name, blocks)
            poses[one.name] = twin.station(one.name).pose
    found = register_pair(scans[a], scans[b])
    if found.fit is not None:
        shift, turn = error(found.fit.pose, poses[a].inverse @ poses[b])
        assert shift < 0.1
        assert turn < np.radians(0.1)
    else:
        assert len(found.rivals) >= 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 8))
def test_no_pose_is_confidently_wrong(seed: int) -> None:
    """Random stations in all scenes: what is registered is right within its covariance."""
    rng = np.random.default_rng(seed)
    for scene, reach in ((yard(), 60.0), (facade(), 30.0), (corridor(), 25.0)):
        side = 1.0 if reach == 25.0 else 6.0
        places = [
            (*rng.uniform(-1, 1, 2) * (4.0, 0.5 * side), rng.uniform(-3, 3)) for _ in range(2)
        ]
        scans, poses = scanned(scene, places, seed=seed, farthest=reach)
        found = register_pair(*scans)
        if found.fit is None:
            assert found.sentences
            continue
        true = poses[0].inverse @ poses[1]
        p = found.fit.precision
        off = found.fit.pose @ (true.inverse @ p.middle) - p.middle
        assert off @ np.linalg.solve(p.local[:3, :3], off) < 16.3  # chi-square, 99.9 %
