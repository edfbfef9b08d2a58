"""Content of the report against closed forms."""

import numpy as np
import pytest
from scipy.stats import chi2, f, norm

from tests.report.cases import (
    levelled_without_residuals,
    levelling,
    mean_of_two,
    scanner,
    scanner_content,
)
from tribrach.network.adjustment import adjust
from tribrach.network.blunders.snooping import snoop
from tribrach.network.network import Datum
from tribrach.network.quality import assess, check_covariances
from tribrach.network.variance_components import estimate_components
from tribrach.observations.base import Use
from tribrach.report import text
from tribrach.report.build import build
from tribrach.report.chapters import CHAPTERS, named
from tribrach.report.chapters.points import Uncertainty
from tribrach.report.chapters.stations import attitude
from tribrach.report.json_result import network
from tribrach.report.warnings import Severity, warned


def test_levelling_loop_has_the_numbers_of_the_textbook() -> None:
    content = levelling()
    summary = content.summary
    assert (summary.n_observations, summary.n_unknowns, summary.dof) == (3, 2, 1)
    assert summary.vtpv == pytest.approx(3.0)
    assert summary.sigma0_posterior == pytest.approx(np.sqrt(3))
    heights = {p.name: p.xyz[2] for p in content.points}
    assert heights == pytest.approx({"A": 10.0, "B": 11.0, "C": 12.0})
    for row in content.observations:
        assert row.residual == pytest.approx(-1e-3)
        assert row.redundancy == pytest.approx(1 / 3)
        assert row.w == pytest.approx(-np.sqrt(3))
        assert row.tau == pytest.approx(-1.0)
        assert row.mdb == pytest.approx(4.132e-3 * np.sqrt(3), rel=1e-3)
    # an error of the MDB in A-B lifts B by two thirds of it
    assert content.observations[0].external == pytest.approx(
        4.132e-3 * np.sqrt(3) * 2 / 3, rel=1e-3
    )
    assert content.observations[0].external_at == "B"
    assert [row.source for row in content.observations] == [
        "loop.csv:2",
        "loop.csv:3",
        "loop.csv:4",
    ]


def test_sigma_and_interval_of_a_levelled_height() -> None:
    b = levelling(confidence=0.9).points[1]
    assert b.sigma == (None, None, pytest.approx(1e-3 * np.sqrt(2 / 3)))
    assert b.height_interval == pytest.approx(norm.ppf(0.95) * 1e-3 * np.sqrt(2 / 3))
    assert b.xyz[:2] == (None, None)
    assert b.ellipse is None
    assert b.ellipsoid is None


@pytest.mark.parametrize(("readings", "reason"), [(1, "no redundancy"), (3, "are zero")])
def test_posterior_without_residuals_stays_a_priori_and_says_so(readings: int, reason: str) -> None:
    adjustment = levelled_without_residuals(readings)
    assert (adjustment.dof, adjustment.vtpv) == (readings - 1, 0.0)
    assert adjustment.variance_factor(posterior=True) == 1.0
    assert adjustment.scale(posterior=True) == "a priori"
    assert adjustment.results(posterior=True).scale == "a priori"
    content = build(adjustment, assess(adjustment), date="2026-01-01", posterior=True)
    assert (content.scaled, content.origin, content.variance_factor) == (False, "a priori", 1.0)
    assert "are a priori" in content.sigma_origin
    assert reason in content.sigma_origin
    assert network(content)["sigma0"]["covariances"] == "prior"
    b = content.points[1]
    assert b.sigma[2] == pytest.approx(1e-3 / np.sqrt(readings))
    # the factor of the normal distribution, not of Student's with this redundancy
    assert b.height_interval == pytest.approx(norm.ppf(0.975) * b.sigma[2])


def test_posterior_scales_sigmas_by_sigma0_and_says_so() -> None:
    prior, posterior = levelling(), levelling(posterior=True)
    ratio = posterior.points[1].sigma[2] / prior.points[1].sigma[2]
    assert ratio == pytest.approx(np.sqrt(3))
    assert "a posteriori" in posterior.sigma_origin
    assert "1.7321" in posterior.sigma_origin
    assert "a priori" in prior.sigma_origin
    # what tests observations stays a priori
    assert posterior.observations[0].w == prior.observations[0].w


def test_held_point_is_control_and_named_in_the_datum() -> None:
    content = levelling()
    assert [p.role for p in content.points] == ["control", "free", "free"]
    assert "A" in content.datum.sentence
    assert content.control[0].use == "held"


def test_check_point_difference_has_the_sigma_of_both() -> None:
    content = mean_of_two()
    check = next(c for c in content.control if c.use == "check")
    assert check.difference == pytest.approx((0.0, -0.010, 0.0), abs=1e-9)
    assert check.difference_sigma == pytest.approx((1e-3 * np.sqrt(1.5),) * 3)
    assert check.verdict is not None
    assert check.verdict.statistic == pytest.approx(100 / 1.5)
    assert check.verdict.limit == pytest.approx(chi2.ppf(0.95, 3))
    assert not check.verdict.agrees
    row = next(o for o in content.observations if o.state == "check" and o.component == "N")
    assert row.w == pytest.approx(-10 / np.sqrt(1.5))
    assert np.isnan(row.redundancy)
    assert any("P" in text and "not agree" in text for text in content.warnings)


def test_control_difference_has_the_sigma_of_the_residual() -> None:
    first = mean_of_two().control[0]
    assert first.use == "weighted"
    assert first.difference[0] == pytest.approx(1.5e-3)
    assert first.difference_sigma[0] == pytest.approx(1e-3 / np.sqrt(2))
    assert first.verdict is not None
    assert first.verdict.statistic == pytest.approx(4.5)


def test_plan_ellipse_and_ellipsoid_of_equal_sigmas_are_round() -> None:
    point = mean_of_two().points[0]
    assert point.ellipse is not None
    assert point.ellipsoid is not None
    radius = 1e-3 / np.sqrt(2)
    assert point.ellipse.major == pytest.approx(2.4477 * radius, rel=1e-4)
    assert point.ellipse.minor == pytest.approx(2.4477 * radius, rel=1e-4)
    assert point.ellipsoid.axes == pytest.approx((2.7955 * radius,) * 3, rel=1e-4)


def test_switched_off_observation_stays_with_its_reason() -> None:
    content = scanner_content()
    off = [o for o in content.observations if o.state == "off"]
    assert len(off) == 1
    assert off[0].reason.startswith("prism")
    assert off[0].residual == pytest.approx(-0.5, abs=0.01)
    assert np.isnan(off[0].w)
    assert off[0].source == "tps.csv:9"
    assert content.summary.n_off == 1


def test_counts_of_kinds_add_up_to_the_redundancy() -> None:
    content = scanner_content()
    total = sum(k.redundancy or 0.0 for k in content.summary.kinds)
    assert total == pytest.approx(content.summary.dof, abs=1e-8)
    assert sum(k.active for k in content.summary.kinds) == content.summary.n_observations


def test_orientation_unknown_stands_at_its_point() -> None:
    unknown = next(u for u in scanner_content().unknowns if u.name == "circle T0")
    assert (unknown.role, unknown.at, unknown.unit) == ("orientation", "T0", "rad")
    assert unknown.value == pytest.approx(0.5, abs=1e-3)


def test_single_unknowns_are_numbers_in_their_columns() -> None:
    (table,) = (one for one in scanner_content().tables() if one.name == "unknowns")
    value, sigma = table.columns[3:5]
    one = all(len(u.values) == 1 for u in scanner_content().unknowns)
    assert one == value.numeric == sigma.numeric
    (row,) = (row for row in table.rows if row.cells[0].text == "circle T0")
    assert [cell.unit for cell in row.cells[3:5]] == ["gon", "mgon"]
    assert float(row.cells[3].text) == pytest.approx(0.5 * 200 / np.pi, abs=0.1)


def test_a_level_axis_has_the_azimuth_of_the_ellipse() -> None:
    covariances = np.zeros((3, 3, 3))
    # to the south-east, the same with its other end up, and one that is inclined to the south
    for k, (azimuth, elevation) in enumerate(((135, 1e-3), (135, -1e-3), (180, 30))):
        a, e = np.radians([azimuth, elevation])
        axis = np.array([np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), np.sin(e)])
        covariances[k] = 1e-6 * np.eye(3) + 8e-6 * np.outer(axis, axis)
    found = Uncertainty(covariances, np.full((3, 3), np.inf), scanner_content().settings)
    level = [found.ellipsoid(k) for k in (0, 1)]
    for k, one in enumerate(level):
        assert one is not None
        plan = found.ellipse(k)
        assert plan is not None
        assert np.degrees([one.azimuth, plan.azimuth]) == pytest.approx([135, 135], abs=1e-6)
    inclined = found.ellipsoid(2)
    assert inclined is not None
    assert np.degrees([inclined.azimuth, inclined.elevation]) == pytest.approx([180, 30])


def test_attitude_against_central_differences() -> None:
    from tribrach.geometry import rotation

    rng = np.random.default_rng(3)
    r = rotation.exp(rng.uniform(-1.2, 1.2, (20, 3)))
    given = attitude(r)
    for k in range(3):
        d = np.zeros(3)
        d[k] = 1e-6
        forward, back = attitude(rotation.exp(d) @ r), attitude(rotation.exp(-d) @ r)
        turned = (forward.angles - back.angles + np.pi) % (2 * np.pi) - np.pi
        assert turned / 2e-6 == pytest.approx(given.derivative[:, :, k], abs=1e-7)


def test_attitude_of_a_scanner_that_leans_towards_east() -> None:
    from tribrach.geometry import rotation

    # x axis towards north, then everything leans by 0.1 towards east (a turn about N)
    r = rotation.exp(np.array([0.0, 0.1, 0.0])) @ rotation.exp(np.array([0.0, 0.0, np.pi / 2]))
    angles = attitude(r[None]).angles[0]
    assert angles[0] % (2 * np.pi) == pytest.approx(0.0, abs=1e-12)
    assert angles[1:] == pytest.approx([0.0, 0.1, 0.1], abs=1e-12)


def test_level_scanner_has_no_tilt_direction_but_no_error_either() -> None:
    flat = attitude(np.eye(3)[None])
    assert flat.angles[0] == pytest.approx([np.pi / 2, 0, 0, 0])
    assert np.isfinite(flat.derivative).all()


def test_check_covariance_is_that_of_prediction_and_measurement() -> None:
    adjustment = scanner()
    o = adjustment.network.observations[-1]
    assert o.kind == "coordinates"
    items = np.array([0, 2])
    got = check_covariances(adjustment, o, items)
    for k, i in enumerate(items):
        name = o.ends(adjustment.layout)[i][0]
        assert got[k] == pytest.approx(o.covariance[i] + adjustment.covariance(name), rel=1e-6)


def test_free_network_says_in_which_datum_sigmas_hold() -> None:
    adjustment = adjust(scanner().network.with_datum(Datum("free", ("T1", "T2", "T3"))))
    content = build(adjustment, assess(adjustment))
    assert "T1, T2, T3" in content.datum.sentence
    assert content.datum.kind == "free"
    off = [c for c in content.control if c.use == "off"]
    assert len(off) == 3
    assert all(c.verdict is None and c.reason for c in off)


def test_logs_of_snooping_and_components_are_listed() -> None:
    network = scanner().network
    table = [o.kind for o in network.observations].index("target_centre")
    network.observations[table].values[3, 1] += 0.03
    adjustment, log = snoop(network)
    found = estimate_components(adjustment.network, alpha=None)
    content = build(found.adjustment, assess(found.adjustment), snooping=log, components=found)
    assert "T3" in content.snooping[0].observation
    assert {c.group for c in content.components} >= {"target_centre", "control"}
    off = [o for o in content.observations if o.state == "off" and o.kind == "target_centre"]
    # what another observation explains as well stays in
    assert len(off) == (0 if log.steps[0].undecided else 3)
    assert all("snooping" in o.reason for o in off)


def test_only_used_states_appear() -> None:
    states = {o.state for o in scanner_content().observations}
    assert states == {"active", "off"}
    assert int(Use.OFF) == 2


def test_warnings_come_by_weight_and_keep_their_order_within() -> None:
    """Who warns first does not decide where a warning stands."""
    adjustment = scanner()
    given = [
        *warned(Severity.NOTE, ["a note"]),
        *warned(Severity.WEAK, ["weak here", "weak there"]),
        *warned(Severity.INPUT, ["traverse.gsi:3: a line was left out"]),
        *warned(Severity.NOTE, ["a note"]),
    ]
    shown = build(adjustment, assess(adjustment), warnings=given).warnings
    at = [shown.index(text) for text in ("traverse.gsi:3: a line was left out.", "Weak here.",
                                         "Weak there.", "A note.")]  # fmt: skip
    assert at[0] == 0
    assert at == sorted(at)
    assert shown.count("A note.") == 1
    # what is off asks for nothing and is no warning
    assert not any("switched off" in text for text in shown)
    chapter = build(adjustment, assess(adjustment)).chapter("adjustment")
    assert chapter is not None
    assert any("switched off" in sentence for sentence in chapter.sentences)


def test_every_subject_has_a_key_of_its_own_and_a_model_for_its_data() -> None:
    declared = [named(name) for name in CHAPTERS]
    assert [subject.key for subject in declared] == list(CHAPTERS)
    content = scanner_content()
    modelled = {subject.key for subject in declared if subject.model is not None}
    with_data = {c.key or c.name for c in content.chapters if c.data is not None}
    assert with_data <= modelled


def test_the_verdict_on_a_check_point_uses_f_a_posteriori() -> None:
    """Two given coordinates 3 mm apart, one check 10 mm off; three redundancies."""
    adjustment = mean_of_two().adjustment
    quality = assess(adjustment, posterior=True)
    content = build(adjustment, quality, date="2026-01-01", posterior=True)
    check = next(c for c in content.control if c.use == "check")
    factor = 4.5 / 3
    assert check.verdict is not None
    assert check.verdict.statistic == pytest.approx(10**2 / 1.5 / factor)
    assert check.verdict.limit == pytest.approx(3 * f.ppf(0.95, 3, 3))
    assert not mean_of_two().control[-1].verdict.agrees  # type: ignore[union-attr]
    weighted = content.control[0].verdict
    # all the redundancy there is: it can neither agree nor disagree with its own sigma0
    assert weighted is not None
    assert weighted.statistic == pytest.approx(3.0)
    assert weighted.limit == pytest.approx(3.0)
    assert weighted.agrees


def test_the_confidence_sets_the_limits_of_verdicts() -> None:
    adjustment = mean_of_two().adjustment
    for confidence in (0.9, 0.999):
        content = build(adjustment, assess(adjustment, confidence=confidence))
        verdict = content.control[-1].verdict
        assert verdict is not None
        assert verdict.limit == pytest.approx(chi2.ppf(confidence, 3))


def test_variance_components_are_said_beside_the_sigmas() -> None:
    adjustment = scanner()
    found = estimate_components(adjustment.network, minimum_redundancy=1, alpha=None)
    content = build(found.adjustment, assess(found.adjustment), components=found)
    assert "unscaled" not in content.sigma_origin
    assert "factors of their variance components" in content.sigma_origin
    assert "unscaled" in build(adjustment, assess(adjustment)).sigma_origin
    assert "after the estimate of variance components" in text.render(content)


def test_tau_and_its_limit_are_shown_a_posteriori() -> None:
    adjustment = scanner()
    quality = assess(adjustment, posterior=True)
    shown = text.render(build(adjustment, quality, posterior=True))
    assert f"beyond the limit {quality.tau_critical:.2f} of τ" in " ".join(shown.split())
    assert "w, MDB and effect are a priori" in " ".join(shown.split())
    plain = text.render(build(adjustment, assess(adjustment)))
    assert "limit 3.29 of w" in " ".join(plain.split())
