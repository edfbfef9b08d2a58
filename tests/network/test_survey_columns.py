"""A survey refuses columns that a kind does not have, and ends that are missing."""

from typing import Any

import pytest

from tribrach.errors import InputError
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
