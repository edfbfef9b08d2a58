"""Kolida DL (and levels that write the same): ``B`` start, ``G`` back, ``I`` fore, ``W`` end.

A reading is ``G 1.44883m 12.075m A1 A1 3B1``: on the staff, distance, point, start of the line,
and how many times it was read and as what. ``B`` has the height of the start; the sums of ``W``
repeat what was read.
"""

from __future__ import annotations

import re
from pathlib import Path

from tribrach.io.levels.readings import LevelBook, LevelFile, StaffReading
from tribrach.io.opened_files import lines_of
from tribrach.io.totalstation.text import read_lines
from tribrach.units import UNITS

_KINDS = {"G": "back", "I": "fore"}
_READING = re.compile(
    r"\s*([A-Z])\s+(-?\d+\.\d+)\s*(m|ft)\s+(\d+\.\d+)\s*(m|ft)\s+(\S+)\s+\S+\s+\d*[A-Z][12]?\s*$"
)
_START = re.compile(r"\s*B\s+(\S+)\s+(-?\d+\.\d+)\s*(m|ft)\b")
_END = re.compile(r"\s*W\s")


def sniff(text: str) -> bool:
    """True if a text begins with a line of such a level."""
    rows = [row for row in lines_of(text) if row.strip()]
    at = next((k for k, row in enumerate(rows) if _START.match(row)), None)
    return at is not None and any(_READING.match(row) for row in rows[at + 1 : at + 3])


def read(path: Path) -> LevelFile:
    """Read a file."""
    book = LevelBook()
    for line, text in enumerate(read_lines(path), start=1):
        if start := _START.match(text):
            book.close()
            height = float(start[2]) * UNITS[start[3]]
            if start[1] not in book.computed:
                book.given.setdefault(start[1], (height, line))
        elif found := _READING.match(text):
            value, far = float(found[2]) * UNITS[found[3]], float(found[4]) * UNITS[found[5]]
            if found[1] in _KINDS:
                book.add(StaffReading(_KINDS[found[1]], found[6], value, far, line))
            else:
                book.problems.append((line, f"the reading {found[1]} is of no known sort"))
        elif _END.match(text):
            book.close()
    return book.file(path, "Kolida DL")
