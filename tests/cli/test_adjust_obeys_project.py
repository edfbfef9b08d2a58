"""`tribrach adjust` and `tribrach run` of one project without scans say the same."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tribrach.cli import app

RUN = CliRunner()
PROJECT = """title = "Loops"
confidence = 0.99
facts = {{ crew = "two" }}
[adjustment]
snoop = true
posterior = true
{more}
[output]
angle = "deg"
[[points]]
file = "points.csv"
role = "fixed"
[[observations]]
file = "levels.csv"
"""


@pytest.fixture(params=["", "vce = true", 'robust = "igg3"'])
def project(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A levelling net with 60 mm of blunder in one of its lines."""
    rng = np.random.default_rng(5)
    heights = {"A": 10.0, "B": 12.5, "C": 9.0, "D": 11.2, "E": 14.1}
    rows = ["from,to,height_difference_m,sigma_mm"]
    names = list(heights)
    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            value = heights[b] - heights[a] + rng.normal(0, 2e-3) + 0.06 * ((a, b) == ("B", "D"))
            rows.append(f"{a},{b},{value:.5f},1")
    (tmp_path / "levels.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "points.csv").write_text("point,u_m\nA,10\n")
    path = tmp_path / "loops.toml"
    path.write_text(PROJECT.format(more=request.param))
    return path


def adjusted(path: Path, *options: str) -> tuple[dict[str, Any], str]:
    """JSON and text of adjust."""
    out, words = path.parent / "adjusted.json", path.parent / "adjusted.txt"
    files = ["--json", str(out), "--text", str(words), "-q"]
    result = RUN.invoke(app, ["adjust", str(path), *files, *options])
    assert result.exit_code == 0, result.output
    return json.loads(out.read_text()), words.read_text()


def switched_off(data: dict[str, Any]) -> list[tuple[str, str]]:
    """Ends of the observations that are off."""
    return [(row["from"], row["to"]) for row in data["observations"] if row["state"] == "off"]


def test_adjust_obeys_the_project_as_run_does(project: Path) -> None:
    result = RUN.invoke(app, ["run", str(project), "-q"])
    assert result.exit_code == 0, result.output
    out = project.parent / "out"
    data, words = adjusted(project)
    assert data == json.loads((out / "result.json").read_text())
    assert words == (out / "report.txt").read_text()
    assert switched_off(data) == [("B", "D")]
    assert "99 %" in words


def test_an_option_that_is_given_takes_the_place_of_the_project(project: Path) -> None:
    plain, _ = adjusted(project)
    other, words = adjusted(project, "--no-snoop", "--prior", "--confidence", "0.9")
    assert switched_off(other) == []
    assert "90 %" in words
    assert "99 %" not in words
    assert plain["points"]["C"]["covariance"] != other["points"]["C"]["covariance"]
    kept, _ = adjusted(project, "--confidence", "0.9")
    assert kept["points"] == plain["points"]


def test_what_the_robust_estimate_points_at_is_switched_off_first(tmp_path: Path) -> None:
    """The reason names the robust estimate; without it snooping gives its own test."""
    (tmp_path / "points.csv").write_text("point,u_m\nA,10\n")
    rows = ["A,B,2.501,1", "A,B,2.499,1", "A,B,2.500,1", "A,B,2.460,1"]
    (tmp_path / "levels.csv").write_text(
        "\n".join(["from,to,height_difference_m,sigma_mm", *rows]) + "\n"
    )
    path = tmp_path / "loops.toml"
    for more, reason in (('robust = "igg3"', "robust estimate"), ("", "snooping: test")):
        path.write_text(PROJECT.format(more=more))
        data, _ = adjusted(path)
        off = [row for row in data["observations"] if row["state"] == "off"]
        assert [row["source"] for row in off] == ["levels.csv:5"]
        assert reason in off[0]["reason"]
