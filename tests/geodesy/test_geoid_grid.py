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


def test_plumb_lines_are_curved(tmp_path: Path) -> None:
    grid = GeoidGrid(write_gtx(tmp_path / "g.gtx", 0.0, 0.0))
    xi, _ = grid.deflection(LATITUDE, LONGITUDE, 1000.0)
    assert xi / SEC == pytest.approx(-0.17 * np.sin(2 * LATITUDE), abs=1e-4)


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
