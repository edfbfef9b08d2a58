"""The commands of the tutorials do what their pages say."""

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.geometry import rotation
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.point_list import point_list_text, read_point_list
from tribrach.io.scans.formats import read_scans
from tribrach.io.twins import write_twin
from tribrach.simulate.twins import build

RUN = CliRunner()
DOCS = Path(__file__).resolve().parents[1] / "docs"


def commands(page: str) -> list[list[str]]:
    """Calls of the program on a page."""
    text = (DOCS / f"{page}.md").read_text()
    blocks = re.findall(r"^```\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    lines = [shlex.split(line) for block in blocks for line in block.splitlines()]
    return [line[1:] for line in lines if line and line[0] == "tribrach"]


def call(words: list[str]) -> str:
    result = RUN.invoke(app, words)
    assert result.exit_code == 0, (words, result.output)
    return result.output


def test_transformations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every command of the page, on points of a known transformation."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(1)
    a = rng.uniform(-30, 30, (8, 3))
    turn, shift = rotation.exp(np.array([0.01, 0.02, 1.2])), np.array([4e5, 5.2e6, 310.0])
    names, c = [f"P{k}" for k in range(8)], np.tile(1e-6 * np.eye(3), (8, 1, 1))
    b = a @ turn.T + shift + rng.normal(0, 0.001, a.shape)
    for name, xyz in (("scanner.csv", a), ("site.csv", b), ("more.csv", a + 1.0)):
        Path(name).write_text(point_list_text(names, xyz, c))
    with create(Path("S1.laz"), CloudHeader("S1")) as writer:
        writer.write(a, {})
    calls = commands("transform")
    assert len(calls) == 4
    for words in calls:
        call(words)
    assert read_point_list(Path("moved.csv")).xyz == pytest.approx(
        (a + 1) @ turn.T + shift, abs=0.01
    )
    chunk = next(read_scans(Path("back.laz"))[0].chunks())
    assert chunk.xyz == pytest.approx(a, abs=3e-4)


def courtyard(folder: Path, stations: tuple[str, ...], points: int, seed: int) -> Path:
    """The twin with some of its stations."""
    twin = build("sphere-courtyard", points, seed)
    kept = [s for s in twin.stations if s.name in stations]
    scans = [s for s in twin.scans if s.station in stations]
    return write_twin(replace(twin, stations=kept, scans=scans), folder, truth=500)


def chapter(folder: Path) -> dict:
    return json.loads((folder / "out" / "result.json").read_text())


def check_courtyard(folder: Path, data: dict) -> None:
    """Marks, spheres and what is said to be absolute, against the truth."""
    found = data["georeferencing"]
    common = found["absolute"]["common"]["common shift of session 1"]
    assert common["sigma"] == pytest.approx(np.sqrt(0.5) * np.array([0.02, 0.02, 0.05]))
    assert (np.array(found["absolute"]["shift"]) > common["sigma"]).all()
    assert found["relative"]["pair"][2] < 0.005 < found["absolute"]["shift"][2]
    assert found["check"]["points"] == 2
    truth = json.loads((folder / "truth" / "truth.json").read_text())["points"]
    for name in ("M1", "M4", "P2", "P6"):
        error = np.array(data["points"][name]["xyz"]) - truth[name]
        square = error @ np.linalg.solve(np.array(data["points"][name]["covariance"]), error)
        assert square < chi2.ppf(0.9995, 3), name


def test_courtyard_with_three_stations(tmp_path: Path) -> None:
    """From marks through rods and spheres to stations; then the recipe, which keeps one height."""
    path = courtyard(tmp_path, ("S2", "S3"), 10_000, 2)
    call(["run", str(path), "-q"])
    data = chapter(tmp_path)
    check_courtyard(tmp_path, data)
    text = path.read_text() + '\n[adjustment]\nheights = "recipe"\nheight_mark = "M2"\n'
    path.write_text(text)
    call(["run", str(path), "-q"])
    recipe = chapter(tmp_path)
    assert any("that of M2 is kept with its whole error" in w for w in recipe["warnings"])
    rows = (tmp_path / "gnss.csv").read_text().splitlines()
    given = {r.split(",")[0]: r.split(",") for r in rows[1:]}
    for mark, row in given.items():
        antenna = float(row[4]) - float(row[5])
        height = recipe["points"][mark]["xyz"][2]
        if mark == "M2":
            assert height == pytest.approx(antenna, abs=3e-3)
    gap = {m: recipe["points"][m]["xyz"][2] - data["points"][m]["xyz"][2] for m in given}
    # the recipe moves all marks by what the one height is wrong against the others
    assert np.ptp(list(gap.values())) < 3e-3
    assert abs(np.mean(list(gap.values()))) > 5e-3


@pytest.mark.slow
def test_courtyard_as_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The commands of the page themselves, all stations; its numbers are those of the report."""
    monkeypatch.chdir(tmp_path)
    calls = commands("courtyard")
    assert [words[0] for words in calls] == ["simulate", "run"]
    for words in calls:
        call([*words, "-q"])
    folder = tmp_path / "courtyard"
    data = chapter(folder)
    check_courtyard(folder, data)
    found = data["georeferencing"]
    assert found["absolute"]["shift"] == pytest.approx([0.015, 0.015, 0.038], abs=6e-4)
    assert np.degrees(found["absolute"]["turn"][2]) * 3600 == pytest.approx(94, abs=2)
    assert found["relative"]["pair"] == pytest.approx([0.003, 0.005, 0.0005], abs=3e-4)
