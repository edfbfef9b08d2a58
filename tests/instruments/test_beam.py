"""Both shapes of a beam, from the project file to the covariance of a point."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from tests.job.cloud_jobs import NOISE, made, opened, placed
from tests.job.test_clouds import WORK, in_a_room
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.geometry.pose import Pose
from tribrach.instruments.beam import Beam
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.job.poses import pose_texts, read_poses
from tribrach.project.instrument import Instrument
from tribrach.targets.prints.search import footprint_at

FIGURES = {"range_mm": 1, "scan_angle_arcsec": 8, "beam_exit_mm": 4, "beam_divergence_mrad": 0.3}


@pytest.mark.parametrize(
    ("cone", "expected"), [(False, [0.004, 0.0072111, 0.0302655]), (True, [0.004, 0.01, 0.034])]
)
def test_diameters(cone: bool, expected: list[float]) -> None:
    """4 mm and 0.3 mrad at 0, 20 and 100 m, by hand."""
    beam = Beam(4e-3, 0.3e-3, cone)
    assert beam.diameter(np.array([0.0, 20.0, 100.0])) == pytest.approx(expected, abs=1e-7)
    assert footprint_at(beam, np.array([12.0, 0.0, 16.0])) == pytest.approx(expected[1], abs=1e-7)


def test_the_project_chooses() -> None:
    waist = Instrument.model_validate(FIGURES).noise()
    cone = Instrument.model_validate(FIGURES | {"beam_shape": "cone"}).noise()
    assert waist is not None
    assert cone is not None
    assert (waist.beam_cone, cone.beam_cone) == (False, True)
    assert cone.words == waist.words + " as a cone"
    with pytest.raises(ValueError, match="waist"):
        Instrument.model_validate(FIGURES | {"beam_shape": "cylinder"})


@pytest.mark.parametrize("cone", [False, True])
def test_points_have_the_quarter_of_it_across_the_beam(cone: bool) -> None:
    """The compiled covariance of a point at 20 m against d / 4, without any other error."""
    noise = ScanNoise(1e-12, 0, 0, 0, 4e-3, 0.3e-3, beam_cone=cone)
    where = Placement("S", Pose(np.eye(3), np.zeros(3)), np.zeros((6, 6)), noise)
    (c,) = covariances(np.array([[20.0, 0.0, 0.0]]), where)
    expected = float(noise.beam_diameter(np.array([20.0]))[0]) / 4
    assert np.sqrt(c[1:3]) == pytest.approx([expected, expected], rel=1e-6)


def test_the_file_of_poses_keeps_it(tmp_path: Path) -> None:
    in_a_room(tmp_path / "S1.las", step=0.1)
    scans = opened(tmp_path / "S1.las")
    places = placed(scans)
    noise = ScanNoise(**asdict(NOISE) | {"beam_cone": True})
    name = scans[0].name
    one = places[name]
    places[name] = Placement(one.station, one.pose, one.covariance, noise)
    for path, text in pose_texts(tmp_path, scans, places, WORK, "prior", None).items():
        path.write_bytes(text.encode() if isinstance(text, str) else text)
    (found,) = read_poses(tmp_path / "poses.json").scans
    assert found.placement.noise == noise
    older = (tmp_path / "poses.json").read_text()
    (tmp_path / "poses.json").write_text(older.replace('"beam_cone": true', '"more": 1'))
    (found,) = read_poses(tmp_path / "poses.json").scans
    assert found.placement.noise == NOISE
    (product,) = made(scans, places, WORK, tmp_path / "out")
    assert product.new
