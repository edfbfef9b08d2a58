"""Rows of cells of a list, as programs and spreadsheets leave it: text of any separator, or xlsx.

Text may be UTF-8, UTF-16 or Windows-1252; between cells stand semicolons, tabs, bars, commas or
blanks, whichever makes rows of one length; lines that begin with ``#`` are comments, and titles
above the header are passed over. What is not plain is taken as it most likely is and told in a
sentence; :class:`ListForm` says it for certain.

A spreadsheet takes a cell that begins with ``=``, ``+``, ``-`` or ``@`` for a formula, so names
that begin so are written behind an apostrophe (:func:`name_cell`), which is no part of the name
when the file is read.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.decimals import Decimal, decimal_of
from tribrach.io.opened_files import lines_of
from tribrach.io.spreadsheet import is_spreadsheet, read_sheet
from tribrach.io.text_form import MARKS, TextForm, mark_of
from tribrach.io.xml_file import read_bytes

#: what a spreadsheet takes for the beginning of a formula, white space before it left aside
_FORMULA = re.compile(r"\s*[=+\-@]")
#: a cell that was written by :func:`name_cell`
_QUOTED = re.compile(r"^'(?=\s*[=+\-@])")
#: separators by the words of a project
SEPARATORS = {"tab": "\t", "blank": " ", "semicolon": ";", "comma": ",", "bar": "|"}
#: bytes that no text of a list has: control characters but tab, line ends, form feed, SUB
_CONTROL = bytes(set(range(32)) - {9, 10, 12, 13, 26})
#: the beginning of old Excel files
_OLD_EXCEL = b"\xd0\xcf\x11\xe0"
#: encodings by the mark that a file begins with; the longer ones first
_BY_MARK = (
    (b"\xff\xfe\x00\x00", "utf-32"),
    (b"\x00\x00\xfe\xff", "utf-32"),
    (b"\xff\xfe", "utf-16"),
    (b"\xfe\xff", "utf-16"),
    (b"\xef\xbb\xbf", "utf-8-sig"),
)
#: rows at the top that may be titles, and rows that tell how a list is written
_TITLES, _LOOKED = 20, 200


@dataclass(frozen=True)
class ListForm:
    """How a list is written, as far as somebody says it."""

    #: our name of a column, such as ``point`` or ``sigma_e_mm``, and its head in the file, or its
    #: number from one
    columns: Mapping[str, str | int] = field(default_factory=dict)
    decimal: Decimal | None = None  #: what stands before decimals
    #: what stands between cells: one character or a word of :data:`SEPARATORS`
    separator: str | None = None
    encoding: str | None = None  #: name of the encoding
    sheet: str | None = None  #: name of the sheet of a spreadsheet

    @property
    def mark(self) -> str | None:
        """The separator as a character, a blank for white space."""
        return None if self.separator is None else SEPARATORS.get(self.separator, self.separator)


#: nothing is said: everything is as it is found
AS_FOUND = ListForm()


@dataclass(frozen=True)
class ListRows:
    """Rows of cells."""

    path: Path  #: of the file
    cells: list[list[str]]  #: the header first, and all rows as long as it
    lines: list[int]  #: 1-based line, or row of the sheet, of each
    separator: str  #: what stood between cells, "" in a spreadsheet
    form: ListForm = AS_FOUND  #: what was said of the list
    #: what was taken for something that the file does not say, one sentence each without the stop
    remarks: tuple[str, ...] = ()

    def decimal(self, columns: Sequence[int]) -> tuple[Decimal, tuple[str, ...]]:
        """The decimal sign of columns of numbers, and a sentence if it is a comma."""
        parts = [[row[k] for row in self.cells[1:]] for k in columns]
        return decimal_of(self.path, parts, self.lines[1:], self.form.decimal, self.separator)


def name_cell(name: str) -> str:
    """A name as a cell that no spreadsheet takes for a formula."""
    return f"'{name}" if _FORMULA.match(name) else name


def read_rows(path: Path, form: ListForm = AS_FOUND) -> ListRows:
    """Rows of cells and their lines."""
    data = read_bytes(path)
    if data.startswith(_OLD_EXCEL):
        raise InputError(
            "this is an old Excel file (xls)", file=path, cure="save it as xlsx or CSV"
        )
    if path.name.startswith("~$"):
        what = "this is no list but what Excel leaves beside one that is open"
        raise InputError(what, file=path, cure=f"give {path.name[2:]}")
    if is_spreadsheet(data):
        found, lines, remarks = read_sheet(path, data, form.sheet)
        return _whole(ListRows(path, found, lines, "", form, remarks))
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        what = "the file is no spreadsheet, whatever its name says"
        raise InputError(what, file=path, cure="copy it again, or save it as xlsx or CSV")
    if form.sheet is not None:
        what = f"the file is no spreadsheet, and the sheet {form.sheet} is asked for"
        raise InputError(what, file=path, cure="leave sheet out")
    text, said = decoded(path, data, form.encoding)
    numbered = [
        (number, row)
        for number, row in enumerate(lines_of(text), start=1)
        if row.strip("\x1a \t") and not row.lstrip().startswith("#")
    ]
    if not numbered:
        raise InputError("the file is empty", file=path, cure="give a header and rows")
    lines, kept = [number for number, _ in numbered], [row for _, row in numbered]
    # titles stand above the header
    at = next((k for k, row in enumerate(kept[:_TITLES]) if max(map(row.count, MARKS)) > 1), 0)
    at = 0 if any(mark in kept[0] for mark in MARKS) else at
    separator = form.mark or mark_of(kept[at], kept[at + 1 : _LOOKED])
    rows = _split(path, kept, lines, separator)
    return _whole(ListRows(path, rows, lines, separator, form, tuple(said)))


def decoded(path: Path, data: bytes, encoding: str | None = None) -> tuple[str, list[str]]:
    """The text of bytes, and what was guessed of its encoding."""
    marked = next((name for mark, name in _BY_MARK if data.startswith(mark)), None)
    said: list[str] = []
    name = encoding or marked or _wide(data) or "utf-8"
    try:
        text = data.decode(name)
    except (UnicodeDecodeError, LookupError, UnicodeError) as error:
        if encoding is not None or marked is not None or name != "utf-8":
            what = f"the file is no text in {name.removesuffix('-sig').upper()}"
            raise InputError(what, file=path, cure="save it as UTF-8") from error
        text, said = _western(path, data)
    if "\0" in text:
        raise InputError("the file is not text", file=path, cure="give a CSV file in UTF-8")
    return text.removeprefix("\ufeff"), said


def _wide(data: bytes) -> str | None:
    """UTF-16 without a mark, which has a zero in every second byte of plain letters."""
    start = data[:2000]
    if len(start) < 4 or 0 not in start:
        return None
    for first, name in ((1, "utf-16-le"), (0, "utf-16-be")):
        zeros, others = start[first::2], start[1 - first :: 2]
        if zeros.count(0) > 0.7 * len(zeros) and 0 not in others:
            return name
    return None


def _western(path: Path, data: bytes) -> tuple[str, list[str]]:
    """Text that is not UTF-8, as Windows writes it in western Europe, and the sentence on it."""
    cure = "save it as UTF-8, or add encoding to its entry"
    if data.translate(None, _CONTROL) != data:
        raise InputError("the file is not text", file=path, cure="give a list as text or xlsx")
    try:
        return data.decode("cp1252"), ["not UTF-8: letters are read as Windows-1252"]
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        what = "the text is neither UTF-8 nor Windows-1252"
        raise InputError(what, file=path, line=line, cure=cure) from error


def _split(path: Path, kept: list[str], lines: list[int], separator: str) -> list[list[str]]:
    """Cells of lines."""
    form = TextForm(separator)
    if separator != " ":
        try:
            rows = list(csv.reader(kept, delimiter=separator, skipinitialspace=True))
        except csv.Error as error:
            raise InputError(f"this is no CSV file: {error}", file=path) from error
        if len(rows) != len(kept):
            raise InputError("a quoted cell goes over several lines", file=path, line=lines[0])
    return [form.cells(row) for row in kept]


def _whole(rows: ListRows) -> ListRows:
    """The same without titles, empty rows and empty columns; all rows are as long as the header."""
    path, remarks = rows.path, rows.remarks
    filled = [k for k, row in enumerate(rows.cells) if any(map(str.strip, row))]
    # commas alone are the rows of a table of one kind; their cells are told to be empty
    if len(filled) < len(rows.cells) and rows.separator != ",":
        rows = _chosen(rows, filled)
    titles = 0
    while titles < min(_TITLES, len(rows.cells) - 2) and _is_title(rows.cells[titles:]):
        titles += 1
    if titles:
        rows = _chosen(rows, range(titles, len(rows.cells)))
        remarks += (f"titles above the header in line {rows.lines[0]} are passed over",)
    if not rows.cells:
        raise InputError("the file is empty", file=path, cure="give a header and rows")
    if len(rows.cells) == 1:
        what = "there are no rows under the header"
        raise InputError(what, file=path, line=rows.lines[0], cure="add them")
    cells = rows.cells
    if rows.separator == "":
        widest = max(len(row) for row in cells)
        cells = [row + [""] * (widest - len(row)) for row in cells]
    with RefusalCollector() as refused:
        for row, number in zip(cells, rows.lines, strict=True):
            if len(row) != len(cells[0]):
                what = f"the row has {len(row)} cells, the header has {len(cells[0])}"
                cure = "give every row the same cells"
                if rows.separator == ",":
                    cure += ", and decimals a point or other separators"
                refused.add(InputError(what, file=path, line=number, cure=cure))
    if rows.separator:
        cells = [[_QUOTED.sub("", cell, count=1) for cell in row] for row in cells]
    return ListRows(path, cells, rows.lines, rows.separator, rows.form, remarks)


def _chosen(rows: ListRows, keep: Sequence[int]) -> ListRows:
    """Some of the rows."""
    cells, lines = [rows.cells[k] for k in keep], [rows.lines[k] for k in keep]
    return ListRows(rows.path, cells, lines, rows.separator, rows.form, rows.remarks)


def _is_title(cells: Sequence[Sequence[str]]) -> bool:
    """True if one cell stands alone above a header of three and more."""
    alone = sum(bool(cell.strip()) for cell in cells[0]) == 1
    below = (sum(bool(cell.strip()) for cell in row) for row in cells[1:_TITLES])
    return alone and max(below, default=0) > 2
