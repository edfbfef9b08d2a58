"""Temperature and pressure on the ranges of scans: their scale and its sigma."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.instruments.atmosphere import REFERENCE, refractivity
from tribrach.instruments.common_errors import CommonErrors
from tribrach.io.scans.formats import read_scans
from tribrach.job.opened import open_job
from tribrach.job.scans import RangeAir, StationScan, air_of, open_scans
from tribrach.job.state import Remembered
from tribrach.project import Project

WAVE = 1.55
HEAD = f"""\
title = "Air"
[instruments.scanner]
range_mm = 2.0
scan_angle_arcsec = 10.0
wavelength_um = {WAVE}
[[points]]
file = "points.csv"
[[scans]]
file = "{{file}}"
origin = "scanner"
instrument = "scanner"
{{air}}
"""
#: on a ring of 100 m
TURN = np.linspace(0, 2 * np.pi, 400, endpoint=False)
TRUE = np.stack([100 * np.cos(TURN), 100 * np.sin(TURN), 5 * np.sin(3 * TURN)], axis=1)


def read_in(temperature: float, pressure: float, humidity: float = 60.0) -> np.ndarray:
    """The points as an instrument gives them that computes for its reference air."""
    here = refractivity(temperature, pressure, humidity, WAVE)
    there = refractivity(
        REFERENCE.temperature_c, REFERENCE.pressure_hpa, REFERENCE.humidity_percent, WAVE
    )
    measured: np.ndarray = TRUE * (1 + 1e-6 * float(here)) / (1 + 1e-6 * float(there))
    return measured


def opened(folder: Path, xyz: np.ndarray, air: str, file: str = "S1.xyz") -> StationScan:
    """The scan of a project whose points were written so."""
    (folder / "points.csv").write_text("point,role,e_m,n_m,u_m\nA,fixed,0,0,0\nB,fixed,1,1,1\n")
    if file.endswith(".xyz"):
        np.savetxt(folder / file, xyz, fmt="%.9f")
    (folder / "job.toml").write_text(HEAD.format(air=air, file=file))
    job = open_job(Project.load(folder / "job.toml"))
    (scan,) = open_scans(job, Remembered(folder / "out"))
    return scan


def points_of(scan: StationScan) -> np.ndarray:
    return np.concatenate([chunk.xyz for chunk in scan.scan.chunks()])


@pytest.mark.parametrize(("warmer", "higher"), [(20.0, 0.0), (0.0, -60.0), (20.0, -60.0)])
def test_ranges_come_back_to_a_tenth_of_a_ppm(warmer: float, higher: float, tmp_path: Path) -> None:
    t, p = REFERENCE.temperature_c + warmer, REFERENCE.pressure_hpa + higher
    xyz = read_in(t, p)
    assert np.abs(np.linalg.norm(xyz, axis=1) / np.linalg.norm(TRUE, axis=1) - 1).max() > 1e-5
    air = f"temperature_c = {t}\npressure_hpa = {p}"
    scan = opened(tmp_path, xyz, air)
    length = np.linalg.norm(points_of(scan), axis=1) / np.linalg.norm(TRUE, axis=1)
    assert np.abs(length - 1).max() < 1e-7
    # without the keys nothing changes
    plain = opened(tmp_path, xyz, "")
    np.testing.assert_allclose(points_of(plain), xyz, atol=1e-9)
    assert plain.common is None


def test_the_sigma_of_the_air_is_that_of_a_scale(tmp_path: Path) -> None:
    keys = "temperature_c = 25\npressure_hpa = 950\nsigma_temperature_c = 3\nsigma_pressure_hpa = 4"
    scan = opened(tmp_path, TRUE, keys)
    assert scan.common is not None
    by_kelvin = refractivity(26, 950, 60, WAVE) - refractivity(25, 950, 60, WAVE)
    by_hpa = refractivity(25, 951, 60, WAVE) - refractivity(25, 950, 60, WAVE)
    expected = 1e-6 * np.hypot(3 * by_kelvin, 4 * by_hpa)
    assert scan.common.range_scale == pytest.approx(expected, rel=1e-6)
    assert 2e-6 < scan.common.range_scale < 4e-6
    shared = RangeAir(0.0, 3e-6).shared(CommonErrors("x", range_scale=4e-6, refraction=0.1), "x")
    assert shared == CommonErrors("x", range_scale=pytest.approx(5e-6), refraction=0.1)


def test_the_header_of_a_scan_says_its_air(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "S1.xyz", read_in(30.0, 960.0, 40.0), fmt="%.9f")
    (tmp_path / "points.csv").write_text("point,role,e_m,n_m,u_m\nA,fixed,0,0,0\nB,fixed,1,1,1\n")
    (tmp_path / "job.toml").write_text(HEAD.format(air='air = "header"', file="S1.xyz"))
    project = Project.load(tmp_path / "job.toml")
    (scan,) = read_scans(tmp_path / "S1.xyz")
    entry = project.scans[0]
    with pytest.raises(InputError, match="has no temperature and pressure"):
        air_of(project, 0, entry, scan, "scanner")
    facts = {"temperature [C]": "30", "atmospheric pressure [Pa]": "96000"}
    facts["relative humidity [%]"] = "40"
    air = air_of(project, 0, entry, replace(scan, facts=facts), "scanner")
    length = np.linalg.norm(read_in(30.0, 960.0, 40.0), axis=1) * (1 + air.scale)
    np.testing.assert_allclose(length, np.linalg.norm(TRUE, axis=1), rtol=1e-7)


WEATHER = (
    "time;temperature_c;pressure_hpa\n2026-03-01T10:00Z;22,0;983\n2026-03-01T11:00Z;42,0;923\n"
)


def test_a_table_says_the_air_by_time(tmp_path: Path) -> None:
    (tmp_path / "weather.csv").write_text(WEATHER)
    xyz = read_in(32.0, 953.0)
    scan = opened(tmp_path, xyz, 'air = "weather.csv"\ntime = 2026-03-01T11:30:00+01:00')
    length = np.linalg.norm(points_of(scan), axis=1) / np.linalg.norm(TRUE, axis=1)
    assert np.abs(length - 1).max() < 1e-7
    with pytest.raises(InputError, match=r"10:00 to 2026-03-01 11:00"):
        opened(tmp_path, xyz, 'air = "weather.csv"\ntime = 2026-03-01T12:30:00')
    with pytest.raises(InputError, match="nothing says when S1 began"):
        opened(tmp_path, xyz, 'air = "weather.csv"')
    # the header of an E57 counts seconds of GPS
    project = Project.load(tmp_path / "job.toml")
    (told,) = read_scans(tmp_path / "S1.xyz")
    told = replace(told, facts={"start [GPS s]": "1456396200"})
    found = air_of(project, 0, project.scans[0], told, "scanner")
    assert found.scale == pytest.approx(scan.air, rel=1e-12)


@pytest.mark.parametrize(
    ("air", "what"),
    [
        ("temperature_c = 20", "together"),
        ("pressure_hpa = 960", "together"),
        ("temperature_c = 293\npressure_hpa = 960", "temperature_c"),
        ("temperature_c = 20\npressure_hpa = 96000", "pressure_hpa"),
        ('air = "weather"', "nothing says when"),
        ('air = "weather"\ntime = 2026-03-01T10:00:00', "weather"),
        ("temperature_c = 20\npressure_hpa = 960\nsigma_temperature_c = -1", "sigma_temperature"),
    ],
)
def test_air_that_cannot_be_is_refused(air: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=what):
        opened(tmp_path, TRUE, air)
