"""Variance components: recovered from simulations, and two estimates that must agree."""

from dataclasses import replace

import numpy as np
import pytest

from tests.network.networks import mixed_network
from tests.network.test_textbooks import niemeier
from tribrach.errors import AdjustmentError
from tribrach.network.adjustment import adjust
from tribrach.network.ellipsoids import confidence_factor
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.network.variance_components import VarianceComponents, estimate_components
from tribrach.observations.gnss import GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.simulate.surveying import observe


def overstated(network: Network, factors: dict[str, float], seed: int) -> Network:
    """Observations whose errors are ``factor`` times as large as their sigmas say."""
    truth = adjust(network).state
    honest = replace(
        network,
        observations=tuple(
            replace(o, covariance=o.covariance * factors.get(o.kind, 1.0) ** 2)
            for o in network.observations
        ),
    )
    drawn = observe(honest, truth, np.random.default_rng(seed))
    return replace(
        drawn,
        observations=tuple(
            replace(o, covariance=given.covariance)
            for o, given in zip(drawn.observations, network.observations, strict=True)
        ),
    )


def factors(found: VarianceComponents) -> dict[str, float]:
    return {c.group: c.sigma_factor for c in found.components}


def levels(groups: dict[str, tuple[int, float, float]], seed: int) -> Network:
    """Heights of 15 points by several groups of lines: count, given sigma, true factor."""
    rng = np.random.default_rng(seed)
    heights = rng.uniform(0, 30, 15)
    survey = Survey()
    for k, height in enumerate(heights):
        held = k == 0
        survey.point(
            f"P{k}",
            (0, 0, height if held else np.nan),
            free=(False, False, not held),
            role="control" if held else "free",
        )
    for name, (count, sigma, factor) in groups.items():
        a = rng.integers(0, 15, count)
        b = (a + rng.integers(1, 15, count)) % 15
        rise = heights[b] - heights[a] + factor * sigma * rng.standard_normal(count)
        ends = {"start": [f"P{k}" for k in a], "end": [f"P{k}" for k in b]}
        survey.add(HeightDifferences, values=rise, sigma=sigma, group=name, **ends)
    return survey.network()


def test_factors_of_a_simulation_are_recovered_within_their_sigma() -> None:
    truth = {"line": 1.0, "trigonometric": 2.5, "gnss": 0.5}
    network = levels(
        {"line": (150, 0.001, 1.0), "trigonometric": (150, 0.004, 2.5), "gnss": (80, 0.006, 0.5)}, 1
    )
    found = estimate_components(network, alpha=None)
    assert found.converged
    for c in found.components:
        assert abs(c.sigma_factor - truth[c.group]) < 3.3 * c.sigma_of_factor
        assert c.sigma_of_factor < 0.15 * c.sigma_factor
    assert found.adjustment.posterior_factor == pytest.approx(1.0, abs=1e-4)


def test_the_stated_sigma_of_a_factor_is_that_of_repetitions() -> None:
    groups = {"a": (40, 0.001, 1.0), "b": (30, 0.002, 1.0)}
    both = [
        estimate_components(levels(groups, s), method="helmert", alpha=None).components
        for s in range(40)
    ]
    for k in range(2):
        sample = np.array([found[k].sigma_factor for found in both])
        stated = np.mean([found[k].sigma_of_factor for found in both])
        assert sample.mean() == pytest.approx(1.0, abs=0.08)
        assert sample.std() == pytest.approx(stated, rel=0.35)


@pytest.mark.parametrize("seed", [1, 2])
def test_both_estimates_agree_at_convergence(seed: int) -> None:
    truth = {"direction": 2.0, "slope_distance": 0.6}
    network = overstated(mixed_network().network(), truth, seed)
    simple = estimate_components(network, minimum_redundancy=4, max_iterations=300, alpha=None)
    full = estimate_components(network, minimum_redundancy=4, method="helmert", alpha=None)
    assert simple.converged
    assert full.converged
    assert factors(simple) == pytest.approx(factors(full), rel=1e-4)


def test_full_estimate_of_niemeier() -> None:
    """AC-30 by Helmert's estimate: 0.454 mgon and 5.09 mm."""
    found = estimate_components(
        niemeier().network(), minimum_redundancy=1, method="helmert", alpha=None
    )
    assert 0.5 * factors(found)["direction"] == pytest.approx(0.454, abs=1e-3)
    assert 5 * factors(found)["horizontal_distance"] == pytest.approx(5.09, abs=5e-3)


def test_the_matrix_of_the_full_estimate_is_that_of_the_residual_projector() -> None:
    """``H_ij = |R_ij|^2``: its sum over all groups is the redundancy."""
    from tribrach.network.variance_components import _Groups

    network = levels({"a": (30, 0.001, 1.0), "b": (20, 0.003, 1.0)}, 4)
    adjustment = adjust(network)
    matrix = _Groups(network).helmert_matrix(adjustment)
    design = adjustment.design.toarray()
    projector = np.eye(50) - design @ np.linalg.solve(design.T @ design, design.T)
    parts = [slice(0, 30), slice(30, 50)]
    expected = [[(projector[a, b] ** 2).sum() for b in parts] for a in parts]
    assert matrix == pytest.approx(np.array(expected), rel=1e-8)
    assert matrix.sum() == pytest.approx(adjustment.dof)


def test_a_group_without_enough_redundancy_stays_out_of_it() -> None:
    network = levels({"many": (80, 0.001, 2.0), "few": (2, 0.001, 1.0)}, 5)
    for method in ("foerstner", "helmert"):
        found = estimate_components(network, method=method)  # type: ignore[arg-type]
        few = next(c for c in found.components if c.group == "few")
        assert few.sigma_factor == 1.0
        assert "sigmas kept as given" in few.note
        assert "few" in found.sentences()[0]
        assert factors(found)["many"] == pytest.approx(2.0, rel=0.3)


def test_factors_stop_at_their_limits() -> None:
    network = levels({"wild": (60, 0.001, 50.0), "calm": (60, 0.001, 1.0)}, 6)
    found = estimate_components(network, limits=(0.5, 3.0))
    assert factors(found)["wild"] == pytest.approx(3.0)
    assert "stopped at its limit 3" in found.sentences()[0]


def test_too_few_iterations_are_told() -> None:
    network = levels({"a": (60, 0.001, 5.0), "b": (60, 0.001, 1.0)}, 7)
    found = estimate_components(network, max_iterations=1)
    assert not found.converged
    assert "did not settle" in found.sentences()[-1]


def test_joint_covariances_across_groups_are_refused() -> None:
    survey = Survey()
    for name in "AB":
        survey.point(name)
    one = survey.add(GnssPositions, values=[[0, 0, 0]], sigma=0.01, position=["A"], group="old")
    two = survey.add(GnssPositions, values=[[9, 0, 0]], sigma=0.01, position=["B"], group="new")
    matrix = 1e-4 * (np.eye(6) + 0.5)
    survey.correlate([one] * 3 + [two] * 3, [0] * 6, [0, 1, 2] * 2, matrix)
    with pytest.raises(AdjustmentError, match="ties the groups new and old together"):
        estimate_components(survey.network())


def noisy_levels(seed: int) -> Network:
    """The same two groups of lines, one hardly redundant, with errors of another seed."""
    network = levels({"a": (14, 0.001, 1.0), "b": (14, 0.002, 1.0)}, 3)
    return observe(network, adjust(network).state, np.random.default_rng(seed))


def test_the_simplified_estimate_has_the_sigma_of_the_full_one() -> None:
    """Both have one fixed point, hence one covariance; 1/sqrt(2 r) neglects the other group."""
    simple = estimate_components(
        noisy_levels(1), minimum_redundancy=1, max_iterations=300, alpha=None
    )
    full = estimate_components(noisy_levels(1), minimum_redundancy=1, method="helmert", alpha=None)
    for one, other in zip(simple.components, full.components, strict=True):
        assert one.sigma_of_factor == pytest.approx(other.sigma_of_factor, rel=1e-3)
    b = simple.components[1]
    assert b.sigma_of_factor / b.sigma_factor > 1.06 / np.sqrt(2 * b.redundancy)


@pytest.mark.slow
def test_the_sigma_of_a_factor_over_many_repetitions() -> None:
    """Of the better determined group: 0.275 in 400 repetitions, where 1/sqrt(2 r) is 0.228."""
    found = [
        estimate_components(noisy_levels(seed), minimum_redundancy=1, alpha=None).components[1]
        for seed in range(400)
    ]
    factor = np.array([c.sigma_factor for c in found])
    stated = np.median([c.sigma_of_factor / c.sigma_factor for c in found])
    assert factor.std() == pytest.approx(stated, rel=0.09)


def test_in_large_networks_the_sigma_comes_from_random_vectors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    network = levels({"a": (150, 0.001, 1.0), "b": (100, 0.003, 1.0)}, 4)
    exact = estimate_components(network, alpha=None)
    monkeypatch.setattr("tribrach.network.variance_components.EXACT", 0)
    probed = estimate_components(network, alpha=None)
    for one, other in zip(exact.components, probed.components, strict=True):
        assert one.sigma_of_factor == pytest.approx(other.sigma_of_factor, rel=0.05)


def line_network(
    seed: int, factors: dict[str, float], count: int = 9
) -> tuple[Network, np.ndarray]:
    """Heights of four points, the first held, by lines of a fixed design; true heights."""
    draw = np.random.default_rng(seed)
    heights = np.array([0.0, 3.0, -2.0, 5.0])
    survey = Survey()
    for k, height in enumerate(heights):
        held = k == 0
        survey.point(
            f"P{k}",
            (0, 0, height if held else np.nan),
            free=(False, False, not held),
            role="control" if held else "free",
        )
    for m, (group, factor) in enumerate(factors.items()):
        plan = np.random.default_rng(5 + m)
        a = np.concatenate([np.arange(3), plan.integers(0, 4, count - 3)])
        b = np.where(np.arange(count) < 3, a + 1, (a + plan.integers(1, 4, count)) % 4)
        rise = heights[b] - heights[a] + factor * 1e-3 * draw.standard_normal(count)
        ends = {"start": [f"P{k}" for k in a], "end": [f"P{k}" for k in b]}
        survey.add(HeightDifferences, values=rise, sigma=1e-3, group=group, **ends)
    return survey.network(), heights


def test_a_factor_that_residuals_do_not_tell_from_one_is_left_alone() -> None:
    kept = [
        estimate_components(line_network(seed, {"a": 1.0, "b": 1.0})[0]).components
        for seed in range(12)
    ]
    changed = sum(c.sigma_factor != 1 for found in kept for c in found)
    assert changed <= 4  # 5 % of 24
    found = estimate_components(line_network(3, {"a": 6.0, "b": 1.0})[0])
    assert factors(found)["a"] > 3
    freedom = found.adjustment.freedom(posterior=False)[1:, 2]
    assert np.isfinite(freedom).all()
    assert found.adjustment.network.factors is not None
    # what was known well before is not known worse than its factor is
    assert (freedom >= 2 / found.adjustment.network.factors.covariance.max() * (1 - 1e-9)).all()
    point = found.adjustment.points["P1"]
    assert point.freedom[2] == pytest.approx(freedom[0])


def test_one_group_has_the_degrees_of_freedom_of_its_redundancy() -> None:
    found = estimate_components(line_network(4, {"a": 5.0})[0])
    np.testing.assert_allclose(found.adjustment.freedom(posterior=False)[1:, 2], 6)
    # a common factor changes no weight, and costs nothing but its degrees of freedom
    np.testing.assert_allclose(
        found.adjustment.position_covariances()[1:, 2, 2],
        found.adjustment.cofactor.blocks(np.arange(3)[:, None])[:, 0, 0],
    )


def test_control_is_not_made_better_by_residuals() -> None:
    survey = mixed_network()
    network = survey.network()
    calm = replace(
        network,
        observations=tuple(
            replace(o, covariance=o.covariance * 400) if o.group == "control" else o
            for o in network.observations
        ),
    )
    found = estimate_components(calm, minimum_redundancy=0.5)
    of = {c.group: c for c in found.components}
    if "control" in of:
        assert of["control"].sigma_factor >= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "true", [{"a": 1.0}, {"a": 1.0, "b": 1.0}, {"a": 4.0, "b": 0.25}, {"a": 4.0}]
)
def test_intervals_hold_what_they_say_after_an_estimate(true: dict[str, float]) -> None:
    """Monte Carlo of 600 levellings with right sigmas, and with sigmas that are far off."""
    inside = []
    for seed in range(600):
        network, heights = line_network(seed, true)
        adjustment = estimate_components(network).adjustment
        off = np.abs(adjustment.state.points[1:, 2] - heights[1:])
        sigma = np.sqrt(adjustment.position_covariances()[1:, 2, 2])
        factor = confidence_factor(1, 0.95, adjustment.freedom(posterior=False)[1:, 2])
        inside.append(off <= factor * sigma)
    # three heights of one network go together: 1.3 % is two standard deviations
    assert np.mean(inside) == pytest.approx(0.945, abs=0.018)
