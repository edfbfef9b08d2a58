"""A survey refuses columns that a kind does not have, and ends that are missing."""

from typing import Any

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geometry.rotation import exp
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import Directions, Distances, SlopeDistances

LINE = {"values": [10.0, 20.0], "sigma": 0.001, "source": ["bars.csv:2", "bars.csv:3"]}


def refusal(**columns: Any) -> InputError:
    with pytest.raises(InputError) as raised:
        Survey().add(Distances, **LINE, **columns)
    return raised.value


def test_a_misspelt_end_is_refused() -> None:
    """Beside another table of the kind it ended at the last point, without a word."""
    survey = Survey()
    survey.add(Distances, **LINE, start=["A", "B"], end=["B", "C"])
    with pytest.raises(InputError) as raised:
        survey.add(Distances, values=[10.0], sigma=0.001, start=["A"], finish=["B"])
    assert "a distance has no column 'finish'" in str(raised.value)
    assert "start, end" in str(raised.value)
    assert len(survey.tables()) == 1


def test_a_near_miss_is_named() -> None:
    error = refusal(start=["A", "B"], end=["B", "C"], height_instrumnt=[1.5, 1.5])
    assert error.what == "a distance has no column 'height_instrumnt'"
    assert error.cure is not None
    assert error.cure.startswith("did you mean height_instrument?")


def test_a_missing_end_is_refused() -> None:
    error = refusal(start=["A", "B"])
    assert error.what == "a distance needs the column 'end'"
    assert error.record == "bars.csv:2"


@pytest.mark.parametrize("name", ["", None, -1, 3, float("nan")])
def test_an_end_without_a_name_is_refused(name: Any) -> None:
    error = refusal(start=["A", "B"], end=["B", name])
    assert "the end of a distance is" in error.what
    assert error.record == "bars.csv:3"


def test_one_name_for_each_value() -> None:
    assert "has 3 names for 2 values" in refusal(start=["A", "B", "C"], end=["B", "C"]).what


def test_optional_unknowns_may_be_absent() -> None:
    survey = Survey()
    survey.add(SlopeDistances, **LINE, start=["A", "B"], end=["B", "C"], zero=["", "zero"])
    assert survey.network().observations[0].zero.tolist() == [-1, 0]


def test_a_required_unknown_that_is_no_end() -> None:
    with pytest.raises(InputError, match="a direction needs the column 'orientation'"):
        Survey().add(Directions, values=[1.0], sigma=1e-5, start=["A"], end=["B"])
    with pytest.raises(InputError, match="height difference has no column 'site'"):
        Survey().add(HeightDifferences, values=[1.0], sigma=1e-3, start=["A"], end=["B"], site=None)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"source": ["f:1"]}, "has 1 sources for 2 values"),
        ({"use": [2]}, "the column 'use' of distance has 1 entries for 2 values"),
        ({"sigma": [0.001] * 3}, "has 3 sigmas for 2 values"),
        ({"sigma": "2mm"}, "the sigmas of distance are not all numbers"),
        ({"sigma": None}, "neither sigma nor covariance"),
        ({"values": ["a", "b"]}, "the values of distance are not all numbers"),
        ({"sigma": None, "covariance": [[1e-6]] * 3}, "covariances of the shape"),
    ],
)
def test_columns_of_another_length_or_kind(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as raised:
        Survey().add(Distances, **LINE | wrong, start=["A", "B"], end=["B", "C"])
    assert words in raised.value.what


def test_one_source_holds_for_all() -> None:
    survey = Survey()
    survey.add(Distances, **LINE | {"source": "book"}, start=["A", "B"], end=["B", "C"])
    assert survey.network().observations[0].source.tolist() == ["book", "book"]


def test_a_check_point_moves_nothing() -> None:
    """Its coordinates are held out and compared, whatever sigma they have."""
    survey = Survey()
    survey.point("A", (0, 0, 0), free=(False,) * 3, role="control")
    survey.point("B", (10.03, 0, 0), free=(True, False, False), role="check",
                 covariance=np.eye(3) * 1e-6)  # fmt: skip
    survey.add(Distances, values=[10.0], sigma=0.001, start=["A"], end=["B"])
    adjustment = adjust(survey.network())
    assert adjustment.points["B"].xyz[0] == pytest.approx(10.0, abs=1e-9)
    assert adjustment.points["B"].role == "check"
    with pytest.raises(InputError, match="no role of a point contrl; did you mean control"):
        survey.point("C", role="contrl")
    with pytest.raises(InputError, match="has the shape"):
        survey.point("D", (0, 0, 0), covariance=[1e-6] * 3)


def test_the_rotation_of_a_station_is_one() -> None:
    survey, turn = Survey(), exp(np.array([0.1, -0.2, 2.0]))
    survey.station("S1", rotation=np.round(turn, 4))
    rotation = survey.stations["S1"].rotation
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-14)
    assert rotation == pytest.approx(turn, abs=1e-4)
    for name, wrong in (("S2", 2 * turn), ("S3", turn * [1, 1, -1]), ("S4", np.eye(2))):
        with pytest.raises(InputError, match=f"matrix given for station {name} is not a rotation"):
            survey.station(name, rotation=wrong)
