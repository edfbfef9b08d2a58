"""Standard deviations that no instrument has are told with their line, reasonable ones are not."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.io.survey.formats import read_files
from tribrach.network.plausible_sigmas import held_azimuths, implausible_sigmas
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.poses import RelativePoses
from tribrach.observations.sights import Azimuths, Directions, SlopeDistances
from tribrach.units import SEC

ENDS = {"start": ["A", "A"], "end": ["B", "C"], "source": ["tps.csv:2", "tps.csv:3"]}


def sights(sigma: object) -> Survey:
    survey = Survey()
    survey.add(Directions, values=[0.1, 0.2], sigma=sigma, orientation=["o"] * 2, **ENDS)
    return survey


@pytest.mark.parametrize(
    ("sigma", "words"),
    [
        (0.0003 * SEC, "0.0003 arc seconds, which no instrument reaches"),
        (np.radians(100), "100 degrees, which is no measurement"),
    ],
)
def test_angles(sigma: float, words: str) -> None:
    (sentence,) = implausible_sigmas(sights([1.0 * SEC, sigma]).network())
    assert sentence.startswith("direction A -> C (tps.csv:3) has a standard deviation of " + words)
    assert "check its unit, there or with the instrument" in sentence
    (both,) = implausible_sigmas(sights(sigma).network())
    assert "direction A -> B (tps.csv:2) and 1 more have a standard deviation of" in both


@pytest.mark.parametrize("sigma", [0.1 * SEC, 1 * SEC, 60 * SEC, np.radians(1)])
def test_angles_of_all_instruments(sigma: float) -> None:
    assert implausible_sigmas(sights(sigma).network()) == []


@pytest.mark.parametrize(("sigma", "told"), [(1e-6, True), (1e-5, False), (20.0, False)])
def test_control(sigma: float, told: bool) -> None:
    """A micrometre is that of no coordinates; loose control is what somebody wanted."""
    survey = sights(1 * SEC)
    survey.point("A", (0, 0, 0), covariance=sigma**2 * np.eye(3), source="control.csv:2")
    found = implausible_sigmas(survey.network())
    assert len(found) == told
    if told:
        assert "coordinates A (control.csv:2) has a standard deviation of 0.001 mm" in found[0]


@pytest.mark.parametrize(
    ("sigma", "told"), [(1e-7, True), (1e-5, False), (0.05, False), (2.0, True)]
)
def test_lengths(sigma: float, told: bool) -> None:
    for kind in (SlopeDistances, HeightDifferences):
        survey = Survey()
        survey.add(kind, values=[10.0, 20.0], sigma=sigma, **ENDS)
        assert len(implausible_sigmas(survey.network())) == told


def test_code_solutions_of_receivers_are_metres() -> None:
    survey = Survey()
    survey.add(GnssPositions, values=[[0, 0, 0]], sigma=5.0, position=["A"])
    assert implausible_sigmas(survey.network()) == []


def test_a_sigma_in_degrees_that_a_file_calls_arc_seconds(tmp_path: Path) -> None:
    """1 arc second is 0.0003 degrees."""
    path = tmp_path / "tps.csv"
    path.write_text("from,to,direction_gon,sigma_arcsec\nA,B,10,0.0003\nA,C,20,0.0003\n")
    (sentence,) = implausible_sigmas(read_files([path]).network())
    assert "direction A -> B (tps.csv:2) and 1 more" in sentence


def test_an_azimuth_may_be_held_by_its_sigma() -> None:
    """Textbooks turn a network by one azimuth with a sigma of 0.001 arc seconds."""
    survey = Survey()
    ends = {"start": ["A", "A"], "end": ["B", "C"], "source": ["tps.csv:2", "tps.csv:3"]}
    survey.add(Azimuths, values=[0.1, 0.2], sigma=[0.001 * SEC, 5 * SEC], **ends)
    network = survey.network()
    assert implausible_sigmas(network) == []
    (sentence,) = held_azimuths(network)
    assert sentence.startswith("azimuth A -> B (tps.csv:2) has a standard deviation of 0.001 arc")
    assert "taken as held exactly" in sentence


def test_a_value_that_counts_for_nothing() -> None:
    survey = Survey()
    survey.add(SlopeDistances, values=[10.0, 20.0], sigma=[3.0, 0.001], **ENDS)
    (sentence,) = implausible_sigmas(survey.network())
    assert "3 m, which is no survey measurement: check its unit" in sentence
    assert sentence.endswith("what is to count for nothing is better left out")


def test_a_pose_from_clouds_may_leave_directions_open() -> None:
    """Along a facade nothing holds two clouds; that is geometry, and no unit is asked for."""
    survey = Survey()
    for name in ("S1", "S2"):
        survey.station(name)
    sigmas = np.array([1e3, 0.002, 0.002, 1e-5, 2.0, 1e-5])
    survey.add(
        RelativePoses, values=np.zeros((1, 6)), covariance=[np.diag(sigmas**2)],
        rotation=[np.eye(3)], start=["S1"], end=["S2"], source=["clouds S1 - S2"],
    )  # fmt: skip
    assert implausible_sigmas(survey.network()) == []
