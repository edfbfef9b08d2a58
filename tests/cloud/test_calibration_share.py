"""What a calibration adds to the covariance of points, against a sample of calibrations."""

import numpy as np
from scipy.stats import chi2

from tribrach.cloud.budget import point_budget
from tribrach.cloud.calibration_share import share_of
from tribrach.cloud.covariance import covariances, sigmas
from tribrach.cloud.placement import CalibrationShare, Placement
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.instruments.calibration import NIST
from tribrach.instruments.correction import Correction
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.units import SEC

MODEL = NIST.select(["x10", "x2", "x4", "x6"])
SIZE = np.array([2e-4, 1e-4, 4 * SEC, 3 * SEC])
NOISE = ScanNoise(0.001, 1e-5, 8 * SEC, 8 * SEC)


def joint() -> np.ndarray:
    """A covariance (10, 10) of a pose and four parameters, correlated."""
    rng = np.random.default_rng(3)
    size = np.concatenate([np.full(3, 3e-4), np.full(3, 6 * SEC), SIZE])
    root = rng.normal(size=(10, 10)) + 1.5 * np.eye(10)
    matrix = root @ root.T
    unit = np.sqrt(np.diag(matrix))
    return matrix / np.outer(unit, unit) * np.outer(size, size)


def placement(c: np.ndarray) -> Placement:
    pose = Pose(exp(np.array([0.1, -0.2, 1.0])), np.array([3.0, -2.0, 1.0]))
    share = CalibrationShare(Correction(MODEL, np.zeros(4)), c[6:, 6:], c[:6, 6:])
    return Placement("S", pose, c[:6, :6], NOISE, share)


def test_share_against_a_sample_of_calibrations_and_poses() -> None:
    c, n = joint(), 4000
    where = placement(c)
    xyz = np.array([[4.0, 3.0, 1.0], [-6.0, 2.0, -1.2], [1.0, -2.0, 2.5]])
    drawn = np.random.default_rng(5).multivariate_normal(np.zeros(10), c, n)
    placed = np.array(
        [
            Correction(MODEL, d[6:]).corrected(xyz) @ (exp(d[3:6]) @ where.pose.rotation).T
            + where.pose.translation
            + d[:3]
            for d in drawn
        ]
    )
    plain = Placement("S", where.pose, where.covariance, NOISE)
    noise = Placement("S", where.pose, np.zeros((6, 6)), NOISE)
    station = covariances(xyz, plain) - covariances(xyz, noise)
    stated = station + share_of(xyz, where)
    low, high = chi2.ppf([1e-5, 1 - 1e-5], n - 1) / (n - 1)
    for k in range(len(xyz)):
        sample = np.cov(placed[:, k].T)
        s = stated[k]
        full = np.array([[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]])
        for direction in np.vstack([np.eye(3), np.random.default_rng(k).normal(size=(6, 3))]):
            ratio = direction @ sample @ direction / (direction @ full @ direction)
            assert low < ratio < high


def test_sigmas_have_the_share() -> None:
    where = placement(joint())
    xyz = np.array([[4.0, 3.0, 1.0], [-6.0, 2.0, -1.2]])
    np.testing.assert_allclose(
        sigmas(xyz, where), np.sqrt(covariances(xyz, where)[:, :3]), rtol=1e-5
    )
    without = Placement("S", where.pose, where.covariance, NOISE)
    assert not np.allclose(sigmas(xyz, where), sigmas(xyz, without), rtol=1e-3)


def test_turned_axes_turn_the_share() -> None:
    where = placement(joint())
    xyz = np.array([[4.0, 3.0, 1.0]])
    turn = exp(np.array([0.3, 0.1, -0.7]))
    a, b = share_of(xyz, where)[0], share_of(xyz, where.turned(turn))[0]

    def full(s: np.ndarray) -> np.ndarray:
        return np.array([[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]])

    np.testing.assert_allclose(full(b), turn @ full(a) @ turn.T, atol=1e-15)


def test_the_budget_adds_up_with_a_calibration() -> None:
    where = placement(joint())
    xyz = np.array([[4.0, 3.0, 1.0], [-6.0, 2.0, -1.2]])
    budget = point_budget(xyz, where)
    assert budget.names[:2] == ("station", "calibration")
    stated = covariances(xyz, where)[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    np.testing.assert_allclose(budget.total, stated, rtol=1e-9)
