"""Check points that were written otherwise are recognised; plain disagreement is not explained."""

from collections.abc import Callable

import numpy as np
import pytest

from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.misread_checks import misread_checks
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssPositions
from tribrach.solution import AdjustmentSettings, adjust_network

TRUTH = {"C1": (512.3, 148.9, 33.4), "C2": (431.7, 260.2, 35.1), "C3": (380.4, 95.6, 31.8)}


def survey(
    change: Callable[[np.ndarray], np.ndarray], wrong: tuple[str, ...] = tuple(TRUTH)
) -> Survey:
    """Three points measured twice with 5 mm, and check coordinates, some written otherwise."""
    rng = np.random.default_rng(2)
    out = Survey()
    for line, (name, x) in enumerate(TRUTH.items()):
        given = change(np.array(x)) if name in wrong else np.array(x)
        out.point(
            name,
            given,
            covariance=1e-6 * np.eye(3),
            role="check",
            source=f"check.csv:{line + 2}",
        )
    values = np.repeat(np.array(list(TRUTH.values())), 2, axis=0)
    values += rng.normal(0, 0.005, values.shape)
    out.add(GnssPositions, values=values, sigma=0.005, position=np.repeat(list(TRUTH), 2).tolist())
    return out


def adjusted(made: Survey) -> Adjustment:
    """The adjusted network of a survey."""
    return adjust(made.network())


READINGS = {
    "with E and N exchanged:": lambda x: x[[1, 0, 2]],
    "with the other sign of N": lambda x: x * [1, -1, 1],
    "with the other signs of E and N": lambda x: x * [-1, -1, 1],
    "in feet": lambda x: x / 0.3048,
    "in millimetres": lambda x: x * 1000,
    "in kilometres": lambda x: x / 1000,
    "with the height in feet": lambda x: x / [1, 1, 0.3048],
    "with E and N exchanged, in feet": lambda x: x[[1, 0, 2]] / 0.3048,
    "with E and N exchanged and the sign of E turned": lambda x: np.array([x[1], -x[0], x[2]]),
}


@pytest.mark.parametrize("words", READINGS)
def test_what_was_written_otherwise_is_recognised(words: str) -> None:
    (sentence,) = misread_checks(adjusted(survey(READINGS[words])))
    assert sentence.startswith("check points C1 (check.csv:2), C2 (check.csv:3), C3 (check.csv:4)")
    assert f"agree if read {words}" in sentence
    assert "against 7.8, as given" in sentence


def test_feet_are_told_from_survey_feet_where_that_matters() -> None:
    """Two parts in a million are 1 mm at 500 m: either fits, and both are named."""
    (sentence,) = misread_checks(adjusted(survey(READINGS["in feet"])))
    assert "; also in US survey feet; correct the file" in sentence


def test_one_of_three() -> None:
    (sentence,) = misread_checks(adjusted(survey(lambda x: x[[1, 0, 2]], ("C2",))))
    assert sentence.startswith("check point C2 (check.csv:3) agrees if read with E and N exchanged")


@pytest.mark.parametrize("change", [lambda x: x, lambda x: x + 0.3, lambda x: x + 1000])
def test_what_agrees_or_is_simply_wrong_is_not_explained(
    change: Callable[[np.ndarray], np.ndarray],
) -> None:
    assert misread_checks(adjusted(survey(change))) == []


def test_the_report_says_it() -> None:
    network = survey(lambda x: x[[1, 0, 2]]).network()
    warnings = adjust_network(network, AdjustmentSettings()).warnings
    assert any("agree if read with E and N exchanged" in text for text in warnings)
