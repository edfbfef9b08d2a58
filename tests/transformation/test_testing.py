"""Tests of points, scale and models: constructed blunders, error probabilities, closed forms."""

import numpy as np
import pytest
from scipy.stats import binom

from tribrach.geometry import rotation
from tribrach.transformation.fit import fit_transformation
from tribrach.transformation.model_choice import ladder, scale_test
from tribrach.transformation.testing import check_points, point_tests, snoop_points

SIGMA = 0.003


def pair(rng: np.random.Generator, n: int = 8, scale: float = 1.0):
    a = rng.uniform(-40, 40, (n, 3)) * [1, 1, 0.3]
    b = scale * a @ rotation.exp(np.array([0.02, -0.01, 1.0])).T + [500.0, 300.0, 100.0]
    return a, b + rng.normal(0, SIGMA, b.shape)


def blocks(n: int, sigma: float = SIGMA) -> np.ndarray:
    return np.tile(sigma**2 * np.eye(3), (n, 1, 1))


@pytest.mark.parametrize("weighted", [True, False])
def test_blunders_are_found_by_name(weighted: bool) -> None:
    rng = np.random.default_rng(1)
    a, b = pair(rng, 9)
    b[3] += [0.05, -0.03, 0.1]
    a[6] += [-0.08, 0.04, 0.0]
    names = [f"P{k}" for k in range(9)]
    c = blocks(9) if weighted else None
    found = snoop_points(fit_transformation(a, b, 7, names=names, covariance_b=c))
    assert set(found.removed) == {"P3", "P6"}
    assert found.fit.dof == 3 * 7 - 7
    off = [r for r in found.fit.points.reasons if r]
    assert len(off) == 2
    assert all("does not fit" in reason for reason in off)
    assert any("point P3 is off by about" in step for step in found.steps)


def test_the_estimated_blunder_is_the_blunder() -> None:
    """Without noise the estimate is exact, whatever the redundancy."""
    rng = np.random.default_rng(2)
    a = rng.uniform(-40, 40, (6, 3))
    b = a @ rotation.exp(np.array([0.1, 0.2, 0.3])).T
    error = np.array([0.004, -0.002, 0.003])
    b[2] += error
    fit = fit_transformation(a, b, 6, covariance_b=blocks(6))
    tests = point_tests(fit)
    assert tests.error[2] == pytest.approx(error, abs=1e-5)
    assert tests.left[2] == pytest.approx(0.0, abs=1e-3)
    assert tests.redundancy.sum() == pytest.approx(fit.dof, rel=1e-9)


@pytest.mark.parametrize("weighted", [True, False])
def test_good_points_stay(weighted: bool) -> None:
    """Eight points at 0.1 % each: 0.8 % of good fits lose one, hardly more."""
    rng, lost = np.random.default_rng(9), 0
    for _ in range(150):
        a, b = pair(rng)
        c = blocks(8) if weighted else None
        lost += bool(snoop_points(fit_transformation(a, b, 7, covariance_b=c)).removed)
    assert lost <= binom.ppf(0.9995, 150, 0.01)


@pytest.mark.parametrize("weighted", [True, False])
def test_false_alarms_are_as_rare_as_stated(weighted: bool) -> None:
    """A test of one point at 5 % rejects 5 % of good points (binomial limits of 99.9 %)."""
    rng = np.random.default_rng(3)
    runs, alarms = 600, 0
    for _ in range(runs):
        a, b = pair(rng, 6)
        fit = fit_transformation(a, b, 6, covariance_b=blocks(6) if weighted else None)
        alarms += int(point_tests(fit, 0.05).suspicious[0])
    low, high = binom.ppf([0.0005, 0.9995], runs, 0.05)
    assert low <= alarms <= high


def test_nothing_is_removed_below_a_redundancy_of_one() -> None:
    a = np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]])
    b = a + np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]])
    found = snoop_points(fit_transformation(a, b, 6, covariance_b=blocks(3)))
    assert found.removed == ()
    assert "kept" in found.steps[-1]


def test_points_that_could_as_well_be_wrong_are_named() -> None:
    """Four points in one plane and one of them raised: any of the four may be the one."""
    a = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    b = a + np.array([[0, 0, 0.1], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
    found = snoop_points(fit_transformation(a, b, 6, names=list("ABCD"), covariance_b=blocks(4)))
    assert "it could as well be" in found.steps[0]


def test_check_points_are_held_out() -> None:
    """Squares of check points follow chi-square, with the errors of both systems and of the fit."""
    rng = np.random.default_rng(4)
    held = np.array([False] * 6 + [True, True])
    total = []
    for _ in range(300):
        a, b = pair(rng)
        a = a + rng.normal(0, SIGMA, a.shape)
        fit = fit_transformation(
            a, b, 6, covariance_a=blocks(8), covariance_b=blocks(8), check=held
        )
        result = check_points(fit)
        assert result is not None
        total.append(result.statistic)
    mean = np.mean(total)
    # 600 statistics with three degrees of freedom, two of each run correlated
    assert mean == pytest.approx(3.0, abs=4 * np.sqrt(2 * 6 / 600))
    assert fit.residual_b[held] == pytest.approx(0.0)
    a[7] += 1.0
    again = fit_transformation(a, b, 6, covariance_b=blocks(8), check=held)
    assert check_points(again).rmse.max() > 0.5
    assert again.rms < 0.02


def test_check_points_of_a_fit_without_sigmas() -> None:
    """Error probability with sigma0 a posteriori: F instead of chi-square."""
    rng = np.random.default_rng(5)
    held = np.array([False] * 5 + [True])
    beyond = 0
    for _ in range(500):
        a, b = pair(rng, 6)
        result = check_points(fit_transformation(a, b, 6, check=held))
        assert result is not None
        beyond += int(result.statistic[0] > result.limit(0.95)[0])
    low, high = binom.ppf([0.0005, 0.9995], 500, 0.05)
    assert low <= beyond <= high


def test_the_scale_is_tested() -> None:
    """80 m in extent, 3 mm: the sigma of the scale has a closed form, and 300 ppm are found."""
    rng = np.random.default_rng(6)
    a, b = pair(rng, scale=1 + 3e-4)
    fit = fit_transformation(a, b, 6, covariance_b=blocks(8))
    test = scale_test(fit.points)
    assert test is not None
    local = a - a.mean(axis=0)
    assert test.sigma == pytest.approx(SIGMA / np.sqrt((local**2).sum()), rel=1e-3)
    assert test.needed
    _, b = pair(np.random.default_rng(6))
    same = scale_test(fit_transformation(a, b, 6, covariance_b=blocks(8)).points)
    assert same is not None
    assert not same.needed


def test_scales_are_called_real_as_often_as_stated() -> None:
    rng = np.random.default_rng(7)
    for weighted in (True, False):
        found = 0
        for _ in range(300):
            a, b = pair(rng, 5)
            fit = fit_transformation(a, b, 7, covariance_b=blocks(5) if weighted else None)
            test = scale_test(fit.points)
            assert test is not None
            found += int(test.needed)
        low, high = binom.ppf([0.0005, 0.9995], 300, 0.05)
        assert low <= found <= high


def test_the_ladder_stops_at_the_model_that_made_the_points() -> None:
    rng = np.random.default_rng(8)
    a = rng.uniform(-40, 40, (10, 3))
    stretched = a * [1.001, 1.0, 0.999]
    b = stretched @ rotation.exp(np.array([0.1, 0, 1.0])).T + rng.normal(0, SIGMA, a.shape)
    rungs = ladder(fit_transformation(a, b, 7, covariance_b=blocks(10)).points)
    assert [r.count for r in rungs] == [3, 4, 6, 7, 9, 12]
    verdict = {r.count: r.statistic > r.limit for r in rungs if r.statistic is not None}
    assert verdict[6]
    assert verdict[9]
    assert not verdict[12]
