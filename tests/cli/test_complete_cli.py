"""The command complete: clouds, models, sigmas, several stations in a file, wrong calls."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.comparison.test_completeness import wall
from tests.io.models.test_triangle_files import binary
from tribrach.cli import app

RUN = CliRunner()


def cloud(path: Path, xyz: np.ndarray, **fields: np.ndarray) -> Path:
    """A cloud with further fields, as text."""
    columns = [*xyz.T, *fields.values()]
    head = "//X Y Z " + " ".join(fields)
    np.savetxt(path, np.stack(columns, axis=1), fmt="%.4f", header=head.strip(), comments="")
    return path


def sigmas(n: int, total: float) -> dict[str, np.ndarray]:
    each = np.full(n, total / np.sqrt(3))
    return {f"sigma_{axis}": each for axis in "xyz"}


def run(*words: object) -> str:
    result = RUN.invoke(app, ["complete", *map(str, words)])
    assert result.exit_code == 0, result.output
    return result.output


def test_union_of_two_clouds(tmp_path: Path) -> None:
    a, b = (cloud(tmp_path / f"{n}.txt", wall(*s)) for n, s in (("A", (0, 6)), ("B", (4, 10))))
    said = run(a, b, "--json", tmp_path / "c.json", "--html", tmp_path / "c.html")
    assert "20.0 m² in 2,000 cells of 0.1 m" in said
    assert "80 % by one station, 20 % by two stations" in said
    data = json.loads((tmp_path / "c.json").read_text())
    assert data["seen_by"]["one station"] == 1600
    assert set(data["stations"]) == {"A", "B"}
    page = (tmp_path / "c.html").read_text()
    assert page.count("<figure") == 1
    assert page.count('class="spots"') == 2
    assert "Seen by how many stations" in page


def test_model_and_sigma(tmp_path: Path) -> None:
    xyz = wall(0, 6)
    a = cloud(tmp_path / "A.txt", xyz, **sigmas(len(xyz), 0.006))
    corners = np.array([[[0, 0.05, 0], [10, 0.05, 0], [10, 0.05, 2]],
                        [[0, 0.05, 0], [10, 0.05, 2], [0, 0.05, 2]]])  # fmt: skip
    mesh = tmp_path / "wall.stl"
    mesh.write_bytes(binary(corners))
    page = tmp_path / "c.html"
    said = run(a, "--model", mesh, "--sigma-mm", 5, "--html", page)
    share = float(said.split("seen: ")[1].split("%")[0])
    assert share == pytest.approx(40, abs=0.5)
    assert "0 % of what is seen reaches it" in said
    assert "Seen by no station: " in said
    assert page.read_text().count("<figure") == 2
    points = run(a, "--model", cloud(tmp_path / "m.txt", wall(0, 10)), "--sigma-mm", 7)
    assert "40 % by no station" in points
    assert "100 % of what is seen reaches it" in points


def test_stations_named_by_points(tmp_path: Path) -> None:
    xyz = wall(0, 3)
    number = (xyz[:, 0] > 1.5).astype(float)
    merged = cloud(tmp_path / "all.txt", xyz, station=number)
    data = tmp_path / "c.json"
    run(merged, "--json", data, "-q")
    assert len(json.loads(data.read_text())["stations"]) == 2


def test_scans_of_one_station_are_one(tmp_path: Path) -> None:
    files = [
        cloud(tmp_path / "S1.txt", wall(0, 3)),
        cloud(tmp_path / "S1_fine.txt", wall(0, 3)),
        cloud(tmp_path / "S2.txt", wall(0, 3)),
    ]
    names = (("S1", "S1"), ("S1 fine", "S1"), ("S2", "S2"))
    rows = [{"scan": scan, "station": station} for scan, station in names]
    assert "100 % by three and more" in run(*files)
    (tmp_path / "poses.json").write_text(json.dumps({"scans": rows}))
    assert "100 % by two stations" in run(*files)
    xyz = wall(0, 3)
    merged = cloud(tmp_path / "all.txt", np.vstack([xyz] * 3),
                   station=np.repeat([0.0, 1.0, 2.0], len(xyz)))  # fmt: skip
    assert "100 % by two stations" in run(merged)


def test_files_of_one_name_are_two_stations(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    files = [cloud(tmp_path / folder / "A.txt", wall(0, 2)) for folder in "ab"]
    assert "100 % by two stations" in run(*files)


def test_wrong_calls_end_in_a_sentence(tmp_path: Path) -> None:
    a = cloud(tmp_path / "A.txt", wall(0, 2))
    (tmp_path / "poses").mkdir()
    (tmp_path / "poses" / "poses.json").write_text('{"scans": [1]}')
    b = cloud(tmp_path / "poses" / "B.txt", wall(0, 2))
    (tmp_path / "bad.stl").write_bytes(b"no mesh at all")
    for words, said in (
        ([a, "--sigma-mm", 5], "has no sigmas of points"),
        ([tmp_path / "none.laz"], "there is no such file"),
        ([a, a], "the cloud is given twice"),
        ([a, "--model", tmp_path / "bad.stl"], "no STL file"),
        ([b], "this is no file of poses"),
    ):
        result = RUN.invoke(app, ["complete", *map(str, words)])
        assert result.exit_code == 2
        assert said in result.output
        assert "Traceback" not in result.output
