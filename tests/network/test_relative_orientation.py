"""Components of the pose between two stations count for those stations, and for nothing else.

Their ends are poses. With three points, pose number 3 (S4) has the number of the position of S1:
read as positions they tied S1 to a target it never saw and credited it with what S4 observed.
"""

import numpy as np
import pytest

from tribrach.geometry import rotation
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.contributions import contributions
from tribrach.network.survey import Survey
from tribrach.observations.poses import RelativeRotations, RelativeTranslations
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.registration.geometry_warnings import targets_around

POINTS = {"P0": (0.0, 0.0, 0.0), "P1": (30.0, 4.0, 2.0), "P2": (10.0, 40.0, 5.0)}
PLACES = {"S1": (5, 8, 2), "S2": (20, 25, 1), "S3": (12, 5, 3), "S4": (25, 12, 2)}


@pytest.fixture(scope="module")
def adjustment() -> Adjustment:
    """Four stations; the levelled S1 sees two targets, the others all; the base S4 to S2."""
    survey = Survey()
    turns = dict(zip(PLACES, rotation.exp(np.outer([0.1, 1.0, 2.0, 3.0], [0, 0, 1])), strict=True))
    for name, xyz in POINTS.items():
        survey.point(name, xyz, covariance=1e-6 * np.eye(3), role="control")
    for name, place in PLACES.items():
        survey.station(name, translation=place, rotation=turns[name])
        seen = ["P0", "P2"] if name == "S1" else list(POINTS)
        chords = np.array([np.subtract(POINTS[target], place) for target in seen])
        survey.add(
            TargetCentres,
            values=chords @ turns[name],
            sigma=0.001,
            station=[name] * len(seen),
            target=seen,
        )
    survey.add(Inclinations, values=[[0.0, 0.0]], sigma=1e-5, station=["S1"])
    base = turns["S4"].T @ np.subtract(PLACES["S2"], PLACES["S4"])
    survey.add(
        RelativeTranslations, values=base[:1], sigma=0.001,
        start=["S4"], end=["S2"], axis=np.array([[1.0, 0, 0]]),
    )  # fmt: skip
    survey.add(
        RelativeRotations, values=[0.0], sigma=1e-4, start=["S4"], end=["S2"],
        axis=np.array([[0.0, 0, 1]]), reference=(turns["S4"].T @ turns["S2"])[None],
    )  # fmt: skip
    return adjust(survey.network())


def test_a_station_is_tied_to_what_it_saw(adjustment: Adjustment) -> None:
    around = {one.station: one for one in targets_around(adjustment)}
    assert around["S1"].names == ("P0", "P2")
    assert around["S1"].levelled
    # S2 and S4 hold each other as well
    assert set(around) == {"S1", "S3"}


def test_a_station_is_credited_with_its_own(adjustment: Adjustment) -> None:
    own = {
        name: {part.kind for part in contributions(adjustment, name) if part.own} for name in PLACES
    }
    relative = {"relative_translation", "relative_rotation"}
    assert own["S4"] == {"target_centre"} | relative
    assert own["S1"] == {"target_centre", "inclination"}
    assert not (own["S2"] | own["S3"]) & relative


def test_ends_are_the_stations(adjustment: Adjustment) -> None:
    tables = {o.kind: o for o in adjustment.network.observations}
    assert tables["relative_rotation"].ends(adjustment.layout) == [("S4", "S2")]
