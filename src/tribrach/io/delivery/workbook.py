"""A result as a spreadsheet: points, and observations' ends; units stand in the heads."""

from __future__ import annotations

import io
import re
import zipfile
from importlib import import_module
from typing import Any

from tribrach.io.delivery.content import Delivery
from tribrach.io.delivery.lists import columns_of

#: dates inside a packed file, the first that it can hold
_EPOCH = (1980, 1, 1, 0, 0, 0)


def write(delivery: Delivery) -> bytes:
    """The bytes of an xlsx file."""
    openpyxl: Any = import_module("openpyxl")
    book = openpyxl.Workbook()
    heads, rows = columns_of(delivery)
    sheet = book.active
    sheet.title = "displacements" if delivery.moves else "points"
    sheet.append([_head(head) for head in heads])
    sheet.freeze_panes = "B2"
    for row in rows:
        sheet.append([_cell(value) for value in row.values()])
    bold = import_module("openpyxl.styles").Font(bold=True)
    for k, digits in enumerate(heads.values(), start=1):
        sheet.cell(1, k).font = bold
        sheet.column_dimensions[sheet.cell(1, k).column_letter].width = 18
        for line in range(2, len(rows) + 2):
            cell = sheet.cell(line, k)
            if digits is not None:
                cell.number_format = f"0.{'0' * digits}"
            elif cell.data_type == "f":
                cell.data_type = "s"  # a name that begins with = is no formula
    about = book.create_sheet("about")
    for name, value in (
        ("title", delivery.title),
        ("reference system", delivery.crs or "local frame"),
        ("heights", delivery.heights),
        ("epoch", delivery.epoch),
        ("datum", delivery.datum),
        ("sigmas", "a posteriori" if delivery.scale == "posterior" else "a priori"),
        ("program", delivery.program),
    ):
        about.append([name, _cell(value)])
        if about.cell(about.max_row, 2).data_type == "f":
            about.cell(about.max_row, 2).data_type = "s"
    made = io.BytesIO()
    book.save(made)
    return _undated(made.getvalue())


def _head(head: str) -> str:
    """``sigma_easting_mm`` as ``sigma easting [mm]``."""
    words, _, unit = head.rpartition("_")
    return f"{words.replace('_', ' ')} [{unit}]" if unit in ("m", "mm") else head.replace("_", " ")


def _cell(value: Any) -> Any:
    """A value without characters that a sheet does not hold."""
    return re.sub(r"[\x00-\x1f]", " ", value) if isinstance(value, str) else value


def _undated(data: bytes) -> bytes:
    """The same parts without the time of writing, so that equal results are equal files."""
    out = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(data)) as given,
        zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made,
    ):
        for part in given.infolist():
            content = given.read(part)
            if part.filename == "docProps/core.xml":
                content = re.sub(
                    rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", b"1980-01-01T00:00:00Z", content
                )
            made.writestr(zipfile.ZipInfo(part.filename, _EPOCH), content)
    return out.getvalue()
