"""Decisions by hand are obeyed by adjust and run, and every report lists them."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import tribrach as tb
from tests.cli.scan_jobs import POSE, SPHERES, cloud, points
from tests.cli.scan_jobs import project as scan_project
from tests.network.test_results import SIGHTS, project
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Use
from tribrach.questions.adjust.adjusted import adjust_job
from tribrach.report import html, json_result, text

RUN = CliRunner()
ID = "horizontal_distance:A:P:sights.csv:2"


def decide(folder: Path, words: str) -> Path:
    path = folder / "edits.toml"
    path.write_text(words)
    return path


def edit(observation: str, use: str, reason: str = "prism tilted") -> str:
    return (
        f'[[edit]]\nobservation = "{observation}"\nuse = "{use}"\nreason = "{reason}"\nby = "AB"\n'
    )


def role(point: str, what: str) -> str:
    return f'[[role]]\npoint = "{point}"\nrole = "{what}"\nreason = "pillar was hit"\n'


def same(one: Adjustment, two: Adjustment) -> None:
    for name in one.points:
        np.testing.assert_allclose(one.points[name].xyz, two.points[name].xyz, atol=1e-9)
        np.testing.assert_allclose(
            one.points[name].covariance, two.points[name].covariance, atol=1e-15
        )
    assert len(one.observations) == len(two.observations)
    for a in one.observations:
        b = two.observations[a.id]
        assert (a.state, a.residual) == (b.state, pytest.approx(b.residual, abs=1e-9))
        assert a.w == pytest.approx(b.w, abs=1e-6, nan_ok=True)


@pytest.mark.parametrize("use", ["off", "check"])
def test_a_use_is_that_of_the_network(tmp_path: Path, use: str) -> None:
    network = project(tmp_path, SIGHTS).network()
    expected = tb.adjust(network.with_use(ID, Use[use.upper()], reason="prism tilted"))
    decide(tmp_path, edit(ID, use))
    adjusted = tb.adjust(tmp_path / "job.toml")
    same(adjusted, expected)
    assert adjusted.observations[ID].state == use
    if use == "off":
        same(adjusted, tb.adjust(network.without(ID, reason="prism tilted")))


def test_what_a_file_switched_off_is_taken_back(tmp_path: Path) -> None:
    job = project(tmp_path, SIGHTS)
    expected = tb.adjust(job)
    sights = tmp_path / "sights.csv"
    lines = sights.read_text().splitlines()
    lines = [
        lines[0] + ",use",
        *(f"{x},{'off' if k == 4 else ''}" for k, x in enumerate(lines[1:])),
    ]
    sights.write_text("\n".join(lines) + "\n")
    assert tb.adjust(tmp_path / "job.toml").dof == expected.dof - 1
    decide(tmp_path, edit(ID, "active"))
    np.testing.assert_array_equal(
        tb.adjust(tmp_path / "job.toml").points["P"].xyz, expected.points["P"].xyz
    )


def test_reports_list_the_changes_and_count_them_beside_the_global_test(tmp_path: Path) -> None:
    job = project(tmp_path, SIGHTS)
    decide(tmp_path, edit(ID, "off") + "at = 2026-11-23\n" + edit("sights.csv:3", "check", "wind"))
    content = adjust_job(tb.open_job(job.project))
    data = json.loads(json_result.dumps(content))
    assert data["edits"] == [
        {"id": ID, "action": "off", "reason": "prism tilted", "by": "AB", "at": "2026-11-23"},
        {
            "id": "horizontal_distance:A:Q:sights.csv:1",
            "action": "check",
            "reason": "wind",
            "by": "AB",
            "at": "",
        },
    ]
    for page in (html.render(content), text.render(content)):
        for word in ("2 changes were made by hand", ID, "prism tilted", "2026-11-23", "wind"):
            assert word in " ".join(page.split())
    assert "2 changes were made by hand." in content.adjustment.summary()
    states = {row["id"]: (row["state"], row.get("reason")) for row in data["observations"]}
    assert states[ID] == ("off", "prism tilted")


def test_what_does_not_match_ends_with_the_nearest(tmp_path: Path) -> None:
    project(tmp_path, SIGHTS)
    decide(tmp_path, edit(ID, "off") + edit("horizontal_distance:A:P:sights.csv:9", "off"))
    done = RUN.invoke(app, ["adjust", str(tmp_path / "job.toml")])
    assert done.exit_code == 2
    words = " ".join(done.output.split())
    assert "edits.toml:6 (edit 2): there is no observation" in words.replace("- ", "-")
    assert "did you mean horizontal_distance:A:P:sights.csv:" in words.replace(" ", "").replace(
        "didyoumean", "did you mean "
    )
    decide(tmp_path, role("Z", "check"))
    with pytest.raises(InputError, match=r"edits.toml:1 \(role 1\): there is no point Z"):
        tb.adjust(tmp_path / "job.toml")
    decide(tmp_path, role("P", "check"))
    with pytest.raises(InputError, match="no given coordinates that could be check"):
        tb.adjust(tmp_path / "job.toml")
    decide(tmp_path, '[[target]]\nscan = "S"\ncenter = [1, 2, 3]\nname = "T"\nreason = "x"\n')
    with pytest.raises(InputError, match="the project has no scans"):
        tb.adjust(tmp_path / "job.toml")


def test_another_file_can_be_named_and_must_be_there(tmp_path: Path) -> None:
    project(tmp_path, SIGHTS)
    path = tmp_path / "job.toml"
    path.write_text('edits = "mine.toml"\n' + path.read_text())
    decide(tmp_path, "this is not read")
    with pytest.raises(InputError, match=r"job.toml:1: there is no file mine.toml"):
        tb.adjust(path)
    (tmp_path / "mine.toml").write_text(edit(ID, "off"))
    assert tb.adjust(path).observations[ID].state == "off"


def test_no_result_takes_the_place_of_the_file(tmp_path: Path) -> None:
    project(tmp_path, SIGHTS)
    path = decide(tmp_path, edit(ID, "off"))
    before = path.read_bytes()
    done = RUN.invoke(
        app, ["adjust", str(tmp_path / "job.toml"), "--json", str(path), "--overwrite", "-q"]
    )
    assert done.exit_code == 2
    assert path.read_bytes() == before


POINTS = (
    "point,e_m,n_m,sigma_e_mm,sigma_n_mm,role\n"
    "A,0,0,1,1,control\nB,100,0,1,1,control\nC,150,50,1,1,{}\n"
)


def control_project(folder: Path, role_of_c: str) -> Path:
    job = project(
        folder, [*SIGHTS, "C,P,100.001,2", "C,Q,141.420,2", "A,C,158.115,2", "B,C,70.712,2"]
    )
    (folder / "points.csv").write_text(POINTS.format(role_of_c))
    return job.folder / "job.toml"


@pytest.mark.parametrize("before", ["control", "check"])
@pytest.mark.parametrize("after", ["control", "check"])
def test_a_role_is_that_of_the_file_of_points(tmp_path: Path, before: str, after: str) -> None:
    expected = tb.adjust(control_project(tmp_path / "expected", after))
    path = control_project(tmp_path / "edited", before)
    decide(path.parent, role("C", after))
    same(tb.adjust(path), expected)
    assert tb.adjust(path).points["C"].role == after


def test_a_free_point_forgets_its_coordinates(tmp_path: Path) -> None:
    expected = tb.adjust(control_project(tmp_path / "expected", "approximate"))
    path = control_project(tmp_path / "edited", "control")
    decide(path.parent, role("C", "free"))
    adjusted = tb.adjust(path)
    np.testing.assert_allclose(adjusted.points["C"].xyz, expected.points["C"].xyz, atol=1e-9)
    assert adjusted.dof == expected.dof
    assert adjusted.points["C"].role == "free"


@pytest.mark.parametrize("after", ["check", "free"])
def test_a_point_that_was_held_is_released(tmp_path: Path, after: str) -> None:
    wanted = {"check": "check", "free": "approximate"}[after]
    expected = tb.adjust(control_project(tmp_path / "expected", wanted))
    path = control_project(tmp_path / "edited", "fixed")
    decide(path.parent, role("C", after))
    adjusted = tb.adjust(path)
    np.testing.assert_allclose(
        adjusted.points["C"].xyz[:2], expected.points["C"].xyz[:2], atol=1e-9
    )
    assert adjusted.dof == expected.dof
    assert adjusted.points["C"].role == after


def test_edits_go_before_snooping(tmp_path: Path) -> None:
    path = project(tmp_path, SIGHTS).folder / "job.toml"
    path.write_text("[adjustment]\nsnoop = true\n" + path.read_text())
    snooped = tb.adjust(path)
    assert [row.id for row in snooped.observations if row.state == "off"] == [ID]
    decide(tmp_path, edit(ID, "off"))
    content = adjust_job(tb.open_job(path))
    assert content.adjustment.observations[ID].reason == "prism tilted"
    assert content.snooping == ()


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scanned")
    cloud(folder / "one.las", points())
    cloud(folder / "two.las", points(seed=1))
    path = scan_project(folder, "one.las", "two.las")
    tb.run(path)
    return path


def names(report: tb.Report) -> dict[str, list[str]]:
    placed = report.job.placed
    assert placed is not None
    assert placed.named is not None
    return {s: list(n) for s, n in placed.named.identification.names.items()}


def target(scan: str, center: np.ndarray, rest: str) -> str:
    place = ", ".join(f"{x:.4f}" for x in center)
    return f'[[target]]\nscan = "{scan}"\ncenter = [{place}]\n{rest}\nreason = "field book"\n'


def test_targets_are_rejected_and_renamed(scanned: Path) -> None:
    plain = tb.run(scanned)
    assert sorted(names(plain)["one"]) == [f"T{k}" for k in range(5)]
    more = target("one", SPHERES[1], "accept = false") + target("two", SPHERES[2], 'name = "X"')
    decide(scanned.parent, more)
    try:
        report = tb.run(scanned)
        assert sorted(names(report)["one"]) == ["T0", "T2", "T3", "T4"]
        assert sorted(names(report)["two"]) == ["T0", "T1", "T3", "T4", "X"]
        placed = report.job.placed
        assert placed is not None
        assert any("rejected by hand: field book" in r.reason for r in placed.findings[0].rejected)
        place = POSE @ SPHERES[2]
        np.testing.assert_allclose(report.adjustment.points["X"].xyz, place, atol=0.003)
        assert [e.action for e in report.adjustment.network.edits] == ["rejected", "name X"]
        decide(scanned.parent, target("one", SPHERES[1] + 0.5, "accept = false"))
        with pytest.raises(InputError, match=r"\(target 1\): scan one has no target within 20 mm"):
            tb.run(scanned)
        decide(scanned.parent, target("ono", SPHERES[1], "accept = false"))
        with pytest.raises(InputError, match="did you mean one"):
            tb.run(scanned)
        decide(scanned.parent, target("one", SPHERES[1], 'name = "tie 1"'))
        with pytest.raises(InputError, match="tie points are given"):
            tb.run(scanned)
    finally:
        (scanned.parent / "edits.toml").unlink()
