"""Proposals against all combinations; sets and sigmas against what they claim."""

from itertools import combinations

import numpy as np
import pytest

from tests.network.plan_networks import KINDS, candidates, combine, room_network
from tribrach.observations.control import (
    Coordinate,
    ScalarPriors,
    VectorComponentPriors,
    VectorPriors,
)
from tribrach.planning.blocks import join
from tribrach.planning.groups import coming, going, prospect_for
from tribrach.planning.prediction import Criterion, figures, fixed_datum, predict
from tribrach.planning.search import best_moves, propose
from tribrach.planning.weights import needed_precision, needed_sets, reading_groups, scaled


def designs(kind, count=12, datum="control"):
    base = predict(fixed_datum(room_network(datum).network()))
    further, groups = candidates("targets")(None, range(count))
    now = prospect_for(base, Criterion(kind, ("T5", "T6", "T9")), [further])
    return base, now, join(coming(base, now, further, groups))


@pytest.mark.parametrize("kind", KINDS)
def test_the_proposal_is_nearly_the_best_of_all_combinations(kind):
    _, now, blocks = designs(kind)
    found = propose(now, [blocks], 3)
    every = now.judge(combine(blocks, np.array(list(combinations(range(12), 3))))).value
    gains = (every - now.value()) * (-1 if kind != "redundancy" else 1)
    mine = (found.value - now.value()) * (-1 if kind != "redundancy" else 1)
    assert mine >= 0.9 * gains.max() or mine == pytest.approx(gains.max(), abs=1e-9)
    assert found.start == pytest.approx(now.value())
    after = [pick.after for pick in found.picks]
    assert after == sorted(after, reverse=kind != "redundancy")
    assert len({pick.number for pick in found.picks}) == len(found.picks)
    np.testing.assert_allclose(found.single, now.judge(blocks).value)


def test_no_more_is_proposed_than_required():
    _, now, blocks = designs("sigma")
    one = propose(now, [blocks], 1)
    enough = propose(now, [blocks], 5, required=one.value * 1.000001)
    assert [p.number for p in enough.picks] == [p.number for p in one.picks]
    assert propose(now, [blocks], 5, required=now.value()).picks == ()
    assert propose(now, [], 5).value == pytest.approx(now.value())


def test_the_best_move_is_what_a_new_network_says():
    criterion = Criterion("sigma", ("T5", "T6", "T9"))
    base = predict(room_network().network())
    further, groups = candidates("targets")(None, range(8))
    now = prospect_for(base, criterion, [further], ["T7", "T8"])
    blocks = coming(base, now, further, groups)
    moves = best_moves(now, going(base, now, ["T7", "T8"]), blocks)
    assert moves
    assert moves[0].after == min(move.after for move in moves)
    for move in moves:
        gone = ["T7", "T8"][move.gone]
        exact = [
            figures(
                predict(candidates("targets")(room_network(without=gone), [k])[0]), criterion
            ).value("sigma")
            for k in range(8)
        ]
        assert move.after == pytest.approx(min(exact), rel=1e-6)
        assert move.come == int(np.argmin(exact))


@pytest.mark.parametrize("kind", ["sigma", "undetected"])
def test_sets_reach_what_is_required(kind):
    network = room_network("free").network()
    criterion = Criterion(kind, ("T5", "T6", "T9"))
    start = figures(predict(network), criterion).value(kind)
    found = needed_sets(network, criterion, 0.6 * start)
    assert found.reached
    assert found.value <= 0.6 * start * (1 + 1e-6)
    assert found.start == pytest.approx(start)
    assert sum(found.sets.values()) == 3 + len(found.steps)
    # one set fewer anywhere is not enough for the greedy order
    assert found.steps[-1][1] <= 0.6 * start * (1 + 1e-6)
    assert len(found.steps) == 1 or found.steps[-2][1] > 0.6 * start
    # in a free network everything scales: n sets everywhere give a sigma of 1 / sqrt(n)
    whole = scaled(network, lambda o: np.full(o.values.shape, 0.5))
    assert figures(predict(whole), criterion).value(kind) == pytest.approx(start / 2, rel=1e-6)


def test_what_sets_cannot_reach_is_said():
    network = room_network("control").network()
    found = needed_sets(network, Criterion("sigma", ("T5",)), 1e-5, most=3)
    assert not found.reached
    assert max(found.sets.values()) == 3


def test_the_precision_needed_is_what_it_says():
    network = room_network("free").network()
    criterion = Criterion("sigma", ("T5", "T6", "T9"))
    start = figures(predict(network), criterion).value("sigma")
    ranges, angles = needed_precision(network, criterion, 0.8 * start)
    assert ranges.group == "scanner_polar range"
    assert angles.group == "scanner_polar horizontal/zenith"
    assert (ranges.sigma, angles.sigma) == (1e-3, 4e-5)
    for found, rows in ((ranges, [0]), (angles, [1, 2])):
        if np.isnan(found.factor):
            assert found.limit > 0.8 * start
            continue

        def factors(o, rows=rows, found=found):
            out = np.ones(o.values.shape)
            out[:, rows] = found.factor
            return out

        value = figures(predict(scaled(network, factors)), criterion).value("sigma")
        assert value == pytest.approx(0.8 * start, rel=0.01)
        assert value <= 0.8 * start


def test_a_prior_is_no_instrument_that_reads_again():
    """The zero of the EDM took sets and a finer sigma, as if it had been read at a station."""
    survey = room_network("free")
    survey.add(ScalarPriors, values=[0.0], sigma=1e-3, scalar=["x10"], group="calibration")
    survey.add(Coordinate, values=[0.0], sigma=1e-3, position=["T0"], axis=2)
    survey.vectors["arm"] = (np.zeros(3), True)
    survey.add(VectorPriors, values=[np.zeros(3)], sigma=1e-3, vector=["arm"])
    survey.add(VectorComponentPriors, values=[0.0], sigma=1e-3, vector=["arm"], axis=1)
    network = survey.network()
    assert {kind for *_, kind in reading_groups(network)} == {"scanner_polar"}
    criterion = Criterion("sigma", ("T5", "T6", "T9"))
    required = 0.9 * figures(predict(network), criterion).value("sigma")
    assert set(needed_sets(network, criterion, required).sets) == {"S0", "S1", "S2"}
