"""Weak networks without error are told as weak, and solved where they have a minimum."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.network.networks import free_stations
from tribrach.errors import NotConverged
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Options, adjust
from tribrach.network.survey import Survey
from tribrach.network.weakness import weak_places, weakness_sentences
from tribrach.project import Project
from tribrach.solution import AdjustmentSettings, solve
from tribrach.units import SEC


def within_a_metre(seed: int) -> Survey:
    """One free station; its four targets stand within 1 m at 1 km in the east."""
    rng = np.random.default_rng(seed)
    targets = {f"T{i}": np.array([1000.0, 0, 0]) + rng.uniform(-0.5, 0.5, 3) for i in range(4)}
    return free_stations({"S": (0.0, 0.0, 0.0)}, targets, rng=rng)


@pytest.mark.parametrize("seed", range(8))
def test_targets_within_a_metre_at_a_kilometre(seed: int) -> None:
    """The station swings about its targets by metres: solved, and told as weak, not as wrong."""
    solution = solve(within_a_metre(seed).network(), AdjustmentSettings())
    adjustment = solution.adjustment
    (weak,) = weak_places(adjustment)
    (sentence,) = weakness_sentences(adjustment)
    assert weak.name == "S"
    assert abs(weak.direction[1]) > 0.999
    assert sentence.startswith(
        "S is weak along the azimuth 0 gon, which is geometry and no blunder"
    )
    assert "would hold it" in sentence
    # the truth is at 0, a few of its sigmas away along the weak direction and nowhere else
    error = adjustment.points["S"].xyz
    assert abs(error[1]) < 4 * weak.sigma
    assert 2 < weak.sigma < 12
    texts = [w.text for w in solution.warnings]
    assert sentence[1:] in " ".join(texts)
    assert not [t for t in texts if "exchanged" in t or "one mistake" in t]


def test_the_minimum_is_one() -> None:
    """At the end the gradient is zero against sigma: from there nothing descends."""
    adjustment = adjust(within_a_metre(0).network())
    gradient = adjustment.design.T @ adjustment.whitened_residuals
    sigma = np.sqrt(adjustment.cofactor.entries(*2 * [np.arange(adjustment.n_unknowns)]))
    assert np.abs(adjustment.cofactor.solve(gradient) / sigma).max() < 1e-4


def test_control_of_a_kilometre_does_not_keep_it_from_the_minimum(shared_data: Path) -> None:
    """Coordinates with sigmas of 1 km: the shape is sharp, the place is not."""
    path = shared_data / "faults" / "gauge" / "p.toml"
    if not path.is_file():
        pytest.skip("the project is not there")
    adjustment = adjust(open_job(Project.load(path)).network())
    assert adjustment.dof == 60
    assert adjustment.sigma0_posterior == pytest.approx(1.0254, abs=1e-4)
    (sentence,) = weakness_sentences(adjustment)
    assert sentence.startswith("the network as a whole is weak, which is geometry and no blunder")
    assert "control with smaller sigmas" in sentence
    assert "datum free" in sentence


def test_targets_straight_above_are_no_blunder() -> None:
    """Directions to the zenith say nothing; where no minimum is reached that is what is said."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        targets = {f"T{i}": (0.0, 0.0, 30.0 + i) for i in range(4)}
        survey = free_stations({"S": (0.0, 0.0, 0.0)}, targets, rng=rng)
        try:
            adjust(survey.network())
        except NotConverged as error:
            text = str(error)
            assert "the network is weak" in text
            assert "neither straight above nor below" in text
            assert "look for a blunder" not in text


def test_a_real_blunder_is_not_taken_for_weakness() -> None:
    """A good network with one wild distance is not weak."""
    rng = np.random.default_rng(3)
    targets = {f"T{i}": rng.uniform(-50, 50, 3) for i in range(5)}
    survey = free_stations({"S": (0.0, 0.0, 0.0)}, targets, rng=rng, wild=("T2", 30.0))
    adjustment = adjust(survey.network())
    assert adjustment.sigma0_posterior > 10
    assert not weakness_sentences(adjustment)


def test_a_real_blunder_that_ends_the_search_is_looked_for() -> None:
    """A distance that no place can satisfy, cut off early, in a good geometry."""
    rng = np.random.default_rng(3)
    targets = {f"T{i}": rng.uniform(-50, 50, 3) for i in range(5)}
    survey = free_stations({"S": (0.0, 0.0, 0.0)}, targets, rng=rng, wild=("T2", 30.0))
    with pytest.raises(NotConverged, match="sigma at slope distance S -> T2; look for a blunder"):
        adjust(survey.network(), options=Options(max_iterations=2))


def test_good_networks_are_not_weak() -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        targets = {f"T{i}": rng.uniform(-80, 80, 3) * (1, 1, 0.2) for i in range(6)}
        stations = {f"S{k}": rng.uniform(-30, 30, 3) * (1, 1, 0.1) for k in range(3)}
        adjustment = adjust(free_stations(stations, targets, rng=rng, sigma=3 * SEC).network())
        assert not weakness_sentences(adjustment)
