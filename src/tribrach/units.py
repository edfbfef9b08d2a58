"""Angles and lengths at the border: one parser, one formatter, one table of units.

Inside the program there are only metres and radians. A unit is named by the suffix of the field
it stands in: ``direction_gon``, ``sigma_zenith_arcsec``, ``height_instrument_m``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: radians per gon, arc second, ten-thousandth of a gon, degree
GON = math.pi / 200
SEC = math.pi / 648000
CC = GON / 10000
DEG = math.pi / 180
#: metres per millimetre
MM = 1e-3
#: no file means a number from here on; squares of smaller ones can still be added up
LARGEST = 1e12

#: factor to metres, radians, their squares or one, by suffix
UNITS: dict[str, float] = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "km": 1e3,
    "ft": 0.3048,
    "usft": 1200 / 3937,
    "rad": 1.0,
    "mrad": 1e-3,
    "deg": math.pi / 180,
    "gon": GON,
    "mgon": GON / 1000,
    "cc": CC,
    "arcmin": SEC * 60,
    "arcsec": SEC,
    "ppm": 1e-6,
    "percent": 1e-2,
    "m2": 1.0,
    "mm2": 1e-6,
}

#: metres in other units that lengths come in, in words
OTHER_LENGTHS = {
    "millimetres": 1e-3,
    "centimetres": 1e-2,
    "kilometres": 1e3,
    "feet": 0.3048,
    "yards": 0.9144,
    "inches": 0.0254,
}

#: the circle [rad], with room for rounding
_CIRCLE = 2 * math.pi * (1 + 1e-9)

_SEXAGESIMAL = re.compile(r"([+-]?)(\d+)[-:°\s]\s*(\d+)[-:'\s]\s*(\d+(?:\.\d*)?)\"?$")


#: angles with 60 minutes or seconds in the files that are being read; None where nobody asks
_CARRIED: ContextVar[list[str] | None] = ContextVar("angles that were carried", default=None)


@contextmanager
def carried_angles() -> Iterator[list[str]]:
    """A block that gathers the angles with 60 minutes or seconds, as ``35-44-60 as 35-45-00``."""
    found: list[str] = []
    token = _CARRIED.set(found)
    try:
        yield found
    finally:
        _CARRIED.reset(token)


def from_dms(degrees: int, minutes: int, seconds: float, text: str) -> float:
    """An angle [rad] without its sign.

    Programs that round seconds print ``35-44-60`` for ``35-45-00``: 60 minutes or seconds are
    carried and noted for :func:`carried_angles`. More than 60 are refused.
    """
    if minutes > 60 or seconds > 60:
        raise ValueError(f"{text!r} has more than 60 minutes or seconds")
    value = (degrees * 3600 + minutes * 60 + seconds) * SEC
    carried = _CARRIED.get()
    if carried is not None and (minutes == 60 or seconds == 60):
        sign = "-" if text.strip().startswith("-") else ""
        carried.append(f"{text.strip()} as {sign}{format_angle(value, 'dms', 0)}")
    return value


def too_large(value: ArrayLike) -> bool:
    """True if a number, or one of several, is beyond any measurement; NaN is not."""
    if isinstance(value, float):
        return abs(value) >= LARGEST
    return bool((np.abs(np.asarray(value, dtype=float)) >= LARGEST).any())


def beyond_circle(angle: ArrayLike) -> NDArray[np.bool_]:
    """True for angles [rad] of more than one turn either way, which no instrument reads."""
    return np.asarray(np.abs(np.asarray(angle, dtype=float)) > _CIRCLE)


def circle_passed(angle: float) -> bool:
    """As :func:`beyond_circle`, of one angle [rad]."""
    return abs(angle) > _CIRCLE


def check_circle(angle: float, turns: int = 1) -> float:
    """An angle [rad] as it is, unless it is more than a turn, or so many."""
    if abs(angle) > turns * _CIRCLE:
        circles = "a circle" if turns == 1 else f"{turns} circles"
        raise ValueError(
            f"{angle / GON:.10g} gon ({math.degrees(angle):.10g} degrees) is more than {circles}: "
            "check the angle and its unit"
        )
    return angle


def parse_angle(text: str, unit: str) -> float:
    """An angle in radians, from its text."""
    text = text.strip()
    if unit != "dms":
        return float(text) * UNITS[unit]
    match = _SEXAGESIMAL.match(text)
    if match is None:
        raise ValueError(f"{text!r} is not degrees, minutes and seconds")
    sign, degrees, minutes, seconds = match.groups()
    value = from_dms(int(degrees), int(minutes), float(seconds), text)
    return -value if sign == "-" else value


def format_angle(value: float, unit: str, digits: int = 4) -> str:
    """An angle in a unit of :data:`UNITS`, or as ``D-MM-SS`` in ``dms``, with decimal digits."""
    if unit != "dms":
        return f"{value / UNITS[unit]:.{digits}f}"
    whole = round(abs(value) / SEC, digits)
    degrees, rest = divmod(whole, 3600)
    minutes, seconds = divmod(rest, 60)
    width = digits + 3 if digits else 2
    sign = "-" if value < 0 and whole > 0 else ""
    return f"{sign}{int(degrees)}-{int(minutes):02d}-{seconds:0{width}.{digits}f}"


def percent(share: float) -> str:
    """The text of a share, as every sentence has it: ``95 %``, ``1.7 %``, ``99.8 %``, ``0.03 %``.

    Two digits count, from the end that is nearer, so that what is not all does not become 100 %;
    zeros after the point are left out.
    """
    value = 100 * share
    rest = min(abs(value), abs(100 - value)) if 0 <= value <= 100 else abs(value)
    # what is nearer than a millionth is the end itself, whatever a sum of shares left
    digits = 0 if rest < 1e-4 else max(0, 1 - math.floor(math.log10(rest) + 1e-9))
    text = f"{value:.{digits}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return f"{'0' if text == '-0' else text} %"


def span(low: float, high: float) -> str:
    """Two numbers of four digits without powers of ten; one if they are alike."""
    ends = [_four_digits(value) for value in (low, high)]
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"


def _four_digits(value: float) -> str:
    text = f"{value:.4g}"
    return f"{float(text):.12f}".rstrip("0").rstrip(".") if "e" in text else text
