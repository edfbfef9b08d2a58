"""Series of scans: redundancy, experimental standard deviations, error rates of all tests."""

import numpy as np
import pytest
from scipy.stats import chi2, f

from tests.instruments.field_surveys import SIGMA, readings
from tribrach.calibration.field_series import SeriesCheck, against_earlier, check_series
from tribrach.calibration.scanner_readings import face_means
from tribrach.errors import InputError

SERIES = ("1", "2", "3")


def one(rng, **options) -> SeriesCheck:
    return check_series(face_means(readings(rng, series=SERIES, **options)))


def test_redundancy_is_that_of_the_closed_form():
    found = one(np.random.default_rng(0))
    assert (found.scans, found.targets, found.series) == (6, 4, 3)
    assert found.dof == 30
    assert found.limit == pytest.approx(43.773, abs=1e-3)
    assert set(found.s_station) == {"inside", "outside"}
    assert found.stations.dof == (6, 24)
    assert found.stations.upper == pytest.approx(f.ppf(0.95, 6, 24))


def test_one_series_of_two_stations_is_the_distances():
    found = check_series(face_means(readings(np.random.default_rng(0))))
    assert found.dof == 6
    assert found.stations is None
    assert found.s_station == {}


def test_the_experimental_standard_deviation_is_that_of_the_noise():
    """Noise of 0.4 mm along and across beams of ten metres: s estimates it."""
    rng = np.random.default_rng(4)
    h = np.array([0.1, 1.6, 3.4, 4.9])
    ring = 10 * np.stack([np.cos(h), np.sin(h), [0.1, -0.1, 0.05, 0.0]], axis=1)
    places = {"A": np.zeros(3), "B": np.array([0.4, 0.5, 0.1])}
    given = {"targets": ring, "stations": places, "sigma": np.array([4e-4, 4e-5, 4e-5])}
    found = [one(rng, **given) for _ in range(25)]
    # means of two faces
    assert found[0].stated == pytest.approx(4e-4 / np.sqrt(2), rel=0.03)
    total = sum((check.s / found[0].stated) ** 2 * check.dof for check in found)
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 25 * 30)
    assert 0.94 * low < total < 1.06 * high
    assert sum(not check.passed for check in found) <= 6


@pytest.mark.slow
def test_error_rates_are_as_stated():
    rng = np.random.default_rng(6)
    runs, alpha = 600, 0.05
    stated = stations = 0
    statistics = []
    for _ in range(runs):
        found = one(rng)
        stated += not found.passed
        stations += not found.stations.passed
        statistics.append(found.statistic)
    bound = 4 * np.sqrt(alpha * (1 - alpha) / runs)
    assert abs(stated / runs - alpha) < bound
    assert abs(stations / runs - alpha) < bound
    low, high = chi2.ppf([1e-4, 1 - 1e-4], runs * found.dof)
    assert low < sum(statistics) < high


def test_noise_beyond_what_is_stated_is_found():
    found = one(np.random.default_rng(1), noise=2.0)
    assert not found.passed
    assert found.p < 1e-3
    assert found.s_bound > found.s


def test_what_stations_differ_by_shows_a_range_zero():
    found = one(np.random.default_rng(1), parameters={"x10": 4e-3})
    assert not found.stations.passed
    assert max(found.s_station.values()) < 2 * SIGMA[0]


def test_against_an_earlier_day():
    found = one(np.random.default_rng(1))
    same = against_earlier(found.s, 30, found.s, 30)
    assert same.passed
    assert same.ratio == 1
    assert same.upper == pytest.approx(f.ppf(0.975, 30, 30))
    assert not against_earlier(found.s, 30, found.s / 2, 30).passed
    assert not against_earlier(found.s, 30, found.s * 2, 30).passed


def test_too_little_is_refused():
    given = face_means(readings(np.random.default_rng(1)))
    with pytest.raises(InputError, match="there is one scan only"):
        check_series(given.take(given.station == "inside"))
    with pytest.raises(InputError, match="have 2 targets in common"):
        check_series(given.take(given.target != "T1").take(np.array([0, 1, 3, 4])))
