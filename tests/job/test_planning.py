"""Plans of the laboratory room: proposals against chance, predictions against executed surveys."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.job.plan_jobs import PARAMETERS, load, table
from tests.network.plan_networks import combine
from tribrach.errors import InputError, RankDefect
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.observations.scanner import ScannerPolar
from tribrach.planning.blocks import join
from tribrach.planning.groups import coming, prospect_for
from tribrach.planning.prediction import Criterion, figures, predict
from tribrach.project import Project
from tribrach.questions.plan.design import DesignResult, plan_project
from tribrach.questions.plan.survey import PlanSurvey
from tribrach.simulate.surveying import observe
from tribrach.simulate.twins import newcastle_lab
from tribrach.simulate.twins.newcastle_lab import MISALIGNMENTS
from tribrach.units import SEC

PROPOSE = "faces = 2\nadd_targets = 3\nspacing_m = 0.8\n"


@pytest.mark.parametrize(
    "criterion",
    [
        "sigma",
        pytest.param("correlation", marks=pytest.mark.slow),
        pytest.param("redundancy", marks=pytest.mark.slow),
        pytest.param("undetected", marks=pytest.mark.slow),
    ],
)
def test_three_targets_beat_a_thousand_random_placements(tmp_path: Path, criterion: str) -> None:
    project = load(tmp_path, PROPOSE + f'criterion = "{criterion}"\n')
    plan = plan_project(open_job(project))
    assert plan.before is not None
    # the same places, judged three at a time at random
    survey = PlanSurvey(open_job(project))
    base = predict(survey.network())
    further = survey.candidates(dict(plan.places), {}, base.network)
    now = prospect_for(base, plan.criterion, [further])
    blocks = join(coming(base, now, further, {n: k for k, n in enumerate(plan.places)}))
    rng = np.random.default_rng(1)
    chosen = np.array([rng.choice(len(blocks), 3, replace=False) for _ in range(1000)])
    values = now.judge(combine(blocks, chosen)).value
    sign = 1 if criterion == "redundancy" else -1
    gains = sign * (values - plan.before.value(criterion))
    mine = sign * (plan.after.value(criterion) - plan.before.value(criterion))
    assert len(plan.proposals) == 3
    assert mine > np.median(gains)
    assert mine >= 0.9 * gains.max()
    # what was judged by updates is what the prediction of the whole says
    assert plan.proposals[-1].after == pytest.approx(plan.after.value(criterion), rel=1e-6)
    assert plan.proposals[0].before == pytest.approx(plan.before.value(criterion), rel=1e-6)


def executed(plan: DesignResult, runs: int, seed: int) -> tuple[np.ndarray, Adjustment]:
    """Deviations (runs, u) of adjusted unknowns from the truth, which has misalignments."""
    start = plan.network.start
    scalars = start.scalars.copy()
    for name, value in MISALIGNMENTS.items():
        scalars[start.layout.index("scalar", f"{name}(scanner)")] = value
    truth = replace(start, scalars=scalars)
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(runs):
        found = adjust(observe(plan.network, truth, rng)).state
        parts = (
            found.points - truth.points,
            found.pose_t - truth.pose_t,
            found.scalars - truth.scalars,
        )
        out.append(np.concatenate([part.ravel() for part in parts]))
    return np.array(out), plan.adjustment


def predicted_variances(found: Adjustment) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of points, of station positions, of parameters."""
    places = np.einsum("nii->ni", found.position_covariances())
    points = found.layout.count("point")
    scalars = found.family_covariances("scalar").ravel()
    return places[:points].ravel(), places[points:].ravel(), scalars


def test_an_executed_survey_scatters_as_predicted(tmp_path: Path) -> None:
    plan = plan_project(open_job(load(tmp_path, PROPOSE.replace("0.8", "2.0"))))
    runs = 25
    deviations, found = executed(plan, runs, seed=1)
    names = [f"{p}(scanner)" for p in PARAMETERS]
    columns = np.concatenate([found.columns(name) for name in names])
    covariance = found.covariance_columns(columns, columns)
    last = deviations[:, -len(names) :][:, [found.layout.index("scalar", n) for n in names]]
    statistic = np.einsum("ki,ij,kj->", last, np.linalg.inv(covariance), last)
    low, high = chi2.ppf([1e-4, 1 - 1e-4], runs * len(names))
    assert low < statistic < high
    for variance, part in zip(predicted_variances(found), split(deviations, found), strict=True):
        assert np.sqrt(np.mean(part**2) / variance.mean()) == pytest.approx(1, abs=0.25)


def split(deviations: np.ndarray, found: Adjustment) -> list[np.ndarray]:
    points, poses = 3 * found.layout.count("point"), 3 * found.layout.count("pose")
    return np.split(deviations, [points, points + poses], axis=1)


@pytest.mark.slow
def test_predicted_precision_is_that_of_executed_surveys(tmp_path: Path) -> None:
    plan = plan_project(open_job(load(tmp_path, PROPOSE)))
    runs = 1500
    deviations, found = executed(plan, runs, seed=11)
    parts = split(deviations, found)
    for variance, part in zip(predicted_variances(found), parts, strict=True):
        assert np.sqrt(np.mean(part**2) / variance.mean()) == pytest.approx(1, abs=0.05)
    # every parameter by itself, and the bound of its sample variance
    ratio = np.mean(parts[2] ** 2, axis=0) / predicted_variances(found)[2]
    assert np.sqrt(ratio) == pytest.approx(np.ones(len(PARAMETERS)), abs=0.05)
    low, high = chi2.ppf([5e-4, 1 - 5e-4], runs) / runs
    assert ((ratio > low) & (ratio < high)).all()


def test_moves_and_what_can_be_spared_are_named(tmp_path: Path) -> None:
    keys = 'move_targets = 2\nspacing_m = 1.5\ndrop = true\npoints = ["S1", "S2"]\nkeep = ["T01"]\n'
    plan = plan_project(open_job(load(tmp_path, keys, targets=8, calibration=False)))
    assert len(plan.relocations) == 2
    assert all(r.after < r.before for r in plan.relocations)
    # the points of the criterion stay, and so does what is to be kept
    assert {s.name for s in plan.spares} == {"T07", "T13", "T19", "T25", "T31", "T37", "T43"}
    assert all(not s.after < s.before for s in plan.spares)


def test_sets_and_sigmas_for_a_requirement(tmp_path: Path) -> None:
    plan = plan_project(open_job(load(tmp_path, "sigma_mm = 0.6\n", targets=13, calibration=False)))
    assert plan.reached is False
    assert plan.sets is not None
    assert plan.sets.reached
    assert plan.sets.value <= 0.6e-3 * (1 + 1e-6)
    assert {p.group for p in plan.precisions} == {
        "scanner_polar range",
        "scanner_polar horizontal/zenith",
    }


def test_datums_agree_in_what_is_estimable(tmp_path: Path) -> None:
    plan = plan_project(open_job(load(tmp_path, "", targets=13, calibration=False)))
    assert len(plan.datums) >= 2
    first = plan.datums[0]
    for choice in plan.datums[1:]:
        assert choice.distance == pytest.approx(first.distance, rel=1e-6)
        assert choice.redundancy == pytest.approx(first.redundancy, rel=1e-6)
    assert max(c.mean for c in plan.datums) > 1.01 * min(c.mean for c in plan.datums)


def test_new_points_get_the_stations_that_they_need(tmp_path: Path) -> None:
    """Behind a wall, new points are seen from some of the places only."""
    project = hidden_points(tmp_path)
    plan = plan_project(open_job(project))
    assert plan.before is None
    assert plan.reached
    chosen = [p.name for p in plan.proposals]
    assert chosen[0] == "good"
    seen = PlanSurvey(open_job(project)).network(stations={})
    with pytest.raises(RankDefect):
        predict(seen)
    exact = figures(plan.adjustment, Criterion("sigma", ("N1", "N2", "N3")))
    assert exact.value("sigma") == pytest.approx(plan.after.value("sigma"))


def hidden_points(folder: Path) -> object:
    places = {"good": np.array([5.6, 6.0, 0.0]), "blind": np.array([-6.0, 0.0, 0.0])}
    (folder / "places.csv").write_text(table(places))
    keys = (
        'new_points = ["N1", "N2", "N3"]\nadd_stations = 2\nstation_places = "places.csv"\n'
        "sigma_mm = 3\n"
    )
    project = load(folder, keys, targets=13, calibration=False)
    inside = {f"N{k}": np.array([5.1 + 0.2 * k, 9.8, 0.4 * k - 0.8]) for k in (1, 2, 3)}
    old = (folder / "targets.csv").read_text()
    (folder / "targets.csv").write_text(old + table(inside).split("\n", 1)[1])
    text = (folder / "lab.toml").read_text()
    screen = (
        '[[plan.scene]]\nkind = "rectangle"\ncenter_m = [4.9, 9.4, 0.1]\nsize_m = [2.2, 3.2]\n'
        "normal = [1, 0, 0]\n"
    )
    (folder / "lab.toml").write_text(text + screen)
    return type(project).load(folder / "lab.toml")


def test_a_measured_project_is_planned_on(tmp_path: Path) -> None:
    """Two faces of all targets are measured; further targets are seen from the same stations."""
    twin = newcastle_lab.build(points=1000)
    for name in ("polar.csv", "control.csv"):
        (tmp_path / name).write_text(twin.files[name])
    places = {"W1": np.array([0.4, 1.2, -1.5]), "W2": np.array([6.0, 3.0, 1.2])}
    (tmp_path / "places.csv").write_text(table(places))
    text = (
        '[[points]]\nfile = "control.csv"\n[[observations]]\nfile = "polar.csv"\n'
        "[instruments.scanner]\nrange_mm = 1.2\nrange_ppm = 10\nscan_angle_arcsec = 8\n"
        f'[calibration]\nmodel = "nist"\nparameters = {list(PARAMETERS)}\n'
        '[plan]\nfaces = 2\nadd_targets = 1\ntarget_places = "places.csv"\n'
        'criterion = "correlation"\n'
    )
    (tmp_path / "job.toml").write_text(text)
    project = Project.load(tmp_path / "job.toml")
    measured = adjust(open_job(project).network())
    plan = plan_project(open_job(project))
    assert plan.before is not None
    # before, the plan is the adjustment that there is, but for misalignments in the geometry
    own = figures(measured, plan.criterion)
    assert plan.before.sigma == pytest.approx(own.sigma, rel=1e-3)
    assert plan.before.value("redundancy") == pytest.approx(own.value("redundancy"), rel=1e-3)
    assert [p.name for p in plan.proposals] == ["W1"]
    assert plan.after.value("correlation") < plan.before.value("correlation")
    seen = {s for o in plan.network.observations for s in o.source if "planned" in str(s)}
    assert seen == {"planned scan S1", "planned scan S2"}


def test_points_on_a_target_average_the_noise_alone(tmp_path: Path) -> None:
    """Nine points: a third of the noise of ranges and angles, all of the systematic part."""
    text = (
        'datum = "free"\n[[points]]\nfile = "control.csv"\nrole = "approximate"\n'
        "[instruments.scanner]\nrange_mm = 1.2\n"
        "scan_angle_arcsec = 6\nscan_angle_accuracy_arcsec = 10\n"
        '[plan]\nstations = "stations.csv"\n'
    )
    (tmp_path / "control.csv").write_text(
        table({f"T{k}": np.array([10.0 * np.cos(k), 10 * np.sin(k), k - 2.0]) for k in range(5)})
    )
    (tmp_path / "stations.csv").write_text(table({"S": np.array([0.5, 0.3, 0.0])}))
    sigmas = []
    for points in (1, 9):
        (tmp_path / "job.toml").write_text(text + f"target_points = {points}\n")
        plan = plan_project(open_job(Project.load(tmp_path / "job.toml")))
        (scans,) = (o for o in plan.network.observations if isinstance(o, ScannerPolar))
        sigmas.append(np.sqrt(np.diag(scans.covariance[0])))
    np.testing.assert_allclose(sigmas[0], [1.2e-3, 10 * SEC, 10 * SEC], rtol=1e-6)
    np.testing.assert_allclose(sigmas[1][0], 0.4e-3, rtol=1e-6)
    np.testing.assert_allclose(sigmas[1][1:], np.hypot(2, 8) * SEC, rtol=1e-6)


def test_what_is_wrong_is_said(tmp_path: Path) -> None:
    for keys, words in (
        ("add_targets = 2\n", "targets are proposed at target_places"),
        ("add_stations = 2\n", "stations are proposed at station_places"),
        ('targets = ["T99"]\n', "T99 has no approximate coordinates"),
        ('points = ["T99"]\n', "T99 is no point or station"),
        ("sets = 0\n", "sets is 0 and should be greater than 0"),
        ('criterion = "correlation"\nadd_targets = 1\nspacing_m = 2.0\n', "no parameters"),
        ('add_targets = 1\ntarget_places = "targets.csv"\n', "T01 is a point or station"),
    ):
        with pytest.raises(InputError, match=words):
            plan_project(open_job(load(tmp_path, keys, calibration=False)))
