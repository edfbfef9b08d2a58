"""Angles of one station alone are told as what they are, with what would make them a network."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import NoStartValues
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.sights import Angles, Directions


def sentences(survey: Survey) -> str:
    with pytest.raises(NoStartValues) as refused:
        adjust(survey.network())
    return " ".join(refused.value.sentences)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("directions", [False, True])
def test_angles_of_one_station(seed: int, directions: bool) -> None:
    rng = np.random.default_rng(seed)
    targets = [f"T{k}" for k in range(int(rng.integers(4, 9)))]
    survey = Survey(datum=Datum("free"))
    if directions:
        survey.add(Directions, values=rng.uniform(0, 6, len(targets)), sigma=1e-5,
                   start=["P"] * len(targets), end=targets,
                   orientation=["o"] * len(targets))  # fmt: skip
    else:
        n = len(targets) - 1
        survey.add(Angles, values=rng.uniform(0, 6, n), sigma=1e-5, start=["P"] * n,
                   end=targets[:-1], foresight=targets[1:])  # fmt: skip
    assert "station adjustment" in (said := sentences(survey))
    assert "taken at P" in said


def test_angles_of_two_stations_are_no_station_adjustment() -> None:
    survey = Survey(datum=Datum("free"))
    targets = ["A", "B", "C", "D"]
    for station in "PQ":
        survey.add(Directions, values=np.arange(4) + ord(station) % 3, sigma=1e-5,
                   start=[station] * 4, end=targets, orientation=[station] * 4)  # fmt: skip
    assert "station adjustment" not in (said := sentences(survey))
    assert "give coordinates" in said


def test_angles_of_a_textbook(shared_data: Path) -> None:
    path = shared_data / "faults" / "networks2" / "24-station-angles" / "station_angles.csv"
    if not path.is_file():
        pytest.skip(f"third-party data are not in {path.parent}")
    said = sentences(observed_part(read_files([path])))
    assert "taken at P" in said
    assert "give coordinates or distances" in said
