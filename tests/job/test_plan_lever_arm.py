"""Planning the calibration of a lever arm: covariances, proposals, what cannot be planned.

Truth: the normal equations of the calibration written out by hand, published medians (AC-20),
executed surveys, every single proposal judged by itself.
"""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.geometry.rotation import skew
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.project import Project
from tribrach.questions.plan.design import DesignResult, plan_project
from tribrach.simulate.surveying import observe
from tribrach.units import SEC

RUN = CliRunner()
#: scanning 5 mm in every coordinate, GNSS 2 mm in plan and 1 mm up
SCAN, GNSS = 5e-3, np.array([2e-3, 2e-3, 1e-3])
ARM = np.array([0.0, 0.0, 0.329])
PROJECT = """
title = "Lever arm"
[instruments.scanner]
range_mm = 0.001
scan_angle_arcsec = 0.001
target_floor_mm = 5.0
[instruments.gnss]
gnss_plan_mm = 2.0
gnss_up_mm = 1.0
[lever_arms.antenna]
x_m = 0.0
y_m = 0.0
z_m = 0.329
sigma_mm = {prior}
[stations.S1]
lever_arm = "antenna"
{station}
{points}
[plan]
instrument = "scanner"
{plan}
[plan.lever_arm]
name = "antenna"
gnss = "gnss"
{arm}
"""


def load(
    folder: Path,
    plan: str = "",
    arm: str = "",
    *,
    prior: float = 1e4,
    station: str = "",
    targets: np.ndarray | None = None,
) -> Project:
    """A project of one scanner at zero; targets (n, 3) or those that are laid out."""
    points = ""
    if targets is not None:
        rows = [f"B{k},{x:.6f},{y:.6f},{z:.6f}" for k, (x, y, z) in enumerate(targets)]
        (folder / "targets.csv").write_text("\n".join(["point,e_m,n_m,u_m", *rows, ""]))
        points = '[[points]]\nfile = "targets.csv"\nrole = "approximate"'
    path = folder / "p.toml"
    text = PROJECT.format(prior=prior, station=station, points=points, plan=plan, arm=arm)
    path.write_text(text)
    return Project.load(path)


def by_hand(targets: np.ndarray, prior: float, tilt: float | None = None) -> np.ndarray:
    """Covariance (3, 3) of the lever arm: unknowns t, d, l; targets are eliminated by addition.

    A target that is scanned and measured gives ``x = R^T (X - t)`` with both covariances.
    """
    design = [np.hstack([-np.eye(3), skew(x), np.zeros((3, 3))]) for x in targets]
    weight = [np.diag(1 / (SCAN**2 + GNSS**2))] * len(targets)
    design += [np.hstack([np.eye(3), -skew(ARM), np.eye(3)]), np.eye(9)[6:]]
    weight += [np.diag(1 / GNSS**2), np.eye(3) / prior**2]
    if tilt is not None:
        design.append(np.eye(9)[3:5])
        weight.append(np.eye(2) / tilt**2)
    normal = sum(a.T @ p @ a for a, p in zip(design, weight, strict=True))
    return np.linalg.inv(normal)[6:, 6:]


def worst(covariance: np.ndarray) -> float:
    """Largest sigma in any direction."""
    return float(np.sqrt(np.linalg.eigvalsh(covariance).max()))


def layout(seed: int, window: float, near: float, far: float) -> np.ndarray:
    """Eleven random targets in a window around north, 10 degrees up and down."""
    rng = np.random.default_rng(seed)
    around, length = rng.uniform(-window / 2, window / 2, 11), rng.uniform(near, far, 11)
    up = length * np.tan(rng.uniform(-np.radians(10), np.radians(10), 11))
    return np.column_stack([length * np.sin(around), length * np.cos(around), up])


def forecast(plan: DesignResult):  # type: ignore[no-untyped-def]
    assert plan.lever_arm is not None
    return plan.lever_arm


@pytest.mark.parametrize("levelled", [False, True])
@pytest.mark.parametrize("prior", [4.0, 1e4])
def test_the_covariance_is_that_of_the_normal_equations(
    tmp_path: Path, levelled: bool, prior: float
) -> None:
    targets = layout(5, np.radians(40), 10, 40)
    station = "levelled = true\nlevelling_arcsec = 30" if levelled else ""
    project = load(tmp_path, prior=prior, station=station, targets=targets)
    found = forecast(plan_project(open_job(project)))
    expected = by_hand(targets, 1e-3 * prior, 30 * SEC if levelled else None)
    np.testing.assert_allclose(found.after, expected, rtol=2e-4, atol=1e-10)
    assert np.array_equal(found.after, found.before)
    np.testing.assert_allclose(found.prior, np.eye(3) * (1e-3 * prior) ** 2)


@pytest.mark.parametrize(
    ("window", "near", "far", "levelled", "published"),
    [
        (np.radians(40), 10, 40, False, (4.9, 5.1)),
        (np.radians(40), 10, 40, True, (4.9, 3.4)),
        (np.radians(40), 5, 15, False, (5.4, 6.0)),
        (2 * np.pi, 5, 15, False, (2.6, 1.9)),
    ],
)
def test_published_medians(
    tmp_path: Path,
    window: float,
    near: float,
    far: float,
    levelled: bool,
    published: tuple[float, float],
) -> None:
    """AC-20: sigmas across the view and in height, medians of random layouts."""
    station = "levelled = true\nlevelling_arcsec = 30" if levelled else ""
    sigmas = []
    for seed in range(15):
        project = load(tmp_path, station=station, targets=layout(seed, window, near, far))
        sigmas.append(np.sqrt(np.diag(forecast(plan_project(open_job(project))).after)))
    x, _, z = 1e3 * np.median(sigmas, axis=0)
    assert (x, z) == pytest.approx(published, rel=0.12)


def test_the_name_of_the_antenna_in_a_later_job_does_not_matter(tmp_path: Path) -> None:
    one = forecast(plan_project(open_job(load(tmp_path))))
    two = forecast(plan_project(open_job(load(tmp_path, station='mounted_point = "ROVER"'))))
    assert np.array_equal(one.after, two.after)


def test_an_executed_calibration_scatters_as_planned(tmp_path: Path) -> None:
    plan = plan_project(open_job(load(tmp_path, "add_targets = 2", "window_deg = 60", prior=20.0)))
    found, runs = forecast(plan).after, 60
    rng = np.random.default_rng(3)
    total = 0.0
    for _ in range(runs):
        error = adjust(observe(plan.network, plan.network.start, rng)).state.vectors[0] - ARM
        total += error @ np.linalg.solve(found, error)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 3 * runs)
    assert low < total < high


def test_the_first_proposal_is_the_best_of_all(tmp_path: Path) -> None:
    """Each place by itself through the normal equations: none is better than the proposed one."""
    window = "window_deg = 40\nnearest_m = 10\nfarthest_m = 40"
    plan = plan_project(open_job(load(tmp_path, "add_targets = 1", window)))
    layout_ = plan.adjustment.layout
    (proposed,) = plan.proposals
    own = [n for n in layout_.names["point"] if n != proposed.name]
    state = plan.adjustment.state
    targets = np.array([state.points[layout_.index("point", n)] for n in own])
    each = {
        name: worst(by_hand(np.vstack([targets, place]), 10.0))
        for name, place in plan.places.items()
    }
    assert len(each) == 216
    assert each[proposed.name] == pytest.approx(min(each.values()), rel=1e-6)
    assert proposed.after == pytest.approx(min(each.values()), rel=1e-4)
    for name, value in plan.single.items():
        assert value == pytest.approx(each[name], rel=1e-4)
    # the window opens to the north: help comes from the south
    assert proposed.place[1] < -9
    gaps = forecast(plan).gaps
    assert np.degrees(gaps.before) == pytest.approx(360 - 40 * 10 / 11, abs=1e-6)
    assert np.degrees(gaps.plan) < 200


def test_targets_at_places_of_a_file(tmp_path: Path) -> None:
    places = [f"Q{k},{9 * np.sin(a):.3f},{9 * np.cos(a):.3f},0.5" for k, a in enumerate((1, 3, 5))]
    (tmp_path / "places.csv").write_text("\n".join(["point,e_m,n_m,u_m", *places, ""]))
    keys = 'add_targets = 2\nmove_targets = 1\ntarget_places = "places.csv"\ndrop = true'
    targets = layout(2, np.radians(90), 5, 15)[:5]
    plan = plan_project(open_job(load(tmp_path, keys, targets=targets)))
    assert {p.name for p in plan.proposals} < {"Q0", "Q1", "Q2"}
    assert len(plan.proposals) == 2
    spares = {s.name: s.after for s in plan.spares}
    all_of_it = [*targets, *(p.place for p in plan.proposals)]
    for k in range(5):
        without = by_hand(np.array(all_of_it[:k] + all_of_it[k + 1 :]), 10.0)
        assert spares[f"B{k}"] == pytest.approx(
            np.sqrt(np.linalg.eigvalsh(without).max()), rel=1e-4
        )


def test_a_calibration_that_is_measured_already(tmp_path: Path) -> None:
    """Four targets were scanned and measured: where does one more help?"""
    targets = layout(4, np.radians(60), 5, 15)[:4]
    rows = [f"S1,B{k},{x:.6f},{y:.6f},{z:.6f},5,5,5" for k, (x, y, z) in enumerate(targets)]
    head = "station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm"
    (tmp_path / "scan.csv").write_text("\n".join([head, *rows, ""]))
    rows = [f"B{k},{x:.6f},{y:.6f},{z:.6f},2,2,1" for k, (x, y, z) in enumerate(targets)]
    head = "gnss,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"
    (tmp_path / "gnss.csv").write_text("\n".join([head, *rows, "S1,0,0,0.329,2,2,1", ""]))
    files = '[[observations]]\nfile = "scan.csv"\n[[observations]]\nfile = "gnss.csv"\n'
    project = load(tmp_path, "add_targets = 1")
    path = tmp_path / "p.toml"
    path.write_text(path.read_text().replace("[plan]\n", f"{files}[plan]\n"))
    plan = plan_project(open_job(path))
    found = forecast(plan)
    np.testing.assert_allclose(found.before, by_hand(targets, 10.0), rtol=2e-4, atol=1e-10)
    (one,) = plan.proposals
    after = by_hand(np.vstack([targets, one.place]), 10.0)
    np.testing.assert_allclose(found.after, after, rtol=2e-4, atol=1e-10)
    assert project.plan is not None


def test_the_command_and_what_it_writes(tmp_path: Path) -> None:
    load(tmp_path, "add_targets = 2\nsigma_mm = 3", "window_deg = 40")
    call = ["plan", str(tmp_path / "p.toml"), "--json", str(tmp_path / "p.json")]
    result = RUN.invoke(app, [*call, "--html", str(tmp_path / "p.html")])
    assert result.exit_code == 0, result.output
    said = " ".join(result.output.split())
    assert "Lever arm antenna with the targets of the plan: sigma x" in said
    assert "largest standard deviation of the lever arm in any direction goes from" in said
    assert "The requirement of 3 mm is reached" in said
    data = json.loads((tmp_path / "p.json").read_text())["lever_arm"]
    assert set(data) == {"name", "prior", "before", "plan", "horizon_without_targets"}
    before, after = (np.linalg.eigvalsh(data[key]) for key in ("before", "plan"))
    assert 0 < after.max() < before.max()
    assert after.max() < 3e-3**2
    assert "The lever arm" in (tmp_path / "p.html").read_text()
    alone = load(tmp_path, "", "window_deg = 40")
    result = RUN.invoke(app, ["plan", str(tmp_path / "p.toml")])
    said = " ".join(result.output.split())
    assert "leave 360 gon of the horizon free" in said
    assert alone.plan is not None


def test_the_example_of_the_docs(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "antennas.md").read_text()
    block = next(b for b in re.findall(r"```toml\n(.*?)```", page, re.S) if "plan.lever_arm" in b)
    (tmp_path / "p.toml").write_text(block)
    result = RUN.invoke(app, ["plan", str(tmp_path / "p.toml")])
    assert result.exit_code == 0, result.output
    after = page.split(block)[1].split("```\n")[1]
    shown = [line[4:] for line in after.splitlines()[:6] if line.startswith("    ")]
    assert len(shown) == 3
    for line in shown:
        assert f"- {line}" in result.output


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "antenna"', 'name = "prism"', r"p\.toml:\d+: lever arm prism is not defined"),
        ('lever_arm = "antenna"\n', "", "no station carries lever arm antenna"),
        ("gnss_up_mm = 1.0", "", "nothing is known of the GNSS positions of gnss"),
        ('gnss = "gnss"', 'gnss = "other"', "instrument other is not defined"),
        ('gnss = "gnss"', 'gnss = "gnss"\nnearest_m = 20', "nearest_m is larger than farthest_m"),
        ('gnss = "gnss"', 'gnss = "gnss"\nlowest_m = 9', "lowest_m is larger than highest_m"),
        ('instrument = "scanner"', 'points = ["T1"]', "about points or about lever_arm, not both"),
        ('instrument = "scanner"', 'criterion = "redundancy"', "says nothing about lever_arm"),
        ('gnss = "gnss"', 'gnss = "gnss"\ntargets = 0', "targets"),
    ],
)
def test_what_cannot_be_planned_is_a_sentence(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    load(tmp_path)
    path = tmp_path / "p.toml"
    text = path.read_text()
    at = text.index(old)
    path.write_text(text[:at] + new + text[at + len(old) :])
    with pytest.raises(InputError, match=words):
        plan_project(open_job(path))
