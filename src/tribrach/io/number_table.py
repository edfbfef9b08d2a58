"""Columns of numbers from a CSV file by their names, in the units that the header gives.

A column ``range`` may be titled ``range``, ``range_m``, ``range [m]`` or ``range (m)``. Text or a
spreadsheet (:mod:`tribrach.io.csv_rows`). Other columns are ignored.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.csv_rows import read_rows
from tribrach.io.decimals import plain
from tribrach.units import LARGEST

_UNIT = r"(?:_| ?[\[(])\s*([\w/°\"″%]+)\s*[\])]?$"


@dataclass(frozen=True)
class NumberTable:
    """Columns of numbers by name."""

    path: Path  #: of the file
    values: dict[str, Array]  #: in the units of the file
    units: dict[str, str]  #: "" where not given
    #: sentences about what was left out, and what was guessed of how the list is written
    remarks: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


def read_numbers(
    path: Path, names: Sequence[str], *, optional: Sequence[str] = (), timed: bool = False
) -> NumberTable:
    """Named columns of a CSV file, every cell a finite number.

    optional : columns that may be missing; timed : a column ``time`` is read too, in seconds since
    1970, UTC.
    """
    table = read_rows(path)
    rows, lines = table.cells, table.lines
    titles = [" ".join(title.split()) for title in rows[0]]
    there = [name for name in optional if _has(titles, name)]
    places = {
        name: _place(path, lines[0], titles, name) for name in dict.fromkeys((*names, *there))
    }
    decimal, said = table.decimal([column for column, _ in places.values()])
    values = {
        name: np.array(
            [
                _number(path, line, titles[column], plain(row[column], decimal))
                for row, line in zip(rows[1:], lines[1:], strict=True)
            ]
        )
        for name, (column, _) in places.items()
    }
    if timed:
        column, _ = _place(path, lines[0], titles, "time")
        times = [
            time_of(path, line, row[column]) for row, line in zip(rows[1:], lines[1:], strict=True)
        ]
        values["time"] = np.array(times)
    units = {name: unit for name, (_, unit) in places.items()}
    return NumberTable(path, values, units, (*table.remarks, *said))


def time_of(path: Path, line: int, cell: str) -> float:
    """Seconds since 1970 of an ISO 8601 time in a cell, UTC where it has no offset."""
    try:
        when = datetime.fromisoformat(cell.strip().replace("Z", "+00:00"))
        return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        raise InputError(
            f"time is {cell.strip()!r}, which is none",
            file=path,
            line=line,
            cure="write it as 2025-03-01T00:02:58Z",
        ) from None


def _whole(name: str) -> re.Pattern[str]:
    """The titles that a column of a name may have."""
    return re.compile(re.escape(name) + f"(?:{_UNIT})?$", re.IGNORECASE)


def _has(titles: list[str], name: str) -> bool:
    """True if there is a column of a name."""
    return any(map(_whole(name).match, titles))


def _place(path: Path, line: int, titles: list[str], name: str) -> tuple[int, str]:
    """Number and unit of the column with a name."""
    whole = _whole(name)
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
    if abs(value) < LARGEST:
        return value
    if math.isfinite(value):
        what = f"{title} is {cell.strip()}, too large to be fitted"
        raise InputError(what, file=path, line=line, cure="correct it, or leave the row out")
    shown = repr(cell.strip()) if cell.strip() else "empty"
    comma = re.fullmatch(r"\s*[+-]?\d+,\d+\s*", cell)
    cure = "write decimals with a point" if comma else "give a number, or leave the row out"
    raise InputError(f"{title} is {shown}, not a number", file=path, line=line, cure=cure)
