"""``tribrach info`` of projects of RiSCAN PRO: rows, sentences, JSON, refusals."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.io.survey.riscan_files import Rsp, Scan, write
from tests.io.survey.test_riscan_links import control, seen, sop
from tribrach.cli import app

RUN = CliRunner()


def info(*arguments: object, code: int = 0) -> str:
    result = RUN.invoke(app, ["info", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return " ".join((result.output + (result.stderr if code else "")).split())


def test_a_project_in_rows_sentences_and_json(tmp_path: Path) -> None:
    """One position is linked to control, the other is not registered and has one reflector off."""
    links = {f"tp00{k}": f"/test/TPL (GLCS)/CP{k}" for k in range(1, 6)}
    scans = [
        Scan("S1", seen("S1", lambda n: n.replace("CP", "tp00")), sop("S1"), links=links),
        Scan("S2", seen("S2", lambda n: n.replace("CP", "x")), registered=False, inactive=("x1",)),
    ]
    path = write(Rsp(scans, glcs=control(0.9996), crs="EPSG:32633"), tmp_path / "project.rsp")
    said = info(path, "--json", tmp_path / "info.json")
    assert "project.rsp (test)" in said
    assert "EPSG:32633" in said
    assert "5 points, 5 active" in said
    assert "! Control fits the measured distances with a scale of -399." in said
    data = json.loads((tmp_path / "info.json").read_text())
    assert data["scans"] == []
    (project,) = data["projects"]
    assert (project["crs"], project["control"], project["tie_points"]) == ("EPSG:32633", 5, 0)
    first, second = project["positions"]
    assert (first["reflectors"], first["active"], first["of_control"]) == (5, 5, 5)
    assert (second["registered"], second["active"], second["of_control"]) == (False, 4, 0)
    assert first["sop"][3] == [0, 0, 0, 1]
    assert second["sop"] is None
    assert second["gnss"] is None
    assert len(project["sentences"]) >= 1


def test_a_project_that_becomes_no_survey_is_described(tmp_path: Path) -> None:
    targets = seen("S1")
    targets["CP1"] = (targets["CP1"][0], None)
    path = write(Rsp([Scan("S1", targets, sop("S1"))]), tmp_path / "project.rsp")
    said = info(path)
    assert "5 reflectors, 5 active" in said
    assert "reflector CP1 has no accuracy above zero" in said


@pytest.mark.parametrize("text", ["", "<project/>", "<other/>", "not XML"])
def test_what_is_no_project_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.rsp"
    path.write_text(text)
    assert "x.rsp" in info(path, code=2)


@pytest.mark.data
def test_a_real_project(shared_data: Path) -> None:
    said = info(shared_data / "scans" / "riegl_project" / "project.rsp")
    assert "position SP01" in said
    assert "registered; 20 reflectors, 20 active; GNSS position" in said
    assert "places the project on the Earth" in said


@pytest.mark.parametrize(
    ("name", "text", "command"),
    [
        (
            "site.10o",
            f"{'     2.11           OBSERVATION DATA    G (GPS)':60}RINEX VERSION / TYPE\n"
            f"{'site':60}MARKER NAME\n{'':60}END OF HEADER\n",
            "baseline",
        ),
        ("a.dat", ".UNITS METERS\n.3D\nC A 0 0 0 ! ! !\nM A-B 100 20.0 90.0\n", "adjust"),
    ],
)
def test_what_is_no_scan_is_named_with_its_command(
    tmp_path: Path, name: str, text: str, command: str
) -> None:
    (tmp_path / name).write_text(text)
    assert f"tribrach {command}" in info(tmp_path / name, code=2)
