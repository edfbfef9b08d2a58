"""tribrach compare CLOUD DESIGN: verdicts by element, table, cloud, refusals."""

import csv
import json
import re
from pathlib import Path
from shutil import copyfile

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.cli.test_register import obj_of
from tests.comparison.test_as_designed import NOISE, POSE_SIGMA, WIDE, built, walls
from tribrach.cli import app
from tribrach.cloud.placement import Placement
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.io.outputs import write_texts
from tribrach.io.scans.formats import read_scans
from tribrach.job.poses import pose_texts
from tribrach.job.scans import StationScan

RUN = CliRunner()
COUNT = 6
#: deviation of each wall [m]
BUILT = np.array([0.0, 0.03, -0.025, 0.0, 0.011, 0.0])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ring of walls, a cloud of them with the poses.json of its run, tolerances."""
    place = tmp_path_factory.mktemp("design")
    shape = np.zeros((COUNT, 3))
    shape[:, 0] = BUILT
    cloud = built(COUNT, shape, np.zeros(6), np.random.default_rng(1), 3000)
    # the last wall was not seen
    cloud = cloud[: -len(cloud) // COUNT]
    np.savetxt(place / "S.xyz", cloud, fmt="%.5f")
    obj_of(walls(COUNT), place / "hall.obj")
    station = Pose(np.eye(3), np.array([0.0, 0.0, 1.5]))
    scan = StationScan("S", "S", read_scans(place / "S.xyz")[0], NOISE, True, {})
    placement = Placement("S", station, np.diag(POSE_SIGMA**2), NOISE)
    frame = OutputFrame(WorkFrame())
    write_texts(pose_texts(place, [scan], {"S": placement}, frame, "prior", None))
    (place / "tolerances.csv").write_text("element,tolerance_mm\nwall 00?,12\ndoor*,5\n")
    (place / "wrong.csv").write_text("wall,mm\nwall 001,12\n")
    return place


def called(folder: Path, *options: str) -> tuple[int, str]:
    result = RUN.invoke(app, ["compare", str(folder / "S.xyz"), str(folder / "hall.obj"), *options])
    assert "Traceback" not in result.output
    return result.exit_code, " ".join(result.output.split())


def test_verdicts_table_and_cloud_as_the_page_has_them(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "as_designed.md").read_text()
    (shown,) = re.findall(r"^tribrach (compare .*)$", page, re.MULTILINE)
    for path in folder.iterdir():
        copyfile(path, tmp_path / path.name)
    monkeypatch.chdir(tmp_path)
    result = RUN.invoke(app, shown.split())
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "hall.json").read_text())
    assert data["pose"] == "poses.json"
    verdict = {row["element"]: row["verdict"] for row in data["elements"]}
    assert [verdict[f"wall {k + 1:03d}"] for k in range(COUNT)] == [
        "within", "not within", "not within", "within", "cannot tell", "not seen",
    ]  # fmt: skip
    assert data["elements"][0]["element"] == "wall 002"
    assert data["verdicts"] == {"within": 2, "not within": 2, "cannot tell": 1, "not seen": 1}
    with (tmp_path / "hall.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["mean_mm"]) == pytest.approx(30.0, abs=0.5)
    assert [row["element"] for row in rows] == [row["element"] for row in data["elements"]]
    cloud = laspy.read(tmp_path / "hall.laz")
    second = np.asarray(cloud["element"]) == 2
    assert np.asarray(cloud["distance"])[second].mean() == pytest.approx(0.03, abs=5e-4)
    assert (np.asarray(cloud["verdict"])[second] == 2).mean() > 0.9
    assert np.median(np.asarray(cloud["sigma"])) == pytest.approx(0.0037, rel=0.3)
    assert "door*" in result.output


def test_a_pose_that_nobody_knows_judges_nothing(folder: Path, tmp_path: Path) -> None:
    alone = tmp_path / "S.xyz"
    alone.write_bytes((folder / "S.xyz").read_bytes())
    (tmp_path / "hall.obj").write_bytes((folder / "hall.obj").read_bytes())
    found = tmp_path / "d.json"
    code, said = called(tmp_path, "--tolerance-mm", "12", "--json", str(found))
    assert code == 0, said
    data = json.loads(found.read_text())
    assert data["pose"] is None
    assert set(data["verdicts"]) == {"not judged", "not seen"}
    code, said = called(
        tmp_path, "--tolerance-mm", "12", "--registration-mm", "2", "--json", str(found),
        "--overwrite",
    )  # fmt: skip
    assert code == 0, said
    data = json.loads(found.read_text())
    assert data["pose"] == "stated"
    assert data["verdicts"]["not within"] == 2


def test_faces_are_elements_where_there_are_no_parts(folder: Path, tmp_path: Path) -> None:
    found = tmp_path / "d.json"
    code, said = called(folder, "--by", "faces", "--tolerance-mm", "12", "--json", str(found))
    assert code == 0, said
    data = json.loads(found.read_text())
    seen = [row for row in data["elements"] if row["verdict"] != "not seen"]
    assert len(data["elements"]) == 6 * COUNT
    assert len(seen) == COUNT - 1
    assert all(row["seen"] > 0.8 for row in seen)
    assert WIDE == 3.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--model-unit", "mm"], "--model-unit"),
        (["--sites", "tolerances.csv"], "two clouds"),
        (["--registration-mm", "3"], "poses.json"),
        (["--tolerances", "wrong.csv"], "tolerated"),
        (["--place-m", "0.001"], "0.01"),
    ],
)
def test_refusals(folder: Path, options: list[str], words: str) -> None:
    files = [str(folder / o) if o.endswith((".csv", ".obj")) else o for o in options]
    code, said = called(folder, *files)
    assert code == 2
    assert words in said


def test_a_model_in_millimetres_is_doubted(folder: Path, tmp_path: Path) -> None:
    obj_of(walls(COUNT), tmp_path / "hall.obj", 1000.0)
    (tmp_path / "S.xyz").write_bytes((folder / "S.xyz").read_bytes())
    code, said = called(tmp_path)
    assert code == 2
    assert "millimetres" in said
    code, said = called(tmp_path, "--model-unit", "mm")
    assert code == 0, said


def test_options_of_models_are_none_of_clouds(folder: Path) -> None:
    cloud = str(folder / "S.xyz")
    result = RUN.invoke(app, ["compare", cloud, cloud, "--tolerance-mm", "5"])
    assert result.exit_code == 2
    assert "--tolerance-mm" in result.output
