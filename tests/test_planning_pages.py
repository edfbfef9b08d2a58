"""The pages on planning and on the field check, run as they stand."""

import itertools
import json
import re
import runpy
import shlex
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.cli.test_check_cli import polar_table
from tests.instruments.field_surveys import TARGETS, readings
from tribrach.cli import app
from tribrach.io.survey.csv.planned import PLANNED
from tribrach.planning.prediction import CRITERIA
from tribrach.project.plan import PlanSection, SceneBody

DOCS = Path(__file__).resolve().parents[1] / "docs"
FILLED = runpy.run_path(str(DOCS / "inserts.py"))["filled"]
RUN = CliRunner()


def page(name: str) -> str:
    return FILLED((DOCS / f"{name}.md").read_text())


def commands(name: str) -> list[list[str]]:
    found = re.findall(r"^```(\w*)\n(.*?)^```$", page(name), re.DOTALL | re.MULTILINE)
    lines = [line for language, block in found if not language for line in block.splitlines()]
    return [shlex.split(line)[1:] for line in lines if line.startswith("tribrach")]


def files(name: str, folder: Path) -> None:
    """Every block that follows the name of a file is that file."""
    text = page(name)
    for file, block in re.findall(r"`(\w+\.\w+)`[^`]*?:\n\n```\w+\n(.*?)^```$", text, re.S | re.M):
        (folder / file).write_text(block)


def test_the_plan_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files("planning", tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"hall.toml", "targets.csv", "stations.csv"}
    monkeypatch.chdir(tmp_path)
    (call,) = commands("planning")
    result = RUN.invoke(app, call)
    assert result.exit_code == 0, result.output
    plan = json.loads((tmp_path / "plan.json").read_text())
    assert plan["criterion"]["points"] == ["A", "B"]
    # the machine hides something from somebody
    assert len(plan["sights"]) < 2 * len(plan["points"])
    assert 1 <= len(plan["proposals"]) <= 2
    assert (tmp_path / "plan.html").is_file()
    text = (tmp_path / "plan.txt").read_text()
    # what cannot go says so; names of kinds are words, and zero has no sign
    assert re.search(r"station S1 +\d\.\d\d mm +needed", text)
    assert "scanner_polar" not in text
    assert not re.search(r"-0\.0+\b", text)


def test_the_checks_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = readings(np.random.default_rng(3), series=("1", "2", "3"))
    table = polar_table(given)
    header = re.search(r"```csv\n(.*)\n", page("field_check"))
    assert header is not None
    assert table.startswith(header.group(1))
    (tmp_path / "targets.csv").write_text(table)
    monkeypatch.chdir(tmp_path)
    lengths = ["from,to,distance_m,sigma_mm"]
    for i, j in itertools.combinations(range(4), 2):
        lengths.append(f"T{i},T{j},{np.linalg.norm(TARGETS[i] - TARGETS[j]):.5f},0.3")
    (tmp_path / "lengths.csv").write_text("\n".join([*lengths, ""]))
    outputs = {}
    for call in commands("field_check"):
        # the check reads the table of targets; the scans beside it are for calibration
        few = ["--points", "20000"] if call[0] == "simulate" else []
        result = RUN.invoke(app, [*call, *few])
        assert result.exit_code == 0, result.output
        outputs[" ".join(call)] = " ".join(result.output.split())
    (again,) = (said for call, said in outputs.items() if "--earlier" in call)
    (with_lengths,) = (said for call, said in outputs.items() if "lengths.csv" in call)
    assert "Against targets.csv" in again
    assert "full procedure" in again
    assert "Scale of the range beside a range zero" in with_lengths


def words_of(name: str) -> set[str]:
    """What stands in backticks outside of blocks."""
    text = re.sub(r"^```.*?^```$", "", page(name), flags=re.DOTALL | re.MULTILINE)
    return set(re.findall(r"`([^`]+)`", text))


def test_kinds_criteria_and_keys_are_listed() -> None:
    words = words_of("planning")
    assert set(CRITERIA) <= words
    assert set(PLANNED) - {"direction", "zenith", "slope_distance"} <= words
    listed = words_of("project_keys") | {"scene"}  # as [[plan.scene]]
    for model in (PlanSection, SceneBody):
        assert set(model.model_fields) - {"kind"} <= listed, model.__name__
