"""Work frame, ECEF and verticals, against published coordinates and closed forms."""

import numpy as np
import pytest
from pyproj import Transformer

from tribrach.geodesy.site import GRS80, EllipsoidSite, FlatSite, ecef_from_geodetic, enu_rotation

WGS84 = (6378137.0, 1 / 298.257223563)
KONYA = np.radians([37.87, 32.5])


def dms(degrees: float, minutes: float, seconds: float) -> np.ndarray:
    return np.radians(degrees + minutes / 60 + seconds / 3600)


def test_example_of_the_epsg_guidance_note():
    """Guidance Note 7-2, geographic to geocentric on WGS 84 (AC-47)."""
    latitude, longitude = dms(53, 48, 33.82), dms(2, 7, 46.38)
    ecef = ecef_from_geodetic(latitude, longitude, np.array(73.0), WGS84)
    np.testing.assert_allclose(ecef, [3771793.968, 140253.342, 5124304.349], atol=1e-3)
    site = EllipsoidSite(0.9, 0.1, 0.0, WGS84)
    geodetic = site.geodetic(site.from_ecef(ecef[None]))[0]
    np.testing.assert_allclose(geodetic[:2], [latitude, longitude], atol=1e-13)
    assert geodetic[2] == pytest.approx(73.0, abs=1e-8)


def test_a_vertical_lever_arm_is_oblique_in_ecef():
    """0.329 m upwards at Konya (AC-19)."""
    up = enu_rotation(*KONYA)[2]
    np.testing.assert_allclose(0.329 * up, [0.2190, 0.1395, 0.2020], atol=5e-5)


def test_covariances_turn_with_the_frame():
    """Sigmas (1.1, 1.5, 2.7) mm east, north, up are others in ECEF, and correlated (AC-48)."""
    turn = enu_rotation(*KONYA)
    ecef = turn.T @ np.diag([1.1, 1.5, 2.7]) ** 2 @ turn
    sigma = np.sqrt(np.diag(ecef))
    np.testing.assert_allclose(sigma, [2.045, 1.555, 2.037], atol=1e-3)
    assert ecef[0, 1] / sigma[0] / sigma[1] == pytest.approx(0.60, abs=5e-3)


def test_work_frame_against_proj():
    site = EllipsoidSite(float(KONYA[0]), float(KONYA[1]), 1020.0)
    pipeline = (
        "+proj=pipeline +step +proj=cart +ellps=GRS80 +step +proj=topocentric +ellps=GRS80 "
        "+lon_0=32.5 +lat_0=37.87 +h_0=1020"
    )
    lon, lat, h = np.array([32.5, 32.51, 32.4]), np.array([37.87, 37.9, 37.8]), [1020.0, 1100, 950]
    expected = np.stack(Transformer.from_pipeline(pipeline).transform(lon, lat, h), axis=1)
    x = site.from_ecef(ecef_from_geodetic(np.radians(lat), np.radians(lon), np.array(h), GRS80))
    np.testing.assert_allclose(x, expected, atol=1e-7)
    np.testing.assert_allclose(site.to_ecef(x), site.origin + expected @ site.w_from_ecef)
    np.testing.assert_allclose(site.height(x), h, atol=1e-8)


def test_earth_curvature():
    """The horizon leaves a sphere by d^2 / 2R: 0.785, 7.063, 132.63 mm (AC-50)."""
    sphere = EllipsoidSite(0.4, 1.0, 0.0, (6371000.0, 0.0))
    distance = np.array([100.0, 300.0, 1300.0])
    horizon = np.stack([distance * 0.6, distance * 0.8, 0 * distance], axis=1)
    drop_mm = 1e3 * sphere.height(horizon)
    np.testing.assert_allclose(drop_mm, [0.785, 7.063, 132.63], atol=5e-3)
    np.testing.assert_array_equal(FlatSite().height(horizon), 0)


def test_heights_near_the_origin_have_no_rounding_of_geocentric_coordinates():
    """Levelled lines of half a millimetre tell 1e-9 m: a closed form on the sphere, and a step."""
    generator = np.random.default_rng(4)
    radius, height = 6371000.0, 300.0
    x = generator.uniform(-5000, 5000, (500, 3)) * [1, 1, 0.1]
    sphere = EllipsoidSite(0.4, 1.0, height, (radius, 0.0))
    total = radius + height
    squares = (x**2).sum(axis=1) + 2 * total * x[:, 2]
    rise = squares / (np.sqrt(total**2 + squares) + total)
    np.testing.assert_allclose(sphere.height(x) - height, rise, atol=2e-12)
    site = EllipsoidSite(0.8, -1.16, 50.0)
    moved = x + 1e-7 * generator.normal(size=x.shape)
    along = np.einsum("ni,ni->n", site.axes(x)[:, 2], moved - x)
    np.testing.assert_allclose(site.height(moved) - site.height(x), along, atol=5e-12)


def test_the_plumb_line_turns_by_one_second_in_31_metres():
    sphere = EllipsoidSite(0.4, 1.0, 0.0, (6371000.0, 0.0))
    x = np.array([[0.0, 30.9, 0.0]])
    turn = sphere.axes(x)[0, 2] @ sphere.axes(0 * x)[0, 2]
    assert np.degrees(np.arccos(min(turn, 1.0))) * 3600 == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("latitude", [-0.9, 0.1, 1.2])
def test_turn_is_the_derivative_of_the_axes(latitude):
    site = EllipsoidSite(latitude, 2.0, 100.0)
    x = np.array([[800.0, -300.0, 40.0]])
    for k in range(3):
        step = 50 * np.eye(3)[k]
        change = (site.axes(x + step) - site.axes(x - step))[0] / 100
        w = site.turn(x)[0, :, k]
        axes = site.axes(x)[0]
        np.testing.assert_allclose(change, np.cross(w, axes), atol=1e-13)
