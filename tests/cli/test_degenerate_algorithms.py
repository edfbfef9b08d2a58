"""Valid but degenerate inputs end in a result or in a sentence, as the folders of faults say."""

import json
from pathlib import Path

import pytest

from tests.cli.test_bad_scans import RUN
from tribrach.cli import app
from tribrach.job.opened import open_job
from tribrach.project import Project
from tribrach.solution import AdjustmentSettings, solve


def folder_of(shared_data: Path, number: str) -> Path:
    """The folder of a fault."""
    return next((shared_data / "faults" / "algorithms").glob(f"{number}-*"))


@pytest.mark.parametrize("number", ["01", "02"])
def test_clouds_that_hold_no_pose(shared_data: Path, tmp_path: Path, number: str) -> None:
    folder = folder_of(shared_data, number)
    words = ["register", str(folder / "a.ply"), str(folder / "b.ply"), "--out", str(tmp_path / "X")]
    result = RUN.invoke(app, [*words, "-q"])
    assert result.exit_code == 2, result.output
    assert not (tmp_path / "X" / "clouds").exists()


def test_a_cloud_without_points(shared_data: Path, tmp_path: Path) -> None:
    words = ["complete", str(folder_of(shared_data, "03") / "e.ply")]
    assert RUN.invoke(app, [*words, "--html", str(tmp_path / "r.html")]).exit_code == 2


def test_noise_of_few_planes(shared_data: Path, tmp_path: Path) -> None:
    folder = folder_of(shared_data, "18")
    words = ["noise", str(folder / "a.ply"), str(folder / "b.ply"), "-q"]
    files = [str(tmp_path / name) for name in ("n.json", "n.html")]
    result = RUN.invoke(app, [*words, "--json", files[0], "--html", files[1]])
    assert result.exit_code in (0, 2), result.output
    if result.exit_code == 0:
        json.loads(Path(files[0]).read_text(), parse_constant=pytest.fail)


def test_names_with_control_characters(shared_data: Path, tmp_path: Path) -> None:
    words = ["export", str(folder_of(shared_data, "10") / "p.toml"), "--to", "gkf", "--partial"]
    result = RUN.invoke(app, [*words, "-o", str(tmp_path / "x.gkf")])
    assert result.exit_code == 2, result.output
    assert "\x01" not in result.output


def test_where_all_is_wrong_nobody_is_accused(shared_data: Path) -> None:
    project = Project.load(folder_of(shared_data, "11") / "p.toml")
    solved = solve(open_job(project).network(), AdjustmentSettings.of(project))
    keys = {warning.key for warning in solved.warnings}
    assert "wrong_coordinate" not in keys


def test_a_fault_of_the_program_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "c.xyz").write_text("0 0 0\n1 0 0\n")

    def broken(*given: object) -> None:
        raise ZeroDivisionError("secret")

    monkeypatch.setattr("tribrach.questions.info.read_scans", broken)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    result = RUN.invoke(app, ["info", str(tmp_path / "c.xyz")])
    assert result.exit_code == 3
    (file,) = tmp_path.glob("tribrach-fault-*")
    assert "ZeroDivisionError: secret" in file.read_text()
    assert file.name in result.output
    assert "Traceback" not in result.output
