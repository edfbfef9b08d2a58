"""Natural points that were picked tie stations, are compared, and become new points."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

from tests.targets.test_picks import directions, read, solid
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.geometry.rotation import exp, log
from tribrach.job.opened import open_job
from tribrach.job.steps import find_and_name
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.observations.base import Use
from tribrach.project import Project

#: corners of bodies, the faces of each, and where two scanners stand
CORNERS = np.array([[6.0, 1.0, 0.5], [5.0, -4.0, 1.5], [-4.0, 5.0, -0.5], [2.0, 7.0, 1.8]])
PLACES = np.array([[0.0, 0.0, 0.0], [1.5, 0.8, 0.2]])
TURN = 0.7
HEAD = """\
datum = "fixed:C0,C1,C2"
[[points]]
file = "points.csv"
role = "fixed"
[[scans]]
file = "S1.xyz"
origin = "scanner"
[[scans]]
file = "S2.xyz"
origin = "scanner"
"""


def scan_of(place: np.ndarray, turn: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Points of windows around all corners, each of a body of its own, in the scanner frame."""
    parts = []
    for corner in CORNERS:
        # three faces at right angles about the line of sight from the middle
        away = (corner - PLACES.mean(axis=0)) / np.linalg.norm(corner - PLACES.mean(axis=0))
        one = np.cross(away, [0.0, 0.0, 1.0])
        one /= np.linalg.norm(one)
        roll = 2 * np.pi / 3 * np.arange(3)[:, None] + corner[0]
        faces = np.sqrt(2 / 3) * (np.cos(roll) * one + np.sin(roll) * np.cross(away, one))
        faces = faces - away / np.sqrt(3)
        at, normals = turn.T @ (corner - place), faces @ turn
        h, v = np.arctan2(at[1], at[0]), np.arccos(at[2] / np.linalg.norm(at))
        grid = np.arange(-0.045, 0.045, 2.5e-3)
        hh, vv = np.meshgrid(h + grid, v + grid)
        unit = directions(hh.ravel(), vv.ravel())
        parts.append(read(unit, solid(unit, normals, at, hollow=True), rng))
    return np.concatenate(parts)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with picks in two scans, for all tests to copy."""
    return written(tmp_path_factory.mktemp("picks")).parent


def project(made: Path, folder: Path) -> Path:
    """A copy of the project in a folder of the test's own."""
    for path in made.iterdir():
        shutil.copy(path, folder)
    return folder / "job.toml"


def written(folder: Path) -> Path:
    """Two scans without targets, and what was picked in them."""
    rng = np.random.default_rng(4)
    turns = np.eye(3), exp(np.array([0.0, 0.0, TURN]))
    rows = [f"C{k},{x},{y},{z}" for k, (x, y, z) in enumerate(CORNERS)]
    (folder / "points.csv").write_text("\n".join(["point,e_m,n_m,u_m", *rows[:3]]) + "\n")
    entries = ["# why these"]
    for name, place, turn in zip(("S1", "S2"), PLACES, turns, strict=True):
        np.savetxt(folder / f"{name}.xyz", scan_of(place, turn, rng), fmt="%.5f")
        for k, corner in enumerate(CORNERS):
            x, y, z = turn.T @ (corner - place) + rng.normal(0, 0.01, 3)
            use = 'use = "check"\n' if name == "S2" and k == 3 else ""
            entries.append(
                f'[[pick]]\nscan = "{name}"\nkind = "corner"\nname = "C{k}"\n{use}'
                f'place = [{x:.3f}, {y:.3f}, {z:.3f}]\nradius_m = 0.25\nreason = "no target"\n'
            )
    (folder / "edits.toml").write_text("\n".join(entries))
    (folder / "job.toml").write_text(HEAD)
    return folder / "job.toml"


def adjusted(path: Path) -> Adjustment:
    job = open_job(Project.load(path))
    work = find_and_name(job, path.parent / "out", lambda *_: None)
    return adjust(job.network(work.registered.survey, final=True))


def test_picked_corners_place_two_stations_without_a_target(made: Path, tmp_path: Path) -> None:
    adjustment = adjusted(project(made, tmp_path))
    square = 0.0
    for name, place, angle in (("S1", PLACES[0], 0.0), ("S2", PLACES[1], TURN)):
        station = adjustment.stations[name]
        turn = log(station.world_from_scanner[:3, :3] @ exp(np.array([0.0, 0.0, angle])).T)
        error = np.concatenate([station.xyz - place, turn])
        square += error @ np.linalg.solve(station.covariance, error)
        assert station.sigma.max() < 1e-3
    assert chi2.ppf(1e-3, 12) < square < chi2.ppf(0.999, 12)
    # the fourth corner is new: the first scan places it, the second is only compared
    new = adjustment.points["C3"]
    error = new.xyz - CORNERS[3]
    assert error @ np.linalg.solve(new.covariance, error) < chi2.ppf(0.999, 3)
    uses = {o.id: o.state for o in adjustment.observations if ":C3:" in o.id}
    assert {key.split(":")[1]: state for key, state in uses.items()} == {
        "S1": Use.ACTIVE.name.lower(),
        "S2": Use.CHECK.name.lower(),
    }


def test_the_command_keeps_a_pick(made: Path, tmp_path: Path) -> None:
    path = project(made, tmp_path)
    before = (tmp_path / "edits.toml").read_text()
    place = [f"{x:.3f}" for x in CORNERS[0]]
    given = ["pick", str(path), "--at", *place, "--scan", "S1", "--radius", "0.25"]
    told = ["--json", str(tmp_path / "p.json"), "--picture", str(tmp_path / "p.png")]
    run = CliRunner().invoke(app, [*given, *told, "--name", "D0", "--reason", "a door frame"])
    assert run.exit_code == 0, run.output
    data = json.loads((tmp_path / "p.json").read_text())
    np.testing.assert_allclose(data["point"]["center"], CORNERS[0], atol=1e-3)
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    edits = Project.load(path).read_edits()
    assert edits.pick[-1].name == "D0"
    assert len(edits.pick) == 9
    assert "# why these" in (tmp_path / "edits.toml").read_text()
    again = CliRunner().invoke(
        app, [*given, "--name", "D0", "--reason", "once more", "--overwrite"]
    )
    assert again.exit_code == 2
    assert "already" in again.output
    # only looked at, nothing is kept
    (tmp_path / "edits.toml").write_text(before)
    assert CliRunner().invoke(app, given).exit_code == 0
    assert (tmp_path / "edits.toml").read_text() == before


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('scan = "S2"', 'scan = "S9"', "S9"),
        ('kind = "corner"', 'kind = "axis"', "no axis was found"),
        ('name = "C1"', 'name = "C0"', "decided twice"),
        ("radius_m = 0.25", "radius_m = 0.001", "points are around it"),
        ('reason = "no target"', "", "reason"),
    ],
)
def test_picks_that_are_none_are_refused(
    old: str, new: str, what: str, made: Path, tmp_path: Path
) -> None:
    path = project(made, tmp_path)
    edits = tmp_path / "edits.toml"
    edits.write_text(edits.read_text().replace(old, new))
    with pytest.raises(InputError, match=what):
        adjusted(path)
