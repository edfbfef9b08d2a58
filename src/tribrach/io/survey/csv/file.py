"""A table by columns: read once, numbers in metres and radians, every row with its line.

Text or a spreadsheet (:mod:`tribrach.io.csv_rows`). A cell that is empty has no value.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError, RefusalCollector
from tribrach.io.csv_rows import AS_FOUND, ListForm, ListRows, read_rows
from tribrach.io.decimals import Decimal, plain
from tribrach.io.survey.csv.columns import (
    LAYOUTS,
    NUMBERS,
    QUANTITIES,
    WORDS,
    TableLayout,
    nearest,
    titled,
    units_of,
)
from tribrach.io.survey.csv.headings import (
    Heads,
    heads_of,
    looks_headless,
    named_columns,
    refuse_headless,
)
from tribrach.io.survey.csv.observation_heads import observation_heads
from tribrach.io.text_form import refuse_two_commas
from tribrach.units import LARGEST, UNITS, parse_angle

#: a number with its unit in the cell
_WITH_UNIT = re.compile(r"([-+]?\d+(?:[.,]\d+)?)\s*(?:mm|cm|m|km|gon|deg|°|\"|cc|mgon)")


@dataclass(frozen=True)
class CsvTable:
    """A CSV file by columns.

    words : names by column, "" where empty; numbers : values (n,) in metres, radians and square
    metres by quantity, NaN where empty; lines : 1-based line of each row; head : line of the
    header; titles : column names as typed; label : what tells the file from others of the same
    name, its name if empty; remarks : what was taken for something that the file does not say, one
    sentence each without the stop.
    """

    path: Path
    layout: TableLayout
    words: dict[str, list[str]]
    numbers: dict[str, Array]
    lines: list[int]
    head: int
    titles: dict[str, str]
    label: str = ""
    remarks: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.lines)

    def has(self, *columns: str) -> bool:
        """True if all columns are there."""
        return all(column in self.words or column in self.numbers for column in columns)

    @property
    def name(self) -> str:
        """What the file is called in sources and in names of unknowns."""
        return self.label or self.path.name

    def source(self, row: int) -> str:
        """``file:line`` of a row."""
        return f"{self.name}:{self.lines[row]}"

    def error(self, row: int | None, what: str, cure: str | None = None) -> InputError:
        """An error at a row, or at the header."""
        line = self.head if row is None else self.lines[row]
        return InputError(what, file=self.path, line=line, cure=cure)

    def refuse(
        self, rows: Index, what: str | Callable[[int], str], cure: str | None = None
    ) -> None:
        """Refuse rows, all of them at once; nothing happens if there are none."""
        with RefusalCollector() as refused:
            for row in np.asarray(rows).tolist():
                refused.add(self.error(row, what if isinstance(what, str) else what(row), cure))

    def without(self, lines: Collection[int | None]) -> CsvTable:
        """The table without the rows of some lines."""
        keep = [row for row, line in enumerate(self.lines) if line not in lines]
        return replace(
            self,
            words={name: [cells[row] for row in keep] for name, cells in self.words.items()},
            numbers={name: values[keep] for name, values in self.numbers.items()},
            lines=[self.lines[row] for row in keep],
        )

    def number(self, column: str) -> Array:
        """Values (n,) of a column; NaN without the column."""
        values = self.numbers.get(column)
        return np.full(len(self), np.nan) if values is None else values

    def columns(self, *names: str) -> Array:
        """Values (n, k) of columns that must be filled."""
        for name in names:
            if name not in self.numbers:
                raise self.error(None, f"there is no column for {name}", f"add {titled(name)}")
        values = np.stack([self.numbers[name] for name in names], axis=1)
        with RefusalCollector() as refused:
            for row, column in np.argwhere(np.isnan(values)).tolist():
                what = f"{self.titles[names[column]]} is empty"
                refused.add(self.error(row, what, "give a value"))
        return values

    def names(self, column: str, rows: Sequence[int] | NDArray[np.int64]) -> list[str]:
        """Names of rows, none of them empty."""
        cells = self.words[column]
        empty = np.array([row for row in rows if not cells[row]], dtype=np.int64)
        self.refuse(empty, f"{column} is empty", "give a name")
        return [cells[row] for row in rows]


def read_table(path: Path, form: ListForm = AS_FOUND) -> CsvTable:
    """Read a table whose header names columns and units.

    Lists of coordinates may have the heads of other programs (:mod:`.headings`).
    """
    rows = read_rows(path, form)
    rows, header = _headed(rows)
    line = rows.lines[0]
    with RefusalCollector() as refused:
        columns = []
        for name in header:
            with refused.record():
                columns.append(_column(path, line, name))
        refused.settle()
        plan = _scanned(columns)
        layout = _layout(path, line, [quantity for quantity, _ in plan])
        return _table(path, layout, header, plan, rows, refused)


def _headed(rows: ListRows) -> tuple[ListRows, list[str]]:
    """Rows of the columns that are read, and the names of these in our words."""
    path, columns = rows.path, rows.form.columns
    titles = [" ".join(name.split()) for name in rows.cells[0]]
    headless = looks_headless(titles)
    if headless and rows.separator == "," and not any("." in c for row in rows.cells for c in row):
        refuse_two_commas(rows.cells, path)
    if headless and not columns:
        refuse_headless(path, rows.lines[0], titles)
    if headless:
        titles = [f"column {k}" for k in range(1, len(titles) + 1)]
        cells = [titles, *rows.cells]
        rows = replace(rows, cells=cells, lines=[rows.lines[0], *rows.lines])
    named = named_columns(path, rows.lines[0], titles, columns) if columns else [""] * len(titles)
    named = [_with_unit(name) for name in named]
    lower = [title.lower() for title in titles]
    own = [name or (low if _is_ours(low) else "") for name, low in zip(named, lower, strict=True)]
    # columns without head and content, as a separator at the end of each line makes
    bare = [
        not t and not any(row[k].strip() for row in rows.cells[1:]) for k, t in enumerate(titles)
    ]
    said: tuple[str, ...] = ()
    if all(name or empty for name, empty in zip(own, bare, strict=True)):
        heads = own
    elif found := _of_others(path, rows.lines[0], titles, own):
        heads, said = list(found.names), found.remarks
    elif columns:
        left = [
            t for t, name, empty in zip(titles, own, bare, strict=True) if not name and not empty
        ]
        heads, said = own, (f"columns that are left out: {', '.join(left)}",)
    else:
        heads = [name or low for name, low in zip(own, lower, strict=True)]
        heads = ["" if empty else head for head, empty in zip(heads, bare, strict=True)]
    keep = [k for k, head in enumerate(heads) if head]
    if len(keep) < len(heads):
        rows = replace(rows, cells=[[row[k] for k in keep] for row in rows.cells])
    return replace(rows, remarks=(*rows.remarks, *said)), [heads[k] for k in keep]


def _of_others(path: Path, line: int, titles: Sequence[str], own: Sequence[str]) -> Heads | None:
    """What heads of other programs mean, of coordinates or of observations."""
    found = heads_of(path, line, titles, own)
    return observation_heads(path, line, titles, own) if found is None else found


def _is_ours(name: str) -> bool:
    """True if a head is a column of ours with its unit."""
    if name == "scan" or name in WORDS or name in NUMBERS:
        return True
    quantity, _, unit = name.rpartition("_")
    return quantity in QUANTITIES and unit in QUANTITIES[quantity]


#: coordinates that a project may name without a unit
_METRES = (
    "e",
    "n",
    "u",
    "x",
    "y",
    "z",
    "easting",
    "northing",
    "height",
    "ecef_x",
    "ecef_y",
    "ecef_z",
)


def _with_unit(name: str) -> str:
    """A head that a project gave; coordinates are in metres where nothing says another unit."""
    return f"{name}_m" if name in _METRES else name


def _table(
    path: Path,
    layout: TableLayout,
    header: list[str],
    plan: list[tuple[str, str | None]],
    rows: ListRows,
    refused: RefusalCollector,
) -> CsvTable:
    """The table of rows whose header is understood; cells that cannot be read are refused."""
    words: dict[str, list[str]] = {}
    numbers: dict[str, Array] = {}
    titles: dict[str, str] = {}
    lines = rows.lines
    cells = [list(column) for column in zip(*rows.cells[1:], strict=True)] or [[] for _ in header]
    decimal, said = rows.decimal([k for k, (_, unit) in enumerate(plan) if unit is not None])
    for title, (quantity, unit), column in zip(header, plan, cells, strict=True):
        name = layout.aliases.get(quantity, quantity)
        with refused.record():
            _check_place(path, lines[0], layout, title, name, titles)
            titles[name] = title
            if unit is None:
                words[name] = [cell.strip() for cell in column]
            else:
                numbers[name] = _numbers(path, lines[1:], title, column, unit, decimal)
    remarks = (*rows.remarks, *said)
    return CsvTable(path, layout, words, numbers, lines[1:], lines[0], titles, remarks=remarks)


def _column(path: Path, line: int, name: str) -> tuple[str, str | None]:
    """Quantity and unit of a column name; the unit is None for words, "" for plain numbers."""
    if name == "scan":
        return "station", None
    if name in WORDS or name in NUMBERS:
        return name, (None if name in WORDS else "")
    quantity, _, unit = name.rpartition("_")
    if quantity in QUANTITIES and unit in QUANTITIES[quantity]:
        return quantity, unit
    if name in QUANTITIES:
        what, cure = f"column {name} has no unit", f"name it {titled(name)}"
    elif quantity in QUANTITIES:
        what, cure = f"{unit} in column {name} is no unit of it", f"use {units_of(quantity)}"
    else:
        near = nearest(name)
        what = f"column {name!r} is unknown"
        cure = f"did you mean {near}" if near else "see the documentation of the CSV files"
    raise InputError(what, file=path, line=line, cure=cure)


def _scanned(plan: list[tuple[str, str | None]]) -> list[tuple[str, str | None]]:
    """In a table with stations ``point`` is another name of ``target``."""
    names = [name for name, _ in plan]
    if "station" not in names or "target" in names:
        return plan
    return [("target" if name == "point" else name, unit) for name, unit in plan]


def _layout(path: Path, line: int, quantities: list[str]) -> TableLayout:
    """What kind of table has these columns, in whatever order the kinds are listed.

    Among those whose needs are there, one that knows every column goes before one that does not,
    and one that needs more before one that needs a part of it.
    """
    fitting = [layout for layout in LAYOUTS if set(layout.needs) <= set(quantities)]
    fitting = [layout for layout in fitting if all(map(layout.knows, quantities))] or fitting
    for layout in fitting:
        if not any(set(layout.needs) < set(other.needs) for other in fitting):
            return layout
    raise InputError(
        "the columns do not say what kind of table this is",
        file=path,
        line=line,
        cure="name from and to; station and target; point; or gnss",
    )


def _check_place(
    path: Path, line: int, layout: TableLayout, title: str, name: str, titles: dict[str, str]
) -> None:
    """Refuse a column that means nothing in this kind of table or is there already."""
    if not layout.knows(name):
        what, cure = f"column {title} has no meaning in a table of {layout.name}", "remove it"
        if name.startswith("sigma") and "station" in layout.needs:
            cure = (
                "name the ends from and to where rows have sigmas of their own; a table of station "
                "and target takes those of the instrument of a project"
            )
        elif name.startswith("sigma"):
            own = [titled(n) for n in layout.numbers if n.startswith("sigma")]
            cure = f"its columns of sigmas are {', '.join(own[:3])}" if own else cure
    elif name in titles:
        what, cure = f"columns {titles[name]} and {title} say the same thing", "keep one of them"
    else:
        return
    raise InputError(what, file=path, line=line, cure=cure)


def _numbers(
    path: Path, lines: list[int], title: str, column: list[str], unit: str, decimal: Decimal
) -> Array:
    """Values in metres and radians, NaN for empty cells; sigmas must be above zero."""
    if unit == "dms":
        cells = [cell.strip() for cell in column]
        cells = cells if decimal == "." else [cell.replace(",", ".") for cell in cells]
    else:
        cells = [plain(cell, decimal).strip() for cell in column]
    try:
        if unit == "dms":
            values = np.array([parse_angle(c, unit) if c else np.nan for c in cells])
        else:
            values = np.array([float(c or "nan") for c in cells]) * UNITS.get(unit, 1.0)
        good = np.isfinite(values) | np.array([not c for c in cells], dtype=bool)
    except ValueError:
        good = np.array([not c or _is_number(c, unit) for c in cells], dtype=bool)
    if good.all():
        # Python reads 1_0 as ten
        good = ~(np.abs(values) >= LARGEST) & np.array(["_" not in c for c in cells], dtype=bool)
    if title.startswith("sigma"):
        bad = np.flatnonzero(~good) if not good.all() else np.flatnonzero(values <= 0)
        good[bad] = False
    with RefusalCollector() as refused:
        for row in np.flatnonzero(~good).tolist():
            shown = column[row].strip()
            refused.add(_bad_cell(path, lines[row], title, cells[row], shown, unit, decimal))
    return values


def _bad_cell(
    path: Path, line: int, title: str, cell: str, shown: str, unit: str, decimal: Decimal
) -> InputError:
    """Sentence on a wrong cell, quoted as in the file."""
    if _is_number(cell, unit) and abs(parse_angle(cell, unit if unit == "dms" else "m")) >= LARGEST:
        what, cure = f"{title} is {cell}", "give a number that was measured"
    elif _is_number(cell, unit):
        what, cure = f"{title} is {cell}", "give a standard deviation above zero"
    elif "," in cell and _is_number(cell.replace(",", "."), unit):
        mark = "point" if decimal == "." else "comma, as elsewhere in the file"
        what, cure = f"{title} is {shown!r}", f"write decimals with a {mark}"
    elif unit == "dms":
        what, cure = f"{title} is {cell!r}", "write degrees, minutes and seconds as 12-34-56.7"
    elif with_unit := _WITH_UNIT.fullmatch(cell):
        what = f"{title} is {shown!r}, not a number"
        cure = f"write {with_unit[1]}: the unit stands in the head of the column"
    else:
        what, cure = f"{title} is {cell!r}, not a number", "give a number or leave the cell empty"
    return InputError(what, file=path, line=line, cure=cure)


def _is_number(cell: str, unit: str) -> bool:
    """True if a cell can be read as a finite value of the unit."""
    try:
        return "_" not in cell and math.isfinite(parse_angle(cell, unit if unit == "dms" else "m"))
    except ValueError:
        return False
