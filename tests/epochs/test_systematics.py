"""Interval tests against the published numbers and against many draws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tribrach.epochs.systematics import answer, power, quadratic_range
from tribrach.errors import InputError
from tribrach.statistics import chi2


def test_the_interval_example() -> None:
    """mu (2, 1) cm, sigma 0.8 and 0.5 cm, bounds 0.2 cm: T 10.25 between 7.6225 and 13.3225."""
    mu, covariance = np.array([2.0, 1.0]), np.diag([0.64, 0.25])
    point, _ = quadratic_range(mu, covariance, np.zeros(2))
    least, largest = quadratic_range(mu, covariance, np.array([0.2, 0.2]))
    assert (point, least, largest) == pytest.approx((10.25, 7.6225, 13.3225))
    limit = float(chi2.ppf(0.95, 2))
    powers = [power(t, 2, limit) for t in (point, least, largest)]
    assert powers == pytest.approx([0.8254, 0.6952, 0.9150], abs=5e-5)
    assert answer(least, largest, limit) == "moved"
    assert answer(least, largest, 9.21) == "cannot tell"
    assert answer(least, largest, 13.4) == "not moved"


@settings(max_examples=40)
@given(
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    st.lists(st.floats(0, 2), min_size=3, max_size=3),
    st.integers(0, 1000),
)
def test_no_draw_leaves_the_range(d: list[float], b: list[float], seed: int) -> None:
    """Systematic parts within their bounds give statistics within the range, which is reached."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3)) + 2 * np.eye(3)
    covariance = root @ root.T + 0.1 * np.eye(3)
    least, largest = quadratic_range(np.array(d), covariance, np.array(b))
    draws = np.array(d) + rng.uniform(-1, 1, (400, 3)) * b
    values = np.einsum("ni,ij,nj->n", draws, np.linalg.inv(covariance), draws)
    assert values.min() >= least * (1 - 1e-9) - 1e-9
    assert values.max() <= largest * (1 + 1e-9) + 1e-9


def test_bounds_that_are_none_are_refused() -> None:
    with pytest.raises(InputError, match="negative"):
        quadratic_range(np.zeros(1), np.eye(1), np.array([-1.0]))
    with pytest.raises(InputError, match="more than"):
        quadratic_range(np.zeros(13), np.eye(13), np.ones(13))
