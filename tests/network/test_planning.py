"""Plans against new factors, closed forms and the surveys that they predict."""

import numpy as np
import pytest

from tests.network.networks import scanner_network
from tests.network.plan_networks import (
    KINDS,
    STATIONS,
    candidates,
    combine,
    places,
    room_network,
    sights,
)
from tribrach.errors import InputError
from tribrach.network.network import Datum
from tribrach.network.reliability import weigh
from tribrach.observations.scanner import TargetCentres
from tribrach.planning.blocks import join
from tribrach.planning.groups import coming, going, prospect_for
from tribrach.planning.prediction import (
    Criterion,
    figures,
    fixed_datum,
    largest_sigma,
    predict,
    redundancy_rows,
)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("what", ["targets", "stations"])
@pytest.mark.parametrize("datum", ["control", "free"])
def test_what_comes_is_judged_as_a_new_factor_judges_it(kind, what, datum):
    survey, add = room_network(datum), candidates(what)
    criterion = Criterion(kind, ("T0", "T3", "T7"), stations=("S0", "S1", "S2"))
    base = predict(fixed_datum(survey.network()))
    further, groups = add(None, range(6))
    now = prospect_for(base, criterion, [further])
    assert now.value() == pytest.approx(figures(base, criterion).value(kind), rel=1e-9)
    blocks = join(coming(base, now, further, groups))
    scores = now.judge(blocks)
    names = base.network.datum.names
    for k, number in enumerate(blocks.number):
        wide, _ = add(room_network(datum), [int(number)])
        if datum == "free":
            wide = wide.with_datum(Datum("free", names))
        exact = figures(predict(wide), criterion).value(kind)
        assert scores.value[k] == pytest.approx(exact, rel=1e-6), number


@pytest.mark.parametrize("kind", KINDS)
def test_several_come_one_after_the_other_or_at_once(kind):
    add = candidates("targets")
    criterion = Criterion(kind, ("T0", "T3", "T7"), stations=("S0", "S1", "S2"))
    base = predict(room_network().network())
    further, groups = add(None, range(6))
    now = prospect_for(base, criterion, [further])
    blocks = join(coming(base, now, further, groups))
    together = combine(blocks, np.array([[0, 2, 5], [1, 3, 4]]))
    numbers = [sorted(int(blocks.number[i]) for i in row) for row in ([0, 2, 5], [1, 3, 4])]
    exact = [
        figures(predict(add(room_network(), chosen)[0]), criterion).value(kind)
        for chosen in numbers
    ]
    np.testing.assert_allclose(now.judge(together).value, exact, rtol=1e-6)
    step = now.changed(blocks, 0).changed(blocks, 2)
    assert step.changed(blocks, 5).value() == pytest.approx(exact[0], rel=1e-6)
    assert step.judge(blocks).value[5] == pytest.approx(exact[0], rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("gone", ["T8", "S2"])
def test_what_goes_is_judged_as_a_new_factor_judges_it(kind, gone):
    criterion = Criterion(kind, ("T0", "T3", "T7"), stations=("S0", "S1"))
    base = predict(fixed_datum(room_network("free").network(), without=["T8", "T9"]))
    now = prospect_for(base, criterion, going_names=["T8", "S2"])
    there = join(going(base, now, ["T8", "S2"]))
    which = ["T8", "S2"].index(gone)
    kept = {k: v for k, v in STATIONS.items() if k != gone}
    rest = room_network("free", stations=kept, without=gone)
    network = rest.network().with_datum(Datum("free", tuple(f"T{i}" for i in range(8))))
    exact = figures(predict(network), criterion).value(kind)
    assert now.judge(there, -1).value[which] == pytest.approx(exact, rel=1e-6)
    after = now.changed(there, which, -1)
    assert after.value() == pytest.approx(exact, rel=1e-6)


def test_what_cannot_be_spared_is_said():
    survey = room_network("control", count=5, stations={"S0": STATIONS["S0"]})
    base = predict(survey.network())
    now = prospect_for(base, Criterion("sigma", ("T0",)), going_names=["S0", "T4"])
    scores = now.judge(join(going(base, now, ["S0", "T4"])), -1)
    # without the only station nothing determines T4, which is no control
    assert np.isnan(scores.value[0])
    assert np.isfinite(scores.value[1])
    assert scores.order().tolist() == [1]


def test_largest_sigma_is_the_largest_eigenvalue():
    rng = np.random.default_rng(0)
    half = rng.normal(size=(500, 3, 3)) * 10 ** rng.uniform(-4, 1, (500, 1, 1))
    c = half @ half.transpose(0, 2, 1)
    exact = np.sqrt(np.linalg.eigvalsh(c)[:, 2])
    np.testing.assert_allclose(largest_sigma(c), exact, rtol=1e-7)
    np.testing.assert_allclose(largest_sigma(np.stack([np.eye(3) * 4, np.zeros((3, 3))])), [2, 0])


def test_redundancies_of_correlated_values_add_up():
    """Target centres with elongated covariances: none is negative, the sum is the redundancy."""
    survey, _ = scanner_network(np.random.default_rng(2))
    along = np.array([3.0, 4.0, 1.0]) / np.sqrt(26)
    survey.add(
        TargetCentres,
        values=np.ones((4, 3)),
        covariance=np.tile(1e-8 * np.eye(3) + 1e-6 * np.outer(along, along), (4, 1, 1)),
        station=["S0"] * 4,
        target=["T0", "T1", "T2", "T3"],
    )
    adjustment = predict(fixed_datum(survey.network()))
    _, share = redundancy_rows(weigh(adjustment))
    assert share.sum() == pytest.approx(adjustment.dof, rel=1e-9)
    assert (share > -1e-9).all()
    assert (share < 1 + 1e-9).all()
    criterion = Criterion("redundancy")
    found = figures(adjustment, criterion).value("redundancy")
    assert found == pytest.approx(share.min())
    assert prospect_for(adjustment, criterion).value() == pytest.approx(found)


def test_a_plan_needs_places():
    survey = room_network()
    survey.station("S9")
    sights(survey, "S9", STATIONS["S0"], ["T0", "T1", "T2"], places()[:3])
    with pytest.raises(InputError, match="station S9 has no approximate place"):
        predict(survey.network())
    with pytest.raises(InputError, match="T77 is no point or station"):
        figures(predict(room_network().network()), Criterion("sigma", ("T77",)))
    with pytest.raises(InputError, match="x2 is no parameter of the network"):
        figures(predict(room_network().network()), Criterion("sigma", parameters=("x2",)))
