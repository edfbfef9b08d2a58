"""The command noise: the law of a scanner from files, its instrument file, sentences, refusals."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.scan.noisy_scenes import hall
from tribrach.cli import app
from tribrach.geometry.pose import Pose
from tribrach.instruments.range_law import RangeLaw
from tribrach.project.instrument import Instrument
from tribrach.project.instrument_file import read_instrument_file
from tribrach.simulate.instruments import PULSED
from tribrach.simulate.scanner import ScanGrid, scan

RUN = CliRunner()
LAW = RangeLaw(2e-5, -1.0, 5e-4, 1e-5, 1.0)
DATA = Path(__file__).parents[2] / ".." / "shared" / "data" / "scans"
PUMP, FOREST = DATA / "e57" / "pump.e57", DATA / "vz400i_forest" / "scan.laz"


def written(path: Path, seed: int = 31, step: float = 1e-4, light: bool = True) -> Path:
    """A LAZ file of a hall, with 16 bits of intensity."""
    scanner = replace(PULSED, noise=replace(PULSED.noise, law=LAW))
    pose, grid = Pose(np.eye(3), np.zeros(3)), ScanGrid.panorama((0.4, 2.5), 120_000)
    parts = list(scan(hall(seed, 60), pose, scanner, grid, seed))
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, step)
    las = laspy.LasData(header)
    las.xyz = np.concatenate([part.xyz for part in parts])
    if light:
        las.intensity = np.rint(65535 * np.concatenate([part.intensity for part in parts]))
    las.write(str(path))
    return path


def run(*words: object) -> str:
    """What the command says, blanks as one."""
    result = RUN.invoke(app, ["noise", *map(str, words)])
    assert result.exit_code == 0, result.output
    return " ".join(result.output.split())


@pytest.fixture(scope="module")
def hall_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("hall") / "hall.laz")


def test_law_leaves_as_instrument_file(hall_file: Path, tmp_path: Path) -> None:
    """16 bits of intensity: the law of the light holds with I over 65535."""
    out, data, html = (tmp_path / name for name in ("scanner.toml", "n.json", "n.html"))
    said = run(hall_file, "--out", out, "--json", data, "--html", html)
    table, source = read_instrument_file(out)
    assert source.startswith("estimated from planar patches of hall.laz (")
    assert "points)" in source
    noise = Instrument.model_validate(tomllib.loads(out.read_text())["instrument"]).noise()
    assert noise is not None
    assert noise.law is not None
    light = np.geomspace(max(noise.law.low / 65535, 0.01), noise.law.high / 65535, 6)
    assert noise.law.sigma(65535 * light) == pytest.approx(LAW.sigma(light), rel=0.05)
    # angles hold the divergence, the place the diameter at the exit
    assert table["scan_angle_arcsec"] == pytest.approx(14.3, rel=0.1)
    assert table["beam_exit_mm"] == pytest.approx(3.5, rel=0.1)
    assert "Noise of ranges is a law of the intensity: ranges" in said
    assert "16 bits of LAS" in said
    assert "Beyond the intensity, the range hardly matters" in said
    assert "upper bound" not in said
    document = json.loads(data.read_text())
    assert document["law"]["a"] * 1e3 == pytest.approx(table["range_law_a_mm"], rel=1e-4)
    by_light = [one for one in document["classes"] if one["by"] == "intensity"]
    assert len(by_light) == 8
    assert all(0.9 < one["chi2_dof"] < 1.1 for one in by_light)
    page = html.read_text()
    assert page.count('class="dots s0"') == 1
    assert "law of the range&#39;s noise" in page
    assert "range_law_b" in page


def test_a_sheet_is_compared_and_gives_the_beam(hall_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "p40.toml"
    said = run(hall_file, "--sheet", "Leica ScanStation P40", "--out", out)
    table = tomllib.loads(out.read_text())["instrument"]
    assert table["sheet"] == "Leica ScanStation P40"
    assert "beam_exit_mm" not in table
    assert "times that of the data sheet of Leica ScanStation P40: " in said
    assert ", stated " in said


def test_the_instrument_of_a_project_is_compared(hall_file: Path, tmp_path: Path) -> None:
    project = tmp_path / "job.toml"
    one = "range_mm = 1.0\nscan_angle_arcsec = 8.0\nbeam_exit_mm = 3.5\n"
    scans = '[[scans]]\nfile = "S.laz"\nstation = "S"\n'
    project.write_text(f"[instruments.red]\n{one}[instruments.blue]\n{one}{scans}")
    said = run(hall_file, "--project", project, "--name", "red")
    assert "times that of the project for red" in said
    for words, why in (
        ([], "no one scanner to compare with"),
        (["--name", "green"], "has no scanner green"),
        (["--sheet", "RIEGL VZ-400i"], "both state a noise"),
    ):
        result = RUN.invoke(app, ["noise", str(hall_file), "--project", str(project), *words])
        assert result.exit_code == 2
        assert why in " ".join(result.output.split())


def test_smoothed_ranges_are_recognised(hall_file: Path, tmp_path: Path) -> None:
    """Means of three ranges along the columns, where surfaces allow it."""
    las = laspy.read(hall_file)
    xyz = np.asarray(las.xyz)
    length = np.linalg.norm(xyz, axis=1)
    near = np.abs(np.diff(length)) < 0.05
    kept = np.flatnonzero(near[:-1] & near[1:]) + 1
    smooth = length.copy()
    smooth[kept] = (length[kept - 1] + length[kept] + length[kept + 1]) / 3
    las.xyz = xyz * (smooth / length)[:, None]
    las.write(str(tmp_path / "smooth.laz"))
    assert "averaged or smoothed the ranges" not in run(hall_file)
    assert "averaged or smoothed the ranges" in run(tmp_path / "smooth.laz")


def test_rounded_coordinates_and_no_intensity_are_said(tmp_path: Path) -> None:
    path = written(tmp_path / "coarse.las", step=0.002, light=False)
    said = run(path)
    assert "There is no law of the intensity: all intensities are the same" in said
    assert "Coordinates are stored in steps of 2 mm, whose rounding of 0.58 mm is taken" in said
    assert "noise below 1 mm cannot be seen" in said


def test_scans_without_planes_end_in_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "cloud.xyz"
    points = np.random.default_rng(1).normal(size=(3000, 3)) * 5
    np.savetxt(path, points, fmt="%.4f")
    result = RUN.invoke(app, ["noise", str(path), "--out", str(tmp_path / "x.toml")])
    assert result.exit_code == 2
    assert "planar patches, too few" in " ".join(result.output.split())
    assert "Traceback" not in result.output
    assert not (tmp_path / "x.toml").exists()


@pytest.mark.skipif(not PUMP.exists(), reason="trial data is not here")
def test_a_real_scan_of_a_room_is_an_upper_bound(tmp_path: Path) -> None:
    """A concrete floor at 3 to 5 m under 49 to 67 degrees: 2.1 mm along the beam, no file."""
    data = tmp_path / "pump.json"
    said = run(PUMP, "--json", data)
    document = json.loads(data.read_text())
    classes = [one for one in document["classes"] if one["by"] == "incidence"]
    assert all(0.0017 < one["observed"] < 0.0024 for one in classes)
    assert document["law"] is None
    assert "upper bound and not the noise of the scanner" in said
    assert "not seen both straight and slantwise" in said
    result = RUN.invoke(app, ["noise", str(PUMP), "--out", str(tmp_path / "pump.toml")])
    assert result.exit_code == 2
    assert not (tmp_path / "pump.toml").exists()


@pytest.mark.skipif(not FOREST.exists(), reason="trial data is not here")
def test_a_real_forest_tells_of_its_ground(tmp_path: Path) -> None:
    """No intensities, coordinates in steps of 1 mm, ground at 2 to 9 m that is no plane."""
    said = run(FOREST, "--sheet", "RIEGL VZ-400i")
    assert "all intensities are the same" in said
    assert "steps of 1 mm" in said
    assert "upper bound and not the noise of the scanner" in said
    # even this bound is below what the sheet's footprint makes of slanted surfaces
    assert "of the data sheet of RIEGL VZ-400i: less than stated" in said
