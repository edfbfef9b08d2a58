"""Calibration files: the same numbers back, and sentences for what is wrong with them."""

import datetime
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.calibration_file import Calibration, calibration_text, read_calibration

GOOD = Calibration(
    instrument='Scanner "A"\\1',
    serial="S\n1",
    model="nist",
    parameters=("x10", "x6", "x4"),
    values=np.array([1.1e-3, 2.9e-5, -1 / 3e5]),
    covariance=np.array([[4e-8, 1e-13, 0], [1e-13, 9e-12, -2e-12], [0, -2e-12, 4e-12]]),
    date=datetime.date(2024, 2, 29),
    datum="inner constraints",
    sigma_origin="a priori",
    observations=100,
    redundancy=40,
)


def written(folder: Path, text: str) -> Path:
    path = folder / "scanner.toml"
    path.write_text(text)
    return path


def test_what_is_written_is_read(tmp_path: Path) -> None:
    back = read_calibration(written(tmp_path, calibration_text(GOOD)))
    assert back.parameters == GOOD.parameters
    np.testing.assert_array_equal(back.values, GOOD.values)
    np.testing.assert_array_equal(back.covariance, GOOD.covariance)
    for name in ("instrument", "serial", "model", "date", "datum", "sigma_origin", "redundancy"):
        assert getattr(back, name) == getattr(GOOD, name)
    assert back.columns().parameters == GOOD.parameters


def test_unit_lengths_are_kept(tmp_path: Path) -> None:
    lichti = Calibration(
        "L", "", "lichti", ("A0", "A3"), np.array([1e-3, 2e-4]), np.diag([1e-8, 1e-9]), (1.2, 9.6),
        sigma_origin="a priori",
    )  # fmt: skip
    back = read_calibration(written(tmp_path, calibration_text(lichti)))
    assert back.unit_lengths == (1.2, 9.6)
    assert back.columns().parameters == ("A0", "A3")


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("schema = 1", "schema = 2", "schema 2 is not known"),
        ('model = "nist"', 'model = "nest"', "no calibration model nest"),
        ('name = "x6"', 'name = "x99"', "order of the covariance"),
        ("value = 0.0011", "value = nan", "parameters.value is beyond any measurement"),
        ("value = 0.0011", "wert = 0.0011", "value: field required"),
        ('unit = "m"', 'unit = "rad"', "parameter x10 is in rad; it is in m"),
        ("sigma = 0.0002", "sigma = 0.0003", "the covariance says 0.0002"),
        ("[4e-08,", "[-4e-08,", "variance of x10 is not above zero"),
        ("1e-13, 0.0]", "1e-03, 0.0]", "not symmetric and positive definite"),
        ("[covariance]", "[covariance", "this is not TOML"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, old: str, new: str, match: str) -> None:
    text = calibration_text(GOOD)
    assert old in text
    with pytest.raises(InputError, match=match) as caught:
        read_calibration(written(tmp_path, text.replace(old, new, 1)))
    assert "scanner.toml" in str(caught.value)


def test_no_text_and_no_file(tmp_path: Path) -> None:
    path = tmp_path / "scanner.toml"
    with pytest.raises(InputError, match=r"scanner\.toml"):
        read_calibration(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        read_calibration(path)
