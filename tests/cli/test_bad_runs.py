"""Runs whose scans or lists do not fit: what is said, and that nothing is half-written."""

import re
import shutil
from pathlib import Path

import laspy
import numpy as np
import pye57
import pytest

from tests.cli.scan_jobs import POSE, SPHERES, cloud, control, points, project
from tests.cli.test_bad_scans import RUN, end
from tribrach.cli import app
from tribrach.io.scans.formats import read_scans


def files(folder: Path) -> set[str]:
    """What a run left, without what it remembers for the next one."""
    out = folder / "out"
    found = {str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()}
    assert not [name for name in found if name.endswith(".part")]
    return {name for name in found if ".tribrach" not in name}


def runs(path: Path) -> str:
    """What a run says that must end well, on one line."""
    result = RUN.invoke(app, ["run", str(path)])
    assert result.exit_code == 0, result.output
    return " ".join(result.stdout.split())


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a job that was run once, so that targets need no new search."""
    folder = tmp_path_factory.mktemp("job")
    cloud(folder / "S1.las", points())
    runs(project(folder, "S1.las"))
    assert files(folder) >= {"report.html", "clouds/S1.las", "clouds/poses.csv"}
    return folder


@pytest.fixture
def job(done: Path, tmp_path: Path) -> Path:
    """The project in a folder of its own, without products."""
    folder = tmp_path / "job"
    shutil.copytree(done, folder)
    for product in [p for p in (folder / "out").iterdir() if p.name != ".tribrach"]:
        shutil.rmtree(product) if product.is_dir() else product.unlink()
    return folder / "job.toml"


def said_by(job: Path, *, sought: bool = False) -> str:
    """The sentence of a run that must be refused and leave nothing but targets that it found."""
    said = end("run", job)
    left = {"targets/targets.json", "targets/1-S1.png"}
    assert files(job.parent) == (left if sought else set())
    return said


def test_swapped_north_and_east(job: Path) -> None:
    control(job.parent / "control.csv", (POSE @ SPHERES)[:, [1, 0, 2]])
    said = said_by(job, sought=True)
    assert "first two columns swapped (the determinant is -1)" in said
    assert "check which column is East and which is North" in said


def test_no_matching(job: Path) -> None:
    control(job.parent / "control.csv", POSE @ (1.1 * SPHERES))
    said = said_by(job, sought=True)
    assert "station S1 cannot be matched" in said
    assert "no 3 targets have the mutual distances of 3 points" in said


def test_several_matchings_are_not_guessed(job: Path) -> None:
    """A second group of the same points in another place: both fit."""
    there = POSE @ SPHERES
    again = there @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [5000.0, 0.0, 0.0]
    names = [f"T{k}" for k in range(5)] + [f"U{k}" for k in range(5)]
    control(job.parent / "control.csv", np.concatenate([there, again]), names)
    said = said_by(job, sought=True)
    assert "5 targets fit in 2 ways" in said
    assert "name one of its targets" in said
    x, y, z = SPHERES[2]
    named = f"[[scans]]\nnames = {{ U2 = [{x}, {y}, {z}] }}\n"
    job.write_text(job.read_text().replace("[[scans]]\n", named))
    runs(job)
    rows = (job.parent / "out" / "clouds" / "poses.csv").read_text().splitlines()
    east = float(rows[1].split(",")[rows[0].split(",").index("m03")])
    expected = POSE.translation @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [5000.0, 0, 0]
    assert east == pytest.approx(expected[0], abs=2e-3)


@pytest.mark.parametrize("value", ["nan", "inf", "1e999", "north"])
def test_a_list_with_coordinates_that_are_no_numbers(job: Path, value: str) -> None:
    path = job.parent / "control.csv"
    path.write_text(re.sub(r"^T2,[^,]*,", f"T2,{value},", path.read_text(), flags=re.MULTILINE))
    assert "control.csv:4" in said_by(job)


def test_two_scans_of_one_name(job: Path) -> None:
    (job.parent / "b").mkdir()
    shutil.copy(job.parent / "S1.las", job.parent / "b" / "S1.las")
    job.write_text(job.read_text() + '[[scans]]\nfile = "b/S1.las"\n')
    said = said_by(job)
    assert "two scans have the name S1" in said
    assert "give each file a station of its own" in said


def test_two_scans_of_one_name_in_one_file(tmp_path: Path) -> None:
    """They are told apart, which is said; both go into one copy of their file."""
    file = pye57.E57(str(tmp_path / "both.e57"), mode="w")
    for seed in (1, 2):
        xyz = points(seed=seed)
        file.write_scan_raw({f"cartesian{a}": xyz[:, k] for k, a in enumerate("XYZ")}, name="hall")
    file.close()
    job = project(tmp_path, "both.e57")
    job.write_text(job.read_text().replace('"las"', '"e57"').replace('origin = "scanner"\n', ""))
    said = runs(job)
    assert "another scan has the name 'hall' too, this one is called 'hall-2'" in said
    assert "both.e57 has the points of both.e57 byte for byte: sigmas are not in it" in said
    assert {p.name for p in (tmp_path / "out" / "clouds").iterdir()} == {
        "both.e57",
        "poses.csv",
        "poses.json",
        "poses_covariance.npy",
        "poses_given.npy",
    }
    for scan in read_scans(tmp_path / "out" / "clouds" / "both.e57"):
        assert scan.pose is not None
        assert scan.pose.translation == pytest.approx(POSE.translation, abs=3e-3)


def test_merged_e57_of_several_files(job: Path) -> None:
    """Refused before anything is computed."""
    shutil.copy(job.parent / "S1.las", job.parent / "S2.las")
    text = job.read_text().replace('format = "las"', 'format = "e57"\nmerged = true')
    job.write_text(text + '[[scans]]\nfile = "S2.las"\n')
    line = job.read_text().splitlines().index("merged = true") + 1
    said = said_by(job)
    assert f"job.toml:{line}: clouds in E57 keep points in the frame of their scanner" in said
    assert "say merged = false" in said


def test_the_second_scan_is_damaged(job: Path) -> None:
    """What was found in the first is remembered; nothing else is there."""
    data = (job.parent / "S1.las").read_bytes()
    (job.parent / "S2.las").write_bytes(data[:-20_000])
    job.write_text(job.read_text() + '[[scans]]\nfile = "S2.las"\norigin = "scanner"\n')
    assert "S2.las" in said_by(job)


def test_without_an_origin_there_are_no_sigmas(tmp_path: Path) -> None:
    """Points that lie far from zero; how well each is known depends on where the scanner stood."""
    cloud(tmp_path / "S1.las", points() + np.array([5000.0, 100.0, 0.0]))
    job = project(tmp_path, "S1.las")
    job.write_text(job.read_text().replace('origin = "scanner"\n', ""))
    said = runs(job)
    assert "S1.las has no sigmas of points because of scan S1: where the scanner stood" in said
    assert 'say origin = "scanner"' in said
    result = RUN.invoke(app, ["targets", str(tmp_path / "S1.las"), "--sphere", "0.1"])
    assert "5 targets" in result.stdout
    assert "nan" not in result.stdout
    made = laspy.read(tmp_path / "out" / "clouds" / "S1.las")
    assert not set(made.point_format.extra_dimension_names) & {"sigma_x", "sigma_y", "sigma_z"}


def test_points_that_were_placed_already_and_their_scanner(done: Path, tmp_path: Path) -> None:
    """With the scanner's place everything is as if the points had never been moved."""
    at = np.array([5000.0, 100.0, 10.0])
    cloud(tmp_path / "S1.las", points() + at)
    job = project(tmp_path, "S1.las")
    job.write_text(job.read_text().replace('"scanner"\n', "[5000.0, 100.0, 10.0]\n"))
    runs(job)
    ours, theirs = (laspy.read(f / "out" / "clouds" / "S1.las") for f in (tmp_path, done))
    assert np.abs(ours.xyz - theirs.xyz).max() < 1e-4
    for name in ("sigma_x", "sigma_y", "sigma_z"):
        assert ours[name] == pytest.approx(theirs[name], rel=1e-3)
    job.write_text(job.read_text().replace("[5000.0, 100.0, 10.0]", "[100.0, 5000.0, 10.0]"))
    shutil.rmtree(tmp_path / "out")
    said = said_by(job)
    assert "the place given for the scanner is" in said
    job.write_text(job.read_text().replace("[100.0, 5000.0, 10.0]", '[100.0, "x"]'))
    assert "origin" in said_by(job)
