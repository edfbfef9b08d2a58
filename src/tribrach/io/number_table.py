"""Columns of numbers from a CSV file by their names, units as the header gives them.

A column ``range`` may be titled ``range``, ``range_m``, ``range [m]`` or ``range (m)``. UTF-8;
comma, semicolon or tab between cells; ``#`` starts a comment line. Other columns are left alone.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.xml_file import read_bytes

__all__ = ["NumberTable", "read_numbers"]

Array = NDArray[np.float64]

_UNIT = r"(?:_| ?[\[(])\s*([\w/°\"″%]+)\s*[\])]?$"


@dataclass(frozen=True)
class NumberTable:
    """Columns by name.

    values : (n,) in the units of the file; units : "" where not given; remarks : sentences about
    what was left out.
    """

    path: Path
    values: dict[str, Array]
    units: dict[str, str]
    remarks: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


def read_numbers(path: Path, names: Sequence[str]) -> NumberTable:
    """Named columns of a CSV file, every cell a finite number.

    Raises
    ------
    InputError : unreadable, not UTF-8 text, a column that is missing or there twice, a row of
        another length, a cell that is no number.
    """
    rows, lines = _rows(path)
    titles = [" ".join(title.split()) for title in rows[0]]
    found = {name: _place(path, lines[0], titles, name) for name in dict.fromkeys(names)}
    for row, line in zip(rows[1:], lines[1:], strict=True):
        if len(row) != len(titles):
            what = f"the row has {len(row)} cells, the header has {len(titles)}"
            raise InputError(what, file=path, line=line, cure="give every row the same cells")
    values = {
        name: np.array(
            [
                _number(path, line, titles[column], row[column])
                for row, line in zip(rows[1:], lines[1:], strict=True)
            ]
        )
        for name, (column, _) in found.items()
    }
    return NumberTable(path, values, {name: unit for name, (_, unit) in found.items()})


def _rows(path: Path) -> tuple[list[list[str]], list[int]]:
    """Rows of cells and their 1-based lines, the header first."""
    data = read_bytes(path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InputError(
            "the file is not UTF-8 text", file=path, line=line, cure="save it as UTF-8"
        ) from error
    if "\0" in text:
        raise InputError("the file is not text", file=path, cure="give a CSV file in UTF-8")
    kept = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(kept) < 2:
        raise InputError("there are no rows under a header", file=path, cure="add them")
    separator = max(",;\t", key=kept[0][1].count)
    try:
        rows = list(csv.reader((line for _, line in kept), delimiter=separator))
    except csv.Error as error:
        raise InputError(f"this is no CSV file: {error}", file=path) from error
    if len(rows) != len(kept):
        raise InputError("a quoted cell goes over several lines", file=path, line=kept[0][0])
    return rows, [number for number, _ in kept]


def _place(path: Path, line: int, titles: list[str], name: str) -> tuple[int, str]:
    """Number and unit of the column with a name."""
    whole = re.compile(re.escape(name) + f"(?:{_UNIT})?$", re.IGNORECASE)
    hits = [(k, m.group(1) or "") for k, t in enumerate(titles) if (m := whole.match(t))]
    if len(hits) == 1:
        return hits[0]
    if hits:
        what = f"columns {' and '.join(titles[k] for k, _ in hits)} both are {name}"
        raise InputError(what, file=path, line=line, cure="keep one of them")
    near = difflib.get_close_matches(name, titles, 1)
    cure = f"did you mean {near[0]}" if near else f"the columns are {', '.join(titles)}"
    raise InputError(f"there is no column {name}", file=path, line=line, cure=cure)


def _number(path: Path, line: int, title: str, cell: str) -> float:
    """A finite number."""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if math.isfinite(value):
        return value
    shown = repr(cell.strip()) if cell.strip() else "empty"
    comma = re.fullmatch(r"\s*[+-]?\d+,\d+\s*", cell)
    cure = "write decimals with a point" if comma else "give a number, or leave the row out"
    raise InputError(f"{title} is {shown}, not a number", file=path, line=line, cure=cure)
