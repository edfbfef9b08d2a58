"""Geometry of stations in words: sectors, lines, spare targets, reach beyond the targets."""

import numpy as np
import pytest

from tests.network.facade import facade
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.registration.geometry_warnings import (
    TargetsAround,
    extrapolation_factor,
    geometry_sentences,
    targets_around,
)


def station(azimuths: list[float], *, levelled: bool = True, rise: float = 1.0) -> TargetsAround:
    """A station at the origin with targets at 20 m by azimuths [degrees], at varying heights."""
    a = np.radians(azimuths)
    heights = rise * np.array([(-1) ** k * (1 + k) for k in range(len(a))])
    targets = np.stack([20 * np.sin(a), 20 * np.cos(a), heights], axis=1)
    names = tuple(f"T{k}" for k in range(len(a)))
    return TargetsAround("S1", np.zeros(3), names, targets, levelled)


@pytest.mark.parametrize(
    ("azimuths", "sector"),
    [([10, 50], 40), ([350, 20], 30), ([0, 120, 240], 240), ([5], 0), ([180, 181, 179], 2)],
)
def test_sector(azimuths: list[float], sector: float) -> None:
    assert np.degrees(station(azimuths).sector) == pytest.approx(sector)


def test_good_geometry_is_silent() -> None:
    assert station([0, 70, 140, 230]).sentences() == []
    assert station([0, 120, 200, 250], levelled=False).sentences() == []


@pytest.mark.parametrize(
    ("azimuths", "levelled", "words"),
    [
        ([0, 60], True, "no more than it takes"),
        ([0, 60, 120], False, "no more than it takes"),
        ([0, 5, 12], True, "lie within 12°"),
        ([0, 172], True, "almost on the line between its two targets (172°)"),
        ([0, 30, 60, 80], True, "on one side of it, within 80°"),
    ],
)
def test_weak_geometry_is_said(azimuths: list[float], levelled: bool, words: str) -> None:
    assert any(words in text for text in station(azimuths, levelled=levelled).sentences())


def test_targets_on_a_line_matter_without_a_compensator() -> None:
    line = np.stack([np.linspace(-30, 30, 5), np.full(5, 20.0), np.full(5, 2.0)], axis=1)
    names = tuple("ABCDE")
    free = TargetsAround("S1", np.zeros(3), names, line, False).sentences()
    assert any("almost on one line" in text for text in free)
    held = TargetsAround("S1", np.zeros(3), names, line, True).sentences()
    assert not any("almost on one line" in text for text in held)


def test_networks() -> None:
    adjustment = adjust(facade().network())
    found = targets_around(adjustment)
    assert [one.station for one in found] == ["S1", "S2"]
    assert found[0].levelled
    assert found[0].names == ("T0", "T1", "T2", "T3", "T4", "T5")
    assert geometry_sentences(adjustment) == []


def test_a_resection_on_two_targets_is_told() -> None:
    survey: Survey = facade()
    network = survey.network()
    for o in network.observations:
        if o.kind == "target_centre":
            s1 = network.start.layout.index("pose", "S1")
            names = [network.start.layout.names["point"][p] for p in o.target]
            o.use[(o.station == s1) & ~np.isin(names, ["T0", "T1"])] = 2
    said = geometry_sentences(adjust(network))
    assert len(said) == 1
    assert "station S1 is tied to 2 targets (T0, T1)" in said[0]


def test_extrapolation_of_a_square() -> None:
    """Targets at the corners of a square of 20 m; a ring of 30 m reaches beyond its sides."""
    corners = np.array([[10, 10, 0], [10, -10, 0], [-10, -10, 0], [-10, 10, 0]], dtype=float)
    angle = np.linspace(0, 2 * np.pi, 721)[:-1]
    ring = 30 * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    # the hull is wider by half a metre on every side
    largest = extrapolation_factor(corners, np.zeros(3), ring, 1.0)
    assert largest == pytest.approx(30 / 10.5, rel=0.01)
    assert extrapolation_factor(corners, np.zeros(3), ring / 4, 1.0) < 1


def test_extrapolation_from_a_line_is_finite() -> None:
    line = np.array([[0, 10, 0], [0, 20, 0]], dtype=float)
    sideways = np.array([[30.0, 10.0, 0.0]])
    along = np.array([[0.0, 19.0, 0.0]])
    assert extrapolation_factor(line, np.zeros(3), sideways) > 10
    assert extrapolation_factor(line, np.zeros(3), along) < 1
