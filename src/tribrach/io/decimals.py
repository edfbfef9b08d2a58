"""Numbers as countries write them: decimals behind a point or a comma, thousands apart.

``4567123.45``, ``4567123,45``, ``4.567.123,45``, ``4,567,123.45``, ``2'600'123.45`` and numbers
with blanks between thousands are one number each. Which mark stands before decimals is decided for
all numbers of a file together, never cell by cell.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Literal

from tribrach.errors import InputError

Decimal = Literal[".", ","]

_EXPONENT = r"(?:[eE][+-]?\d+)?"
#: a cell that is a number with a decimal point, with a decimal comma
_POINT = re.compile(rf"[+-]?(?:\d*\.\d+{_EXPONENT}|\d{{1,3}}(?:,\d{{3}})+\.\d*)$")
_COMMA = re.compile(rf"[+-]?(?:\d*,\d+{_EXPONENT}|\d{{1,3}}(?:\.\d{{3}})+,\d*)$")
#: numbers whose only mark may stand before decimals or between thousands
_UNCLEAR = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}$")
_THOUSANDS = {
    ".": re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d*)?$"),
    ",": re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d*)?$"),
}
#: blanks and apostrophes between thousands
_APART = re.compile(r"(?<=\d)[\u00a0\u202f\u2009 '\u2019](?=\d{3}(?!\d))")
_GROUPED = re.compile(r"[+-]?\d{1,3}(?:[\u00a0\u202f\u2009 '\u2019]\d{3})+(?:[.,]\d*)?$")


class Exact(str):
    """A number that a spreadsheet holds as one: its point stands before decimals for certain."""

    __slots__ = ()


def lone_commas(cells: Iterable[str], separator: str) -> str | None:
    """The first cell with a comma where each may stand before decimals or thousands, else None.

    Between semicolons commas stand before decimals.
    """
    commas = [cell for cell in cells if "," in cell]
    if separator == ";" or not all(map(_UNCLEAR.match, commas)):
        return None
    return next(iter(commas), None)


def decimal_of(
    path: Path,
    columns: Sequence[Sequence[str]],
    lines: Sequence[int],
    stated: Decimal | None,
    separator: str,
) -> tuple[Decimal, tuple[str, ...]]:
    """What stands before decimals, and a sentence if a comma was found to."""
    if stated is not None:
        return stated, ()
    marked = list(_marked(columns, lines))
    commas = [(cell, line) for cell, line in marked if _COMMA.match(cell)]
    points = sum(_POINT.match(cell) is not None for cell, _ in marked) if commas else 0
    if len(commas) <= points:
        return ".", ()
    cell, line = commas[0]
    if lone_commas((cell for cell, _ in commas), separator) is not None:
        raise InputError(
            f"{cell} may be a number with decimals or one in thousands",
            file=path,
            line=line,
            cure='add decimal = "," or decimal = "." to the entry of the file',
        )
    return ",", (f"decimals are written with a comma, such as {cell} in line {line}",)


def _marked(columns: Sequence[Sequence[str]], lines: Sequence[int]) -> Iterator[tuple[str, int]]:
    """Cells with a comma or a point, with their lines."""
    for cells in columns:
        for cell, line in zip(cells, lines, strict=True):
            if not isinstance(cell, Exact) and ("," in cell or "." in cell):
                yield _APART.sub("", cell.strip()), line


def plain(cell: str, decimal: Decimal) -> str:
    """A number as Python writes it; anything else comes back as it is."""
    if isinstance(cell, Exact) or cell.isdigit():
        return str(cell)
    text = cell.strip()
    if _GROUPED.match(text):
        text = _APART.sub("", text)
    other = "," if decimal == "." else "."
    if other in text and _THOUSANDS[decimal].match(text):
        # one mark alone, such as 5.302 among commas, is told and not guessed
        if decimal == "." and _UNCLEAR.match(text):
            return text
        if decimal == "," and _UNCLEAR.match(text):
            return text.replace(".", ",")
        text = text.replace(other, "")
    if decimal == ".":
        return text
    if _POINT.match(text):
        return text.replace(".", ",")
    return text.replace(",", ".") if _COMMA.match(text) else text
