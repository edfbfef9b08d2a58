"""What is looked for in every solution has a key, and is found under it."""

import numpy as np

from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.solution import DIAGNOSES, AdjustmentSettings, solve


def levelling(*, sigma: float = 1e-3, gross: float = 0.0) -> Survey:
    """Two bench marks and a new point, levelled three times from either."""
    survey = Survey()
    for name, height in (("A", 10.0), ("B", 12.0 + gross), ("C", 15.0)):
        survey.point(name, (0, 0, height), role="control", covariance=1e-6 * np.eye(3))
    survey.point("P", (0, 0, 11.0), free=(False, False, True))
    for start, rise in (("A", 1.0), ("B", -1.0), ("C", -4.0)):
        survey.add(
            HeightDifferences, values=[rise] * 3, sigma=sigma, start=[start] * 3, end=["P"] * 3
        )
    return survey


def keys(survey: Survey) -> set[str]:
    return {warning.key for warning in solve(survey.network(), AdjustmentSettings()).warnings}


def test_keys_name_one_diagnosis_each() -> None:
    names = [one.key for one in DIAGNOSES]
    assert len(set(names)) == len(names)
    assert all(names)


def test_what_is_found_is_found_under_its_key() -> None:
    assert "wrong_coordinate" not in keys(levelling())
    assert "wrong_coordinate" in keys(levelling(gross=0.5))
    assert "implausible_sigma" in keys(levelling(sigma=5.0))
