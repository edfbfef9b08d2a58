"""Beams without return are told by their ranges; surfaces are never taken for them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.registration.clouds.scenes import points_of, yard
from tests.scan.in_memory import in_memory, mixed, shell
from tribrach.geometry.pose import Pose
from tribrach.io.scans.formats import read_scans
from tribrach.scan.no_return import find_no_return, screened
from tribrach.scan.prepared import seen_from
from tribrach.scan.scan import NoReturn, Scan


@pytest.fixture(scope="module")
def surfaces() -> np.ndarray:
    """A scan of a yard, nothing farther than 45 m."""
    return points_of(yard(), Pose(np.eye(3), np.array([0.0, 0.0, 1.7])), 40_000, 1, 45.0)


def kept(scan: Scan) -> np.ndarray:
    """Numbers of the points that a scan gives."""
    return np.concatenate([np.asarray(chunk.values["number"]) for chunk in scan.chunks()])


@pytest.mark.parametrize("share", [0.005, 0.02, 0.05, 0.4])
@pytest.mark.parametrize("noise", [0.0, 0.003])
@pytest.mark.parametrize("far", [46.0, 120.0])
def test_a_shell_is_found_to_the_point(
    surfaces: np.ndarray, share: float, noise: float, far: float
) -> None:
    count = int(share / (1 - share) * len(surfaces))
    points, beams = mixed(surfaces, shell(count, far, noise=noise))
    scan = screened(in_memory(points))
    assert scan.no_return is not None
    left = kept(scan)
    assert not np.isin(left, np.flatnonzero(beams)).any()
    assert np.isin(np.flatnonzero(~beams), left).all()
    assert scan.no_return.in_shell == scan.no_return.points == count
    assert scan.no_return.total == len(points)
    low, high = scan.no_return.shell or (0, 0)
    assert low < far < high
    assert sum(chunk.dropped for chunk in scan.chunks()) == count


def test_part_of_the_sky_is_enough(surfaces: np.ndarray) -> None:
    """A cap of 17 degrees; the places of the file are not those of the scanner."""
    count = len(surfaces) // 100
    points, beams = mixed(surfaces, shell(count, 60.0, lowest=0.957))
    place = np.array([300.0, -200.0, 50.0])
    scan = screened(seen_from(in_memory(points + place, origin="unknown"), (300.0, -200.0, 50.0)))
    assert np.array_equal(kept(scan), np.flatnonzero(~beams))


def test_strays_beyond_stay(surfaces: np.ndarray) -> None:
    strays = shell(15, 90.0, seed=3) * np.linspace(1, 1.3, 15)[:, None]
    points, beams = mixed(np.concatenate([surfaces, strays]), shell(800, 60.0))
    assert np.array_equal(kept(screened(in_memory(points))), np.flatnonzero(~beams))


def test_zeros_and_places_that_repeat(surfaces: np.ndarray) -> None:
    zeros, same = np.zeros((7, 3)), np.tile([[0.0, 0.0, 99.5]], (400, 1))
    points, beams = mixed(surfaces, np.concatenate([zeros, -zeros, same]))
    scan = screened(in_memory(points))
    assert np.array_equal(kept(scan), np.flatnonzero(~beams))
    found = scan.no_return
    assert found is not None
    assert (found.zeros, found.repeated, found.in_shell) == (14, 400, 0)
    assert found.places == ((0.0, 0.0, 99.5),)
    assert found.words == "14 in the place of the scanner, 400 that repeat 0 0 99.5"
    # where the scanner stood is not known: a few zeros may be a point, many are not
    assert find_no_return(replace(in_memory(points), origin="unknown")).points == 400
    many = np.concatenate([surfaces, np.zeros((500, 3))])
    unknown = find_no_return(in_memory(many, origin="unknown"))
    assert unknown.repeated == unknown.points == 500


def test_a_thinned_comparison_finds_places_that_repeat() -> None:
    """More points than are compared."""
    rng = np.random.default_rng(2)
    points, beams = mixed(rng.uniform(1, 30, (900_000, 3)), np.full((9_000, 3), -1.0))
    found = find_no_return(in_memory(points))
    assert found.repeated == found.points == beams.sum()


def wall(normal: int, far: float, size: float, count: int = 4000) -> np.ndarray:
    """A board of points with noise across an axis, its middle on the axis."""
    rng = np.random.default_rng(4)
    out = rng.uniform(-size / 2, size / 2, (count, 3))
    out[:, normal] = far + 0.001 * rng.normal(size=count)
    return out


def rings(rows: int) -> np.ndarray:
    """What beams of a few inclinations see of a floor that is level: all at equal ranges."""
    turn = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    down = np.radians(np.linspace(2.0, 25.0, rows))[:, None]
    r = 1.7 / np.sin(down) + 0.001 * np.random.default_rng(5).normal(size=(rows, len(turn)))
    return np.stack(
        [r * np.cos(down) * np.cos(turn), r * np.cos(down) * np.sin(turn), -r * np.sin(down)], -1
    ).reshape(-1, 3)


def room() -> np.ndarray:
    """A room that is scanned from its middle: eight corners at the largest range."""
    rng = np.random.default_rng(6)
    out = rng.uniform(-1, 1, (60_000, 3))
    out /= np.abs(out).max(axis=1)[:, None]
    return np.asarray(out * [4, 3, 2] + 0.001 * rng.normal(size=out.shape))


def waves() -> np.ndarray:
    """A surface that is farthest along lines."""
    h, v = np.meshgrid(np.linspace(0, 6, 400), np.linspace(1.2, 1.9, 120))
    r = 6 + np.sin(7 * h)
    flat = r * np.sin(v)
    return np.stack([flat * np.cos(h), flat * np.sin(h), r * np.cos(v)], axis=-1).reshape(-1, 3)


@pytest.mark.parametrize(
    "points",
    [
        rings(1),
        rings(8),
        room(),
        waves(),
        shell(5000, 1.0) * np.random.default_rng(7).uniform(2, 30, 5000)[:, None],
    ],
    ids=["one ring", "rings", "room", "waves", "cut off at 30 m"],
)
def test_what_is_no_shell(points: np.ndarray) -> None:
    assert find_no_return(in_memory(points)).points == 0


@pytest.mark.parametrize("size", [0.3, 1.0, 3.0])
def test_boards_that_are_the_last_thing(surfaces: np.ndarray, size: float) -> None:
    """One across the line of sight, two, three of them at the same range."""
    boards = np.zeros((0, 3))
    for axis in range(3):
        boards = np.concatenate([boards, wall(axis, 60.0, size)])
        points, _ = mixed(surfaces, boards)
        assert find_no_return(in_memory(points)).points == 0


@pytest.mark.data
def test_real_scanners(shared_data: Path) -> None:
    """What a nodding and a spinning laser write, and scans that have nothing of it."""

    def found(name: str) -> NoReturn:
        (scan,) = read_scans(shared_data / "scans" / name)
        return find_no_return(scan)

    nodding = found("nodding_laser/scan000.xyz")
    assert nodding.in_shell == nodding.points == 1481
    assert found("nodding_laser/scan002.xyz").in_shell == 1618
    spinning = found("spinning_lidar/251370668.pcd")
    assert spinning.zeros == spinning.points == 5032
    for name in ("street/000000.pcd", "e57/pump.e57", "vz400i_forest/scan.laz"):
        assert found(name).points == 0, name
