"""Nikon RAW V2.00 (``.raw``, ``.nik``), also as Ruide, Spectra and the Trimble M3 write it.

Records of cells between commas. Comments of the header give the units; stations (``ST``) carry the
azimuth of the backsight and the reading that the circle was set to there, to which the sights after
it refer; the reading of the first ``F1`` at the backsight was taken before. Distances contain the
corrections of the instrument. Records that begin with an asterisk were deleted in the field.
Format: record tables in the manuals of the Nikon DTM-330 and the Trimble M3.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import angle, number, read_lines
from tribrach.units import UNITS

T = TypeVar("T")

_ANGLES = {"dddmmss": "dms", "dms": "dms", "gons": "gon", "gon": "gon", "mils": "mil", "mil": "mil"}
_LENGTHS = {"metres": 1.0, "meters": 1.0, "feet": UNITS["ft"], "us-feet": UNITS["usft"]}
_AIR = re.compile(
    r"Temp:\s*(-?[\d.]+)\s*([CF])\s+Press:\s*([\d.]+)\s*(hPa|mmHg|inHg)"
    r"(?:\s+Prism:\s*(-?[\d.]+))?",
    re.IGNORECASE,
)
_HPA = {"hpa": 1.0, "mmhg": 1013.25 / 760, "inhg": 33.8639}
_INPUT = re.compile(r"\b(th|ih)\s+(-?[\d.]+)\s*(m|ft)\b")
_TIME = re.compile(r"\s*\d{1,2}:\d{2}:\d{2}\s*$")
#: cells of the longest record
_CELLS = 8
#: coordinates that were given, and those that the instrument computed
_POINTS = {"UP": True, "MP": True, "MC": True, "CC": False, "RE": False}


def sniff(text: str) -> bool:
    """True if a text has the comments or the records of the format."""
    first = text.lstrip("\x02\r\n ").split("\n", 1)[0]
    return first.startswith("CO,") and (
        "raw data" in first.lower() or re.search(r"^ST,", text, re.MULTILINE) is not None
    )


def read(path: Path) -> RawFile:
    """Read a file."""
    reader = _Reader(Recorder(path, "Nikon RAW"))
    for line, record in enumerate(read_lines(path), start=1):
        record = record.strip("\x02\x03\x04\x1a ")
        if record:
            reader.record(line, record)
    return reader.recorder.finish()


class _Reader:
    """Turns records into set-ups, sights and coordinates."""

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder
        self.angle, self.length = "dms", 1.0
        self.horizon = self.east_first = False
        self.deleted = False
        #: circle reading at the backsight that the next F1 stands for
        self.set_circle = math.nan
        self.backsight = ""
        self._handlers: dict[str, Callable[[int, list[str]], None]] = {
            "CO": self._comment,
            "ST": self._station,
            "SS": lambda line, cells: self._sight(line, cells, 0, cells[0]),
            "SO": lambda line, cells: self._sight(line, cells[1:], 0, cells[0]),
            "CP": lambda line, cells: self._sight(line, cells[1:], 0, cells[0]),
            "F1": lambda line, cells: self._face(line, cells, 1),
            "F2": lambda line, cells: self._face(line, cells, 2),
        }

    def record(self, line: int, record: str) -> None:
        """One record; if it cannot be right it is left out and counted."""
        self.deleted = record.startswith("*")
        kind, *cells = record.lstrip("*").split(",")
        kind = kind.strip().upper()
        # a line that was cut has fewer cells
        cells += [""] * _CELLS
        try:
            if kind in _POINTS:
                self._point(line, cells, _POINTS[kind])
            elif kind in self._handlers:
                self._handlers[kind](line, cells)
            else:
                self.recorder.unknown[f"record {kind[:12]}"] += 1
        except ValueError as error:
            self.recorder.problem(line, str(error))

    def _comment(self, line: int, cells: list[str]) -> None:
        """Comments with units, air, and heights that were keyed in."""
        text = ",".join(cells).strip(", ")
        key, _, value = text.partition(":")
        key, value = key.strip().lower(), value.strip()
        if key == "angle units":
            self.angle = _known(_ANGLES, value, "angle unit")
        elif key == "dist units":
            self.length = _known(_LENGTHS, value, "length unit")
        elif key == "zero va":
            self.horizon = value.lower().startswith("horiz")
        elif key == "coord order":
            self.east_first = value.upper().startswith("EN")
        elif key == "instrument":
            self.recorder.instrument = value
        elif text.startswith("O/S MSR"):
            self.recorder.unknown["reading before an offset"] += 1
            return
        self._air(text)
        self._inputs(line, text)
        self.recorder.understood["comment"] += 1

    def _air(self, text: str) -> None:
        """Temperature, pressure and prism constant in a comment."""
        match = _AIR.search(text)
        if match is None:
            return
        temperature = float(match[1])
        if match[2].upper() == "F":
            temperature = (temperature - 32) / 1.8
        self.recorder.temperature_c = temperature
        self.recorder.pressure_hpa = float(match[3]) * _HPA[match[4].lower()]
        if match[5]:
            self.recorder.prism = float(match[5]) / 1000

    def _inputs(self, line: int, text: str) -> None:
        """Heights ``th`` and ``ih`` in comments of the Trimble M3."""
        for name, value, unit in _INPUT.findall(text) if text.startswith("TI") else ():
            metres = float(value) * UNITS[unit]
            if name == "ih":
                self.recorder.height_instrument(line, metres)
            else:
                self.recorder.target_height = metres

    def _station(self, line: int, cells: list[str]) -> None:
        """Station, its number, backsight, its number, height, azimuth, circle."""
        cells = [cell.strip() for cell in cells]
        azimuth, circle = angle(cells[5], self.angle), angle(cells[6], self.angle)
        height = number(cells[4]) * self.length
        self.backsight, self.set_circle = cells[2], circle
        self.recorder.setup(
            line, cells[0], height=height, backsight=cells[2], azimuth=azimuth, circle=circle
        )
        self.recorder.understood["set-up"] += 1

    def _point(self, line: int, cells: list[str], given: bool) -> None:
        cells = [cell.strip() for cell in cells]
        first, second, up = (number(cell) * self.length for cell in cells[2:5])
        east, north = (first, second) if self.east_first else (second, first)
        self.recorder.point(line, cells[0], east, north, up, given=given)
        self.recorder.understood["coordinates"] += 1

    def _face(self, line: int, cells: list[str], face: int) -> None:
        """A raw reading; the first one at the backsight stands for the circle as it was set."""
        target = cells[0].strip()
        if not target and not self.backsight:
            self.recorder.unknown["sight without a target"] += 1
            return
        circle = self.set_circle if face == 1 and target in ("", self.backsight) else math.nan
        if not math.isnan(circle):
            self.set_circle = math.nan
        self._sight(line, cells, face, target or self.backsight, circle)

    def _sight(
        self, line: int, cells: list[str], face: int, target: str, circle: float = math.nan
    ) -> None:
        """Target, height, distance, direction, vertical angle, time, code."""
        cells = [cell.strip() for cell in cells]
        direction, zenith = angle(cells[3], self.angle), angle(cells[4], self.angle)
        if self.horizon:
            zenith = math.pi / 2 - zenith if zenith <= math.pi / 2 else 2.5 * math.pi - zenith
        code = cells[6] if _TIME.match(cells[5]) or not cells[5] else cells[5]
        self.recorder.shot(
            line,
            target.strip(),
            direction=direction if math.isnan(circle) else circle,
            zenith=zenith,
            distance=number(cells[2]) * self.length,
            face=face,
            height=number(cells[1]) * self.length,
            code=code,
            off="deleted in the field" if self.deleted else "",
        )
        self.recorder.understood["sight"] += 1


def _known(words: Mapping[str, T], value: str, what: str) -> T:
    """The meaning of a word of the header."""
    if value.lower() not in words:
        raise ValueError(f"the {what} {value!r} is unknown")
    return words[value.lower()]
