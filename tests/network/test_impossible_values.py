"""Numbers that no survey has, and points in one place: a sentence, before anything overflows."""

from typing import Any

import numpy as np
import pytest

from tribrach.errors import InputError, NotConverged
from tribrach.network.adjustment import adjust
from tribrach.network.observations.distance import Distances
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.observations.zenith import ZenithAngles
from tribrach.network.survey import Survey

FIXED = (False, False, False)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (np.nan, "distance is not a number"),
        (-np.inf, "not a number"),
        (1e300, "is 1e\\+300, beyond"),
    ],
)
def test_measured(value: float, words: str) -> None:
    with pytest.raises(InputError, match=f"net.csv:7: .*{words}"):
        Survey().add(
            Distances,
            values=[10.0, value],
            sigma=0.001,
            start=["A", "A"],
            end=["B", "C"],
            source=["net.csv:6", "net.csv:7"],
        )


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.nan, np.inf, 1e-200, 1e200])
def test_sigmas(sigma: float) -> None:
    """Their squares must neither vanish nor overflow, whichever way they are given."""
    columns: dict[str, Any] = {"start": ["A"], "end": ["B"], "source": ["net.csv:6"]}
    with pytest.raises(InputError, match=r"net.csv:6: sigma of distance is"):
        Survey().add(Distances, values=[10.0], sigma=sigma, **columns)
    with pytest.raises(InputError, match=r"net.csv:6: (sigma|covariance) of distance is"):
        Survey().add(Distances, values=[10.0], covariance=[[[sigma * abs(sigma)]]], **columns)


def test_heights_and_coordinates() -> None:
    with pytest.raises(InputError, match=r"net.csv:2: height target of zenith is -2\.14748e\+09 m"):
        Survey().add(
            ZenithAngles,
            values=[1.5, 1.5],
            sigma=1e-5,
            start=["A", "A"],
            end=["B", "C"],
            height_instrument=1.6,
            height_target=[1.3, -2147483649.0],
            source=["net.csv:1", "net.csv:2"],
        )
    with pytest.raises(InputError, match=r"P has a coordinate of 1e\+200 m"):
        Survey().point("P", (0.0, -1e200, np.nan))


def test_points_in_one_place_have_no_direction() -> None:
    survey = Survey()
    survey.point("A", (5.0, 5.0, 1.0), free=FIXED, role="control")
    survey.point("B", (5.0, 5.0, 1.0), free=(True, False, False))
    survey.point("C", (15.0, 5.0, 1.0), free=(True, False, False))
    survey.add(SlopeDistances, values=[10.0], sigma=0.001, start=["A"], end=["C"])
    survey.add(
        SlopeDistances,
        values=[4.0],
        sigma=0.001,
        start=["A"],
        end=["B"],
        source=["net.csv:9"],
    )
    with pytest.raises(NotConverged, match=r"slope distance A -> B \(net.csv:9\)"):
        adjust(survey.network())
