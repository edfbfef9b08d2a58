"""Folders of five offices: by ``init --yes`` and ``run`` nothing is dropped and nothing edited."""

import json
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.journeys.folders import facades, scans_alone
from tests.journeys.offices import OFFICES, _e57
from tribrach.cli import app
from tribrach.io.scans.formats import read_scans
from tribrach.job.set_ups import set_ups

RUN = CliRunner()


def said(*words: str, answers: str | None = None) -> str:
    """What a command prints; it must not fail."""
    done = RUN.invoke(app, list(words), input=answers)
    assert done.exit_code == 0, done.output
    return done.output


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in OFFICES if name != "lists"]


@pytest.mark.parametrize("name", ["lists", *SLOW])
def test_nothing_is_dropped(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "job"
    twin = OFFICES[name](folder, 15_000)
    words = said("init", str(folder), "--yes")
    left = words.partition("Not in it:\n")[2].splitlines()
    left = [line for line in left if line.startswith("  ")]
    assert all("one of the pictures" in line for line in left), words
    said("run", str(folder / "project.toml"), "--quiet")
    result = json.loads((folder / "out" / "result.json").read_text())
    assert result["points"]["E"]["role"] in ("control", "free")
    if name == "lists":
        assert np.allclose(result["points"]["B"]["xyz"][:2], [1020.30, 2038.18], atol=0.02)
        return
    scanned = [name for name in result["stations"] if name[:1] == "S"]
    assert len(scanned) == len(twin.stations)
    for station in twin.stations:
        (own,) = (name for name in scanned if name.startswith(station.name))
        off = (
            np.array(result["stations"][own]["world_from_scanner"])[:3, 3]
            - station.pose.translation
        )
        assert np.linalg.norm(off) < 0.01, station.name


def test_a_german_folder_is_told_without_a_question(tmp_path: Path) -> None:
    folder = tmp_path / "Schulhof"
    OFFICES["german"](folder, 5_000)
    words = said(
        "init", str(folder), "--yes", "--scanner", "Leica P40", "--target", "checkerboard:300mm"
    )
    left = [line for line in words.partition("Not in it:\n")[2].splitlines() if line[:2] == "  "]
    assert left == ["  Bilder/IMG_0001.jpg: one of the pictures"]
    assert "Y is taken as easting and X as northing, which fits the observations" in words
    project = tomllib.loads((folder / "project.toml").read_text())
    stations = [scan["station"] for scan in project["scans"]]
    assert sorted(stations) == ["S1", "S1", "S2", "S2", "S3", "S3", "S4", "S4"]
    assert {Path(one["file"]).name for one in project["observations"]} == {
        "Nivellement.csv",
        "Polygonzug.gsi",
    }


def test_axes_are_those_that_fit_the_observations(tmp_path: Path) -> None:
    """X and Y of a list exchanged: mirrored coordinates fit no survey, whatever is usual."""
    folder = tmp_path / "job"
    OFFICES["lists"](folder)
    table = folder / "koord.txt"
    for head, east in (("Nr\tY\tX\tZ", "Y"), ("Nr\tX\tY\tZ", "X")):
        table.write_text(re.sub(r"^Nr.*", head, table.read_text()))
        words = said("init", str(folder), "--yes", "--overwrite")
        assert f"{east} is taken as easting" in words
        assert "fits the observations" in words
    # without observations of three points it is what is usual, and an option says otherwise
    lines = table.read_text().splitlines()
    table.write_text("\n".join([lines[0], *lines[1:3], ""]))
    assert "say --axes north if" in said("init", str(folder), "--yes", "--overwrite")
    words = said("init", str(folder), "--yes", "--overwrite", "--axes", "north")
    assert "Y is taken as easting and X as northing, as asked for" in words


def test_every_question_takes_an_empty_answer(tmp_path: Path) -> None:
    folder = tmp_path / "job"
    OFFICES["lists"](folder)
    lines = (folder / "koord.txt").read_text().splitlines()
    (folder / "koord.txt").write_text("\n".join([*lines[:3], ""]))
    words = said("init", str(folder), answers="\n" * 20)
    assert "koord.txt:\n  Nr | Y | X | Z\n  A | 999.9997" in words
    assert "[north]" in words
    assert "project.toml" in words
    words = said("init", str(folder), "--overwrite", answers="x\neast\n" + "\n" * 20)
    assert "X is taken as easting and Y as northing, as answered" in words


def test_a_survey_that_nothing_ties_is_a_project_of_its_own(tmp_path: Path) -> None:
    folder = tmp_path / "yard"
    scans_alone(folder, 3_000)
    twin = facades()
    for name in ("control.csv", "traverse.gsi"):
        (folder / name).write_text(twin.files[name])
    words = said("init", str(folder), "--yes")
    assert "Not in it" not in words
    first, second = (
        tomllib.loads((folder / f"{n}.toml").read_text()) for n in ("project", "survey")
    )
    assert len(first["scans"]) == 4
    assert "points" not in first
    assert second["observations"][0]["file"] == "traverse.gsi"
    assert second["output"]["folder"] == "out-survey"
    said("run", str(folder / "survey.toml"), "--quiet")
    assert (folder / "out-survey" / "result.json").is_file()
    done = RUN.invoke(app, ["init", str(folder), "--yes", "--out", str(folder / "other.toml")])
    assert done.exit_code == 0
    assert (folder / "other-survey.toml").is_file()


@pytest.mark.parametrize("posed", [True, False])
def test_panorama_and_window_are_one_station(tmp_path: Path, posed: bool) -> None:
    """By their poses, or by names and what both see; not by names alone."""
    twin = facades()
    names = {"S3 Panorama.e57": "S3", "S3 Fenster.e57": "S3-targets", "S3 Detail.e57": "S4"}
    for file, scan in names.items():
        _e57(tmp_path / file, twin, [scan], 20_000, posed=posed)
    scans = [(path, scan) for path in sorted(tmp_path.iterdir()) for scan in read_scans(path)]
    stations = {path.name: station for (path, _), station in set_ups(scans).items()}
    assert stations["S3 Panorama.e57"] == stations["S3 Fenster.e57"] == "S3"
    assert stations["S3 Detail.e57"] != "S3"
    shutil.rmtree(tmp_path)
