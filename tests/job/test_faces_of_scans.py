"""Scans of two faces in a project: two scans of one station, each with its face and correction."""

from pathlib import Path

import numpy as np
import pytest

from tests.scan.test_faces import panoramic
from tribrach.errors import InputError
from tribrach.io.calibration_file import Calibration, calibration_text
from tribrach.job.opened import open_job
from tribrach.job.scans import StationScan, open_scans
from tribrach.job.state import Remembered
from tribrach.project import Project
from tribrach.scan.loading import load

PROJECT = """\
title = "Two faces"

[instruments.scanner]
{calibration}
range_mm = 1.0
scan_angle_arcsec = 8.0

[[scans]]
file = "S1.ptx"
face = "{face}"
"""


def project(folder: Path, face: str, calibration: str = "", turn: float = 2 * np.pi) -> Project:
    xyz, row, column, _ = panoramic(turn, columns=36)
    rows = int(row.max()) + 1
    lines = ["36", str(rows), "0 0 0", "1 0 0", "0 1 0", "0 0 1"]
    lines += ["1 0 0 0", "0 1 0 0", "0 0 1 0", "0 0 0 1"]
    lines += [f"{x:.6f} {y:.6f} {z:.6f} 0.5" for x, y, z in xyz]
    assert len(xyz) == 36 * rows == 36 * (row.max() + 1)
    assert (np.diff(column) >= 0).all()
    (folder / "S1.ptx").write_text("\n".join(lines) + "\n")
    path = folder / "job.toml"
    path.write_text(PROJECT.format(face=face, calibration=calibration))
    return Project.load(path)


def test_a_scan_of_two_faces_is_two_scans_of_its_station(tmp_path: Path) -> None:
    scans = open_scans(open_job(project(tmp_path, "order")), Remembered(tmp_path))
    assert [(s.name, s.station, s.faces) for s in scans] == [
        ("S1 front", "S1", "front"),
        ("S1 back", "S1", "back"),
    ]
    counts = [len(load(s.scan).xyz) for s in scans]
    assert sum(counts) > 5000
    assert abs(counts[0] - counts[1]) < 0.05 * sum(counts)
    key = Remembered(tmp_path / "out").key
    assert key(load, scans[0].measured) != key(load, scans[1].measured)


def test_each_face_has_its_own_correction(tmp_path: Path) -> None:
    known = Calibration(
        "scanner", "", "nist", ("x4",), np.array([1e-3]), np.array([[1e-10]]), sigma_origin="a"
    )
    (tmp_path / "c.toml").write_text(calibration_text(known))
    plain = open_scans(open_job(project(tmp_path, "order")), Remembered(tmp_path))
    corrected = open_scans(
        open_job(project(tmp_path, "order", 'calibration = "c.toml"')), Remembered(tmp_path)
    )

    def zenith(scan: StationScan) -> np.ndarray:
        xyz = load(scan.scan).xyz
        return np.arctan2(np.hypot(xyz[:, 0], xyz[:, 1]), xyz[:, 2])

    for before, after, sign in zip(plain, corrected, (1.0, -1.0), strict=True):
        change = zenith(after) - zenith(before)
        steep = zenith(before) < 0.01
        np.testing.assert_allclose(change[~steep], sign * 1e-3, atol=1e-5)
        key = Remembered(tmp_path / "out").key
        assert key(load, before.measured) != key(load, after.measured)


def test_faces_that_the_file_has_lost_are_refused(tmp_path: Path) -> None:
    broken = project(tmp_path, "order")
    lines = (tmp_path / "S1.ptx").read_text().splitlines()
    # the mirror looks behind in the first half of its rows
    one_side = [line if k % 151 >= 75 else "0 0 0 0" for k, line in enumerate(lines[10:])]
    (tmp_path / "S1.ptx").write_text("\n".join([*lines[:10], *one_side]) + "\n")
    with pytest.raises(InputError, match="one side of the standing axis"):
        open_scans(open_job(broken), Remembered(tmp_path))
