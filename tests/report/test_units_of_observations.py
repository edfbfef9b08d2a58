"""Values stand in the report in their own unit: those of priors in that of the unknown."""

import numpy as np
import pytest

from tribrach.network.adjustment import adjust
from tribrach.network.observation_rows import observation_rows
from tribrach.network.quality import assess
from tribrach.network.survey import Survey
from tribrach.observations.control import ScalarPriors
from tribrach.observations.sights import SlopeDistances, ZenithAngles
from tribrach.report.numbers import three_digits


def test_a_prior_has_the_unit_of_its_scalar() -> None:
    survey = Survey()
    survey.point("A", (0.0, 0.0, 0.0), free=(False, False, False))
    survey.point("B", (0.0, 100.0, 0.0), free=(False, True, True))
    ends = {"start": ["A", "A"], "end": ["B", "B"]}
    survey.add(SlopeDistances, values=[100.0, 100.001], sigma=0.001, zero="zero", **ends)
    z = np.full(2, np.pi / 2)
    survey.add(ZenithAngles, values=z, sigma=1e-5, refraction_unknown="k", **ends)
    survey.add(ScalarPriors, values=[0.0, 0.0], sigma=[0.002, 0.1], scalar=["zero", "k"])
    survey.scalars["k"] = (0.0, True)
    adjustment = adjust(survey.network())
    rows = observation_rows(adjustment, assess(adjustment))
    assert [row.unit for row in rows] == ["m", "m", "rad", "rad", "m", "1"]


@pytest.mark.parametrize(
    ("value", "text", "column"),
    [(0.01234, "0.0123", "0.0123"), (2.4, "2.4", "2.40"), (999.4, "999", "999"),
     (999.6, "1000", "1000"), (4128.0, "4130", "4130"), (-123456.0, "-123000", "-123000")],
)  # fmt: skip
def test_three_digits_are_never_a_power_of_ten(value: float, text: str, column: str) -> None:
    assert three_digits(value) == text
    assert three_digits(value, zeros=True) == column
