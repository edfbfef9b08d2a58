"""Heaps without walls: registered by their slopes, or refused with what was tried."""

from pathlib import Path

import numpy as np

from tests.registration.clouds.scenes import error, scanned
from tribrach.geometry.pose import Pose
from tribrach.io.scans.formats import read_scans
from tribrach.registration.clouds.pair import Origin, register_pair
from tribrach.registration.clouds.prepared import prepare
from tribrach.simulate.scene import Scene, ground, sphere


def _heaps(places: tuple[tuple[float, float, float], ...]) -> Scene:
    """Flat heaps on level ground: caps of spheres (x, y, radius)."""
    return Scene.of(
        [ground((0, 0, 0), 200), *(sphere((x, y, -0.75 * r), r, 0.4) for x, y, r in places)]
    )


def test_heaps_are_found_by_their_slopes() -> None:
    scene = _heaps(((8, 2, 9), (-5, 9, 13), (-7, -8, 7), (6, -11, 10), (15, 12, 8)))
    (a, b), (first, second) = scanned(scene, ((0.0, 0.0, 0.3), (7.0, -4.0, 2.2)))
    found = register_pair(a, b)
    assert found.fit is not None
    assert found.fit.origin is Origin.SLOPES
    assert error(found.fit.pose, first.inverse @ second)[0] < 0.03


def test_one_round_heap_is_found_nowhere_or_open() -> None:
    (a, b), (first, second) = scanned(_heaps(((9, 0, 12),)), ((0.0, 0.0, 0.3), (9.0, -9.0, 2.2)))
    found = register_pair(a, b)
    if found.fit is not None:
        off = error(found.fit.pose, first.inverse @ second)
        assert off[0] < 5 * np.sqrt(np.trace(found.fit.precision.covariance[:3, :3]))


def test_the_stockpile_of_others(shared_data: Path) -> None:
    folder = shared_data / "faults" / "worlds" / "05-stockpile-no-overlap"
    scans = [
        prepare(n, (c.xyz for c in read_scans(folder / f"{n}.laz")[0].chunks()))
        for n in ("S1", "S2")
    ]
    true = Pose.from_matrix(np.loadtxt(folder / "S2_pose.txt"))
    found = register_pair(*scans)
    assert found.fit is not None
    assert error(found.fit.pose, true)[0] < 0.02


def test_a_rough_face_has_no_rivals_at_residuals_of_decimetres(shared_data: Path) -> None:
    """It lies on itself anywhere to 0.2 m; the right place fits to 2 mm."""
    folder = shared_data / "faults" / "scans2" / "12-edge-of-a-block"
    scans = [prepare(n, (c.xyz for c in read_scans(folder / f"{n}.e57")[0].chunks())) for n in "12"]
    found = register_pair(*scans)
    assert found.fit is not None
    assert error(found.fit.pose, Pose.identity())[0] < 0.005
