"""Clouds of scanners with a law of the noise of ranges: sigmas by the intensity of each point."""

from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest

from tests.job.cloud_jobs import NOISE, made, opened, placed
from tests.job.test_clouds import WORK, in_a_room
from tribrach.cloud.covariance import sigmas
from tribrach.errors import InputError
from tribrach.instruments.range_law import RangeLaw
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.job.cloud_file import open_cloud, station_pair
from tribrach.job.compare import compare_clouds
from tribrach.job.poses import pose_texts, read_poses
from tribrach.job.scans import StationScan
from tribrach.scan.scan import Field

LAW = RangeLaw(0.06, -0.6, 0.0003, 20.0, 200.0)


def lawful(*paths: Path, law: RangeLaw = LAW) -> list[StationScan]:
    return [replace(scan, noise=replace(NOISE, law=law)) for scan in opened(*paths)]


def test_each_point_has_the_sigma_of_its_intensity(tmp_path: Path) -> None:
    xyz = in_a_room(tmp_path / "S1.las")
    scans = lawful(tmp_path / "S1.las")
    places = placed(scans)
    (product,) = made(scans, places, WORK, tmp_path, format="las", incidence=True)
    cloud = laspy.read(product.path)
    light = np.arange(len(xyz)) % 200
    expected = sigmas(xyz, places[scans[0].name], None, light)
    for k, axis in enumerate("xyz"):
        np.testing.assert_allclose(cloud[f"sigma_{axis}"], expected[:, k], rtol=2e-3)
    # intensities 0 to 19 of 0 to 199
    (said,) = product.sentences
    assert "10 % of the points" in said
    assert "(20 to 200)" in said


def test_within_the_law_nothing_is_said_and_without_intensities_the_sheet_is(
    tmp_path: Path,
) -> None:
    in_a_room(tmp_path / "S1.las")
    xyz = in_a_room(tmp_path / "S2.ply", fields=())
    wide = replace(LAW, low=1.0)
    scans = lawful(tmp_path / "S1.las", tmp_path / "S2.ply", law=wide)
    places = placed(scans)
    quiet, other = made(scans, places, WORK, tmp_path, format="las")
    assert quiet.sentences == ()
    (said,) = other.sentences
    assert "has no intensities" in said
    stated = sigmas(xyz, replace(places[scans[1].name], noise=NOISE))
    np.testing.assert_allclose(laspy.read(other.path)["sigma_x"], stated[:, 0], rtol=2e-3)


def test_poses_keep_the_law(tmp_path: Path) -> None:
    in_a_room(tmp_path / "S1.las")
    scans = lawful(tmp_path / "S1.las")
    for path, text in pose_texts(tmp_path, scans, placed(scans), WORK, "prior", None).items():
        path.write_text(text) if isinstance(text, str) else path.write_bytes(text)
    (found,) = read_poses(tmp_path / "poses.json").scans
    assert found.placement.noise == scans[0].noise
    damaged = (tmp_path / "poses.json").read_text().replace("-0.6", "0.6")
    (tmp_path / "poses.json").write_text(damaged)
    with pytest.raises(InputError, match="the law of the noise of ranges has"):
        read_poses(tmp_path / "poses.json")


def test_fits_take_the_noise_of_ranges_from_the_points_where_it_has_a_law(tmp_path: Path) -> None:
    in_a_room(tmp_path / "S1.las")
    (plain,), (by_law,) = opened(tmp_path / "S1.las"), lawful(tmp_path / "S1.las")
    assert set(plain.fit_sigmas) == {"sigma_range", "sigma_angle"}
    assert by_law.fit_sigmas == {"sigma_angle": plain.fit_sigmas["sigma_angle"]}


def test_comparisons_have_the_intensities_of_the_scan_and_not_the_stretched_ones_of_the_cloud(
    tmp_path: Path,
) -> None:
    """Light from 0 to 1 is stretched in LAS; read again beside its poses it is what it was."""
    rng = np.random.default_rng(7)
    xyz, light = rng.uniform(2, 9, (400, 3)), rng.uniform(0.02, 0.9, 400).astype(np.float32)
    header = CloudHeader("S1", (Field("intensity", "float32", 0.0, 1.0),), 1e-6)
    with create(tmp_path / "S1.e57", header) as writer:
        writer.write(xyz, {"intensity": light})
    law = replace(LAW, low=0.05, high=0.8)
    scans = lawful(tmp_path / "S1.e57", law=law)
    scans = [replace(scans[0], name="S1", station="S1")]
    places = placed(scans)
    (product,) = made(scans, places, WORK, tmp_path, format="laz")
    folder = tmp_path / "clouds"
    for path, text in pose_texts(folder, scans, places, WORK, "prior", None).items():
        path.write_text(text) if isinstance(text, str) else path.write_bytes(text)
    cloud = open_cloud(product.path)
    assert cloud.columns == 4
    (chunk,) = cloud.lit()
    assert chunk[:, 3] == pytest.approx(light, abs=1e-5)
    (plain,) = cloud.stream()
    assert (chunk[:, :3] == plain).all()
    found = compare_clouds(cloud, cloud, stations=station_pair(cloud, cloud))
    assert found[0].c2c is not None
