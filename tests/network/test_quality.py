"""Quality figures against dense algebra and against what blunders really do."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, ncx2, norm

from tests.network.networks import constrained_network, mixed_network, scanner_network
from tribrach.network import reliability
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.ellipsoids import confidence_factor, plan_ellipses, principal_axes
from tribrach.network.quality import GlobalTest, assess
from tribrach.network.separability import confusable
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.simulate.surveying import observe


def noisy(survey: Survey, seed: int = 1) -> Adjustment:
    network = survey.network()
    truth = adjust(network).state
    return adjust(observe(network, truth, np.random.default_rng(seed)))


def dense(adjustment: Adjustment) -> tuple[np.ndarray, np.ndarray]:
    """Weights and residual cofactor matrix."""
    whitener = adjustment.whitener.toarray()
    design = adjustment.assembly.design(adjustment.state, whitened=False).toarray()
    weights = whitener.T @ whitener
    q = adjustment.cofactor.solve(np.eye(adjustment.n_unknowns))
    return weights, np.linalg.inv(weights) - design @ q @ design.T


@pytest.mark.parametrize("survey", [mixed_network, constrained_network])
def test_figures_are_those_of_the_dense_formulas(survey: object) -> None:
    adjustment = noisy(survey())  # type: ignore[operator]
    quality = assess(adjustment)
    weights, q_vv = dense(adjustment)
    s = np.diag(weights @ q_vv @ weights)
    good = quality.controlled
    assert np.allclose(quality.redundancy, np.diag(q_vv @ weights), atol=1e-8)
    assert quality.redundancy.sum() == pytest.approx(adjustment.dof, abs=1e-6)
    w = (weights @ adjustment.residuals)[good] / np.sqrt(s[good])
    assert np.allclose(quality.w[good], w, atol=1e-6)
    assert np.allclose(quality.mdb[good], 4.1321 / np.sqrt(s[good]), rtol=1e-4)
    assert np.allclose(
        quality.tau, quality.w / np.sqrt(adjustment.posterior_factor), equal_nan=True
    )


def test_external_reliability_is_what_an_error_of_that_size_does() -> None:
    survey = mixed_network()
    adjustment = noisy(survey)
    quality = assess(adjustment)
    rows = adjustment.rows
    row = int(np.nanargmax(quality.external))
    table, item, k = (int(a[row]) for a in (rows.table, rows.item, rows.row))
    network = adjustment.network
    o = network.observations[table]
    values = o.values.copy()
    values[item, k] += quality.mdb[row]
    changed = list(network.observations)
    changed[table] = replace(o, values=values)
    shifted = adjust(replace(network, observations=tuple(changed), start=adjustment.state))
    moved = np.linalg.norm(shifted.state.positions - adjustment.state.positions, axis=1)
    assert moved.max() == pytest.approx(quality.external[row], rel=0.01)
    assert int(np.argmax(moved)) == quality.external_position[row]


def test_large_networks_look_at_the_ends_of_each_observation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    adjustment = noisy(mixed_network())
    everywhere = assess(adjustment)
    monkeypatch.setattr(reliability, "solutions_affordable", lambda _: 12)
    at_ends = assess(adjustment)
    assert everywhere.external_exact.all()
    assert at_ends.external_exact.sum() == 3  # the worst are followed everywhere all the same
    good = everywhere.controlled
    assert (at_ends.external[good] <= everywhere.external[good] * (1 + 1e-9) + 1e-12).all()


def test_w_is_standard_normal_without_blunders() -> None:
    network = mixed_network().network()
    truth = adjust(network).state
    rng = np.random.default_rng(3)
    samples = []
    for _ in range(60):
        quality = assess(adjust(observe(network, truth, rng)))
        samples.append(quality.w[quality.redundancy > 0.05])
    sample = np.array(samples)
    count = sample.shape[0]
    variance = (sample**2).sum(axis=0)
    assert (variance < chi2.ppf(1 - 1e-5, count)).all()
    assert (variance > chi2.ppf(1e-5, count)).all()
    share = (np.abs(sample) > norm.ppf(0.975)).mean()
    assert share == pytest.approx(0.05, abs=0.015)


def test_a_wrong_target_fails_its_block_test() -> None:
    survey, _ = scanner_network(np.random.default_rng(5))
    network = survey.network()
    o = network.observations[0]
    values = o.values.copy()
    values[14] += [0.01, -0.01, 0.005]
    adjustment = adjust(replace(network, observations=(replace(o, values=values),)))
    blocks = assess(adjustment).blocks
    worst = int(np.argmax(blocks.statistic))
    assert (blocks.item[worst], blocks.freedom[worst]) == (14, 3)
    assert blocks.critical[worst] == pytest.approx(16.27, abs=0.01)
    assert blocks.statistic[worst] > 30


def loop(error: float) -> Survey:
    """Three levelled lines in a loop: every w has the same size, nothing can be told apart."""
    survey = Survey()
    survey.point("A", (0, 0, 10), free=(False,) * 3, role="control")
    for name in "BC":
        survey.point(name, (0, 0, np.nan), free=(False, False, True))
    rise = {"values": [1.0, 1.0, -2.0 + error], "sigma": 0.001}
    survey.add(HeightDifferences, start=list("ABC"), end=list("BCA"), **rise)
    return survey


def test_a_loop_cannot_tell_which_line_is_wrong() -> None:
    adjustment = adjust(loop(0.02).network())
    said = confusable(adjustment, assess(adjustment))
    assert len(said) == 1
    assert said[0].startswith("cannot tell which of 3 is wrong")
    clean = adjust(loop(0.0).network())
    assert confusable(clean, assess(clean)) == []


def test_ellipses() -> None:
    """AC-37: factors 1.9600, 2.4477, 2.7955; the standard ellipse holds 39.35 %."""
    factors = [confidence_factor(d, 0.95) for d in (1, 2, 3)]
    assert factors == pytest.approx([1.9600, 2.4477, 2.7955], abs=5e-5)
    assert chi2.cdf(1, 2) == pytest.approx(0.3935, abs=5e-5)
    assert chi2.cdf(1, 3) == pytest.approx(0.1987, abs=5e-5)
    assert confidence_factor(2, 0.95, 10**7) == pytest.approx(factors[1], abs=1e-5)
    assert confidence_factor(2, 0.95, 5) > factors[1]
    c = np.diag([4.0, 1.0, 9.0])[None] * 1e-6
    ellipse = plan_ellipses(c)
    assert (ellipse.major[0], ellipse.minor[0]) == pytest.approx((0.002, 0.001))
    assert ellipse.azimuth[0] == pytest.approx(np.pi / 2)
    axes, directions = principal_axes(c)
    assert axes[0] == pytest.approx((0.003, 0.002, 0.001))
    assert np.abs(directions[0]) == pytest.approx(np.eye(3)[[2, 0, 1]])


def test_a_posteriori_observations_are_judged_by_tau() -> None:
    """Sigmas five times too small make every other w suspicious, and no tau."""
    network = mixed_network().network()
    truth = adjust(network).state
    drawn = observe(network, truth, np.random.default_rng(4))
    tight = tuple(replace(o, covariance=o.covariance / 25) for o in drawn.observations)
    adjustment = adjust(replace(drawn, observations=tight))
    prior, posterior = assess(adjustment), assess(adjustment, posterior=True)
    assert (prior.posterior, posterior.posterior) == (False, True)
    assert prior.suspicious.sum() > 5
    assert not posterior.suspicious.any()
    assert posterior.critical == posterior.tau_critical
    assert np.array_equal(posterior.w, prior.w, equal_nan=True)
    assert np.array_equal(posterior.mdb, prior.mdb, equal_nan=True)
    assert prior.blocks.rejected.any()
    assert not posterior.blocks.rejected.any()
    rows = adjustment.results(posterior=True).observations
    assert not rows.suspicious
    assert adjustment.results().observations.suspicious


def test_values_held_out_are_judged_by_student_a_posteriori() -> None:
    """Two heights of one benchmark from another: with one redundancy t is 636.6 at 0.1 %."""
    survey = Survey()
    survey.point("A", (0, 0, 0), free=(False,) * 3, role="control")
    survey.point("B", (0, 0, np.nan), free=(False, False, True))
    survey.add(
        HeightDifferences,
        values=[1.0, 1.001, 1.02],
        sigma=1e-3,
        start=["A"] * 3,
        end=["B"] * 3,
        use=np.array([0, 0, 1], dtype=np.int8),
    )
    adjustment = adjust(survey.network())
    assert adjustment.observations[2].suspicious
    assert not adjustment.results(posterior=True).observations[2].suspicious
    quality = assess(adjustment, posterior=True)
    assert quality.check_critical == pytest.approx(636.6, abs=0.05)
    assert quality.checks.critical == pytest.approx(636.6**2, rel=1e-3)


@pytest.mark.parametrize(("r", "found"), [(10, 0.74), (100, 0.22), (500, 0.08)])
def test_the_global_test_fails_as_often_as_the_method_says(r: int, found: float) -> None:
    """Half of the significance by chance; and one error of the size of its bound."""
    test = GlobalTest.of(1.0, r, 0.05)
    limit = test.upper
    assert test.level == pytest.approx(0.975)
    assert chi2.sf(limit, r) == pytest.approx(0.025)
    assert ncx2.sf(limit, r, 4.132**2) == pytest.approx(found, abs=0.006)


def test_the_confidence_is_that_of_the_global_test() -> None:
    adjustment = noisy(mixed_network())
    for confidence in (0.9, 0.99):
        test = assess(adjustment, confidence=confidence).global_test
        assert test.alpha == pytest.approx(1 - confidence)
        assert test.upper == pytest.approx(chi2.ppf((1 + confidence) / 2, adjustment.dof))
        assert test.level == pytest.approx((1 + confidence) / 2)
        assert f"at {50 * (1 + confidence):g} %" in test.sentence()


def test_residuals_that_are_rounding_leave_sigmas_a_priori() -> None:
    """Heights near 1e6 m close to 1e-10 m: a factor 0.0000 would make every sigma zero."""
    survey = Survey()
    survey.point("A", (0, 0, 1e6 / 3), free=(False,) * 3, role="control")
    survey.point("B", (0, 0, np.nan), free=(False, False, True))
    survey.add(
        HeightDifferences,
        values=[0.1, 0.1, 0.1 + 2e-14],
        sigma=1e-3,
        start=["A"] * 3,
        end=["B"] * 3,
    )
    adjustment = adjust(survey.network())
    assert 0 < adjustment.posterior_factor < 1e-12
    assert not adjustment.scaled(posterior=True)
    values = adjustment.network.observations[0].values
    values[2] += 1e-8  # ten nanometres are no rounding
    assert adjust(adjustment.network).scaled(posterior=True)
