"""What nothing checks in given coordinates is said; control that is checked is not spoken of."""

from dataclasses import replace

import numpy as np
import pytest

from tests.network.test_control_mistakes import CONTROL, network
from tribrach.network.adjustment import adjust
from tribrach.network.datum_control import unchecked_control
from tribrach.network.given_coordinates import given_coordinates, released
from tribrach.network.network import Datum, Network
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.levelling import HeightDifferences
from tribrach.solution import AdjustmentSettings, adjust_network


def kept(role: str, *names: str, heights: tuple[str, ...] = (), seed: int = 1) -> Network:
    """The network of seven control points with plan of some of them and heights of others."""
    whole = network(role, seed)
    adjustment = adjust(whole)
    for g in given_coordinates(adjustment).items:
        if g.point not in (heights if g.axis == 2 else names):
            whole = released(whole, (g,)) if g.held else whole
    return whole


@pytest.mark.parametrize("role", ["fixed", "control"])
def test_control_that_the_observations_check_is_not_spoken_of(role: str) -> None:
    assert unchecked_control(adjust(network(role))) == []


def test_two_points_check_their_distance_only() -> None:
    (sentence,) = unchecked_control(adjust(kept("fixed", "P0", "P3", heights=("P0", "P3"))))
    assert "only P0 and P3 fix the horizontal datum" in sentence
    assert "checks the distance between them and nothing else" in sentence
    assert "give a third control point" in sentence
    three = kept("fixed", "P0", "P3", "P5", heights=("P0", "P3"))
    assert unchecked_control(adjust(three)) == []


def test_one_bench_mark_checks_nothing() -> None:
    found = unchecked_control(adjust(kept("fixed", *CONTROL, heights=("P2",))))
    assert found == [
        "the given height of P2 is checked by nothing: an error there shifts or turns everything "
        "unseen; give further control, or check points"
    ]


def test_the_least_that_a_datum_takes_checks_nothing_at_all() -> None:
    """Levelling from one bench mark, with and without another held out as a check."""
    for check in (False, True):
        survey = Survey()
        survey.point("A", (0, 0, 10.0), free=(False,) * 3, role="control")
        survey.point("B", (0, 0, 11.0), free=(False, False, True),
                     covariance=1e-6 * np.eye(3) if check else None,
                     role="check" if check else "free")  # fmt: skip
        survey.add(
            HeightDifferences, values=[1.0, 1.001], sigma=1e-3, start=["A"] * 2, end=["B"] * 2
        )
        (sentence,) = unchecked_control(adjust(survey.network()))
        assert "the given coordinates of A are checked by nothing" in sentence
        assert ("only the check points would show it" in sentence) == check


def test_weighted_control_without_redundancy_is_named_too() -> None:
    good = network("control")
    table = next(k for k, o in enumerate(good.observations) if o.group == "control")
    o = good.observations[table]
    use = np.where(np.arange(len(o)) < 2, Use.ACTIVE, Use.OFF).astype(np.int8)
    tables = list(good.observations)
    tables[table] = replace(o, use=use)
    (sentence,) = unchecked_control(adjust(replace(good, observations=tuple(tables))))
    assert "only P0 and P1 fix the horizontal datum" in sentence


def test_free_networks_have_no_control_to_check() -> None:
    assert unchecked_control(adjust(network("control").with_datum(Datum("free")))) == []


def test_the_report_has_it_on_top() -> None:
    content = adjust_network(kept("fixed", "P0", "P3", heights=("P0",)), AdjustmentSettings())
    assert any("fix the horizontal datum" in text for text in content.warnings)
    assert any("the given height of P0 is checked by nothing" in text.lower().replace("p0", "P0")
               for text in content.warnings)  # fmt: skip
