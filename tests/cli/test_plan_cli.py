"""The command plan: what it says, writes and refuses."""

import json
import re
from pathlib import Path
from typing import Literal

import pytest
from typer.testing import CliRunner

from tests.job.plan_jobs import laboratory, load
from tribrach.cli import app
from tribrach.job.opened import open_job
from tribrach.questions.plan.chapters import answer_of
from tribrach.questions.plan.design import plan_project

RUN = CliRunner()


def test_plan_of_the_laboratory(tmp_path: Path) -> None:
    keys = "faces = 2\nadd_targets = 2\nspacing_m = 2.0\nsigma_mm = 0.5\ndrop = true\n"
    project = laboratory(tmp_path, keys, targets=13)
    files = {kind: tmp_path / f"plan.{kind}" for kind in ("json", "html", "txt")}
    result = RUN.invoke(
        app,
        [
            *("plan", str(project), "--json", str(files["json"])),
            *("--html", str(files["html"]), "--text", str(files["txt"])),
        ],
    )
    assert result.exit_code == 0, result.output
    for words in ("Add target P", "Where to set up", "Datums", "have the largest correlation"):
        assert words in result.output
    data = json.loads(files["json"].read_text())
    assert data["schema"] == 1
    assert data["criterion"]["kind"] == "sigma"
    assert len(data["proposals"]) == 2
    assert data["plan"]["sigma"].keys() == data["before"]["sigma"].keys()
    assert max(data["plan"]["sigma"].values()) < max(data["before"]["sigma"].values())
    assert data["parameters"].keys() == {f"x{k}(scanner)" for k in ("10", "2", "3", "4", "6")}
    page = files["html"].read_text()
    assert "<svg" in page
    drawn = page.split('id="gain"')[1].split("</figure>")[0]
    assert drawn.count('class="ring"') == 2 * len(data["proposals"])
    assert "Where targets and points are" in page
    assert "http" not in page.split("</head>")[0]
    text = files["txt"].read_text()
    assert "Sights" in text
    # every sight of the crew's table is a line
    assert len(data["sights"]) == text.count("scanner polar  ")


@pytest.mark.parametrize(
    ("angle", "unit", "other"),
    [("gon", "gon", re.compile("°|″|degree")), ("deg", "°", re.compile("gon"))],
)
def test_angles_of_a_plan_have_one_unit(
    tmp_path: Path, angle: Literal["gon", "deg"], unit: str, other: re.Pattern[str]
) -> None:
    """Sentences, tables and the decimal sign are as the project writes them."""
    project = load(tmp_path, "sigma_mm = 0.5\n", targets=13)
    output = project.output.model_copy(update={"angle": angle, "decimal": ","})
    project = project.model_copy(update={"output": output})
    plan = answer_of(plan_project(open_job(project)), project)
    for written in (plan.page().split("<body")[1], plan.text()):
        words = written.split("<script>")[0]
        assert "azimuth" in words
        assert "zenith angles below" in words
        assert unit in words
        assert not other.search(words.replace("degrees of freedom", "").replace("polygon", ""))
        assert not re.search(r"\d\.\d+(?: |\xa0)(?:mm|″|mgon)", words)


def test_planned_observations_of_a_total_station(tmp_path: Path) -> None:
    """A levelling line and a resection whose sigmas are closed forms."""
    (tmp_path / "points.csv").write_text(
        "point,e_m,n_m,u_m,role,sigma_e_mm,sigma_n_mm,sigma_u_mm\n"
        "A,0,0,10,fixed,,,\nB,100,0,10,fixed,,,\nP,50,30,12,approximate,,,\n"
    )
    (tmp_path / "planned.csv").write_text(
        "from,to,kind,sigma_height_difference_mm,sigma_slope_distance_mm,repetitions\n"
        "A,P,height_difference,1.0,,\nB,P,height_difference,1.0,,\n"
        "A,P,slope_distance,,2.0,\nB,P,slope_distance,,2.0,\nP,A,total_station,,,2\n"
        "P,B,total_station,,,2\n"
    )
    (tmp_path / "job.toml").write_text(
        "[instruments.ts]\ndirection_arcsec = 1e6\nzenith_arcsec = 1e6\ndistance_mm = 1e6\n"
        '[[points]]\nfile = "points.csv"\n[plan]\nobservations = ["planned.csv"]\n'
    )
    result = RUN.invoke(
        app, ["plan", str(tmp_path / "job.toml"), "--json", str(tmp_path / "p.json"), "-q"]
    )
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "p.json").read_text())
    covariance = data["points"]["P"]["covariance"]
    # two height differences of 1 mm
    assert covariance[2][2] == pytest.approx(0.5e-6, rel=1e-3)
    # two distances of 2 mm from the sides: a = unit vectors in plan
    s = (50**2 + 30**2 + 2**2) ** 0.5
    east = 2 * (50 / s) ** 2 / 4e-6
    assert covariance[0][0] == pytest.approx(1 / east, rel=1e-3)


def test_wrong_plans_end_in_a_sentence(tmp_path: Path) -> None:
    project = laboratory(tmp_path, 'observations = ["planned.csv"]\n', targets=13)
    for rows, words in (
        ("S1,T01,thinking", "kind is 'thinking'"),
        ("S1,T99,scan", "a planned scan names T99"),
        ("T99,T01,distance", "T99 has no approximate coordinates"),
        ("T01,T05,distance", "there is no sigma_distance"),
    ):
        (tmp_path / "planned.csv").write_text(f"from,to,kind\n{rows}\n")
        result = RUN.invoke(app, ["plan", str(project)])
        assert result.exit_code == 2, result.output
        assert words in result.output
        assert "Traceback" not in result.output
    bare = tmp_path / "bare.toml"
    bare.write_text('[[observations]]\nfile = "planned.csv"\n')
    assert "no section [plan]" in RUN.invoke(app, ["plan", str(bare)]).output
    bare.write_text('[[observations]]\nfile = "planned.csv"\n[plan]\n')
    assert "which nobody measured" in RUN.invoke(app, ["plan", str(bare)]).output


def test_an_open_plan_says_what_is_open(tmp_path: Path) -> None:
    project = laboratory(tmp_path, "longest_m = 2.0\n", targets=13)
    result = RUN.invoke(app, ["plan", str(project)])
    assert result.exit_code == 2
    assert "Traceback" not in result.output
