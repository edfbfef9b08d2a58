"""A session says what `adjust` and `run` say with the same edits.toml, and refuses what they do."""

import json
import re
import shutil
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tribrach as tb
from tests.cli.scan_jobs import SPHERES, cloud, points
from tests.cli.scan_jobs import project as scan_project
from tests.demo_twin import few_boards
from tests.network.test_results import SIGHTS, project
from tests.workbench import twins
from tribrach import demo
from tribrach.errors import InputError, UnknownName
from tribrach.job import find_targets
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.snooping import restart
from tribrach.network.removal import what_if
from tribrach.observations.base import Use
from tribrach.pipeline import run
from tribrach.project.edits import edits_text
from tribrach.questions.adjust.adjusted import adjust_job
from tribrach.report import json_result, text
from tribrach.workbench import session as session_module
from tribrach.workbench.scene import decided_targets
from tribrach.workbench.session import Conflict, Defect, Session, Superseded

ID = "horizontal_distance:A:P:sights.csv:2"
MORE = [*SIGHTS, "A,R,60.000,2", "B,R,80.003,2", "P,R,14.143,2"]


def off(observation: str = ID, use: str = "off") -> dict[str, Any]:
    return {"do": "use", "observation": observation, "use": use, "reason": "prism tilted"}


def levels(folder: Path, head: str) -> Path:
    """A levelling net with a blunder of 60 mm in one of its lines."""
    rng = np.random.default_rng(5)
    heights = {"A": 10.0, "B": 12.5, "C": 9.0, "D": 11.2, "E": 14.1}
    rows, names = ["from,to,height_difference_m,sigma_mm"], list(heights)
    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            value = heights[b] - heights[a] + rng.normal(0, 1e-3) + 0.06 * ((a, b) == ("B", "D"))
            rows.append(f"{a},{b},{value:.5f},1")
    (folder / "levels.csv").write_text("\n".join(rows) + "\n")
    (folder / "points.csv").write_text("point,u_m\nA,10\n")
    files = (
        '[[points]]\nfile = "points.csv"\nrole = "fixed"\n[[observations]]\nfile = "levels.csv"\n'
    )
    path = folder / "loops.toml"
    path.write_text(head + files)
    return path


def printed(words: str) -> str:
    """A text report without the count of iterations, which depends on the start."""
    return re.sub(r"\d+ iterations?", "", words)


def equal(one: Adjustment, two: Adjustment, *, restarted: bool = False) -> None:
    """The same bits; far closer than any digit that is printed where the start was another."""
    assert list(one.points) == list(two.points)
    if not restarted:
        np.testing.assert_array_equal(one.state.positions, two.state.positions)
        np.testing.assert_array_equal(one.residuals, two.residuals)
    for name in one.points:
        np.testing.assert_allclose(one.points[name].xyz, two.points[name].xyz, atol=1e-8)
        np.testing.assert_allclose(
            one.points[name].covariance, two.points[name].covariance, rtol=1e-5, atol=1e-14
        )
    rows = [(row.id, row.component, row.state, row.reason) for row in one.observations]
    assert rows == [(row.id, row.component, row.state, row.reason) for row in two.observations]
    np.testing.assert_allclose(
        one.observations.column("w").astype(float),
        two.observations.column("w").astype(float),
        atol=1e-4,
    )


@pytest.mark.parametrize("large", [0, 5000])
@pytest.mark.parametrize(
    "head",
    [
        "",
        "[adjustment]\nsnoop = true\n",
        '[adjustment]\nsnoop = true\nrobust = "igg3"\nposterior = true\n',
        "[adjustment]\nvce = true\n",
        "[adjustment]\nsnoop = true\nvce = true\n",
        'datum = "free"\n',
    ],
)
def test_what_is_shown_is_what_adjust_prints(
    tmp_path: Path, head: str, large: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the network starts as there or from where it was."""
    monkeypatch.setattr(session_module, "LARGE", large)
    path = levels(tmp_path, head)
    session = Session.open(path)
    names = [str(row.id) for row in session.adjustment.observations]
    lines = [name for name in names if "B:D" in name or "A:C" in name]
    for k, line in enumerate(lines):
        session.apply(k + 1, [off(line, "check" if k else "off")])
    session.save()
    content = adjust_job(tb.open_job(path))
    equal(session.adjustment, content.adjustment, restarted=not large)
    assert printed(text.render(session.content())) == printed(text.render(content))
    tested = session.tests(session.revision)["columns"]
    rows = content.adjustment.results(posterior=content.settings.posterior).observations.columns()
    assert tested["state"] == rows["state"].tolist()
    shown = [f"{x:.2f}" if x is not None else None for x in tested["w"]]
    assert shown == [None if np.isnan(x) else f"{x:.2f}" for x in rows["w"].tolist()]


def test_a_change_is_told_with_its_moves_and_taken_back(tmp_path: Path) -> None:
    session = Session.open(project(tmp_path, MORE).project, author="AB")
    first = session.state()
    assert (first["undo"], first["redo"], first["saved"], first["edits"]) == (
        False,
        False,
        True,
        [],
    )
    before = session.adjustment
    adjusted = session.apply(1, [off()])
    assert json.loads(json.dumps(adjusted)) == adjusted
    assert adjusted["revision"] == session.revision == 2
    (edit,) = adjusted["edits"]
    assert (edit["observation"], edit["by"], edit["reason"]) == (ID, "AB", "prism tilted")
    for row in adjusted["points"]:
        shift = session.adjustment.points[row["name"]].xyz - before.points[row["name"]].xyz
        np.testing.assert_allclose(row["moved"][:2], shift[:2], atol=1e-12)
        np.testing.assert_array_equal(row["before"], before.points[row["name"]].covariance)
    moved = max(adjusted["points"], key=lambda row: row["moved_length"])
    assert adjusted["largest"] == {"name": moved["name"], "moved": moved["moved_length"]}
    assert adjusted["sigma0"]["dof"] == first["adjusted"]["sigma0"]["dof"] - 1
    assert "One change was made by hand." in adjusted["sigma0"]["words"]
    back = session.undo(2)
    assert back["edits"] == []
    assert back["largest"]["moved"] < 1e-10
    assert not session.state()["undo"]
    again = session.redo(3)
    assert again["sigma0"]["posterior"] == pytest.approx(adjusted["sigma0"]["posterior"], abs=1e-12)
    with pytest.raises(InputError, match="nothing was taken back"):
        session.redo(4)


def test_what_says_what_is_so_anyway_is_no_decision(tmp_path: Path) -> None:
    session = Session.open(project(tmp_path, MORE).project)
    session.apply(1, [off()])
    assert session.apply(2, [off(use="active")])["edits"] == []
    assert session.apply(3, [off(use="check")])["edits"][0]["use"] == "check"
    assert len(session.apply(4, [off()])["edits"]) == 1


def test_an_old_state_is_not_changed(tmp_path: Path) -> None:
    session = Session.open(project(tmp_path, MORE).project)
    session.apply(1, [off()])
    for call in (lambda: session.apply(1, [off()]), lambda: session.undo(1)):
        with pytest.raises(Conflict, match="the state is 2"):
            call()
    with pytest.raises(Superseded):
        session.tests(1)
    assert session.tests(2) is session.tests(2)
    assert session.state()["tested"] is session.tests(2)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({**off(), "reason": " "}, "has no reason"),
        ({"do": "use", "observation": ID, "use": "off"}, "has no reason"),
        (off("horizontal_distance:A:P:sights.csv:7"), "did you mean horizontal_distance:A:P"),
        (off(use="gone"), "cannot be understood: use"),
        ({**off(), "more": 1}, "cannot be understood: more"),
        ({"do": "fly"}, "there is no change fly"),
        ({"do": "role", "point": "Z", "role": "check", "reason": "x"}, "no point Z"),
        ({"do": "role", "point": "P", "role": "check", "reason": "x"}, "no given coordinates"),
        ({"do": "target", "scan": "S", "number": 1, "reason": "x"}, "no scan with targets S"),
    ],
)
def test_changes_that_cannot_be_done_leave_everything(
    tmp_path: Path, change: dict[str, Any], words: str
) -> None:
    session = Session.open(project(tmp_path, MORE).project)
    state = session.state()
    with pytest.raises(InputError, match=words):
        session.apply(1, [off(), change])
    assert session.state() == state


def test_a_rank_defect_is_told_and_nothing_changes(tmp_path: Path) -> None:
    session = Session.open(project(tmp_path, ["A,P,70.712,2", "B,P,70.710,2"]).project)
    state, adjustment = session.state(), session.adjustment
    with pytest.raises(Defect) as raised:
        session.apply(1, [off("horizontal_distance:A:P:sights.csv:1")])
    assert any("P" in sentence for sentence in raised.value.sentences)
    assert session.state() == state
    assert session.adjustment is adjustment
    found = session.what_if("horizontal_distance:A:P:sights.csv:1")
    assert found["sigma0"] is None
    assert "nothing else controls it" in found["words"]


def test_decisions_are_saved_and_obeyed_and_those_of_others_are_not_lost(tmp_path: Path) -> None:
    job = project(tmp_path, MORE)
    session = Session.open(job.project)
    session.apply(1, [off()])
    assert not session.state()["saved"]
    path = session.save()
    assert session.state()["saved"]
    assert path == tmp_path / "edits.toml"
    equal(tb.adjust(tmp_path / "job.toml"), session.adjustment)
    again = Session.open(job.project)
    assert again.edits == session.edits or again.edits.model_dump() == session.edits.model_dump()
    path.write_text(path.read_text().replace("prism tilted", "wind"))
    session.undo(2)
    with pytest.raises(InputError, match="changed since the session read it"):
        session.save()
    assert "wind" in path.read_text()


def test_moves_are_counted_from_the_last_run(tmp_path: Path) -> None:
    job = project(tmp_path, MORE)
    run(job.project)
    session = Session.open(job.project)
    assert session.state()["adjusted"]["largest"]["moved"] < 1e-9
    session.apply(1, [off()])
    session.save()
    run(job.project)
    moved = session.state()["adjusted"]["largest"]["moved"]
    assert moved > 1e-3
    session.ran()
    assert session.state()["adjusted"]["largest"]["moved"] < 1e-9
    compared = session.compare(1, 2)
    assert compared["largest"]["moved"] == pytest.approx(moved, abs=1e-9)
    assert compared["sigma0"]["b"]["dof"] == compared["sigma0"]["a"]["dof"] - 1
    session.tests(2)
    both = session.compare("run", 2)
    place = both["observations"]["id"].index(ID)
    assert both["observations"]["state_a"][place] == both["observations"]["state_b"][place] == "off"
    with pytest.raises(UnknownName, match="no state 9"):
        session.compare(1, 9)
    for damage in ("{", '{"points": 3}', '{"points": {}, "stations": {"A": 1}}'):
        (session.folder / "result.json").write_text(damage)
        session.ran()
        assert session.state()["adjusted"]["largest"]["moved"] > 1e-3


@pytest.mark.parametrize("use", [Use.ACTIVE, Use.CHECK])
def test_what_if_is_the_adjustment_without_or_with_it(tmp_path: Path, use: Use) -> None:
    """Without blunders the model is straight over what moves."""
    lines = [line for line in MORE if line != "A,P,70.731,2"]
    network = project(tmp_path, lines).network()
    for item in (0, 2, 5):
        start = tb.adjust(network.switched([(0, item)], use, "tried"))
        other = Use.OFF if use == Use.ACTIVE else Use.ACTIVE
        # from where it is: lengths alone would as well fit the mirror image
        near = restart(start.network.switched([(0, item)], other, "tried"), start)
        expected = tb.adjust(near)
        found = what_if(start, 0, item)
        assert found.dof == expected.dof
        assert found.sigma0 == pytest.approx(expected.sigma0_posterior, rel=1e-4)
        shift = expected.state.positions - start.state.positions
        np.testing.assert_allclose(found.moved, shift, atol=2e-3 * np.abs(shift).max())


def test_roles_are_changed(tmp_path: Path) -> None:
    job = project(tmp_path, MORE)
    head = "point,e_m,n_m,sigma_e_mm,sigma_n_mm,role\n"
    rows = "A,0,0,1,1,control\nB,100,0,1,1,control\nP,50.0,50.0,1,1,control\n"
    (tmp_path / "points.csv").write_text(head + rows)
    session = Session.open(job.project)
    role = {"do": "role", "point": "P", "role": "check", "reason": "pillar was hit"}
    adjusted = session.apply(1, [role])
    assert [edit["role"] for edit in adjusted["edits"]] == ["check"]
    assert session.adjustment.points["P"].role == "check"
    session.save()
    equal(tb.adjust(tmp_path / "job.toml"), session.adjustment)
    assert session.apply(2, [{**role, "role": "control"}])["edits"] == []


def test_many_threads_leave_one_history(tmp_path: Path) -> None:
    session = Session.open(project(tmp_path, MORE).project)
    outcomes: list[str] = []

    def work(k: int) -> None:
        for _ in range(6):
            try:
                revision = session.revision
                session.apply(revision, [off(use=("off", "check")[k % 2])])
                session.tests(revision + 1)
                outcomes.append("done")
            except (Conflict, Superseded):
                outcomes.append("late")

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(outcomes) == 24
    assert "done" in outcomes
    assert session.state()["states"][-1] == str(session.revision)


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two scans of five spheres, run once."""
    folder = tmp_path_factory.mktemp("ran")
    cloud(folder / "one.las", points())
    cloud(folder / "two.las", points(seed=1))
    path = scan_project(folder, "one.las", "two.las")
    run(path)
    return path


@pytest.fixture
def scanned(ran: Path, tmp_path: Path) -> Path:
    shutil.copytree(ran.parent, tmp_path / "job")
    return tmp_path / "job" / ran.name


def test_no_scan_is_decoded_where_nothing_changed(
    scanned: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object) -> None:
        raise AssertionError("a scan was decoded")

    monkeypatch.setattr(find_targets, "laid_out", refuse)
    session = Session.open(scanned)
    assert session.state()["adjusted"]["largest"]["moved"] < 1e-9
    assert [t["name"] for t in session.targets()[:5]] == [n["name"] for n in session.targets()[5:]]


def test_targets_and_observations_of_scans_are_as_run_has_them(scanned: Path) -> None:
    session = Session.open(scanned)
    number = {t["name"]: t["number"] for t in session.targets() if t["scan"] == "one"}
    reject = {"do": "target", "scan": "one", "number": number["T1"], "accept": False}
    session.apply(1, [{**reject, "reason": "a mirror"}])
    assert [t["accepted"] for t in session.targets()].count(False) == 1
    # it keeps its name in the list, though no point has it from this scan any more
    assert [t["name"] for t in session.targets() if not t["accepted"]] == ["T1"]
    rename = {"do": "target", "scan": "two", "number": 1, "name": "X", "reason": "label"}
    session.apply(2, [rename])
    session.apply(3, [off("target_centre:one:T2:one:1")])
    session.save()
    report = run(scanned)
    equal(session.adjustment, report.adjustment)
    assert "X" in report.adjustment.points
    assert session.tests(4)["columns"]["w"] == pytest.approx(
        [None if np.isnan(x) else x for x in report.adjustment.observations.column("w").tolist()],
        abs=1e-4,
    )
    assert sorted(t["name"] for t in session.targets() if t["scan"] == "two")[-1] == "X"
    again = Session.open(scanned)
    equal(again.adjustment, report.adjustment)
    assert [t["name"] for t in again.targets() if not t["accepted"]] == ["T1"]
    # the run lists it among what it rejected; here it is a target with a decision, and only that
    by_run = json_result.network(report)["scans"]
    assert any("rejected by hand" in row["reason"] for row in by_run["rejected"])
    scans = decided_targets(by_run, again.targets())
    assert not any("rejected by hand" in row["reason"] for row in scans["rejected"])
    (bad,) = (row for row in scans["targets"] if not row["accepted"])
    assert bad["pictured"] == -len([r for r in by_run["rejected"] if r["scan"] == "one"])
    # taken back and confirmed
    assert len(again.apply(1, [{**reject, "accept": True, "reason": "it is none"}])["edits"]) == 2
    confirm = {"do": "target", "scan": "one", "number": number["T3"], "reason": "seen"}
    edits = again.apply(2, [confirm])["edits"]
    assert edits[-1]["name"] == "T3"
    np.testing.assert_allclose(edits[-1]["center"], SPHERES[3], atol=0.003)
    missing = {"do": "target", "scan": "one", "number": 6, "reason": "x"}
    with pytest.raises(InputError, match="has 5 targets"):
        again.apply(3, [missing])


def test_the_worst_row_of_the_demonstration(tmp_path: Path) -> None:
    """What the page shows after it is off is what the reports of a run say, digit by digit."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "build", few_boards)
        path = demo.write_project(tmp_path / "demo")
    run(path)
    session = Session.open(path)
    session.tests(1)
    worst = session.adjustment.observations.worst(1)[0].id
    predicted = session.what_if(worst)
    adjusted = session.apply(1, [off(worst)])
    tested = session.tests(2)
    session.save()
    report = run(path)
    equal(session.adjustment, report.adjustment)
    assert predicted["sigma0"] == pytest.approx(adjusted["sigma0"]["posterior"], rel=1e-3)
    data = json.loads((path.parent / "out" / "result.json").read_text())
    assert adjusted["sigma0"]["posterior"] == data["sigma0"]["posterior"]
    assert adjusted["sigma0"]["vtpv"] == data["sigma0"]["vtpv"]
    for row in adjusted["points"]:
        assert row["xyz"] == data["points"][row["name"]]["xyz"]
        assert row["covariance"] == data["points"][row["name"]]["covariance"]
    for row in adjusted["stations"]:
        assert row["world_from_scanner"] == data["stations"][row["name"]]["world_from_scanner"]
    for name in ("state", "w", "residual", "mdb", "external", "external_at", "suspicious"):
        assert tested["columns"][name] == [row[name] for row in data["observations"]]


@pytest.mark.parametrize("kind", twins.KINDS)
def test_in_every_frame_it_says_what_run_says(tmp_path: Path, kind: str) -> None:
    """Scans without targets: what ties the stations stands in a file."""
    path = twins.write(tmp_path, kind)
    run(path)
    session = Session.open(path)
    assert session.state()["adjusted"]["largest"]["moved"] < 1e-9
    worst = session.adjustment.observations.worst(1)[0].id
    moved = session.apply(1, [off(worst)])["largest"]["moved"]
    assert 0 < moved < 0.01
    session.save()
    equal(run(path).adjustment, session.adjustment)
    (tmp_path / "edits.toml").write_text(edits_text(session.edits).replace(worst, f"{worst}0"))
    with pytest.raises(InputError, match=r"edits.toml:3 \(edit 1\): there is no observation"):
        run(path)
