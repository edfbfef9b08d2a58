"""Sokkia SDR33 and SDR2x (``.sdr``), also as other makers write it.

Fixed columns: two digits of record type, two letters of origin, then names of 16 characters (4 in
SDR2x) and numbers of 16 (10 in SDR2x). The header gives the units of angle, length, pressure and
temperature and the order of coordinates. Distances contain the corrections of the instrument.
Format: record tables in the manuals of the Nikon N series and of the Spectra Precision Focus 6.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import angle, number, read_lines
from tribrach.units import UNITS

_ANGLES = {"1": "deg", "2": "gon", "4": "mil"}
_PRESSURE_HPA = {"1": 1013.25 / 760, "2": 33.8639, "3": 1.0}
#: records that say nothing about the geometry
_SILENT = {"06": "scale", "10": "job", "13": "note", "12": "set", "04": "collimation"}
_PRISM = re.compile(r"P\.C\.\s*mm\s*Applied:\s*(-?[\d.]+)", re.IGNORECASE)
_AIR = re.compile(r"Temp:\s*(-?[\d.]+)\s*C\s+Press:\s*([\d.]+)\s*(hPa|mmHg|inHg)", re.IGNORECASE)
_HPA = {"hpa": 1.0, "mmhg": 1013.25 / 760, "inhg": 33.8639}


@dataclass(frozen=True)
class _Layout:
    """Widths and units from the header."""

    name: int
    number: int
    angle: str
    length: float
    pressure: float
    fahrenheit: bool
    east_first: bool

    def fields(self, record: str, names: int, numbers: int) -> tuple[list[str], list[str], str]:
        """Names, numbers as text, and the rest of a record."""
        place, out = 4, []
        for width in [self.name] * names + [self.number] * numbers:
            out.append(record[place : place + width].strip())
            place += width
        return out[:names], out[names:], record[place:].strip()


def sniff(text: str) -> bool:
    """True if there is a header of SDR, with whatever a transmission put before it."""
    return re.search(r"^[\s\x02]*00NMSDR", text, re.MULTILINE) is not None


def read(path: Path) -> RawFile:
    """Read a file."""
    lines = read_lines(path)
    recorder = Recorder(path, "Sokkia SDR")
    reader: _Reader | None = None
    for line, whole in enumerate(lines, start=1):
        # what follows the end of text is a checksum
        record = whole.split("\x03")[0].strip("\x02\x04\x1a")
        if reader is None:
            record = record.lstrip()
        if record.startswith("00NM"):
            reader = _Reader(_header(path, line, record), recorder)
        elif reader is not None and record.strip():
            reader.record(line, record)
        elif record.strip():
            recorder.unknown["line before the header 00NM"] += 1
    if reader is None:
        raise InputError("there is no header record 00NM", file=path, cure="give the whole file")
    return recorder.finish()


def _header(path: Path, line: int, record: str) -> _Layout:
    """Units and widths of the header record."""
    units = record[40:46]
    if len(units) < 5 or units[0] not in _ANGLES or units[1] not in "12":
        raise InputError(
            f"the header has the units {units!r}",
            file=path,
            line=line,
            cure="columns 41 to 45 are angle, length, pressure, temperature and order",
        )
    narrow = record[4:].lstrip().startswith("SDR2")
    return _Layout(
        4 if narrow else 16,
        10 if narrow else 16,
        _ANGLES[units[0]],
        1.0 if units[1] == "1" else UNITS["ft"],
        _PRESSURE_HPA.get(units[2], 1.0),
        units[3] == "2",
        units[4] == "2",
    )


class _Reader:
    """Turns records into set-ups, sights and coordinates."""

    def __init__(self, layout: _Layout, recorder: Recorder) -> None:
        self.layout, self.recorder = layout, recorder
        self.horizon = False
        self.raw_targets: set[tuple[int, str]] = set()
        self._handlers: dict[str, Callable[[int, str], None]] = {
            "01": self._instrument,
            "02": self._station,
            "03": self._target_height,
            "05": self._air,
            "07": self._backsight,
            "08": self._point,
            "09": self._sight,
            "13": self._note,
        }

    def record(self, line: int, record: str) -> None:
        """One record; if it cannot be right it is left out and counted."""
        kind = record[:2]
        if kind == "13" and record[2:4] in ("F1", "F2"):
            self.recorder.unknown["sight of a resection in notes (13F1)"] += 1
            return
        if kind not in self._handlers:
            what = _SILENT.get(kind)
            counted = self.recorder.unknown if what is None else self.recorder.understood
            counted[what or f"record {record[:4].strip()}"] += 1
            return
        try:
            self._handlers[kind](line, record)
        except ValueError as error:
            self.recorder.problem(line, str(error))

    def _length(self, text: str) -> float:
        return number(text) * self.layout.length

    def _instrument(self, line: int, record: str) -> None:
        self.recorder.instrument = record[5:21].strip()
        self.horizon = record[50:51] == "2"
        self.recorder.understood["instrument"] += 1

    def _coordinates(
        self, line: int, name: str, numbers: list[str], given: bool, code: str
    ) -> None:
        first, second, up = (self._length(text) for text in numbers[:3])
        east, north = (first, second) if self.layout.east_first else (second, first)
        self.recorder.point(line, name, east, north, up, given=given, code=code)

    def _station(self, line: int, record: str) -> None:
        (name,), numbers, code = self.layout.fields(record, 1, 4)
        self.recorder.setup(line, name, height=self._length(numbers[3]))
        self._coordinates(line, name, numbers, True, code)
        self.recorder.understood["set-up"] += 1

    def _target_height(self, line: int, record: str) -> None:
        self.recorder.target_height = self._length(record[4:])
        self.recorder.understood["target height"] += 1

    def _air(self, line: int, record: str) -> None:
        _, numbers, _ = self.layout.fields(record, 0, 2)
        pressure, temperature = (number(text) for text in numbers)
        if self.layout.fahrenheit:
            temperature = (temperature - 32) / 1.8
        self.recorder.pressure_hpa = pressure * self.layout.pressure
        self.recorder.temperature_c = temperature
        self.recorder.understood["air"] += 1

    def _backsight(self, line: int, record: str) -> None:
        (station, target), numbers, _ = self.layout.fields(record, 2, 2)
        azimuth, circle = (angle(text, self.layout.angle) for text in numbers)
        self.recorder.backsight(line, station, target, azimuth, circle)
        self.recorder.understood["backsight"] += 1

    def _point(self, line: int, record: str) -> None:
        (name,), numbers, code = self.layout.fields(record, 1, 3)
        self._coordinates(line, name, numbers, record[2:4] != "TP", code)
        self.recorder.understood["coordinates"] += 1

    def _sight(self, line: int, record: str) -> None:
        """Readings of one face (F1, F2), or a mean that the instrument made (MC, MD)."""
        (station, target), numbers, code = self.layout.fields(record, 2, 3)
        distance = self._length(numbers[0])
        zenith, direction = (angle(text, self.layout.angle) for text in numbers[1:])
        if self.horizon:
            zenith = math.pi / 2 - zenith if zenith <= math.pi / 2 else 2.5 * math.pi - zenith
        face = {"F1": 1, "F2": 2}.get(record[2:4], 0)
        self.recorder.at_station(line, station)
        key = (self.recorder.current, target)
        off = "the instrument made this mean" if not face and key in self.raw_targets else ""
        if face:
            self.raw_targets.add(key)
        self.recorder.shot(
            line, target, direction=direction, zenith=zenith, distance=distance, face=face,
            code=code, off=off,
        )  # fmt: skip
        self.recorder.understood["sight"] += 1

    def _note(self, line: int, record: str) -> None:
        """Prism constant and air in a note."""
        prism = _PRISM.search(record)
        if prism is not None:
            self.recorder.prism = float(prism[1]) / 1000
        air = _AIR.search(record)
        if air is not None:
            self.recorder.temperature_c = float(air[1])
            self.recorder.pressure_hpa = float(air[2]) * _HPA[air[3].lower()]
        self.recorder.understood["note"] += 1
