"""Sheets of spreadsheets in the format xlsx, through openpyxl.

Values are read as they were saved: no formula is computed, no link followed. A file may hold so
much and no more, unpacked too, and XML that declares a document type is refused before the
library sees it.
"""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from contextlib import redirect_stdout
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from tribrach.errors import InputError
from tribrach.io.decimals import Exact

#: largest size of all parts of a file [bytes], of one part over its packed size, and their number
_UNPACKED, _RATIO, _PARTS = 200_000_000, 500, 5000
#: cells that are read
_ROWS, _COLUMNS = 200_000, 200
_WORKBOOK = "xl/workbook.xml"
#: XML whose first element comes at once, behind its declaration and remarks
_PLAIN_XML = re.compile(
    rb"(?:\xef\xbb\xbf)?\s*(?:<\?[^<>\0]*\?>\s*|<!--(?:(?!--)[^\0])*-->\s*)*<[A-Za-z_]", re.DOTALL
)


def is_spreadsheet(data: bytes) -> bool:
    """True if bytes are those of a packed spreadsheet, of whatever program."""
    return data.startswith(b"PK\x03\x04")


def read_sheet(
    path: Path, data: bytes, wanted: str | None
) -> tuple[list[list[str]], list[int], tuple[str, ...]]:
    """Cells of a sheet as text."""
    values = _opened(path, data, values=True)
    try:
        name, rows, others = _sheet(path, values, wanted)
    finally:
        values.close()
    _refuse_uncomputed(path, data, name, rows)
    numbers = [k for k, row in enumerate(rows, start=1) if any(cell != "" for cell in row)]
    remarks = (f"sheet {name} is read; {', '.join(others)} empty",) if others else ()
    return [list(rows[k - 1]) for k in numbers], numbers, remarks


def _opened(path: Path, data: bytes, *, values: bool) -> Any:
    """The workbook of a file whose parts have been looked at."""
    _refuse_parts(path, data)
    # half a second, which only spreadsheets should spend
    import openpyxl

    try:
        # a style that the file does not hold is printed by the library before it is an error
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            return openpyxl.load_workbook(
                io.BytesIO(data), read_only=True, data_only=values, keep_links=False
            )
    except Exception as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> InputError:
    """The refusal of a file that the library does not understand."""
    words = str(error).splitlines()[0] if str(error) else type(error).__name__
    return InputError(
        f"the spreadsheet cannot be read: {words[:120].rstrip('.')}",
        file=path,
        cure="open and save it in a spreadsheet program, or save the sheet as CSV",
    )


def _refuse_parts(path: Path, data: bytes) -> None:
    """Refuse files other than xlsx, too large ones, and XML with a document type."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            parts = packed.infolist()
            names = {part.filename for part in parts}
            if _WORKBOOK not in names:
                what = "this is a packed file and no xlsx"
                if any(name.endswith(("content.xml", "workbook.bin")) for name in names):
                    what = "this is a spreadsheet of another format than xlsx"
                raise InputError(what, file=path, cure="save it as xlsx or CSV")
            size = sum(part.file_size for part in parts)
            most = max(part.file_size / max(part.compress_size, 1) for part in parts)
            if size > _UNPACKED or len(parts) > _PARTS or (most > _RATIO and size > 10_000_000):
                raise InputError(
                    f"the spreadsheet unpacks to {size / 1e6:.3g} MB in {len(parts)} parts",
                    file=path,
                    cure="keep the sheet with the list alone",
                )
            for part in parts:
                if not part.filename.lower().endswith((".xml", ".rels", ".vml")):
                    continue
                with packed.open(part) as stream:
                    start = stream.read(4000)
                if start and not _PLAIN_XML.match(start):
                    raise InputError(
                        f"{part.filename} in the spreadsheet has a document type or an encoding "
                        "that is refused",
                        file=path,
                        cure="save it again in a spreadsheet program",
                    )
    except InputError:
        raise
    except Exception as error:
        raise _damaged(path, error) from error


def _sheet(
    path: Path, book: Any, wanted: str | None
) -> tuple[str, list[tuple[str, ...]], list[str]]:
    """Name and rows of the sheet that is wanted, and the names of the empty ones."""
    names = [str(sheet.title) for sheet in book.worksheets]
    if wanted is not None and wanted not in names:
        raise InputError(
            f"there is no sheet {wanted}", file=path, cure=f"its sheets are {', '.join(names[:20])}"
        )
    filled: dict[str, list[tuple[str, ...]]] = {}
    for sheet in book.worksheets:
        if wanted in (None, sheet.title) and (rows := _rows(path, sheet)):
            filled[str(sheet.title)] = rows
    if not filled:
        raise InputError("the spreadsheet is empty", file=path, cure="give a header and rows")
    if len(filled) > 1:
        raise InputError(
            f"the sheets {', '.join(list(filled)[:20])} hold lists",
            file=path,
            cure=f'say which one is meant, such as sheet = "{next(iter(filled))}"',
        )
    name = next(iter(filled))
    return name, filled[name], [] if wanted is not None else [n for n in names if n != name]


def _rows(path: Path, sheet: Any) -> list[tuple[str, ...]]:
    """Cells of a sheet, without empty ones at the ends."""
    rows: list[tuple[str, ...]] = []
    try:
        sheet.reset_dimensions()
        for k, row in enumerate(sheet.iter_rows(), start=1):
            if k > _ROWS or len(row) > _COLUMNS:
                raise InputError(
                    f"sheet {sheet.title} has more than {_ROWS} rows or {_COLUMNS} columns",
                    file=path,
                    cure="keep the list alone",
                )
            cells = [_text(cell) for cell in row]
            while cells and cells[-1] == "":
                cells.pop()
            rows.append(tuple(cells))
    except InputError:
        raise
    except Exception as error:
        raise _damaged(path, error) from error
    while rows and not rows[-1]:
        rows.pop()
    return rows


def _text(cell: Any) -> str:
    """A cell as text."""
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        whole = isinstance(value, int) or value.is_integer()
        number = f"{value:.0f}" if whole and abs(value) < 1e15 else repr(float(value))
        zeros = str(getattr(cell, "number_format", ""))
        if whole and re.fullmatch("0{2,20}", zeros):
            number = number.zfill(len(zeros))  # a name such as 0071
        return Exact(number)
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    return str(value).replace("\n", " ").replace("\r", " ").strip()


def _refuse_uncomputed(path: Path, data: bytes, name: str, rows: list[tuple[str, ...]]) -> None:
    """Refuse formulas whose value was not saved, which would be taken for empty cells."""
    if b"<f" not in _sheets_xml(path, data):
        return
    book = _opened(path, data, values=False)
    try:
        for k, row in enumerate(book[name].iter_rows(), start=1):
            for cell in row:
                held = rows[k - 1] if k <= len(rows) else ()
                column = int(getattr(cell, "column", 0) or 0)
                value = "".join(held[column - 1 : column])
                if getattr(cell, "data_type", "") == "f" and not value:
                    raise InputError(
                        f"cell {cell.coordinate} holds a formula and no value",
                        file=path,
                        line=k,
                        cure="open and save it in a spreadsheet program, or write the number",
                    )
    except InputError:
        raise
    except Exception as error:
        raise _damaged(path, error) from error
    finally:
        book.close()


def _sheets_xml(path: Path, data: bytes) -> bytes:
    """The XML of all sheets, in which formulas are sought."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            names = [n for n in packed.namelist() if n.startswith("xl/worksheets/")]
            return b"".join(packed.read(n) for n in names if not n.endswith("/"))
    except Exception as error:
        raise _damaged(path, error) from error
