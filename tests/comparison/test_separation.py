import numpy as np
import pytest
from scipy import stats

from tests.comparison.planes import frame, plane
from tests.comparison.two_stations import ORIGIN, pair
from tribrach.comparison.cloud_parts import whole
from tribrach.comparison.m3c2 import M3C2Settings, m3c2
from tribrach.comparison.separation import Patches, patches_of, separate
from tribrach.comparison.station_pair import along_normals
from tribrach.errors import InputError

WALLS = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0.8, 0]])


def patches(rng, walls=WALLS, count=80, noise=3e-4, local=0.0, pose=None) -> Patches:
    """Patches of a room displaced by a relative pose (6,) about the origin."""
    normal = walls[np.arange(count) % len(walls)]
    middle = ORIGIN + 5 * normal + rng.uniform(-4, 4, (count, 3)) * (1 - np.abs(normal))
    rows = along_normals(middle, normal, ORIGIN)
    distance = rows @ (np.zeros(6) if pose is None else pose)
    distance = distance + noise * rng.normal(size=count) + local * rng.normal(size=count)
    spread = np.tile([2e-3, 3e-3], (count, 1))
    return Patches(middle, normal, distance, np.full(count, noise), spread)


def test_a_known_pose_is_found() -> None:
    pose = np.array([2e-3, -1e-3, 3e-3, 1e-4, -2e-4, 5e-5])
    found = separate(patches(np.random.default_rng(1), pose=pose, noise=1e-6), pair())
    at_reference = pose[:3] + np.cross(pose[3:], found.reference - ORIGIN)
    assert found.rank == 6
    assert found.pose[:3] == pytest.approx(at_reference, abs=2e-6)
    assert found.pose[3:] == pytest.approx(pose[3:], abs=1e-6)
    assert found.sentences == []
    assert found.noise == pytest.approx([2e-3, 3e-3])


def test_poses_from_the_stations_pass_and_larger_ones_do_not() -> None:
    rng = np.random.default_rng(2)
    stations = pair()
    covariance = stations.relative(ORIGIN)
    tests = []
    for _ in range(400):
        pose = rng.multivariate_normal(np.zeros(6), covariance)
        tests.append(separate(patches(rng, pose=pose), stations))
    assert stats.kstest([t.probability for t in tests], "uniform").pvalue > 0.01
    assert stats.kstest([t.fit_probability for t in tests], "uniform").pvalue > 0.01
    worse = 4 * rng.multivariate_normal(np.zeros(6), covariance)
    assert separate(patches(rng, pose=worse), stations).probability < 1e-3


def test_pose_scatters_as_its_covariance_says() -> None:
    rng = np.random.default_rng(3)
    fixed = patches(np.random.default_rng(4))
    out = []
    for _ in range(400):
        distance = fixed.sigma * rng.normal(size=80)
        again = Patches(fixed.middle, fixed.normal, distance, fixed.sigma, fixed.spread)
        out.append(separate(again, pair()))
    assert np.std([s.pose for s in out], axis=0) == pytest.approx(out[0].sigma, rel=0.12)


def test_local_systematics_are_told_from_noise() -> None:
    found = separate(patches(np.random.default_rng(5), count=800, local=2e-3), pair())
    assert found.excess == pytest.approx(2e-3, rel=0.1)
    assert found.factor == pytest.approx(1 + (2e-3 / 3e-4) ** 2, rel=0.2)
    assert found.fit_probability < 1e-6
    # what is local passes into the sigma of the pose, so that the stations are not blamed
    assert found.probability > 0.01
    clean = separate(patches(np.random.default_rng(6), count=800), pair())
    assert clean.excess < 1.2e-4
    assert clean.factor == pytest.approx(1, abs=0.2)


def test_a_single_wall_does_not_see_shifts_along_it() -> None:
    rng = np.random.default_rng(7)
    pose = np.array([1e-3, 2e-3, 0.5, 1e-4, 1e-4, 1e-4])
    some = patches(rng, walls=np.array([[0.0, 1.0, 0.0]]), pose=pose, noise=1e-5)
    found = separate(some, pair())
    assert found.rank == 3
    assert found.unseen.shape == (6, 3)
    # the half metre along the wall is neither seen nor invented
    assert np.abs(found.pose[[0, 2, 4]]).max() < 1e-9
    assert len(found.sentences) == 3
    text = " ".join(found.sentences)
    assert "a shift along (" in text
    assert "a turn about (0.00 x, 1.00 y, 0.00 z)" in text or "together" in text
    # normals that are a little wrong do not make it seen
    tilted = some.normal + 2e-3 * rng.normal(size=some.normal.shape)
    tilted /= np.linalg.norm(tilted, axis=1)[:, None]
    again = Patches(some.middle, tilted, some.distance, some.sigma, some.spread)
    assert separate(again, pair()).rank == 3


def test_patches_from_clouds() -> None:
    rng = np.random.default_rng(8)
    clouds = []
    for shift in (np.zeros(3), np.array([2e-3, 1e-3, -3e-3])):
        walls = [plane(rng, n, 2.0, 40_000, size=3.0, sigma=2e-3, origin=ORIGIN) for n in WALLS]
        clouds.append(whole(np.concatenate(walls) + shift))
    steps = np.array([(s, t, 2.0) for s in (-0.8, 0.0, 0.8) for t in (-0.8, 0.0, 0.8)])
    core = np.concatenate([ORIGIN + steps @ frame(n).T for n in WALLS])
    settings = M3C2Settings([0.5], 0.4, 0.05, scanner=ORIGIN)
    found = separate(patches_of(m3c2(*clouds, core, settings), roughness=0.003), pair())
    assert found.rank == 6
    assert np.abs(found.pose[:3] - [2e-3, 1e-3, -3e-3]).max() < 4 * found.sigma[:3].max()
    assert found.noise == pytest.approx([2e-3, 2e-3], rel=0.05)


def test_too_few_patches() -> None:
    rng = np.random.default_rng(9)
    with pytest.raises(InputError, match="do not check"):
        separate(patches(rng, count=6), pair())
    with pytest.raises(InputError, match="sigma"):
        separate(patches(rng, noise=0.0), pair())
    with pytest.raises(InputError, match="sigma"):
        separate(patches(rng, count=0), pair())
    one = patches(rng, count=8)
    same = Patches(np.tile(ORIGIN, (8, 1)), one.normal, one.distance, one.sigma, one.spread)
    with pytest.raises(InputError, match="one place"):
        separate(same, pair())
