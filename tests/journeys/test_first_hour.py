"""A new user: from a folder to a report and clouds, with two commands and no edit by hand.

The frame of the clouds is held against the truth of the simulated survey.
"""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.journeys.folders import scans_alone, with_excel_and_gsi, with_starnet_and_laz
from tribrach.cli import app
from tribrach.geometry.alignment import kabsch
from tribrach.simulate.twin import Twin

RUN = CliRunner()
BOARDS = ["--target", "checkerboard:0.3", "--scanner", "Leica P40"]
#: points of a station here; the long journeys have as many as a scanner writes
FEW, MANY = 40_000, 300_000


def said(*words: str) -> str:
    """What a command prints; it must not fail."""
    done = RUN.invoke(app, list(words))
    assert done.exit_code == 0, done.output
    return done.stdout


def placed(folder: Path, twin: Twin) -> dict[str, np.ndarray]:
    """Positions of the stations (3,) in the result, less the true ones [m]."""
    result = json.loads((folder / "out" / "result.json").read_text())
    out = {}
    for station in twin.stations:
        pose = np.array(result["stations"][station.name]["world_from_scanner"])
        out[station.name] = pose[:3, 3] - station.pose.translation
    return out


def travelled(folder: Path) -> str:
    """Write the project file, check it and run it; what init says."""
    words = said("init", str(folder), "--yes", *BOARDS)
    project = str(folder / "project.toml")
    assert "nothing would stop a run" in said("check-project", project)
    said("run", project, "--quiet")
    assert (folder / "out" / "report.html").is_file()
    return words


@pytest.mark.parametrize("points", [FEW, pytest.param(MANY, marks=pytest.mark.slow)])
def test_e57_excel_and_gsi(tmp_path: Path, points: int) -> None:
    twin = with_excel_and_gsi(tmp_path / "Hof", points)
    words = travelled(tmp_path / "Hof")
    assert "Scans/S1.e57: 1 scan" in words
    assert "Festpunkte.xlsx: 2 points with coordinates, with sigmas" in words
    assert "Rechtswert is easting" in words
    assert "decimals are written with a comma" in words
    assert "Fotos.jpg: one of the pictures" in words
    for name, off in placed(tmp_path / "Hof", twin).items():
        assert np.linalg.norm(off) < 0.01, name
        with laspy.open(tmp_path / "Hof" / "out" / "clouds" / f"{name}.laz") as cloud:
            assert cloud.header.point_count > 0.9 * min(points, 100_000)
    head = (tmp_path / "Hof" / "out" / "report.txt").read_text()
    assert "Rechtswert is easting" in head.replace("\n", " ").replace("  ", " ")


@pytest.mark.parametrize("points", [FEW, pytest.param(MANY, marks=pytest.mark.slow)])
def test_laz_and_starnet(tmp_path: Path, points: int) -> None:
    twin = with_starnet_and_laz(tmp_path / "site", points)
    words = travelled(tmp_path / "site")
    assert "site.dat: a file of STAR*NET" in words
    for name, off in placed(tmp_path / "site", twin).items():
        assert np.linalg.norm(off) < 0.01, name
        assert (tmp_path / "site" / "out" / "clouds" / f"{name}.laz").is_file()


@pytest.mark.parametrize("points", [50_000, pytest.param(MANY, marks=pytest.mark.slow)])
def test_scans_alone(tmp_path: Path, points: int) -> None:
    truth = scans_alone(tmp_path / "yard", points)
    words = said("init", str(tmp_path / "yard"), "--yes")
    assert "no control was found: the datum is free" in words
    assert "the scanner is not known" in words
    assert "report:" in said("run", str(tmp_path / "yard" / "project.toml"))
    report = (tmp_path / "yard" / "out" / "report.txt").read_text()
    assert "inner constraints" in report
    result = json.loads((tmp_path / "yard" / "out" / "result.json").read_text())
    own = [np.array(result["stations"][name]["world_from_scanner"])[:3, 3] for name in truth]
    true = np.array([pose.translation for pose in truth.values()])
    fitted = kabsch(np.array(own), true)
    assert np.abs(np.array(own) @ fitted.rotation.T + fitted.translation - true).max() < 0.01


def test_targets_that_nobody_named_are_found(tmp_path: Path) -> None:
    with_excel_and_gsi(tmp_path / "Hof", FEW)
    words = said("init", str(tmp_path / "Hof"), "--yes")
    assert "no targets were named" in words
    assert "checkerboards of side 0.3 m" in words
    assert "checkerboard_side_m = [0.3]" in (tmp_path / "Hof" / "project.toml").read_text()


def test_scans_and_a_survey_without_targets_are_told_apart(tmp_path: Path) -> None:
    scans_alone(tmp_path / "yard", 3_000)
    (tmp_path / "yard" / "control.csv").write_text("Nr;E;N;H\nA;1;2;3\nB;4;5;6\n")
    words = said("init", str(tmp_path / "yard"), "--yes")
    assert "found: none" in words
    assert "nothing ties the scans to the list" in words
    assert "control.csv: 2 points with coordinates, without sigmas: nothing ties it" in words


def test_questions_are_asked(tmp_path: Path) -> None:
    with_excel_and_gsi(tmp_path / "Hof", 5_000)
    answers = "sphere:9000m\ncheckerboard:300mm\nLeica P40\nperhaps\nyes\n\ncheck\n"
    done = RUN.invoke(app, ["init", str(tmp_path / "Hof")], input=answers)
    assert done.exit_code == 0, done.output
    assert "a target of 9000 m is none" in done.output
    text = (tmp_path / "Hof" / "project.toml").read_text()
    assert 'sheet = "Leica ScanStation P40"' in text
    assert "\nlevelled = true" in text
    assert "checkerboard_side_m = [0.3]" in text
    assert 'role = "check"' in text


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    with_excel_and_gsi(tmp_path / "Hof", 5_000)
    path = tmp_path / "Hof" / "project.toml"
    path.write_text("mine")
    done = RUN.invoke(app, ["init", str(tmp_path / "Hof"), "--yes"])
    assert done.exit_code == 2
    assert path.read_text() == "mine"
    said("init", str(tmp_path / "Hof"), "--yes", "--overwrite", *BOARDS)
    assert path.read_text() != "mine"


def test_a_run_of_something_else_points_to_init(tmp_path: Path) -> None:
    (tmp_path / "S1.laz").write_bytes(b"LASF")
    for what in (tmp_path, tmp_path / "S1.laz"):
        done = RUN.invoke(app, ["run", str(what)])
        assert done.exit_code == 2
        assert f"tribrach init {tmp_path}" in done.stderr
