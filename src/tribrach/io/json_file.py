"""Reads JSON files that the program wrote, or that somebody says it wrote.

Numbers are finite and have no more digits than a coordinate needs: Python reads integers of
thousands of digits and words such as ``Infinity``, and fails on both much later.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NoReturn

from tribrach.io.xml_file import read_bytes

#: integers with more digits are no count and no coordinate
_DIGITS = 18


def read_json(path: Path) -> Any:
    """The content of a JSON file."""
    data = read_bytes(path)
    try:
        return json.loads(data, **_BOUNDED)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _integer(digits: str) -> int:
    if len(digits) > _DIGITS:
        raise ValueError(f"an integer of {len(digits)} digits")
    return int(digits)


def _real(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError("a number beyond all bounds")
    return value


def _refused(word: str) -> NoReturn:
    raise ValueError(f"{word} is no number")


_BOUNDED: dict[str, Any] = {
    "parse_int": _integer,
    "parse_float": _real,
    "parse_constant": _refused,
}
#: reads what begins with JSON, with control characters in its texts and words for numbers
LENIENT = json.JSONDecoder(strict=False, parse_int=_integer)
