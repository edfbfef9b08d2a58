"""Lines, numbers and packed angles of raw files."""

from __future__ import annotations

import math
import re
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.opened_files import contents, lines_of, text_of_bytes
from tribrach.io.xml_file import read_bytes
from tribrach.units import UNITS, check_circle, from_dms, too_large

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)$")
#: lines that a transmission leaves in a file, such as <STX>, and what leads to the text of a line
_MARK = re.compile(r"\W*(?:STX|ETX|SOH|EOT|ACK|NAK|XON|XOFF|CR|LF|SUB)\W*$", re.IGNORECASE)
#: bytes that text of any instrument may have below the blank: tab, line ends, STX, ETX, EOT, SUB
_CONTROL = bytes(set(range(32)) - {2, 3, 4, 9, 10, 12, 13, 26})


def read_lines(path: Path) -> list[str]:
    """Lines of a text file with any line ends; UTF-8, else as Windows writes."""
    data = read_bytes(path)
    if data.translate(None, _CONTROL) != data:
        raise InputError("the file is not text", file=path, cure="give the file as it was exported")
    return _without_marks(lines_of(text_of_bytes(data)))


def head(path: Path, size: int = 4000) -> str:
    """Beginning of a file as text, to recognise it; "" if it cannot be read."""
    try:
        lines = _without_marks(lines_of(text_of_bytes(contents(path, size))))
    except OSError:
        return ""
    first = next((k for k, line in enumerate(lines) if line.strip("\x02\x03\x04\x1a \t")), 0)
    return "\n".join(lines[first:])


def _without_marks(lines: list[str]) -> list[str]:
    """Lines of a file, those that only mark a transmission empty: they say nothing."""
    return ["" if line and len(line) < 12 and _MARK.match(line) else line for line in lines]


def number(text: str) -> float:
    """A plain decimal number; NaN if the text is blank."""
    text = text.strip()
    if not text:
        return math.nan
    if _NUMBER.match(text) is None:
        raise ValueError(f"{text!r} is not a number")
    value = float(text)
    if too_large(value):
        raise ValueError(f"{text[:20]} is beyond any measurement")
    return value


def packed_dms(text: str) -> float:
    """Radians of ``DDD.MMSSs``: degrees, then two digits of minutes, two of seconds, decimals."""
    text = text.strip()
    if not text:
        return math.nan
    number(text)
    sign = -1.0 if text.startswith("-") else 1.0
    whole, _, rest = text.lstrip("+-").partition(".")
    rest = rest.ljust(4, "0")
    if len(whole.lstrip("0")) > 3:
        raise ValueError(f"{text[:20]} is no angle")
    minutes, seconds = int(rest[:2]), float(f"{rest[2:4]}.{rest[4:] or '0'}")
    return sign * from_dms(int(whole or 0), minutes, seconds, text)


def angle(text: str, unit: str) -> float:
    """Radians of an angle."""
    if unit == "dms":
        return check_circle(packed_dms(text), turns=2)
    if unit == "mil":
        return check_circle(number(text) * math.pi / 3200, turns=2)
    return check_circle(number(text) * UNITS[unit], turns=2)
