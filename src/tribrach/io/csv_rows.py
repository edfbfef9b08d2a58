"""Rows of cells of a CSV file.

UTF-8; comma, semicolon or tab between cells, whichever the header has most of; lines that begin
with ``#`` are comments. A spreadsheet takes a cell that begins with ``=``, ``+``, ``-`` or ``@``
for a formula, so names that begin so are written behind an apostrophe (:func:`name_cell`), which is
no part of the name when the file is read.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.xml_file import read_bytes

__all__ = ["name_cell", "read_rows"]

#: what a spreadsheet takes for the beginning of a formula, white space before it left aside
_FORMULA = re.compile(r"\s*[=+\-@]")
#: a cell that was written by :func:`name_cell`
_QUOTED = re.compile(r"^'(?=\s*[=+\-@])")


def name_cell(name: str) -> str:
    """A name as a cell that no spreadsheet takes for a formula.

    Parameters
    ----------
    name
        Of a point, station, scan or file.

    Returns
    -------
    str
        The name, behind an apostrophe where it begins like a formula.
    """
    return f"'{name}" if _FORMULA.match(name) else name


def read_rows(path: Path) -> tuple[list[list[str]], list[int]]:
    """Rows of cells and their lines.

    Returns
    -------
    rows : list of list of str
        The header first, and all as long as it.
    lines : list of int
        1-based line of each row.

    Raises
    ------
    InputError
        Unreadable, not UTF-8 text, no row under the header, a quoted cell that goes over several
        lines, or a row of another length.
    """
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
    numbered = [
        (number, row)
        for number, row in enumerate(text.splitlines(), start=1)
        if row.strip() and not row.lstrip().startswith("#")
    ]
    lines, kept = [number for number, _ in numbered], [row for _, row in numbered]
    if not kept:
        raise InputError("the file is empty", file=path, cure="give a header and rows")
    if len(kept) == 1:
        what = "there are no rows under the header"
        raise InputError(what, file=path, line=lines[0], cure="add them")
    separator = max(",;\t", key=kept[0].count)
    try:
        rows = list(csv.reader(kept, delimiter=separator))
    except csv.Error as error:
        raise InputError(f"this is no CSV file: {error}", file=path) from error
    if len(rows) != len(kept):
        raise InputError("a quoted cell goes over several lines", file=path, line=lines[0])
    with RefusalCollector() as refused:
        for row, number in zip(rows, lines, strict=True):
            if len(row) != len(rows[0]):
                what = f"the row has {len(row)} cells, the header has {len(rows[0])}"
                cure = "give every row the same cells"
                refused.add(InputError(what, file=path, line=number, cure=cure))
    if "'" in text:
        rows = [[_QUOTED.sub("", cell, count=1) for cell in row] for row in rows]
    return rows, lines
