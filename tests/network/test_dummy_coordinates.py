"""Set-ups of different names with the same coordinates: placeholders, named once, not used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribrach import adjust
from tribrach.io.survey.formats import read
from tribrach.network.blunders.mistakes import mistakes
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.units import SEC

PLACES = {
    "A": (0.0, 0.0, 10.0),
    "B": (80.0, 5.0, 12.0),
    "C": (60.0, 70.0, 9.0),
    "D": (-10.0, 65.0, 15.0),
}
SAME = (1000.0, 1000.0, 100.0)


def job(given: dict[str, tuple[float, float, float]], between: bool = True) -> Survey:
    """All sights from A, B and C; without those between set-ups, D and E are seen alone."""
    survey = Survey()
    for name, xyz in given.items():
        survey.point(name, xyz)
    survey.datum = Datum("free", tuple(given))
    start, end, hz, v, s = [], [], [], [], []
    places = PLACES | {"E": (30.0, 30.0, 11.0), "F": (25.0, 40.0, 13.0)}
    for a in "ABC":
        for b in places:
            if a == b or (not between and b in "ABC"):
                continue
            d = np.subtract(places[b], places[a])
            start.append(a)
            end.append(b)
            s.append(float(np.linalg.norm(d)))
            hz.append(float(np.arctan2(d[0], d[1])))
            v.append(float(np.arccos(d[2] / s[-1])))
    n = len(s)
    survey.add(Directions, values=hz, sigma=3 * SEC, start=start, end=end, orientation=start)
    survey.add(ZenithAngles, values=v, sigma=3 * SEC, start=start, end=end)
    survey.add(SlopeDistances, values=s, sigma=np.full(n, 0.002), start=start, end=end)
    return survey


@pytest.mark.parametrize("between", [True, False])
def test_the_same_coordinates_of_three_setups_are_not_used(between: bool) -> None:
    """Lengths between the set-ups tell it, and else lengths to common targets."""
    adjustment = adjust(job(dict.fromkeys("ABC", SAME), between))
    (said,) = [w for w in adjustment.warnings if "placeholders" in w]
    assert said.startswith("Points A, B, C are given the same coordinates")
    assert adjustment.network.datum.names == ()
    found = np.array([adjustment.points[n].xyz for n in "ABCD"])
    truth = np.array([PLACES[n] for n in "ABCD"])
    size = np.linalg.norm(found[:, None] - found, axis=2)
    np.testing.assert_allclose(size, np.linalg.norm(truth[:, None] - truth, axis=2), atol=1e-6)


def test_real_coordinates_beside_them_carry_the_datum() -> None:
    given = {"A": SAME, "B": SAME, "C": PLACES["C"], "D": PLACES["D"]}
    adjustment = adjust(job(given))
    (said,) = [w for w in adjustment.warnings if "placeholders" in w]
    assert said.startswith("Points A, B are given")
    assert adjustment.network.datum.names == ("C", "D")
    for name, xyz in PLACES.items():
        np.testing.assert_allclose(adjustment.points[name].xyz, xyz, atol=1e-6)


def test_right_coordinates_are_used_without_a_word() -> None:
    adjustment = adjust(job(PLACES))
    assert not [w for w in adjustment.warnings if "placeholders" in w]
    assert adjustment.network.datum.names == tuple(PLACES)


def test_a_job_of_five_setups_adjusts_and_names_two_heights(shared_data: Path) -> None:
    """Five set-ups at one place; heights entered at the first set-up that nobody else used."""
    path = shared_data / "totalstation" / "same_place_five_setups.gsi"
    if not path.is_file():
        pytest.skip(f"{path.name} is not there")
    survey = read([path])
    said = [w for w in survey.warnings if "placeholders" in w]
    assert len(said) == 1
    assert said[0].startswith("Points 8, 10, 11, 6, 7 are given the same coordinates")
    assert not [w for w in survey.warnings if "fitted to" in w]
    adjustment = adjust(survey)
    assert not [w for w in adjustment.warnings if "placeholders" in w and w not in said]
    first, second = mistakes(adjustment).sentences
    assert "the height of instrument at 8 (1.6450 m)" in first
    assert "the height of target at 9 (1.4210 m)" in second
    assert "too high" in first
    assert "too high" in second
