"""The two-face test: closed forms, the example of a theodolite, false alarms, what it points to."""

import numpy as np
import pytest

from tests.instruments.field_surveys import SIGMA, TARGETS, readings
from tribrach.calibration.scanner_readings import face_means, face_pairs, folded
from tribrach.calibration.two_face import SIGNATURES, signatures, two_face_test
from tribrach.errors import InputError
from tribrach.units import GON

SPREAD = np.vstack([TARGETS, TARGETS[:, [1, 0, 2]] * [-0.4, 0.3, 2.0], [[2.0, 1.0, 3.0]]])


def test_a_pair_of_readings_in_gon():
    """HF 123.4567, HB 323.4633, VF 88.1234, VB 311.8806: V 88.1214, index 0.0020, c -0.0033."""
    raw = np.array([[10.0, 123.4567 * GON, 88.1234 * GON], [10.0, 323.4633 * GON, 311.8806 * GON]])
    polar, face = folded(raw, np.array([1.0, 1.0]))
    assert face.tolist() == [1.0, -1.0]
    given = readings(np.random.default_rng(0), targets=TARGETS[:1], stations={"S": np.zeros(3)})
    pair = face_pairs(type(given)(given.station, given.series, given.target, face, polar,
                                  given.covariance, given.source))  # fmt: skip
    half, mean = pair.half[0] / GON, pair.polar[0] / GON
    assert half[2] == pytest.approx(0.0020, abs=1e-9)
    assert half[1] == pytest.approx(-0.0033, abs=1e-9)
    assert mean[2] == pytest.approx(88.1214, abs=1e-9)


@pytest.mark.parametrize(
    ("parameter", "formula"),
    [
        ("x2", lambda r, h, v: [np.sin(v), 0 * v, np.cos(v) / r]),
        ("x3", lambda r, h, v: [0 * v, 1 / (r * np.sin(v)), 0 * v]),
        ("x4", lambda r, h, v: [0 * v, 0 * v, np.ones_like(v)]),
        ("x6", lambda r, h, v: [0 * v, 2 / np.sin(v), 0 * v]),
        ("x7", lambda r, h, v: [0 * v, -1 / np.tan(v), 0 * v]),
        ("x9n", lambda r, h, v: [0 * v, 0 * v, np.cos(v)]),
        ("x1z", lambda r, h, v: [0 * v, -1 / (r * np.tan(v)), 0 * v]),
        ("x12a", lambda r, h, v: [0 * v, 0 * v, np.cos(2 * v)]),
    ],
)
def test_noise_free_half_differences_are_minus_the_closed_forms(parameter, formula):
    value = 3e-4
    pairs = face_pairs(readings(np.random.default_rng(1), {parameter: value}, noise=0.0))
    expected = -value * np.stack(formula(*pairs.polar.T), axis=1)
    np.testing.assert_allclose(pairs.half, expected, atol=2e-9)
    np.testing.assert_allclose(
        signatures(pairs.polar)[:, :, SIGNATURES.index(parameter)] * value, expected, atol=1e-12
    )


def test_false_alarms_are_as_rare_as_stated():
    rng = np.random.default_rng(3)
    runs, alpha = 700, 0.05
    whole = causes = failed = 0
    for _ in range(runs):
        found = two_face_test(face_pairs(readings(rng, targets=SPREAD)), alpha)
        whole += not all(c.passed for c in found.components)
        causes += bool(found.explanation.causes)
        failed += not found.passed
    # three independent tests of 1 - 0.95^(1/4) each
    rate = 1 - (1 - alpha) ** 0.75
    assert abs(whole / runs - rate) < 4 * np.sqrt(rate * (1 - rate) / runs)
    assert failed / runs < alpha + 4 * np.sqrt(alpha * (1 - alpha) / runs)
    # eleven parameters at a tenth of a percent each are the upper bound
    assert causes / runs < 0.011 + 4 * np.sqrt(0.011 / runs)


@pytest.mark.parametrize(
    ("parameter", "value"),
    [("x2", 0.8e-3), ("x4", 9e-5), ("x6", 9e-5), ("x9n", 2.5e-4), ("x7", 5e-4)],
)
def test_a_misalignment_is_found_and_named(parameter, value):
    rng = np.random.default_rng(5)
    hits, values, sigmas = 0, [], []
    for _ in range(60):
        found = two_face_test(face_pairs(readings(rng, {parameter: value}, targets=SPREAD)))
        assert not found.passed
        names = [c.parameter for c in found.explanation.causes]
        alike = [a for c in found.explanation.causes for a in c.alternatives]
        assert parameter in names or parameter in alike
        if names == [parameter]:
            hits += 1
            values.append(found.explanation.causes[0].value)
            sigmas.append(found.explanation.causes[0].sigma)
    assert hits >= 50
    # estimates of those that were found are unbiased, as their sigma says
    assert abs(np.mean(values) - value) < 5 * np.mean(sigmas) / np.sqrt(hits)


def test_what_looks_alike_is_named_too():
    """Targets all at one range: the mirror's offset and its tilt do the same."""
    h = np.linspace(0, 5, 8)
    ring = 10 * np.stack([np.cos(h), np.sin(h), 0.0 * h], axis=1)
    given = readings(
        np.random.default_rng(2), {"x6": 2e-4}, targets=ring, stations={"S": np.zeros(3)}
    )
    (cause,) = two_face_test(face_pairs(given)).explanation.causes
    assert {"x3", "x6"} <= {cause.parameter, *cause.alternatives}


def test_targets_twice_are_refused():
    given = readings(np.random.default_rng(2), faces=(1.0, 1.0))
    with pytest.raises(InputError, match="inside has target T0 twice on one face"):
        face_means(given)


def test_means_take_what_there_is():
    given = readings(np.random.default_rng(2))
    some = given.take(np.arange(len(given)) != 4)
    means = face_means(some)
    assert len(means) == 8
    assert means.face.tolist().count(0.0) == 7
    np.testing.assert_allclose(means.covariance[0], np.diag(SIGMA**2))
    np.testing.assert_allclose(means.covariance[1], np.diag(SIGMA**2) / 2)
