"""Beams without return move no pose, and a scanner that moved while it scanned is noticed."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.registration.clouds.scenes import error, points_of, yard
from tests.scan.in_memory import in_memory, mixed, shell
from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp, log
from tribrach.questions.register.registration import register_files
from tribrach.registration.clouds.pair import CloudPair, register_pair
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.registration.clouds.relative_covariance import RelativeCovariance, relative_covariance
from tribrach.scan.no_return import screened
from tribrach.simulate.twins import TWINS, build

NO_FLOOR = (0.0, 0.0)
PLACES = ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5))


def poses() -> list[Pose]:
    return [Pose(exp(np.array([0.0, 0.0, turn])), np.array([x, y, 1.7])) for x, y, turn in PLACES]


def yard_points(seed: int, points: int = 40_000) -> list[np.ndarray]:
    return [points_of(yard(), pose, points, 10 * seed + k) for k, pose in enumerate(poses())]


def with_shell(name: str, xyz: np.ndarray, share: float, far: float) -> PreparedScan:
    """A scan as it is opened, prepared; so much of its file are beams without return."""
    count = int(share / (1 - share) * len(xyz))
    points, _ = mixed(xyz, shell(count, far, len(name), 0.001))
    scan = screened(in_memory(points, name))
    assert scan.no_return is not None
    assert scan.no_return.points == count
    return prepare(name, (chunk.xyz for chunk in scan.chunks()))


def moved(a: CloudPair, b: CloudPair) -> float:
    """Squared difference of two poses of a pair in the metric of the covariance of the first."""
    assert a.fit is not None
    assert b.fit is not None
    one, two = a.fit.pose, b.fit.pose
    off = np.concatenate(
        [two.translation - one.translation, log(one.rotation.T @ two.rotation)],
    )
    return float(off @ np.linalg.solve(a.fit.precision.covariance, off))


def unmoved(clouds: list[np.ndarray], far: float, shares: tuple[float, ...]) -> CloudPair:
    """The pair without shells; with them it is the same within its covariance."""
    plain = register_pair(*(prepare(f"S{k}", [xyz]) for k, xyz in enumerate(clouds)))
    for share in shares:
        scans = [with_shell(f"S{k}", xyz, share, far) for k, xyz in enumerate(clouds)]
        assert moved(plain, register_pair(*scans)) < 1
    return plain


def test_a_shell_moves_no_pose() -> None:
    """Two scans without a loop; 5 % of beams without return, at 60 m."""
    pair = unmoved(yard_points(1), 60.0, (0.05,))
    assert pair.fit is not None
    one, two = poses()
    assert error(pair.fit.pose, one.inverse @ two)[0] < 0.005


@pytest.mark.slow
@pytest.mark.parametrize("name", list(TWINS))
def test_a_shell_moves_no_pose_of_a_twin(name: str) -> None:
    twin = build(name, 120_000)
    whole = [k for k, scan in enumerate(twin.scans) if scan.name == scan.station][:2]
    clouds = [np.concatenate([block.xyz for block in twin.measure(k)]) for k in whole]
    far = 1.2 * max(float(np.linalg.norm(xyz, axis=1).max()) for xyz in clouds)
    plain = register_pair(*(prepare(f"S{k}", [xyz]) for k, xyz in enumerate(clouds)))
    for share in (0.005, 0.02, 0.05):
        scans = [with_shell(f"S{k}", xyz, share, far) for k, xyz in enumerate(clouds)]
        shelled = register_pair(*scans)
        assert (plain.fit is None) == (shelled.fit is None)
        if plain.fit is not None:
            assert moved(plain, shelled) < 1


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_a_shell_that_is_kept_gives_no_pose(noise: float) -> None:
    """Whoever keeps the beams, or has them with noise, gets the right pose or none."""
    scans = []
    for k, xyz in enumerate(yard_points(2)):
        points, _ = mixed(xyz, shell(len(xyz) // 12, 60.0, k, noise))
        scans.append(prepare(f"S{k}", [points]))
    pair = register_pair(*scans)
    one, two = poses()
    if pair.fit is None:
        (sentence,) = pair.sentences
        assert "no pose" in sentence
    else:
        assert error(pair.fit.pose, one.inverse @ two)[0] < 0.01


def test_scans_from_one_place_are_no_shell() -> None:
    """A pose near identity that rests on walls, and floors."""
    place = poses()[0]
    turned = Pose(
        place.rotation @ exp(np.array([0, 0, 0.01])), place.translation + np.array([0.02, 0, 0])
    )
    a, b = (
        prepare(f"S{k}", [points_of(yard(), pose, 40_000, 70 + k)])
        for k, pose in enumerate((place, turned))
    )
    pair = register_pair(a, b)
    assert pair.fit is not None
    assert error(pair.fit.pose, place.inverse @ turned)[0] < 0.005


def bent(xyz: np.ndarray, by: Array) -> np.ndarray:
    """A scan of a scanner that moved evenly while it turned: shift [m] and turn [rad] in all."""
    part = np.arctan2(xyz[:, 1], xyz[:, 0]) / (2 * np.pi)
    turns = exp(part[:, None] * by[3:])
    return np.asarray(np.einsum("nij,nj->ni", turns, xyz) + part[:, None] * by[:3])


def fitted(clouds: list[np.ndarray]) -> RelativeCovariance:
    a, b = (prepare(f"S{k}", [xyz]) for k, xyz in enumerate(clouds))
    one, two = poses()
    pair = register_pair(a, b, one.inverse @ two, floor=NO_FLOOR)
    assert pair.fit is not None
    return relative_covariance(a.fine, b.fine, pair.fit.alignment, NO_FLOOR)


def test_a_scanner_that_moved_is_noticed() -> None:
    """20 mm and 2 mrad in one turn: said, with its figure, and sigmas are wider by it."""
    one, two = yard_points(3)
    still = fitted([one, two])
    assert still.sweep.factor == 1
    assert not any("fit differently" in text for text in still.sentences("A", "B"))
    swept = fitted([one, bent(two, np.array([0.02, 0, 0, 0, 0, 0.002]))])
    assert swept.sweep.factor >= swept.sweep.ratio > swept.sweep.limit > 1
    (sentence,) = [text for text in swept.sentences("A", "B") if "fit differently" in text]
    assert f"variance {swept.sweep.factor:.1f} times" in sentence
    assert np.trace(swept.local) > 2 * np.trace(still.local)


@pytest.mark.slow
def test_scanners_that_stood_still_are_not_accused() -> None:
    """Sixty pairs at a level of one in a hundred."""
    accused = sum(fitted(yard_points(seed, 30_000)).sweep.factor > 1 for seed in range(100, 160))
    assert accused <= 3


@pytest.mark.data
def test_a_nodding_laser(shared_data: Path) -> None:
    """Two scans of beams without return at 32.77 m, 3.36 m apart: never identity."""
    files = sorted((shared_data / "scans" / "nodding_laser").glob("*.xyz"))
    found = register_files(files)
    (group,) = found.registration.groups
    shift = group.poses["scan002"].translation - [3.361, 0.083, -0.051]
    assert np.linalg.norm(shift) < 0.03
    assert "1481 of 81360 points (1.8 %) are beams without return" in found.sentences[0]
    assert any("fit differently" in text for text in found.sentences)
    sigma = np.sqrt(np.diag(group.covariances["scan002"]))
    # halves of the second sweep fit by 15 mrad apart
    assert np.linalg.norm(sigma[3:]) > 0.01
    kept = register_files(files, no_return=True)
    assert all(pair.fit is None for pair in kept.registration.pairs)
    assert "equal ranges" in kept.sentences[0]


@pytest.mark.data
def test_a_spinning_laser(shared_data: Path) -> None:
    folder = shared_data / "scans" / "spinning_lidar"
    found = register_files(sorted(folder.glob("*.pcd")))
    true = Pose.from_matrix(np.loadtxt(folder / "relative.txt"))
    (group,) = found.registration.groups
    name = "251371071"
    shift = group.poses[name].translation - true.translation
    assert np.linalg.norm(shift) < 0.02
    turn = log(group.poses[name].rotation @ true.rotation.T)
    off = np.concatenate([shift, turn])
    square = off @ np.linalg.solve(group.covariances[name], off)
    low, high = chi2.ppf([0.025, 0.975], 6)
    assert low < square < high


@pytest.mark.data
def test_a_street(shared_data: Path) -> None:
    """Six pairs of four sweeps; every loop closes."""
    found = register_files(sorted((shared_data / "scans" / "street").glob("*.pcd"))).registration
    assert [pair.fit is not None for pair in found.pairs] == [True] * 6
    assert len(found.consistency.loops) == 4
    assert all(loop.closes for loop in found.consistency.loops)
    assert len(found.groups) == 1
