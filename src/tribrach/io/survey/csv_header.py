"""What the header of a CSV file means: a quantity and its unit in every column name.

``slope_distance_m``, ``direction_gon``, ``sigma_zenith_arcsec``: the suffix is the unit and must be
there; a name without one, or an unknown one, is refused with the nearest known name.
"""

from __future__ import annotations

import csv
import difflib
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.units import UNITS, parse_angle

__all__ = ["Table", "read_table"]

Array = NDArray[np.float64]

LENGTH = ("m", "cm", "mm", "km", "ft", "usft")
ANGLE = ("rad", "mrad", "deg", "gon", "mgon", "cc", "arcmin", "arcsec", "dms")
VARIANCE = ("m2", "mm2")

#: columns of text
WORDS = {
    "from", "to", "backsight", "point", "station", "target", "set", "instrument", "use", "reason",
    "group", "role", "comment",
}  # fmt: skip

#: quantities and the units they may have
QUANTITIES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(
        (
            "slope_distance", "horizontal_distance", "height_difference", "distance",
            "height_instrument", "height_target", "e", "n", "u", "height", "x", "y", "z",
            "de", "dn", "du", "dx", "dy", "dz", "range", "length",
        ),
        LENGTH,
    ),
    **dict.fromkeys(
        ("direction", "angle", "azimuth", "zenith", "horizontal", "latitude", "longitude",
         "tilt_x", "tilt_y"),
        ANGLE,
    ),
    **dict.fromkeys(("cxx", "cxy", "cxz", "cyy", "cyz", "czz"), VARIANCE),
    **dict.fromkeys(("antenna_height",), LENGTH),
}  # fmt: skip
for _name, _units in list(QUANTITIES.items()):
    if _units is not VARIANCE:
        QUANTITIES[f"sigma_{_name}"] = _units
QUANTITIES["sigma_across"] = LENGTH
QUANTITIES["sigma_distance"] = LENGTH
QUANTITIES["sigma_tilt"] = ANGLE
QUANTITIES["face"] = ("",)

MAX_BYTES = 500_000_000


@dataclass(frozen=True)
class Table:
    """A CSV file by columns.

    words : text columns; numbers : values (n,) in metres and radians by quantity, NaN where a
    cell is empty; lines (n,) 1-based line of each row.
    """

    path: Path
    words: dict[str, list[str]]
    numbers: dict[str, Array]
    lines: list[int]

    def __len__(self) -> int:
        return len(self.lines)

    def source(self, row: int) -> str:
        """``file:line`` of a row."""
        return f"{self.path.name}:{self.lines[row]}"

    def error(self, row: int, what: str, cure: str | None = None) -> InputError:
        """An error at a row."""
        return InputError(what, file=self.path, line=self.lines[row], cure=cure)

    def has(self, *names: str) -> bool:
        """True if all columns are there."""
        return all(name in self.words or name in self.numbers for name in names)


def read_table(path: Path) -> Table:
    """Read a CSV file whose header names column and unit; ``#`` starts a comment line.

    Raises
    ------
    InputError : not UTF-8, empty, a column without unit or unknown, a row of another length, a
        cell that is not a number.
    """
    rows, lines = _rows(path)
    if not rows:
        raise InputError("the file is empty", file=path, cure="give a header and rows")
    header = [name.strip().lower() for name in rows[0]]
    plan = [_column(path, lines[0], name) for name in header]
    if len(set(header)) != len(header):
        double = next(n for n in header if header.count(n) > 1)
        raise InputError(f"column {double} occurs twice", file=path, line=lines[0])
    words: dict[str, list[str]] = {}
    numbers: dict[str, Array] = {}
    for row, line in zip(rows[1:], lines[1:], strict=True):
        if len(row) != len(header):
            raise InputError(
                f"the row has {len(row)} cells and the header {len(header)}", file=path, line=line
            )
    for k, (quantity, unit) in enumerate(plan):
        cells = [row[k].strip() for row in rows[1:]]
        if unit is None:
            words[quantity] = cells
        else:
            numbers[quantity] = _numbers(path, lines[1:], header[k], cells, unit)
    return Table(path, words, numbers, lines[1:])


def _rows(path: Path) -> tuple[list[list[str]], list[int]]:
    """Rows and their line numbers, without comments and empty lines."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"the file is larger than {MAX_BYTES // 10**6} MB", file=path)
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=path, cure="check the path"
        ) from error
    except UnicodeDecodeError as error:
        line = path.read_bytes()[: error.start].count(b"\n") + 1
        raise InputError(
            "the file is not UTF-8 text", file=path, line=line, cure="save it as UTF-8"
        ) from error
    rows, lines = [], []
    for number, content in enumerate(io.StringIO(text), start=1):
        if content.strip() and not content.lstrip().startswith("#"):
            rows.append(next(csv.reader([content])))
            lines.append(number)
    return rows, lines


def _column(path: Path, line: int, name: str) -> tuple[str, str | None]:
    """Quantity and unit of a column name; unit None for text."""
    if name in WORDS:
        return name, None
    if name in QUANTITIES and QUANTITIES[name] == ("",):
        return name, ""
    quantity, _, unit = name.rpartition("_")
    if quantity in QUANTITIES and unit in QUANTITIES[quantity]:
        return quantity, unit
    if name in QUANTITIES:
        raise InputError(
            f"column {name} has no unit",
            file=path,
            line=line,
            cure=f"name it for instance {name}_{QUANTITIES[name][0]}",
        )
    if quantity in QUANTITIES:
        raise InputError(
            f"column {name} has the unknown unit {unit}",
            file=path,
            line=line,
            cure=f"use {', '.join(QUANTITIES[quantity])}",
        )
    known = [*WORDS, *(f"{q}_{u}" for q, units in QUANTITIES.items() for u in units[:3])]
    near = difflib.get_close_matches(name, known, 1)
    raise InputError(
        f"column {name} is unknown",
        file=path,
        line=line,
        cure=f"did you mean {near[0]}" if near else "see the documentation of the CSV format",
    )


def _numbers(path: Path, lines: list[int], name: str, cells: list[str], unit: str) -> Array:
    """Values in metres and radians; NaN for empty cells."""
    out = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if cell:
            try:
                out[k] = parse_angle(cell, unit) if unit == "dms" else float(cell)
            except ValueError as error:
                raise InputError(
                    f"{name} is not a number: {cell!r}", file=path, line=lines[k]
                ) from error
            if not np.isfinite(out[k]):
                raise InputError(f"{name} is not a finite number", file=path, line=lines[k])
    return out if unit in ("", "dms") else out * UNITS[unit]
