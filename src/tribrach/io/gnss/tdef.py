"""Trimble data exchange format (TDEF, ``.asc``): stations and vectors of Trimble Business Center.

Sections in brackets hold lines ``key=value``; the values of a record stand between separators that
the section ``[General]`` names, and a word of its own stands for what is missing. ``Station`` has
latitude, longitude and ellipsoidal height of WGS 84, ``Vector`` the ends, the geocentric vector
between the marks and the upper half of its covariance [m^2]. Vectors that are disabled in the
project are kept and off.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy import frames
from tribrach.geodesy.site import ecef_from_geodetic
from tribrach.io.gnss.records import GnssRecords
from tribrach.io.gnss.vector_text import covariance, numbers
from tribrach.io.totalstation.text import read_lines

_METRES = ("meters", "metres", "meter", "metre", "m")
_DISABLED = "disabled in the project it was exported from"
#: places of the values of a vector
_ENDS, _VECTOR, _UPPER = slice(2, 4), slice(4, 7), slice(7, 13)
_DATE, _ENABLED, _SOLUTION = 19, 23, 26


def sniff(text: str) -> bool:
    """True if a text begins as a TDEF file."""
    start = re.match(r"\s*\[General\]\s", text) is not None
    return start and re.search(r"^(GPSVectors|Separator)=", text, re.MULTILINE) is not None


def read_tdef(path: Path) -> GnssRecords:
    """Stations and vectors of a TDEF file."""
    reader = _Reader(path)
    with RefusalCollector() as refused:
        for line, text in enumerate(read_lines(path), start=1):
            with refused.record():
                reader.line(line, text.strip())
        refused.settle()
        if not reader.vectors:
            cure = "export the processed vectors"
            raise InputError("the file has no vectors", file=path, cure=cure)
    records = reader.records
    records.vectors, records.blocks = np.array(reader.vectors), np.array(reader.blocks)
    if reader.floating:
        listed = ", ".join(reader.floating[:5]) + (", ..." if len(reader.floating) > 5 else "")
        records.warnings.append(
            f"{path.name}: {len(reader.floating)} vectors are solutions without fixed ambiguities "
            f"({listed}); their covariances are often too small"
        )
    return records


class _Reader:
    """Goes through the lines of a file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.records = GnssRecords()
        self.section, self.separator, self.missing = "", ":", "?"
        self.vectors: list[Array] = []
        self.blocks: list[Array] = []
        self.floating: list[str] = []

    def line(self, line: int, text: str) -> None:
        """One line."""
        section = re.fullmatch(r"\[(.*)\]", text)
        key, mark, value = text.partition("=")
        if section is not None:
            self.section = section[1].lower()
        elif mark and self.section == "general":
            self._setting(line, key.strip().lower(), value.strip())
        elif mark and (self.section, key) == ("stations", "Station"):
            self._station(line, value.split(self.separator))
        elif mark and (self.section, key) == ("gps", "Vector"):
            self._vector(line, value.split(self.separator))

    def _error(self, line: int, what: str, cure: str | None = None) -> InputError:
        return InputError(what, file=self.path, line=line, cure=cure)

    def _setting(self, line: int, key: str, value: str) -> None:
        """A line of the section ``[General]``."""
        if key == "separator" and value:
            self.separator = value
        elif key == "missingvalue" and value:
            self.missing = value
        elif key == "gpsvectors" and value.lower() != "marktomark":
            raise self._error(
                line, f"the vectors are {value!r}, not between marks", "export them mark to mark"
            )
        elif key in ("coordinateunits", "elevationheightunits", "distanceunits"):
            if value.lower() not in (*_METRES, self.missing):
                raise self._error(line, f"lengths are in {value!r}", "export the file in metres")
        elif key == "angularunits" and value.lower() not in ("degrees", "degree", self.missing):
            raise self._error(line, f"angles are in {value!r}", "export the file in degrees")

    def _station(self, line: int, cells: list[str]) -> None:
        """Approximate place of a point; one that is missing is none."""
        if len(cells) < 6 or not cells[2].strip():
            raise self._error(line, "a station needs a name, latitude, longitude and height")
        if self.missing in cells[3:6]:
            return
        latitude, longitude = (
            self._degrees(line, cell, letters)
            for cell, letters in ((cells[3], "NS"), (cells[4], "EW"))
        )
        (height,) = numbers([cells[5]], "the height", self.path, line)
        xyz = ecef_from_geodetic(np.radians(latitude), np.radians(longitude), height)
        self.records.approximate.setdefault(cells[2].strip(), xyz)

    def _degrees(self, line: int, cell: str, letters: str) -> float:
        """Degrees of a number with the letter of its hemisphere."""
        cell = cell.strip()
        if cell[-1:].upper() not in letters or not cell:
            what = f"{cell!r} does not end with {' or '.join(letters)}"
            raise self._error(line, what, "export latitudes and longitudes in degrees")
        (value,) = numbers([cell[:-1]], "an angle", self.path, line)
        if not 0 <= value <= (90 if letters == "NS" else 180):
            raise self._error(line, f"{cell} is no place on the Earth")
        return float(-value if cell[-1].upper() == letters[1] else value)

    def _vector(self, line: int, cells: list[str]) -> None:
        """A vector with its covariance."""
        cells = [cell.strip() for cell in cells]
        if len(cells) < 13 or not all(cells[_ENDS]):
            raise self._error(line, "a vector needs two names, three and six numbers")
        start, end = cells[_ENDS]
        if start == end:
            raise self._error(line, f"the vector begins and ends at {start}")
        vector = numbers(cells[_VECTOR], "the vector", self.path, line)
        upper = numbers(cells[_UPPER], "the covariance", self.path, line)
        block = covariance(upper, self.path, line)
        self.vectors.append(vector)
        self.blocks.append(block)
        self.records.start.append(start)
        self.records.end.append(end)
        self.records.vector_sources.append(f"{self.path.name}:{line}")
        self.records.vector_off.append(_DISABLED if _cell(cells, _ENABLED) == "D" else "")
        if _cell(cells, _SOLUTION).lower().startswith("float"):
            self.floating.append(f"{start} {end}")
        date = _cell(cells, _DATE)
        if self.records.epoch is None and re.fullmatch(r"\d\d \d\d \d{4}", date):
            try:
                self.records.epoch = frames.decimal_year(date.replace(" ", "."))
            except InputError as error:
                raise self._error(line, error.what, error.cure) from error


def _cell(cells: list[str], place: int) -> str:
    """A value that older files do not have, "" then."""
    return cells[place] if place < len(cells) else ""
