"""Distances from two stations: closed forms, false alarms, range zero."""

import numpy as np
import pytest
from scipy.stats import chi2

from tests.instruments.field_surveys import TARGETS, readings
from tribrach.calibration.scanner_readings import face_means
from tribrach.calibration.target_distances import compare_distances
from tribrach.errors import InputError


def test_range_zero_in_line_is_twice_itself():
    """A station between two targets sees their distance short by twice the range zero."""
    line = np.array([[10.0, 0, 0.1], [-8.0, 0, 0.1], [0.0, 6.0, 1.0], [1.0, -7.0, 0.0]])
    stations = {"A": np.zeros(3), "B": np.array([30.0, 0.0, 0.0])}
    given = readings(
        np.random.default_rng(0), {"x10": 1e-3}, targets=line, stations=stations, noise=0.0
    )
    found = compare_distances(face_means(given), "A", "B")
    pairs = found.pairs
    at = list(zip(pairs.from_, pairs.to, strict=True)).index(("T0", "T1"))
    assert pairs.difference[at] == pytest.approx(-2e-3, abs=1e-6)
    assert found.range_zero.value == pytest.approx(1e-3, rel=1e-4)
    np.testing.assert_allclose(
        pairs.lengths[:, 0] - pairs.lengths[:, 1], pairs.difference, atol=1e-12
    )


@pytest.mark.parametrize("count", [3, 4, 5])
def test_degrees_of_freedom_and_false_alarms(count):
    """Three targets have three distances, four six, five ten of which nine are independent."""
    rng = np.random.default_rng(count)
    targets = np.vstack([TARGETS, [[8.0, 8.0, -1.0]]])[:count]
    runs, alpha = 500, 0.05
    statistics, single = [], 0
    for _ in range(runs):
        found = compare_distances(face_means(readings(rng, targets=targets)), "inside", "outside")
        statistics.append(found.statistic)
        single += bool((np.abs(found.pairs.difference) > found.pairs.limit).any())
    assert found.dof == 3 * count - 6
    rejected = np.mean(np.array(statistics) > found.limit)
    assert abs(rejected - alpha) < 4 * np.sqrt(alpha * (1 - alpha) / runs)
    # Sidak's bound holds for correlated differences as well
    assert single / runs < alpha + 4 * np.sqrt(alpha * (1 - alpha) / runs)
    low, high = chi2.ppf([1e-4, 1 - 1e-4], runs * found.dof)
    assert low < sum(statistics) < high


def test_range_zero_is_found_and_its_sigma_is_true():
    rng = np.random.default_rng(8)
    zeros, found = [], None
    for _ in range(300):
        found = compare_distances(face_means(readings(rng, {"x10": 3e-3})), "inside", "outside")
        zeros.append(found.range_zero.value)
    assert np.mean(zeros) == pytest.approx(3e-3, abs=4 * found.range_zero.sigma / 17)
    assert np.std(zeros) / found.range_zero.sigma == pytest.approx(1, abs=0.17)
    large = face_means(readings(rng, {"x10": 6e-3}))
    found = compare_distances(large, "inside", "outside")
    assert not found.passed
    assert found.explanation.causes[0].parameter == "x10"
    assert found.explanation.fits


def test_readings_of_one_face_are_explained_as_such():
    given = readings(np.random.default_rng(1), {"x2": 9e-3}, faces=(1.0,))
    found = compare_distances(face_means(given), "inside", "outside")
    names = {n for c in found.explanation.causes for n in (c.parameter, *c.alternatives)}
    assert {"x2", "x10"} & names


def test_too_few_targets_are_refused():
    given = face_means(readings(np.random.default_rng(1), targets=TARGETS[:2]))
    with pytest.raises(InputError, match="have 2 targets in common"):
        compare_distances(given, "inside", "outside")
