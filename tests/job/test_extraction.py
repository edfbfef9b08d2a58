"""Targets of a scan file: every kind that is wanted, through the instrument's noise and without."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.cli.scan_jobs import SPHERES, cloud, points, project
from tests.targets.prints import NOISE, gap, scanned
from tribrach.cli import app
from tribrach.geometry.polar import polar_by_xyz
from tribrach.io.scans.formats import read_scans
from tribrach.job.find_targets import find_targets, merged
from tribrach.job.opened import open_job
from tribrach.job.scans import StationScan
from tribrach.job.steps import find_and_name
from tribrach.project.sections import TargetSection
from tribrach.scan.prepared import seen_from
from tribrach.simulate import scene as sc
from tribrach.units import SEC

BOARD, DISC, BALL = np.array([[6.0, -0.6, 0.2], [6.0, 0.1, 0.2], [5.8, 0.6, 0.2]])
WANTED = TargetSection(
    sphere_radius_m=(0.0725,), checkerboard_side_m=(0.2,), disc_radius_m=(0.08,), floor_mm=0.2
)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A scan of a wall with a board, a disc and a ball, as text."""
    things = [
        sc.rectangle((6.5, 0, 0), (-1, 0, 0), 9, 5, 0.5),
        sc.checkerboard(BOARD, (-1, 0.2, 0), 0.2, turn=0.4, margin=0.02),
        sc.disc(DISC, (-1, -0.1, 0.1), 0.08, 0.4),
        sc.sphere(BALL, 0.0725),
    ]
    xyz, light, _ = scanned(things, (-0.2, 0.2), (1.45, 1.65), 1e-3, 3)
    path = tmp_path_factory.mktemp("scan") / "wall.csv"
    rows = np.column_stack([xyz, light])
    np.savetxt(path, rows, fmt="%.5f", delimiter=",", header="x,y,z,intensity", comments="")
    return path


@pytest.mark.parametrize("noise", [NOISE, None])
def test_every_kind_is_found_in_one_scan(file, noise):
    scan = StationScan("wall", "S1", read_scans(file)[0], noise, False, {})
    findings = find_targets(scan, WANTED)
    assert sorted(d.kind for d in findings.detections) == ["checkerboard", "disc", "sphere"]
    truth = {"checkerboard": BOARD, "disc": DISC, "sphere": BALL}
    for d in findings.detections:
        assert gap(d.center, truth[d.kind]) < 1e-3
        # no centre falls below the floor
        assert d.sigmas.min() >= 0.2e-3
    assert findings.panorama is not None
    assert findings.panorama.kinds == tuple(d.kind for d in findings.detections)
    assert len(merged([findings, findings])["S1"]) == 3


def test_a_coarse_detection_of_a_target_is_no_second_target(file):
    """Half a pitch of a coarse scan is more than any fixed distance; bodies do not overlap."""
    scan = StationScan("wall", "S1", read_scans(file)[0], NOISE, False, {})
    findings = find_targets(scan, WANTED)
    (fine,) = (d for d in findings.detections if d.kind == "checkerboard")
    coarse = replace(
        fine,
        center=fine.center + np.array([0, 0.03, 0.02]),
        covariance=1e-4 * np.eye(3),
        scan="overview",
    )
    beside = replace(coarse, center=fine.center + np.array([0, 0.15, 0.15]))
    both = replace(findings, detections=(coarse, fine, beside))
    assert [d.scan for d in merged([both])["S1"]] == ["wall", "overview"]


def test_the_command_finds_every_kind(file, tmp_path):
    out = tmp_path / "found.json"
    sizes = ["--sphere", "0.0725", "--checkerboard", "0.2", "--disc", "0.08"]
    result = CliRunner().invoke(app, ["targets", str(file), *sizes, "--json", str(out), "-q"])
    assert result.exit_code == 0, result.output
    found = json.loads(out.read_text())["targets"]
    assert {t["kind"] for t in found} == {"checkerboard", "disc", "sphere"}
    assert len(found) == 3


PLACE = (500.0, 2000.0, 30.0)


@pytest.fixture(scope="module")
def placed(file, tmp_path_factory):
    """The same scan, its points placed by another program."""
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    rows[:, :3] += PLACE
    path = tmp_path_factory.mktemp("placed") / "wall.csv"
    np.savetxt(path, rows, fmt="%.5f", delimiter=",", header="x,y,z,intensity", comments="")
    return path


def test_without_the_scanner_only_spheres_are_looked_for(placed):
    (scan,) = read_scans(placed)
    findings = find_targets(StationScan("wall", "S1", scan, NOISE, False, {}), WANTED)
    assert [d.kind for d in findings.detections] == ["sphere"]
    (said,) = findings.sentences
    assert said.startswith("wall.csv: checkerboards and discs are not looked for")
    assert "origin = [x, y, z]" in said
    only_balls = TargetSection(sphere_radius_m=(0.0725,))
    assert not find_targets(StationScan("wall", "S1", scan, NOISE, False, {}), only_balls).sentences


def test_a_scanner_elsewhere_than_at_zero_finds_the_same(file, placed):
    results = []
    for scan in (read_scans(file)[0], seen_from(read_scans(placed)[0], PLACE)):
        findings = find_targets(StationScan("wall", "S1", scan, NOISE, False, {}), WANTED)
        assert findings.sentences == ()
        results.append(sorted(findings.detections, key=lambda d: d.kind))
    for a, b in zip(*results, strict=True):
        assert (a.kind, a.points) == (b.kind, b.points)
        assert np.abs(a.center - b.center).max() < 1e-6
        assert np.allclose(a.covariance, b.covariance, rtol=1e-3)
        assert a.range == pytest.approx(b.range, abs=1e-6)


def test_the_command_takes_the_place_of_the_scanner(placed, tmp_path):
    out, run = tmp_path / "found.json", CliRunner()
    result = run.invoke(app, ["targets", str(placed), "--checkerboard", "0.2", "--json", str(out)])
    assert result.exit_code == 2
    assert "give its coordinates with --origin x y z" in " ".join(result.output.split())
    assert not out.exists()
    result = run.invoke(app, ["targets", str(placed), "--sphere", "0.0725", "--disc", "0.08"])
    assert result.exit_code == 0
    assert "discs are not looked for" in result.output
    at = ["--origin", *map(str, PLACE)]
    result = run.invoke(
        app, ["targets", str(placed), "--checkerboard", "0.2", *at, "--json", str(out)]
    )
    assert result.exit_code == 0, result.output
    (board,) = json.loads(out.read_text())["targets"]
    assert gap(np.array(board["center"]) - PLACE, BOARD) < 1e-3
    wrong = ["--origin", "2000", "500", "3e6"]
    result = run.invoke(app, ["targets", str(placed), "--checkerboard", "0.2", *wrong])
    assert result.exit_code == 2
    assert "m from the points" in " ".join(result.output.split())


def test_systematic_angles_do_not_average_out_within_a_target(tmp_path):
    """Both angles of a centre get them, whatever the number of points; its range does not."""
    cloud(tmp_path / "S1.las", points())
    path = project(tmp_path, "S1.las")
    noise = "scan_angle_arcsec = 10.0"
    text, variances = path.read_text(), []
    for more in ("", "\nscan_angle_accuracy_arcsec = 26.0"):
        path.write_text(text.replace(noise, noise + more))
        work = find_and_name(open_job(path), tmp_path / "out", lambda *_: None)
        centres = next(
            o for o in work.registered.survey.network().observations if o.kind == "target_centre"
        )
        assert len(centres) == len(SPHERES)
        slope = polar_by_xyz(centres.values)
        covariance = slope @ centres.covariance @ slope.transpose(0, 2, 1)
        variances.append(np.einsum("nii->ni", covariance))
    added = variances[1] - variances[0]
    np.testing.assert_allclose(added[:, 1:], (24 * SEC) ** 2, rtol=1e-6)
    np.testing.assert_allclose(added[:, 0], 0.0, atol=1e-12)
