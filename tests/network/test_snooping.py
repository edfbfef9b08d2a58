"""Snooping: what is wrong goes, what is right stays or comes back, and every step is told."""

from dataclasses import replace

import numpy as np
import pytest

from tests.network.networks import mixed_network, scanner_network, trilateration
from tribrach.network.adjustment import adjust
from tribrach.network.blunders import snooping as module
from tribrach.network.blunders.robust import adjust_robust
from tribrach.network.blunders.snooping import snoop
from tribrach.network.network import Datum, Network
from tribrach.network.quality import assess
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.levelling import HeightDifferences
from tribrach.simulate.surveying import observe


def spoilt(network: Network, table: int, item: int, error: object) -> Network:
    """The network with a gross error in one observation."""
    o = network.observations[table]
    values = o.values.copy()
    values[item] += error
    tables = list(network.observations)
    tables[table] = replace(o, values=values)
    return replace(network, observations=tuple(tables))


def drawn(survey: Survey, seed: int) -> Network:
    network = survey.network()
    return observe(network, adjust(network).state, np.random.default_rng(seed))


def active(network: Network) -> int:
    return sum(int((o.use == Use.ACTIVE).sum()) for o in network.observations)


def test_three_blunders_of_different_kinds_are_found_and_nothing_else() -> None:
    """A direction, a distance and a GNSS position; the result is that without them."""
    good = drawn(mixed_network(), 4)
    kinds = [o.kind for o in good.observations]
    wrong = {
        (kinds.index("direction"), 5): 30e-5,
        (kinds.index("slope_distance"), 2): 0.05,
        (kinds.index("gnss_position"), 1): [0.1, -0.08, 0.1],
    }
    bad, without = good, good
    for (table, item), error in wrong.items():
        bad = spoilt(bad, table, item, error)
        without = without.switched([(table, item)], Use.OFF, "left out")
    adjustment, log = snoop(bad)
    assert set(log.removed) == set(wrong)
    truth = adjust(without).state.positions
    assert np.abs(adjustment.state.positions - truth).max() < 1e-6
    assert assess(adjustment).global_test.passed
    for table, item in wrong:
        o = adjustment.network.observations[table]
        assert o.use[item] == Use.OFF
        assert o.reason[item].startswith("snooping: test ")
    # the size of the error is told with its sign: l = true + g
    step = next(s for s in log.steps if s.observation.startswith("slope distance"))
    assert step.gross_error == pytest.approx(0.05, abs=0.01)
    assert "error about" in step.sentence()


def test_a_clean_network_stays_as_it_is() -> None:
    network = drawn(mixed_network(), 5)
    adjustment, log = snoop(network, alpha0=1e-5)
    assert (log.steps, log.removed) == ((), ())
    assert active(adjustment.network) == active(network)


def test_what_was_switched_off_wrongly_comes_back() -> None:
    """Good observations suspected at the start are taken back, the wrong one is not."""
    network = spoilt(drawn(mixed_network(), 6), 2, 0, 0.06)
    suspects = {(2, 0): 20.0, (0, 0): 4.0, (0, 7): 3.5, (1, 3): 3.4}
    adjustment, log = snoop(network, suspects=suspects, alpha0=1e-4)
    assert log.removed == ((2, 0),)
    assert [s.action for s in log.steps].count("taken back") == 3
    reference, _ = snoop(network, alpha0=1e-4)
    assert adjustment.state.positions == pytest.approx(reference.state.positions, abs=1e-7)


def levelling(error: float) -> Survey:
    """Four weighted bench marks, one of them wrong, and the lines between them and two points."""
    survey = Survey()
    heights = dict(zip("ABCDPQ", (10.0, 11.0, 12.0, 13.0, 14.0, 15.0), strict=True))
    for name, height in heights.items():
        control = name in "ABCD"
        survey.point(
            name,
            (0, 0, height + (error if name == "B" else 0)),
            free=(False, False, True),
            covariance=np.diag([1, 1, 0.002**2]) if control else None,
            role="control" if control else "free",
        )
    pairs = ["AP", "BP", "CP", "DP", "AQ", "BQ", "CQ", "DQ", "PQ"]
    survey.add(
        HeightDifferences,
        values=[heights[b] - heights[a] for a, b in pairs],
        sigma=0.001,
        start=[a for a, _ in pairs],
        end=[b for _, b in pairs],
    )
    return survey


def test_wrong_control_is_named_and_kept_and_spares_the_observations_around_it() -> None:
    adjustment, log = snoop(levelling(0.05).network())
    assert log.removed == ()
    assert [s.action for s in log.steps] == ["suspicious control, kept"]
    assert "coordinates B" in log.steps[0].observation
    assert active(adjustment.network) == active(levelling(0.05).network())


def test_wrong_control_is_switched_off_on_request() -> None:
    adjustment, log = snoop(levelling(0.05).network(), include_control=True)
    assert len(log.removed) == 1
    assert adjustment.state.points[4, 2] == pytest.approx(14.0, abs=1e-9)


def loop(error: float) -> Survey:
    survey = Survey()
    survey.point("A", (0, 0, 10), free=(False,) * 3, role="control")
    for name in "BC":
        survey.point(name, (0, 0, np.nan), free=(False, False, True))
    rise = {"values": [1.0, 1.0, -2.0 + error], "sigma": 0.001}
    survey.add(HeightDifferences, start=list("ABC"), end=list("BCA"), **rise)
    return survey


def test_redundancy_never_falls_below_one_and_the_doubt_is_told() -> None:
    adjustment, log = snoop(loop(0.1).network())
    assert adjustment.dof == 1
    assert log.removed == ()
    assert all("nothing would be checked" in s.action for s in log.steps)
    assert len(log.steps[0].alternatives) == 2
    assert "it could as well be height difference" in log.sentences()[0]


def test_the_limit_on_removals_is_told() -> None:
    network = drawn(mixed_network(), 7)
    for item in (0, 4, 9):
        network = spoilt(network, 2, item, 0.08)
    adjustment, log = snoop(network, max_removed=1)
    assert len(log.removed) == 1
    assert "look at the data" in log.steps[-1].action
    assert active(adjustment.network) == active(network) - 1


def test_a_free_network_keeps_its_datum() -> None:
    """The inner constraints still refer to the coordinates given, not to the last solution."""
    network = trilateration(Datum("free")).network()
    survey, _ = scanner_network(np.random.default_rng(9), targets=8)
    network = spoilt(survey.network(), 0, 3, [0.02, 0.0, 0.0])
    # far start coordinates: a restart from the solution would change the datum visibly
    start = network.start
    moved = replace(start, points=start.points + np.random.default_rng(1).normal(0, 0.3, (8, 3)))
    network = network.with_start(moved)
    adjustment, log = snoop(network)
    assert log.removed == ((0, 3),)
    plain = adjust(network.switched([(0, 3)], Use.OFF))
    assert adjustment.state.points == pytest.approx(plain.state.points, abs=1e-8)


def test_large_networks_lose_independent_suspects_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    network = drawn(mixed_network(), 8)
    for table, item, error in ((2, 0, 0.08), (2, 16, 0.08), (3, 2, 0.02)):
        network = spoilt(network, table, item, error)
    one_by_one, _ = snoop(network, alpha0=1e-4)
    monkeypatch.setattr(module, "LARGE", 10)
    monkeypatch.setattr(module, "APART", 0.5)
    together, log = snoop(network, alpha0=1e-4)
    assert set(log.removed) == {(2, 0), (2, 16), (3, 2)}
    assert together.state.positions == pytest.approx(one_by_one.state.positions, abs=1e-7)


def test_robust_suspects_confirmed_by_the_tests() -> None:
    """Two errors that mask each other: the robust estimate points, the tests confirm."""
    network = drawn(mixed_network(), 10)
    for item in (1, 2):
        network = spoilt(network, 2, item, 0.05)
    suspects = adjust_robust(network, "igg3").suspects
    assert {(2, 1), (2, 2)} <= set(suspects)
    _, log = snoop(network, suspects=suspects)
    assert {(2, 1), (2, 2)} <= set(log.removed)
    assert len(log.removed) <= 3
