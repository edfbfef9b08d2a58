"""Numbers of the published budget and its surroundings, from the program's own functions."""

import numpy as np
import pytest
from pyproj import Transformer

from tribrach.cloud.budget import point_budget
from tribrach.cloud.placement import Placement
from tribrach.geodesy.projection import ProjectedGrid, grid_scale
from tribrach.geodesy.site import FlatSite
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.network.survey import Survey
from tribrach.observations.sights import ZenithAngles
from tribrach.units import SEC

EARTH = 6_371_000.0


def test_root_sum_of_squares() -> None:
    """AC-04: control 3, resection 4, coordinates 7 and pointing 0.5 mm; and 11.6 mm over root 2."""
    isotropic = {
        name: np.diag([s**2 / 3e6] * 3 + [0.0] * 3)
        for name, s in {"control": 3, "resection": 4, "coordinates": 7, "pointing": 0.5}.items()
    }
    total = np.sum(list(isotropic.values()), axis=0)
    still = ScanNoise(1e-12, 0.0, 0.0, 0.0)
    where = Placement("S", Pose(np.eye(3), np.zeros(3)), total, still)
    budget = point_budget(np.array([[20.0, 0.0, 0.0]]), where, isotropic)
    assert 1e3 * np.sqrt(np.trace(budget.total[0])) == pytest.approx(8.617, abs=5e-4)
    assert 11.6 / np.sqrt(2) == pytest.approx(8.202, abs=5e-4)


def test_angles_as_lengths_at_20_m() -> None:
    """AC-05: half an arc second is 0.0485 mm, half a millimetre is 5.157 arc seconds."""
    noise = ScanNoise(1e-12, 0.0, 0.5 * SEC, 0.0)
    where = Placement("S", Pose(np.eye(3), np.zeros(3)), np.zeros((6, 6)), noise)
    budget = point_budget(np.array([[20.0, 0.0, 0.0]]), where)
    k = budget.names.index("horizontal angle")
    assert 1e3 * np.sqrt(budget.variances[k, 0]) == pytest.approx(0.0485, abs=5e-5)
    assert np.arctan(0.0005 / 20) / SEC == pytest.approx(5.157, abs=5e-4)


@pytest.mark.parametrize(("degrees", "arm", "millimetres"), [(0.015, 20.0, 5.236),
                                                             (1.0, 0.329, 5.742)])  # fmt: skip
def test_levelling(degrees: float, arm: float, millimetres: float) -> None:
    """AC-53: 0.015 degrees at 20 m, and a lever arm of 0.329 m leaning by one degree."""
    tilt = np.diag([0.0, 0.0, 0.0, 0.0, np.radians(degrees) ** 2, 0.0])
    where = Placement("S", Pose(np.eye(3), np.zeros(3)), tilt, ScanNoise(1e-12, 0.0, 0.0, 0.0))
    budget = point_budget(np.array([[arm, 0.0, 0.0]]), where)
    assert 1e3 * np.sqrt(budget.total[0, 2, 2]) == pytest.approx(millimetres, abs=1e-3)


def test_scale_and_convergence_at_the_facades() -> None:
    """AC-49: point A in the grid EPSG:5897."""
    crs = "EPSG:5897"
    to_grid = Transformer.from_crs("EPSG:4756", crs, always_xy=True)
    easting, northing = to_grid.transform(105.77255, 21.07288)
    assert 1 + grid_scale(crs, np.array([easting, northing, 0.0])) == pytest.approx(
        0.9999796, abs=5e-8
    )
    grid = ProjectedGrid(crs, easting, northing, 0.0)
    start, north = grid.from_work(np.array([[0.0, 0.0, 0.0], [0.0, 100.0, 0.0]]))
    assert start[:2] == pytest.approx([easting, northing], abs=1e-6)
    # the meridian of WGS 84 lies 0.002 degrees beside that of the national datum
    convergence = np.degrees(np.arctan2(north[0] - start[0], north[1] - start[1]))
    assert abs(convergence) == pytest.approx(0.2778, abs=1e-3)


def zenith(target: tuple[float, float, float], refraction: float) -> float:
    survey = Survey(site=FlatSite(EARTH))
    survey.point("A", (0.0, 0.0, 0.0))
    survey.point("B", target)
    survey.add(ZenithAngles, values=[1.5], sigma=1e-5, start=["A"], end=["B"],
               refraction=refraction)  # fmt: skip
    network = survey.network()
    return float(network.observations[0].predict(network.start)[0, 0])


@pytest.mark.parametrize(("length", "drop"), [(100, 0.785), (300, 7.063), (1300, 132.63)])
def test_curvature_of_the_earth(length: float, drop: float) -> None:
    """AC-50: what a horizontal sight without refraction ends above the surface [mm]."""
    assert zenith((length, 0.0, drop * 1e-3), 0.0) == pytest.approx(np.pi / 2, abs=1e-8)


def test_trigonometric_height() -> None:
    """AC-50: slope distance 1000 m, zenith angle 88 degrees, k = 0.13."""
    flat = 1000 * np.sin(np.radians(88.0))
    assert np.degrees(zenith((flat, 0.0, 34.9677), 0.13)) == pytest.approx(88.0, abs=1e-5)
