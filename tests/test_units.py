"""Angles and lengths at the border: exact factors, and writing undone by reading."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.units import CC, GON, SEC, UNITS, format_angle, parse_angle, percent, span

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


@pytest.mark.parametrize(
    "text", ["12-61-00", "12-00-60.1", "12-30", "12.5", "a-b-c", "", "1-2-3-4"]
)
def test_no_sexagesimal_angle(text: str) -> None:
    with pytest.raises(ValueError, match=r"is not degrees|has more than 60"):
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


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0, "0 %"), (-1e-9, "0 %"), (1, "100 %"), (1 - 1e-9, "100 %"), (0.05, "5 %"), (0.5, "50 %"),
        (0.017, "1.7 %"), (0.0996, "10 %"), (0.39, "39 %"), (0.951, "95.1 %"), (0.9999, "99.99 %"),
        (0.00034, "0.034 %"), (1.26, "126 %"), (-0.25, "-25 %"), (1 - 0.7, "30 %"), (0.29, "29 %"),
    ],
)  # fmt: skip
def test_shares_have_no_needless_digits_and_almost_all_is_not_all(share: float, text: str) -> None:
    assert percent(share) == text


@given(st.floats(1e-5, 1 - 1e-5))
def test_a_share_is_as_near_as_two_digits_of_its_end(share: float) -> None:
    said = float(percent(share).removesuffix(" %")) / 100
    assert abs(said - share) <= 0.0501 * min(share, 1 - share)
    assert 0 < said < 1


def test_spans_have_no_powers_of_ten() -> None:
    assert span(4182.2, 13_560) == "4182 to 13560"
    assert span(0.005064, 2.5e-5) == "0.005064 to 0.000025"
    assert span(7437.1, 7437.2) == "7437"
    assert span(0, 1e7) == "0 to 10000000"
