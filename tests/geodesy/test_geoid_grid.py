"""Deflections of the vertical from the slope of a grid of geoid heights."""

import struct
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.units import SEC

LATITUDE, LONGITUDE = np.radians(37.87), np.radians(32.5)


def write_gtx(
    path: Path, north: float, east: float, *, south: float = 36.5, west: float = 31.5
) -> Path:
    """A plane geoid through 36 m at 38 degrees north, 33 degrees east; slopes in m per degree.

    It covers three degrees from its southern and western edge.
    """
    step, n = 1 / 60, 181
    lat, lon = south + step * np.arange(n), west + step * np.arange(n)
    height = 36 + north * (lat[:, None] - 38) + east * (lon - 33)
    head = struct.pack(">ddddii", lat[0], lon[0], step, step, n, n)
    path.write_bytes(head + height.astype(">f4").tobytes())
    return path


def test_heights_are_those_of_the_grid(tmp_path: Path) -> None:
    grid = GeoidGrid(write_gtx(tmp_path / "a grid.gtx", 2.0, -3.0))
    found = grid.undulation(np.radians([38.0, 38.1]), np.radians([33.0, 32.9]))
    assert found == pytest.approx([36.0, 36.5], abs=1e-5)


def test_a_geoid_that_rises_0_1_m_in_2_km_leans_by_10_3_arcsec(tmp_path: Path) -> None:
    """Arc lengths of one degree at 37.87 N on GRS80: 110.998 km and 87.991 km."""
    grid = GeoidGrid(write_gtx(tmp_path / "g.gtx", 110.998 / 2 * 0.1, 0.0))
    xi, eta = grid.deflection(LATITUDE, LONGITUDE, 0.0)
    assert xi / SEC == pytest.approx(-10.31, abs=0.02)  # the geoid rises: the zenith leans south
    assert eta / SEC == pytest.approx(0.0, abs=0.01)
    grid = GeoidGrid(write_gtx(tmp_path / "h.gtx", 0.0, -87.991 / 2 * 0.1))
    xi, eta = grid.deflection(LATITUDE, LONGITUDE, 0.0)
    assert eta / SEC == pytest.approx(10.31, abs=0.02)


def normal_zenith(latitude: float, height: float) -> float:
    """Zenith of GRS80's normal gravity north of the ellipsoid normal [rad]: J2 to J6, rotation."""
    a, f, gm, spin = 6378137.0, 1 / 298.257222101, 3986005e8, 7292115e-11
    zonal = {2: 108263e-8, 4: -2.37091222e-6, 6: 6.08347e-9}
    e2 = f * (2 - f)
    nu = a / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    at = np.array([(nu + height) * np.cos(latitude), (nu * (1 - e2) + height) * np.sin(latitude)])

    def potential(place: np.ndarray) -> float:
        """Normal potential on the meridian, less the spherical part's constant."""
        r = float(np.hypot(*place))
        series = sum(
            j * (a / r) ** n * np.polynomial.legendre.legval(place[1] / r, [0] * n + [1])
            for n, j in zonal.items()
        )
        return gm / r * (1 - series) + spin**2 * place[0] ** 2 / 2

    step = 20.0
    gravity = np.array([potential(at + e) - potential(at - e) for e in step * np.eye(2)])
    north = np.array([-np.sin(latitude), np.cos(latitude)])
    up = np.array([np.cos(latitude), np.sin(latitude)])
    return float(np.arctan2(-gravity @ north, -gravity @ up))


@pytest.mark.parametrize(("degrees", "expected"), [(45, 0.1713), (20, 0.1104), (48, 0.1704)])
def test_plumb_lines_are_curved(tmp_path: Path, degrees: float, expected: float) -> None:
    """Over a level geoid the zenith leans north with height, as normal gravity does."""
    latitude = np.radians(degrees)
    zenith = normal_zenith(latitude, 1000.0) - normal_zenith(latitude, 0.0)
    assert zenith / SEC == pytest.approx(expected, abs=4e-4)
    grid = GeoidGrid(write_gtx(tmp_path / "g.gtx", 0.0, 0.0))
    curvature = grid.deflection(LATITUDE, LONGITUDE, 1000.0)[0] / np.sin(2 * LATITUDE)
    assert curvature / SEC * np.sin(2 * latitude) == pytest.approx(expected, abs=4e-4)
    konya = normal_zenith(LATITUDE, 1000.0) - normal_zenith(LATITUDE, 0.0)
    assert grid.deflection(LATITUDE, LONGITUDE, 1000.0)[0] == pytest.approx(konya, rel=2e-3)


def test_a_grid_of_elsewhere_and_no_grid_are_sentences(tmp_path: Path) -> None:
    grid = GeoidGrid(write_gtx(tmp_path / "g.gtx", 0.0, 0.0))
    with pytest.raises(InputError, match="does not reach to latitude 10"):
        grid.undulation(np.radians([10.0]), np.radians([10.0]))
    with pytest.raises(InputError, match="not there"):
        GeoidGrid(tmp_path / "none.gtx").undulation(np.zeros(1), np.zeros(1))
    broken = tmp_path / "broken.gtx"
    broken.write_bytes(b"no grid")
    with pytest.raises(InputError, match="PROJ does not read"):
        GeoidGrid(broken).undulation(np.zeros(1), np.zeros(1))
