"""One project file from RINEX and a scan to report and cloud: the scanner under a rover's antenna.

Truth: the exact place of the simulated rover, the published one of the permanent station; pose,
lever arm and spheres of the simulated scan; PROJ for the coordinates of the cloud. Method 7.4.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyproj import Transformer
from scipy.stats import chi2

from tests.job.rover_jobs import (
    ARM,
    SPHERES,
    Job,
    Receivers,
    by_position,
    geonet,
    spirent,
    write_project,
)
from tribrach.errors import NoStartValues
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.gnss.engine import engines
from tribrach.io.scans.formats import read_scans
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.report.content import Report

needs_engine = pytest.mark.skipif(not engines(), reason="RTKLIB is not installed")
ECEF = 'frame = "ecef"'
#: a point of central Europe with a position of its own: no files of receivers are needed
ANYWHERE = Receivers(
    np.array([4157177.066, 671230.477, 4774767.031]),
    np.array([4156857.120, 673209.029, 4774767.031]),
    (Path(), Path()),
    (),
    "",
    "EPSG:32632",
    2023.02,
)


def dynamic(place: Receivers) -> str:
    return f'frame = "ITRF2014"\nepoch = {place.epoch}'


def delivered(job: Job, station: str) -> tuple[Pose, np.ndarray]:
    """The pose of a scan and its covariance, as other programs get them."""
    file = job.path.parent / "out" / "clouds" / "poses.json"
    (found,) = (s for s in json.loads(file.read_text())["scans"] if s["station"] == station)
    matrix = np.array(found["world_from_scanner"])
    return Pose(matrix[:3, :3], matrix[:3, 3]), np.array(found["covariance"])


def agrees(job: Job) -> None:
    """Geocentric poses lie where the truth is, as far as covariances say; the clouds too."""
    for station in job.poses:
        found, covariance = delivered(job, station)
        true = job.geocentric(station)
        turned = rotation.log((found.rotation @ true.rotation.T)[None])[0]
        error = np.concatenate([found.translation - true.translation, turned])
        assert error @ np.linalg.solve(covariance, error) < chi2.ppf(0.999, 6)
        # 2 to 5 mm of baseline and lever arm, 8 mm of the spheres over their distance
        assert np.abs(error[:3]).max() < 0.03
        assert np.sqrt(np.diag(covariance)).max() < 0.02
        cloud = written(job.path.parent, station)
        # as in the file, which has steps of 0.2 mm
        assert np.abs(cloud - found @ job.points[station]).max() < 2e-4


def written(folder: Path, station: str = "S1") -> np.ndarray:
    (scan,) = read_scans(folder / "out" / "clouds" / f"{station}.ply")
    return np.concatenate([chunk.xyz for chunk in scan.chunks()])


def words(job: Job) -> str:
    return " ".join((job.path.parent / "out" / "report.txt").read_text().split())


def result(job: Job) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((job.path.parent / "out" / "result.json").read_text())
    return found


@needs_engine
@pytest.mark.data
@pytest.mark.parametrize("receivers", [spirent, geonet])
def test_from_rinex_and_a_scan_to_a_geocentric_cloud(
    receivers: Callable[[Path], Receivers], shared_data: Path, tmp_path: Path
) -> None:
    """Antenna and two surveyed spheres of five place the scan; nobody names any of them."""
    place = receivers(shared_data)
    job = write_project(tmp_path, place, dynamic(place), cloud=ECEF)
    content = run(Project.load(job.path))
    agrees(job)
    # nine coordinates and three components of the lever arm for pose and lever arm
    assert content.summary.dof == 3
    assert content.summary.test.accepted
    data = result(job)
    (baseline,) = data["gnss"]["baselines"]
    assert baseline["fixed_share"] == 1
    rover = data["points"]["ROVER"]["ecef"]
    np.testing.assert_allclose(rover, place.rover, atol=0.015)
    arm = data["lever_arm_calibration"]["antenna"]
    error = np.array(arm["vector"]) - ARM
    assert error @ np.linalg.solve(arm["covariance"], error) < chi2.ppf(0.999, 3)
    said = words(job)
    for expected in (
        "S1 is placed by 2 of its 5 targets and the antenna",
        "1 session gave 1 independent baseline, computed by RTKLIB",
        f"in 100 % of {baseline['epochs']} epochs",
        f"Coordinates are in ITRF2014 at epoch {place.epoch:.2f}.",
        "rests on 1 GNSS baseline, 2 weighted control points, 1 held point",
        "Absolute: the site as a whole is known to",
        "Relative: two places of the site are known to each other to",
        "Lever arm antenna, carried by 1 station",
        "There are no check points",
    ):
        assert expected in said
    header = (tmp_path / "out" / "clouds" / "S1.ply").read_bytes()[:2000].decode("latin-1")
    assert f"comment epoch: {place.epoch}" in header


@needs_engine
@pytest.mark.data
def test_a_station_without_antenna_follows_by_its_targets(
    shared_data: Path, tmp_path: Path
) -> None:
    """The second scanner sees the same spheres, two of them with coordinates."""
    place = geonet(shared_data)
    turn = rotation.exp(np.array([0.01, -0.015, 2.8]))
    second = {"S2": Pose(turn, np.array([4.0, 6.0, -0.5]))}
    job = write_project(tmp_path, place, dynamic(place), cloud=ECEF, others=second)
    content = run(Project.load(job.path))
    agrees(job)
    # three more targets, seen by both, and six unknowns of the second station
    assert content.summary.dof == 3 + 2 * 3 + 3 * 3 - 6
    assert "S2 is placed by 5 of its 5 targets" in words(job)


@needs_engine
@pytest.mark.data
def test_the_same_in_a_projection_with_check_points(shared_data: Path, tmp_path: Path) -> None:
    """Base and spheres geocentric, cloud in UTM: each point where PROJ puts that of the other."""
    place = spirent(shared_data)
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    checks = ("C1", "C2", "C3")
    site = f'crs = "{place.grid}"\n{dynamic(place)}'
    one = write_project(tmp_path / "a", place, site, checks=checks)
    two = write_project(tmp_path / "b", place, site, checks=checks, cloud=ECEF)
    content = run(Project.load(one.path))
    run(Project.load(two.path))
    agrees(two)
    steps = (
        "+proj=pipeline +step +inv +proj=cart +ellps=GRS80 "
        "+step +proj=utm +zone=32 +ellps=GRS80"
    )  # fmt: skip
    expected = Transformer.from_pipeline(steps).transform(*written(two.path.parent).T)
    np.testing.assert_allclose(written(one.path.parent), np.stack(expected, axis=1), atol=5e-4)
    rows = {c.name: c for c in content.control if c.use == "check"}
    assert set(rows) == set(checks)
    assert all(c.verdict is not None and c.verdict.agrees for c in rows.values())
    said = words(one)
    assert "3 check points differ by" in said
    assert "EPSG:32632" in said
    assert "lengths differ from those on the ground by" in said
    # E, N, h and latitude, longitude, height of an adjusted sphere
    points = result(one)["points"]
    geocentric = np.array(points["C1"]["ecef"])
    plan = Transformer.from_pipeline(steps).transform(*geocentric)
    np.testing.assert_allclose(points["C1"]["projected"], plan, atol=1e-4)
    true = place.local.to_ecef(np.array([SPHERES["C1"]]))[0]
    assert np.abs(geocentric - true).max() < 0.06


@needs_engine
@pytest.mark.data
def test_an_antenna_with_a_height_over_a_mark_is_asked_about(
    shared_data: Path, tmp_path: Path
) -> None:
    """Receivers often write the height of the last pole; here the lever arm takes it up."""
    place = geonet(shared_data)
    job = write_project(tmp_path, place, dynamic(place), cloud="write = false")
    text = job.path.read_text()
    assert "antenna_height_m = 0.0" in text
    job.path.write_text(text.replace("antenna_height_m = 0.0", "antenna_height_m = 0.2"))
    content = run(Project.load(job.path))
    (said,) = [text for text in content.warnings if "mounted on S1" in text]
    assert "to ROVER" in said
    assert "end 0.200 m under the reference point of its antenna" in said
    assert result(job)["gnss"]["baselines"][0]["antenna_heights"][1] == 0.2


def by_position_alone(folder: Path, **options: Any) -> tuple[Job, Report]:
    """A run without files of receivers: the antenna's position is given."""
    job = write_project(
        folder,
        ANYWHERE,
        dynamic(ANYWHERE),
        cloud=ECEF,
        station=options.pop("station", ""),
        measured=by_position,
        **options,
    )
    return job, run(Project.load(job.path))


def test_a_position_of_the_antenna_and_two_spheres(tmp_path: Path) -> None:
    """As method 7.4: antenna and two targets, the others as check points by their places."""
    job, content = by_position_alone(tmp_path)
    agrees(job)
    assert content.summary.dof == 3
    assert "S1 is placed by 2 of its 5 targets and the antenna" in words(job)


def test_a_levelled_scan_needs_one_sphere(tmp_path: Path) -> None:
    job, content = by_position_alone(
        tmp_path,
        station="levelled = true\nlevelling_arcsec = 20",
        known=("T1",),
        lean=1e-4,
    )
    agrees(job)
    assert content.summary.dof == 2
    assert "S1 is placed by 1 of its 5 targets and the antenna" in words(job)


def test_a_lever_arm_that_nobody_knows_places_nothing(tmp_path: Path) -> None:
    job = write_project(tmp_path, ANYWHERE, dynamic(ANYWHERE), station="", measured=by_position)
    job.path.write_text(job.path.read_text().replace("sigma_mm = 4.0", "sigma_mm = 500"))
    with pytest.raises(NoStartValues, match="station S1 shares no target with the rest"):
        run(Project.load(job.path))
