"""The verdict of a field check: its error rate, what it names, what it cannot test."""

from dataclasses import replace

import numpy as np
import pytest

from tests.instruments.field_surveys import STATIONS, TARGETS, readings
from tests.instruments.test_distance_statistics import known
from tribrach.calibration.field_check import Earlier, check_readings
from tribrach.errors import InputError

THREE = ("1", "2", "3")


def test_a_scanner_in_order_fails_as_rarely_as_stated():
    rng = np.random.default_rng(12)
    runs, alpha = 500, 0.05
    failed = sum(not check_readings(readings(rng), "check", alpha).passed for _ in range(runs))
    # the signatures are tested at less than their share
    assert failed / runs < alpha + 4 * np.sqrt(alpha * (1 - alpha) / runs)
    assert failed / runs > 0.5 * alpha - 2 * np.sqrt(alpha / runs)


@pytest.mark.slow
def test_a_full_check_fails_as_rarely_as_stated():
    rng = np.random.default_rng(13)
    runs, alpha = 300, 0.05
    checks = [check_readings(readings(rng, series=THREE), "check", alpha) for _ in range(runs)]
    failed = sum(not c.passed for c in checks)
    # distances and series see the same errors, so that the bound is not reached
    assert failed / runs < alpha + 3 * np.sqrt(alpha * (1 - alpha) / runs)


def test_every_misalignment_is_in_the_words_of_the_verdict():
    rng = np.random.default_rng(2)
    found = check_readings(readings(rng, {"x6": 2e-4, "x10": 6e-3}), "check")
    assert any(words.startswith("horizontal of both faces") for words in found.failures)
    assert "distances from inside and outside" in found.failures
    assert not found.passed


def other_units(readings, what):
    polar = readings.polar.copy()
    if what == "gon":
        back = readings.face < 0
        # written as circles of both faces have them, and taken for degrees
        polar[back, 1] += np.pi
        polar[:, 1:] = np.mod(polar[:, 1:], 2 * np.pi) / 0.9
        polar[back, 1] -= np.pi
    if what == "mm":
        polar[:, 0] *= 1000
    if what == "names":
        at = readings.station == readings.station[0]
        polar[at] = np.roll(polar[at], 2, axis=0)
    return replace(readings, polar=polar)


@pytest.mark.parametrize("what", ["gon", "mm", "names"])
def test_other_units_and_names_are_no_fault_of_the_scanner(what):
    bad = other_units(readings(np.random.default_rng(3)), what)
    with pytest.raises(InputError) as refused:
        check_readings(bad, "check")
    assert "units" in refused.value.cure


def test_a_full_check_has_all_tests():
    rng = np.random.default_rng(4)
    earlier = Earlier(2e-4, 30, "last year", 1e-3, 20)
    found = check_readings(
        readings(rng, series=THREE), "check", earlier=earlier, known=known(sigma=1e-3)
    )
    assert found.two_face is not None
    assert len(found.distances) == 1
    assert found.distances[0].scans == (3, 3)
    assert found.statistics[0].procedure == "full"
    assert found.lengths is not None
    assert found.change_of_distances is not None
    assert found.series is not None
    assert found.series.stations is not None
    # worse than last year
    assert found.failures == ["the precision against the earlier check"]
    # both faces, differences, u, lengths, two of series, two against last year
    assert found.alpha_each == pytest.approx(1 - 0.95 ** (1 / 8))
    assert found.notes == ()


def test_what_cannot_be_tested_is_said():
    rng = np.random.default_rng(4)
    found = check_readings(readings(rng, faces=(1.0,)), "check", earlier=Earlier(1e-3, 30, "x"))
    assert found.two_face is None
    words = " ".join(found.notes)
    assert "no target was measured in both faces" in words
    assert "there is one series only" in words
    assert "compared with repeated series only" in words
    assert "a scale of the range cannot be tested" in words
    one = {"inside": STATIONS["inside"]}
    alone = check_readings(readings(rng, stations=one), "check")
    assert alone.distances == ()
    assert "one station only" in " ".join(alone.notes)
    with pytest.raises(InputError, match="nothing can be tested: there is one station only"):
        check_readings(readings(rng, stations=one, faces=(1.0,)), "check")


def test_many_targets_are_compared_by_some():
    rng = np.random.default_rng(5)
    targets = rng.uniform([-20, -20, -2], [20, 20, 6], (90, 3))
    targets = np.vstack([TARGETS, targets[np.linalg.norm(targets, axis=1) > 4]])
    found = check_readings(readings(rng, targets=targets, faces=(1.0,)), "check")
    (one,) = found.distances
    assert one.in_common == len(targets)
    assert len(one.pairs) == 40 * 39 / 2
    assert one.dof == 3 * 40 - 6
