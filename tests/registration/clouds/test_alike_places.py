"""Places that look alike: no pose is taken of several, unless something decides between them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.registration.clouds.scenes import (
    deck,
    empty_room,
    error,
    points_of,
    storeys,
    yard_scans,
)
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.io.scans.formats import read_scans
from tribrach.registration.clouds.pair import register_pair, symmetries
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.simulate.scene import Scene


def _at(x: float, y: float, z: float, heading: float) -> Pose:
    return Pose(exp(np.array([0.0, 0.0, heading])), np.array([x, y, z]))


#: scenes whose places are alike, two set-ups in each, and how near the true pose must be found [m]
ALIKE: dict[str, tuple[Callable[[], Scene], Pose, Pose]] = {
    "an empty room": (empty_room, _at(-1.5, 0.6, 1.5, 0.2), _at(2.0, -1.1, 1.6, 1.9)),
    "one storey up": (storeys, _at(-1.6, 1.9, 1.5, 0.1), _at(-1.4, 2.1, 4.6, 0.5)),
    "a deck": (deck, _at(0.0, -1.0, 1.6, 0.3), _at(14.0, 1.4, 1.6, -0.8)),
}


def _pair(name: str) -> tuple[PreparedScan, PreparedScan, Pose]:
    scene, first, second = ALIKE[name]
    world = scene()
    a, b = (
        prepare(f"S{k}", [points_of(world, pose, 60_000, 10 + k, 40.0)])
        for k, pose in enumerate((first, second), start=1)
    )
    return a, b, first.inverse @ second


@pytest.mark.parametrize("name", ALIKE)
def test_of_places_that_are_alike_none_is_taken(name: str) -> None:
    a, b, true = _pair(name)
    found = register_pair(a, b)
    assert found.fit is None, error(found.fit.pose, true)
    assert len(found.rivals) >= 2


@pytest.mark.parametrize("name", ALIKE)
def test_an_approximate_pose_is_not_overruled(name: str) -> None:
    """The right place, or none with the reason; never the wrong one."""
    a, b, true = _pair(name)
    near = Pose(true.rotation, true.translation + np.array([0.15, -0.1, 0.1]))
    found = register_pair(a, b, near)
    if found.fit is None:
        assert found.sentences
        return
    held = np.eye(6) - found.fit.precision.unheld @ found.fit.precision.unheld.T
    off = held[:3, :3] @ (found.fit.pose.translation - true.translation)
    assert np.linalg.norm(off) < 0.02
    assert error(found.fit.pose, true)[1] < np.radians(0.2)


def test_a_yard_has_no_symmetry() -> None:
    (a, b, c), _ = yard_scans()
    assert [symmetries(scan) for scan in (a, b, c)] == [(), (), ()]


#: pairs of others that were taken at a wrong place
OTHERS = (
    "worlds/01-stairwell-one-storey-off/S1.laz S2.laz",
    "worlds/02-bridge-half-turn/S1.laz S2.laz",
    "worlds/03-tunnel-half-turn/S1.laz S2.laz",
    "algorithms/17-confidently-wrong-pose/a.ply b.ply",
    "scans2/02-street-corner/1.ply 5.ply",
)


@pytest.mark.parametrize("pair", OTHERS)
def test_pairs_of_others(pair: str, shared_data: Path) -> None:
    folder, name = (shared_data / "faults" / pair.split()[0]).parent, pair.split()[1]
    paths = (shared_data / "faults" / pair.split()[0], folder / name)
    scans = [prepare(p.stem, (c.xyz for c in read_scans(p)[0].chunks())) for p in paths]
    found = register_pair(*scans)
    assert found.fit is None
    assert len(found.rivals) >= 2
