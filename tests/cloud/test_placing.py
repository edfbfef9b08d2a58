"""Points placed from an array are those of the clouds that a run writes."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tribrach as tb
from tests.job.cloud_jobs import NOISE, made, opened, placed
from tests.network.networks import scanner_network
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.site import FlatSite
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.network.adjustment import adjust
from tribrach.network.results import StationResult


def test_placed_points_are_those_of_the_cloud_that_is_written(tmp_path: Path) -> None:
    text = "\n".join(f"{x:.3f} {y:.3f} {z:.3f}" for x, y, z in _points())
    (tmp_path / "S1.xyz").write_text(text + "\n")
    scans = opened(tmp_path / "S1.xyz")
    where = placed(scans)[scans[0].name]
    frame = OutputFrame(WorkFrame(FlatSite()), "work", None)
    (product,) = made(scans, {scans[0].name: where}, frame, tmp_path, format="ply")
    (cloud,) = opened(product.path)
    chunk = next(cloud.scan.chunks())

    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = where.pose.rotation, where.pose.translation
    station = StationResult(where.station, matrix, where.covariance, "a priori")
    xyz, covariance = tb.place(_points(), station, scans[0].noise)
    np.testing.assert_allclose(xyz, chunk.xyz, atol=1e-6)
    for k, axis in enumerate("xyz"):
        sigma = np.sqrt(covariance[:, k, k])
        np.testing.assert_allclose(chunk.values[f"sigma_{axis}"], sigma, rtol=2e-3)


def _points() -> np.ndarray:
    return np.random.default_rng(4).uniform(-8, 8, (300, 3)).round(3)


def test_stations_of_an_adjustment_place_their_points() -> None:
    survey, truth = scanner_network(np.random.default_rng(11))
    adjustment = adjust(survey.network())
    station = adjustment.stations["S1"]
    seen = np.array([row.value for row in adjustment.observations if row.start == "S1"])
    xyz, covariance = tb.place(seen.reshape(-1, 3), station, NOISE)
    adjusted = np.array([adjustment.points[f"T{k}"].xyz for k in range(len(truth))])
    assert np.abs(xyz - adjusted).max() < 0.005
    where = Placement("S1", _pose(station), station.covariance, NOISE)
    flat = covariances(seen.reshape(-1, 3), where)
    np.testing.assert_allclose(covariance[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], flat)
    np.testing.assert_array_equal(covariance, covariance.transpose(0, 2, 1))
    assert (np.linalg.eigvalsh(covariance) > 0).all()


def _pose(station: StationResult) -> Pose:
    return Pose(station.rotation, station.xyz)


def test_without_noise_the_station_alone_is_uncertain() -> None:
    """By central differences of the pose, turned on the left."""
    adjustment = adjust(scanner_network(np.random.default_rng(2))[0].network())
    station = adjustment.stations["S2"]
    point = np.array([[3.0, -4.0, 1.5]])
    _, covariance = tb.place(point, station)
    jacobian = np.empty((3, 6))
    pose = _pose(station)
    for k in range(6):
        ends = []
        for step in (1e-6, -1e-6):
            delta = np.zeros(6)
            delta[k] = step
            turned = _turned(delta[3:]) @ pose.rotation
            ends.append(turned @ point[0] + pose.translation + delta[:3])
        jacobian[:, k] = (ends[0] - ends[1]) / 2e-6
    expected = jacobian @ station.covariance @ jacobian.T
    np.testing.assert_allclose(covariance[0], expected, rtol=1e-6, atol=1e-14)


def _turned(vector: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(vector).as_matrix()


def test_arrays_of_another_shape_are_refused() -> None:
    station = StationResult("S", np.eye(4), np.eye(6), "a priori")
    with pytest.raises(InputError, match=r"give an array \(n, 3\)"):
        tb.place([1.0, 2.0, 3.0], station)
    with pytest.raises(InputError, match="one cosine for each point"):
        tb.place([[1.0, 2.0, 3.0]], station, NOISE, [0.5, 0.5])


@pytest.mark.parametrize("cosine", [0.0, -0.5, 1.01, np.nan])
def test_cosines_of_no_incidence_are_refused(cosine: float) -> None:
    station = StationResult("S", np.eye(4), np.eye(6), "a priori")
    with pytest.raises(InputError, match=r"1 of 2 cosines are not in \(0, 1\], the first is"):
        tb.place([[1.0, 2.0, 3.0]] * 2, station, NOISE, [1.0, cosine])


@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize("figure", [-1e-9, np.nan, np.inf])
def test_noise_that_is_none_is_refused(place: int, figure: float) -> None:
    figures = NOISE.parameters
    figures[place] = figure
    with pytest.raises(InputError, match="give zero or a positive number"):
        ScanNoise(*figures)
