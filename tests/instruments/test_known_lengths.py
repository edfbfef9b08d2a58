"""Known lengths: a scale comes back, alone and beside a range zero; what cannot be compared."""

from dataclasses import replace

import numpy as np
import pytest

from tests.instruments.field_surveys import STATIONS, readings
from tests.instruments.test_distance_statistics import known
from tribrach.calibration.known_lengths import KnownLengths, compare_lengths, without_blunders
from tribrach.calibration.scanner_readings import face_means

EXACT = {"noise": 0.0, "series": ("1", "2")}


def test_a_scale_without_noise_comes_back():
    rng = np.random.default_rng(0)
    found = compare_lengths(face_means(readings(rng, scale=40e-6, **EXACT)), known())
    assert found.scale == pytest.approx(40e-6, rel=1e-4)
    assert found.beside_zero
    np.testing.assert_allclose(found.rows.difference, 40e-6 * found.rows.known, rtol=1e-3)
    assert len(found.rows) == 12
    assert found.dof == 12


def test_a_range_zero_is_no_scale():
    rng = np.random.default_rng(0)
    given = face_means(readings(rng, {"x10": 4e-3}, **EXACT))
    found = compare_lengths(given, known())
    assert abs(found.scale) < 1e-7
    # alone it would be one: from one station between the targets a zero looks like a scale
    one = known()
    single = KnownLengths(one.pairs[:1], one.lengths[:1], one.covariance[:1, :1])
    alone = compare_lengths(given.take(given.station == "inside"), single)
    assert not alone.beside_zero
    assert alone.scale == pytest.approx(-8e-3 / one.lengths[0], rel=0.02)


def test_estimates_spread_as_stated():
    rng = np.random.default_rng(7)
    found = [
        compare_lengths(face_means(readings(rng, scale=30e-6)), known(rng=rng)) for _ in range(150)
    ]
    scale = np.array([one.scale for one in found])
    assert scale.mean() == pytest.approx(30e-6, abs=4 * found[0].sigma_scale / np.sqrt(150))
    assert scale.std() / found[0].sigma_scale == pytest.approx(1, abs=0.2)


def test_lengths_that_nobody_measured():
    given = face_means(readings(np.random.default_rng(0)))
    one = known()
    none = KnownLengths((("T0", "elsewhere"),), one.lengths[:1], one.covariance[:1, :1])
    assert compare_lengths(given, none) is None
    # a target that one station did not see is compared from the other
    fewer = given.take((given.station != "outside") | (given.target != "T0"))
    found = compare_lengths(fewer, one)
    assert found.rows.station.count("inside") == 6
    assert found.rows.station.count("outside") == 3
    assert set(STATIONS) == set(found.rows.station)


def entries_of(one: KnownLengths) -> KnownLengths:
    """A table of distances, each of which can be wrong by itself."""
    entries = tuple((f"{a} to {b}", (k,)) for k, (a, b) in enumerate(one.pairs))
    return replace(one, entries=entries)


@pytest.mark.parametrize("error", [8e-3, 0.05, 44.0])
def test_a_length_that_contradicts_the_others_is_named_and_taken_out(error):
    rng = np.random.default_rng(11)
    means = face_means(readings(rng, series=("1", "2", "3")))
    one = entries_of(known(rng=rng))
    one.lengths[2] += error
    left, words = without_blunders(means, one)
    assert len(words) == 1
    assert words[0].startswith(f"{one.pairs[2][0]} to {one.pairs[2][1]}")
    assert left.pairs == (*one.pairs[:2], *one.pairs[3:])
    assert compare_lengths(means, left).passed
    assert not compare_lengths(means, one).passed
    # nothing is left of a table of this length alone, but where it is a range that may be wrong
    alone = one.without({0, 1, 3, 4, 5})
    assert len(without_blunders(means, alone)[0]) == (error < 1)


def test_errors_of_the_scanner_are_no_blunders_of_the_table():
    """Nothing is named for a scale, a range zero or noise, which the test of the lengths shows."""
    rng = np.random.default_rng(12)
    for parameters, scale in (({}, 0.0), ({}, 3e-4), ({"x10": 4e-3}, 0.0)):
        for _ in range(10):
            means = face_means(readings(rng, parameters, scale=scale, series=("1", "2", "3")))
            one = entries_of(known(rng=rng))
            left, words = without_blunders(means, one)
            assert (left.pairs, words) == (one.pairs, ())


def test_a_range_zero_is_stated_beside_the_scale():
    rng = np.random.default_rng(13)
    means = face_means(readings(rng, {"x10": 4e-3}, series=("1", "2", "3")))
    found = compare_lengths(means, known(rng=rng))
    assert found.statistic > found.limit
    assert found.after <= found.after_limit
    assert found.zero.value == pytest.approx(4e-3, abs=4 * found.zero.sigma)
    assert abs(found.zero.t) > found.t_limit
