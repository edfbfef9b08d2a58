"""Whether a static solution is fixed at its end: fabricated epochs whose state is known."""

import numpy as np
import pytest

from tribrach.instruments.final_solution import FinalSolution, final_solution

N = 120
LENGTH = 2500.0


def decided(
    fixed: np.ndarray, away: np.ndarray | None = None, sigma: np.ndarray | None = None
) -> FinalSolution:
    """The state of epochs that lie ``away`` (n,) [m] from the truth along x."""
    n = len(fixed)
    values = np.zeros((n, 3))
    values[:, 0] = 0 if away is None else away
    spread = np.where(fixed, 0.001, 0.01) if sigma is None else sigma
    covariance = spread[:, None, None] ** 2 * np.eye(3)
    return final_solution(values, covariance, fixed, np.where(fixed, 20.0, 1.4), LENGTH)


def test_every_epoch_fixed() -> None:
    found = decided(np.ones(N, dtype=bool))
    assert found.fixed
    assert (found.share, found.share_end, found.ratio, found.epochs_end) == (1, 1, 20, 40)
    assert found.reason == ""
    assert not found.scatter.any()


def test_a_few_epochs_in_the_middle_are_no_fixed_solution() -> None:
    """4 % are fixed, with the smallest formal sigmas of all, and 18 mm from the rest."""
    fixed = np.zeros(N, dtype=bool)
    fixed[50:55] = True
    away = np.where(fixed, 0.018, 0.0)
    away[80:] = np.linspace(0.009, 0.001, 40)
    found = decided(fixed, away)
    assert not found.fixed
    assert found.share == pytest.approx(0.0417, abs=1e-3)
    assert found.ratio == 1.4
    # the fixed epochs with their better formal sigmas are not taken
    assert found.epoch >= 80
    assert found.reason == "0 % of the last 40 epochs are fixed, and 80 % are needed"
    expected = np.mean((away[80:] - away[found.epoch]) ** 2)
    np.testing.assert_allclose(found.scatter, np.diag([expected, 0, 0]), atol=1e-12)


def test_integers_that_are_found_late_and_kept_are_fixed() -> None:
    """60 % of the epochs; those before, float and decimetres off, are not held against it."""
    fixed = np.arange(N) >= 48
    found = decided(fixed, np.where(fixed, 0.0, 0.3))
    assert found.fixed
    assert found.share == 0.6


def test_the_same_share_lost_at_the_end_is_float() -> None:
    fixed = np.arange(N) < 72
    found = decided(fixed)
    assert not found.fixed
    assert found.share == 0.6
    assert found.epoch >= 80


@pytest.mark.parametrize(("gaps", "expected"), [(8, True), (9, False)])
def test_gaps_of_rising_satellites(gaps: int, expected: bool) -> None:
    """80 % of the forty epochs at the end: 32 of them."""
    fixed = np.ones(N, dtype=bool)
    fixed[80 : 80 + 2 * gaps : 2] = False
    assert decided(fixed).fixed is expected


@pytest.mark.parametrize(("jump", "expected"), [(0.022, True), (0.023, False), (0.19, False)])
def test_wrong_fixes_that_jump(jump: float, expected: bool) -> None:
    """The limit is 20 mm and 1 ppm of 2.5 km."""
    away = np.where(np.arange(N) % 10 == 5, jump, 0.0)
    sigma = np.where(np.arange(N) % 10 == 5, 0.002, 0.001)
    found = decided(np.ones(N, dtype=bool), away, sigma)
    assert found.fixed is expected
    assert found.limit == pytest.approx(0.0225)
    assert found.apart == pytest.approx(jump)
    if not expected:
        # all are fixed, so that there is no float epoch to take: the scatter says how bad it is
        assert found.scatter[0, 0] == pytest.approx(jump**2 / 10)
        assert "wrong integers" in found.reason


def test_wrong_fixes_between_float_epochs_are_not_taken() -> None:
    fixed = np.ones(N, dtype=bool)
    fixed[80:120:6] = False
    away = np.where(fixed & (np.arange(N) % 2 == 0), 0.06, 0.0)
    found = decided(fixed, away)
    assert found.share_end >= 0.8
    assert not found.fixed
    assert not fixed[found.epoch]


def test_no_epoch_fixed_and_a_single_epoch() -> None:
    found = decided(np.zeros(N, dtype=bool))
    assert (found.fixed, found.share, found.reason) == (False, 0, "no epoch is fixed")
    # a file with one line for the whole session
    one = decided(np.ones(1, dtype=bool))
    assert (one.fixed, one.epochs_end) == (True, 1)
