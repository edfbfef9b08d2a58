"""Critical values against tables and against simulation."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from tribrach.network.significance import (
    block_noncentrality,
    block_tau_critical,
    log_significance,
    noncentrality,
    sidak,
    tau_critical,
    w_critical,
)


def test_noncentrality_finds_an_error_with_the_stated_power() -> None:
    shifted = np.random.default_rng(1).standard_normal(200_000) + noncentrality(0.001, 0.8)
    assert (np.abs(shifted) > w_critical(0.001)).mean() == pytest.approx(0.8, abs=0.004)


@pytest.mark.parametrize("dof", [1, 2, 3, 6])
def test_block_noncentrality_finds_an_error_with_the_stated_power(dof: int) -> None:
    sample = np.random.default_rng(2).standard_normal((100_000, dof))
    sample[:, 0] += block_noncentrality(dof, 0.001, 0.8)
    found = (sample**2).sum(axis=1) > chi2.ppf(0.999, dof)
    assert found.mean() == pytest.approx(0.8, abs=0.005)


def test_one_value_is_a_block_of_one() -> None:
    """The root of Baarda's 17.075, the other tail neglected."""
    assert block_noncentrality(1) == pytest.approx(noncentrality(), abs=1e-4)


@pytest.mark.parametrize("dof", [2, 5, 20])
def test_tau_is_exceeded_as_often_as_stated(dof: int) -> None:
    """Pope's tau: one of r normal values over the root mean square of all of them."""
    z = np.random.default_rng(3).standard_normal((200_000, dof))
    tau = np.abs(z[:, 0]) / np.sqrt((z**2).mean(axis=1))
    assert (tau > tau_critical(dof, 0.05)).mean() == pytest.approx(0.05, abs=0.002)


def test_tau_without_redundancy() -> None:
    assert (tau_critical(0, 0.05), tau_critical(1, 0.05)) == (0.0, 1.0)


def test_sidak_keeps_the_family_at_its_level() -> None:
    assert 1 - (1 - sidak(0.05, 137)) ** 137 == pytest.approx(0.05)


def test_log_significance() -> None:
    """The normal tail in one dimension, continued beyond the smallest number."""
    z = np.array([0.5, 3.0, 10.0, 22.0])
    expected = np.log(2) + norm.logsf(z)
    assert log_significance(z**2, 1) == pytest.approx(expected, rel=1e-10)
    far = np.array([23.0, 50.0, 400.0])
    assert log_significance(far**2, 1) == pytest.approx(np.log(2) + norm.logsf(far), rel=1e-4)
    assert log_significance([np.nan, 12.0], [3, 0]) == pytest.approx([0.0, 0.0])
    assert np.diff(log_significance(np.linspace(499, 501, 9), 3)).max() < 0


@pytest.mark.parametrize(("freedom", "dof"), [(1, 6), (3, 8), (3, 30)])
def test_blocks_over_the_posterior_factor_are_exceeded_as_often_as_stated(
    freedom: int, dof: int
) -> None:
    """The block is part of what the factor was estimated from, so its statistic has a bound."""
    z = np.random.default_rng(5).standard_normal((200_000, dof))
    statistic = (z[:, :freedom] ** 2).sum(axis=1) / (z**2).mean(axis=1)
    assert (statistic > block_tau_critical(freedom, dof, 0.05)).mean() == pytest.approx(
        0.05, abs=0.002
    )
    assert block_tau_critical(freedom, dof, 1e-12) < dof


def test_a_block_that_is_all_the_redundancy_is_never_rejected() -> None:
    """Its statistic is the redundancy itself, whatever the observations are."""
    assert block_tau_critical([3, 4], 3, 0.05) == pytest.approx([3.0, 3.0])
