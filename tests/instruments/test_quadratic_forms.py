"""Weighted sums of squares: chi-square and F where weights are equal, simulation where not."""

import numpy as np
import pytest
from scipy.stats import chi2, f

from tribrach.calibration.quadratic_forms import (
    equivalent_dof,
    exceedance,
    quantile,
    ratio_quantile,
)


@pytest.mark.parametrize("dof", [2, 3, 6, 30, 200])
@pytest.mark.parametrize("p", [0.05, 0.5, 0.95, 0.999])
def test_equal_weights_are_a_chi_square(dof: int, p: float) -> None:
    weights = np.full(dof, 3e-6)
    assert quantile(p, weights) == pytest.approx(3e-6 * chi2.ppf(p, dof), rel=1e-5)
    assert exceedance(3e-6 * chi2.ppf(p, dof), weights) == pytest.approx(1 - p, abs=1e-6)
    assert equivalent_dof(weights) == pytest.approx(dof)


def test_two_pairs_of_weights_have_a_closed_form() -> None:
    """The sum of two exponential variables of means 2 a and 2 b."""
    a, b, x = 1.0, 0.3, 7.0
    truth = (a * np.exp(-x / 2 / a) - b * np.exp(-x / 2 / b)) / (a - b)
    assert exceedance(x, np.array([a, a, b, b])) == pytest.approx(truth, abs=1e-7)


def test_a_ratio_of_equal_weights_is_f() -> None:
    for p in (0.025, 0.5, 0.975):
        found = ratio_quantile(p, np.full(12, 1 / 12), np.full(7, 1 / 7))
        assert found == pytest.approx(f.ppf(p, 12, 7), rel=1e-6)


def test_any_weights_against_simulation() -> None:
    rng = np.random.default_rng(5)
    weights = np.array([4.0, 1.0, 0.5, 0.1, 0.1])
    squares = rng.normal(size=(200_000, 5)) ** 2 @ weights
    for x in (1.0, 5.0, 20.0, 40.0):
        p = exceedance(x, weights)
        assert np.mean(squares > x) == pytest.approx(p, abs=4 * np.sqrt(p * (1 - p) / 200_000))
    # weights of either sign, and none at all
    assert exceedance(0.0, np.array([1.0, -1.0])) == pytest.approx(0.5, abs=1e-6)
    assert exceedance(0.0, np.zeros(3)) == 0.0
