import numpy as np
import pytest
from scipy import stats

from tests.comparison.two_stations import ORIGIN, PLACES, joint_covariance, pair
from tests.network.facade import SIGMA, STATIONS, facade
from tribrach.cloud.placement import Placement
from tribrach.comparison.station_pair import StationPair, along_normals
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp, skew
from tribrach.network.adjustment import adjust

POINTS = ORIGIN + np.random.default_rng(3).uniform(-8, 8, (7, 3))


def test_registration_is_the_joint_covariance_carried_to_the_point() -> None:
    joint = joint_covariance()
    for point, found in zip(POINTS, pair().registration(POINTS), strict=True):
        half = [np.hstack([np.eye(3), -skew(point - place)]) for place in PLACES]
        motion = np.hstack([-half[0], half[1]])
        assert found == pytest.approx(motion @ joint @ motion.T, abs=1e-16)


def test_registration_by_monte_carlo() -> None:
    rng = np.random.default_rng(4)
    errors = rng.multivariate_normal(np.zeros(12), joint_covariance(), size=40_000)
    apart = POINTS[0] - PLACES
    moved = [
        errors[:, s : s + 3] + np.einsum("nij,j->ni", exp(errors[:, s + 3 : s + 6]), apart[k])
        for k, s in ((0, 0), (1, 6))
    ]
    found = pair().registration(POINTS)[0]
    assert np.cov((moved[1] - moved[0]).T) == pytest.approx(found, rel=0.05, abs=2e-8)


def test_common_control_error_cancels() -> None:
    alone, with_control = pair(common=0.0), pair(common=0.05)
    assert with_control.registration(POINTS) == pytest.approx(alone.registration(POINTS), abs=1e-14)
    halves = [
        Placement("S", Pose(np.eye(3), place), with_control.covariance[s : s + 6, s : s + 6], None)
        for place, s in zip(PLACES, (0, 6), strict=True)
    ]
    apart = StationPair.independent(*halves).registration(POINTS)
    assert (np.einsum("mii->m", apart) > 6 * 0.05**2).all()


def test_relative_pose_about_any_reference_gives_the_same_sigmas() -> None:
    normals = np.random.default_rng(5).normal(size=(7, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    expected = np.einsum("mi,mij,mj->m", normals, pair().registration(POINTS), normals)
    for reference in (ORIGIN, PLACES[0], ORIGIN + np.array([30.0, 20.0, -5.0])):
        rows = along_normals(POINTS, normals, reference)
        found = np.einsum("mi,ij,mj->m", rows, pair().relative(reference), rows)
        assert found == pytest.approx(expected, rel=1e-9)


def test_matrices_that_are_no_covariance() -> None:
    with pytest.raises(InputError, match="12 rows"):
        StationPair(*PLACES, np.eye(6))
    with pytest.raises(InputError, match="negative"):
        StationPair(*PLACES, np.diag([1.0] * 11 + [-1.0]))
    StationPair(*PLACES, np.zeros((12, 12)))


def test_adjusted_stations_miss_each_other_as_their_joint_covariance_says() -> None:
    # a point of the facade, in the frames of both scanners
    point = np.array([20.0, 30.5, 12.0])
    names = list(STATIONS)
    seen = [
        (point - np.array(place)) @ exp(np.array([0.0, 0.0, heading]))
        for place, heading in STATIONS.values()
    ]
    squares, alone = [], []
    for seed in range(120):
        found = adjust(facade(dict.fromkeys(SIGMA, 1.0), seed).network())
        state = found.state
        poses = [
            Pose(state.pose_r[k], state.pose_t[k])
            for k in (state.layout.index("pose", name) for name in names)
        ]
        miss = poses[1] @ seen[1] - poses[0] @ seen[0]
        pair_of = StationPair.from_adjustment(found, *names)
        squares.append(miss @ np.linalg.solve(pair_of.registration(point[None])[0], miss))
        halves = [
            Placement(name, pose, found.covariance(name), None)
            for name, pose in zip(names, poses, strict=True)
        ]
        apart = StationPair.independent(*halves).registration(point[None])[0]
        alone.append(miss @ np.linalg.solve(apart, miss))
    assert stats.kstest(squares, stats.chi2(3).cdf).pvalue > 0.01
    # without the correlation through control and targets the stations would seem worse
    assert stats.kstest(alone, stats.chi2(3).cdf).pvalue < 1e-6
    assert np.mean(alone) < 0.7 * 3
