"""Quantiles and tails against scipy.stats, tables and closed forms."""

import numpy as np
import pytest
import scipy.stats

from tribrach.statistics import chi2, f, norm, t

P = np.array([1e-12, 1e-6, 0.001, 0.025, 0.3, 0.9, 0.975, 0.999, 1 - 1e-9])
DOF = np.array([1.0, 2, 3, 6, 10, 50, 300, 5000, 200_000])[:, None]


def test_chi_square() -> None:
    x = scipy.stats.chi2.ppf(P, DOF)
    assert chi2.ppf(P, DOF) == pytest.approx(x, rel=1e-12)
    assert chi2.sf(x, DOF) == pytest.approx(scipy.stats.chi2.sf(x, DOF), rel=1e-10)
    # two degrees of freedom have the exponential distribution
    assert chi2.ppf(0.95, 2) == pytest.approx(-2 * np.log(0.05), rel=1e-14)
    assert chi2.sf(-1.0, 3) == 1.0
    assert np.isnan(chi2.ppf(0.95, 0))


@pytest.mark.parametrize("denominator", [1, 2, 7, 120, 1e6])
def test_f(denominator: float) -> None:
    x = scipy.stats.f.ppf(P, DOF, denominator)
    assert f.ppf(P, DOF, denominator) == pytest.approx(x, rel=1e-9)
    assert f.sf(x, DOF, denominator) == pytest.approx(
        scipy.stats.f.sf(x, DOF, denominator), rel=1e-9
    )
    assert f.sf(-1.0, 3, denominator) == 1.0


def test_f_of_tables() -> None:
    """Upper 5 % points as every table prints them."""
    assert f.ppf(0.95, 3, 10) == pytest.approx(3.71, abs=0.005)
    assert f.ppf(0.95, 10, 3) == pytest.approx(8.79, abs=0.005)


def test_student() -> None:
    x = scipy.stats.t.ppf(P, DOF)
    assert t.ppf(P, DOF) == pytest.approx(x, rel=1e-9)
    assert t.sf(x, DOF) == pytest.approx(scipy.stats.t.sf(x, DOF), rel=1e-9)
    # one degree of freedom has the Cauchy distribution
    assert t.ppf(0.975, 1) == pytest.approx(np.tan(np.pi * 0.475), rel=1e-12)


def test_normal() -> None:
    x = scipy.stats.norm.ppf(P)
    assert norm.ppf(P) == pytest.approx(x, rel=1e-12)
    assert norm.sf(x) == pytest.approx(scipy.stats.norm.sf(x), rel=1e-12)
    assert norm.pdf(x) == pytest.approx(scipy.stats.norm.pdf(x), rel=1e-12)
    assert norm.isf(1e-20) == pytest.approx(scipy.stats.norm.isf(1e-20), rel=1e-12)


@pytest.mark.parametrize("dof", [1, 2, 3, 10])
@pytest.mark.parametrize("power", [0.5, 0.8, 0.99])
def test_noncentrality(dof: int, power: float) -> None:
    limit = chi2.ppf(0.999, dof)
    shift = chi2.noncentrality(limit, dof, power)
    assert scipy.stats.ncx2.sf(limit, dof, shift) == pytest.approx(power, rel=1e-9)
