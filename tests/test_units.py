"""Angles and lengths at the border: exact factors, and writing undone by reading."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.units import CC, GON, SEC, UNITS, format_angle, parse_angle

ANGLES = ("deg", "gon", "mgon", "cc", "arcmin", "arcsec", "rad", "mrad")
TURN = {"deg": 360, "gon": 400, "mgon": 4e5, "cc": 4e6, "arcmin": 21600, "arcsec": 1296000}


@pytest.mark.parametrize("unit", TURN)
def test_units_of_a_full_turn(unit: str) -> None:
    assert parse_angle(str(TURN[unit]), unit) == pytest.approx(2 * math.pi, rel=1e-15)


def test_constants_and_lengths() -> None:
    assert UNITS["gon"] == GON
    assert UNITS["cc"] == CC
    assert UNITS["arcsec"] == SEC
    assert abs(CC / SEC - 0.324) < 1e-14
    assert UNITS["ft"] == 0.3048
    assert UNITS["usft"] == pytest.approx(0.3048006096, abs=1e-10)
    assert (UNITS["mm"], UNITS["km"], UNITS["mm2"]) == (1e-3, 1e3, 1e-6)


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        ("57-32-28.428", 57 + 32 / 60 + 28.428 / 3600),
        ("-0-00-30", -30 / 3600),
        ("+12:30:00", 12.5),
        ("12 30 36", 12.51),
        ("359°59'59.9\"", 359 + 59 / 60 + 59.9 / 3600),
    ],
)
def test_sexagesimal(text: str, degrees: float) -> None:
    assert parse_angle(text, "dms") == pytest.approx(math.radians(degrees), rel=1e-14)


@pytest.mark.parametrize("text", ["12-60-00", "12-00-60", "12-30", "12.5", "a-b-c", "", "1-2-3-4"])
def test_no_sexagesimal_angle(text: str) -> None:
    with pytest.raises(ValueError, match=r"is not degrees|has 60 or more"):
        parse_angle(text, "dms")


@pytest.mark.parametrize("text", ["", "12,5", "0x1", "twelve"])
def test_no_number(text: str) -> None:
    with pytest.raises(ValueError, match="could not convert"):
        parse_angle(text, "gon")


@given(st.floats(-20, 20), st.sampled_from([*ANGLES, "dms"]), st.integers(0, 9))
def test_reading_undoes_writing(value: float, unit: str, digits: int) -> None:
    step = 10.0**-digits * (SEC if unit == "dms" else UNITS[unit])
    back = parse_angle(format_angle(value, unit, digits), unit)
    assert abs(back - value) <= 0.5 * step * (1 + 1e-6) + 1e-14


def test_writing() -> None:
    assert format_angle(100 * GON, "gon") == "100.0000"
    assert format_angle(math.radians(57 + 32 / 60 + 28.428 / 3600), "dms", 3) == "57-32-28.428"
    assert format_angle(59.99996 * SEC, "dms", 4) == "0-01-00.0000"
    assert format_angle(-30 * SEC, "dms", 0) == "-0-00-30"
    assert format_angle(-1e-9 * SEC, "dms", 1) == "0-00-00.0"
