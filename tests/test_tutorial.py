"""The tutorial from raw files to the last table: its commands, one after the other."""

import json
import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tribrach.cli import app

PAGE = Path(__file__).resolve().parents[1] / "docs" / "hanoi.md"
RUN = CliRunner()


def calls() -> list[list[str]]:
    """The commands of the page, with fewer points in the panoramas."""
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)
    lines = [line for tag, block in blocks if not tag for line in block.splitlines()]
    found = [shlex.split(line) for line in lines]
    return [[word.replace("200000", "20000") for word in call[1:]] for call in found]


def test_the_page_has_its_commands() -> None:
    assert [call[0] for call in calls()] == ["simulate", "adjust", "run", "compare", "regress"]


@pytest.mark.slow
def test_the_tutorial_runs_and_ends_with_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for call in calls():
        result = RUN.invoke(app, call)
        assert result.exit_code == 0, (call, result.output)
    data = json.loads((tmp_path / "hanoi" / "out" / "result.json").read_text())
    truth = json.loads((tmp_path / "hanoi" / "truth" / "truth.json").read_text())
    for name, true in truth["stations"].items():
        station = data["stations"][name]
        for k in range(3):
            assert station["covariance"][k][k] < 0.003**2
            error = station["world_from_scanner"][k][3] - true["world_from_scanner"][k][3]
            assert abs(error) < 0.003
    (table,) = data["comparisons"]
    assert len(table["sites"]) == 16
    for site in table["sites"]:
        assert site["prediction"]["enough"]
        assert 0.9 < site["prediction"]["ratio"] < 1.1
        assert 0.9 < site["c2c"]["debiased_rms"] / site["predicted_sigma"] < 1.1
    # panoramas as thin as here have no normals, so that their incidence angles are not known
    poses = [row for row in data["scans"]["truth"] if row["what"] in ("station", "stations")]
    assert len(poses) == 5
    assert all(row["agrees"] for row in poses)
    again = json.loads((tmp_path / "hanoi" / "table.json").read_text())
    assert len(again["sites"]) == 16
    assert "prediction.observed" in PAGE.read_text()
    result = RUN.invoke(app, ["regress", "hanoi/table.json", "--y", "prediction.observed"])
    assert result.exit_code == 0, result.output
