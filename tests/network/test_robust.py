"""Robust weights: invariance, breakdown, correlated values, what cannot be helped."""

from dataclasses import replace

import numpy as np
import pytest

from tests.network.networks import mixed_network, scanner_network
from tribrach.network.adjustment import adjust
from tribrach.network.blunders.robust import Method, adjust_robust, weight_function
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.simulate.surveying import observe

METHODS: tuple[Method, ...] = ("huber", "danish", "igg3")


def repeated(values: list[float], sigma: float = 0.001) -> Network:
    """One height difference measured many times."""
    survey = Survey()
    survey.point("A", (0, 0, 0), free=(False,) * 3, role="control")
    survey.point("B", (0, 0, np.nan), free=(False, False, True))
    n = len(values)
    survey.add(HeightDifferences, values=values, sigma=sigma, start=["A"] * n, end=["B"] * n)
    return survey.network()


def test_danish_weights() -> None:
    v = np.array([1.0, 2.0, 4.0])
    assert weight_function("danish", v) == pytest.approx((1.0, 1.0, np.exp(-3.0)))
    with pytest.raises(ValueError, match="tukey"):
        weight_function("tukey", v)  # type: ignore[arg-type]


@pytest.mark.parametrize("method", METHODS)
def test_good_observations_keep_their_weights(method: Method) -> None:
    z = np.array([-1.2, -0.5, 0.1, 0.4, 1.2]) * 0.001
    result = adjust_robust(repeated(list(1.0 + z)), method)
    assert (result.weights == 1.0).all()
    height = result.adjustment.state.points[1, 2]
    assert height == pytest.approx(1.0, abs=1e-9)
    assert result.suspects == {}


def test_the_estimate_of_a_repeated_measurement_solves_its_equation() -> None:
    """Huber's location estimate: sum of psi(v / spread) is zero."""
    rng = np.random.default_rng(5)
    values = 1.0 + 0.001 * rng.standard_normal(21)
    values[:4] += 0.008
    result = adjust_robust(repeated(list(values)), "huber")
    # every residual has the spread sigma sqrt(1 - 1/n); the scale is that of the result
    v = result.standardised
    psi = np.clip(v, -1.345, 1.345)
    assert abs(psi.sum()) < 0.01
    assert result.adjustment.state.points[1, 2] == pytest.approx(1.0, abs=0.0008)
    assert set(result.suspects) == {(0, 0), (0, 1), (0, 2), (0, 3)}


def test_a_third_of_gross_errors_is_resisted() -> None:
    rng = np.random.default_rng(6)
    values = 1.0 + 0.001 * rng.standard_normal(20)
    values[:6] += 0.02
    result = adjust_robust(repeated(list(values)), "igg3")
    good = values[6:].mean()
    assert result.adjustment.state.points[1, 2] == pytest.approx(good, abs=3e-4)
    assert (result.weights[:6] < 1e-3).all()
    assert any("the weight 0.00: check it" in s for s in result.sentences())


def test_a_wrong_target_of_a_scan_loses_its_weight() -> None:
    survey, _ = scanner_network(np.random.default_rng(3))
    network = survey.network()
    o = network.observations[0]
    values = o.values.copy()
    values[7] += [0.02, 0.02, -0.02]
    result = adjust_robust(replace(network, observations=(replace(o, values=values),)))
    # its neighbours may stand out a little; it stands out most
    assert max(result.suspects, key=lambda key: result.suspects[key]) == (0, 7)


def test_correlated_values_share_their_weights_symmetrically() -> None:
    """Bifactor: the reweighted covariance is D C D with D = diag(1/sqrt(w)), still definite."""
    network = mixed_network().network()
    network = observe(network, adjust(network).state, np.random.default_rng(1))
    kinds = [o.kind for o in network.observations]
    table = kinds.index("gnss_baseline")
    o = network.observations[table]
    values = o.values.copy()
    values[1] += [0.2, 0.0, 0.0]
    tables = list(network.observations)
    tables[table] = replace(o, values=values)
    spoilt = replace(network, observations=tuple(tables))
    result = adjust_robust(spoilt, "huber")
    rows = result.adjustment.rows
    mine = rows.table == table
    factor = 1 / np.sqrt(result.weights[mine])
    expected = network.joint[0].covariance * np.outer(factor, factor)
    assert result.adjustment.network.joint[0].covariance == pytest.approx(expected, rel=1e-9)
    assert result.weights[mine].min() < 0.3
    assert (table, 1) in result.suspects


def test_little_redundancy_is_told() -> None:
    survey = Survey()
    survey.point("A", (0, 0, 0), free=(False,) * 3, role="control")
    survey.point("B", (0, 0, np.nan), free=(False, False, True))
    ends = {"start": ["A"] * 2, "end": ["B"] * 2}
    survey.add(HeightDifferences, values=[1.0, 1.001], sigma=[[0.0004], [0.001]], **ends)
    warnings = adjust_robust(survey.network()).warnings
    assert "1 of 2 values have redundancy below 0.2" in warnings[0]


def test_weights_that_do_not_settle_are_told() -> None:
    values = [1.0, 1.001, 1.002, 1.02, 1.0005]
    result = adjust_robust(repeated(values), "igg3", max_iterations=1)
    assert "did not settle in 1 iterations" in result.warnings[-1]
