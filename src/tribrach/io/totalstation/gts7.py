"""Topcon GTS-7 and GTS-700 raw data (``.gts7``), as the instruments and TopSURV write it.

A word and its values between commas on each line. A header (``BS``, ``FS``, ``SS``) names the
target, its height and its code; the readings follow it (``HV``, ``SD``, ``HD``). ``XYZ`` is
easting, northing, height of the point before it. Degrees are packed ``DDD.MMSS``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import angle, number, read_lines
from tribrach.units import UNITS

_SILENT = ("JOB", "DATE", "NAME", "SCALE", "NOTE", "CTL", "MLM")


def sniff(text: str) -> bool:
    """True if a text begins as the format does."""
    return re.match(r"\s*(TopSURV|GTS-7)", text) is not None or (
        re.search(r"^UNITS\s+[MF],[DG]", text, re.MULTILINE) is not None
        and re.search(r"^STN\s", text, re.MULTILINE) is not None
    )


def read(path: Path) -> RawFile:
    """Read a file."""
    reader = _Reader(Recorder(path, "Topcon GTS-7"))
    for line, record in enumerate(read_lines(path), start=1):
        if record.strip("\x1a "):
            reader.record(line, record.strip("\x1a "))
    return reader.recorder.finish()


class _Reader:
    """Turns lines into set-ups, sights and coordinates."""

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder
        self.angle, self.length = "dms", 1.0
        self.station, self.height = "", math.nan
        #: point that coordinates belong to; target, its height and its code
        self.named = ""
        self.target, self.target_height, self.code = "", math.nan, ""
        self._handlers: dict[str, Callable[[int, list[str]], None]] = {
            "UNITS": self._units,
            "INST": self._instrument,
            "TEMP": self._air,
            "ATMOS": self._air,
            "STN": self._station,
            "XYZ": self._coordinates,
            "BKB": self._bearing,
            "BS": self._header,
            "FS": self._header,
            "SS": self._header,
            "HV": self._sight,
            "SD": self._sight,
            "HD": self._horizontal,
        }

    def record(self, line: int, record: str) -> None:
        """One line; if it cannot be right it is left out and counted."""
        word, _, rest = record.partition(" ")
        word, cells = word.strip().upper(), [cell.strip() for cell in rest.split(",")]
        if word in _SILENT or record.startswith(("TopSURV", "GTS-7")):
            self.recorder.understood["header"] += 1
            return
        if word not in self._handlers:
            self.recorder.unknown[f"word {word[:12]}"] += 1
            return
        try:
            self._handlers[word](line, cells + [""] * 3)
        except ValueError as error:
            self.recorder.problem(line, str(error))

    def _units(self, line: int, cells: list[str]) -> None:
        """Metres or feet; degrees or gon."""
        if cells[0] not in ("M", "F") or cells[1] not in ("D", "G"):
            raise ValueError(f"the units {cells[0]},{cells[1]} are unknown")
        self.length = 1.0 if cells[0] == "M" else UNITS["ft"]
        self.angle = "dms" if cells[1] == "D" else "gon"
        self.recorder.understood["header"] += 1

    def _instrument(self, line: int, cells: list[str]) -> None:
        self.recorder.instrument = cells[0]
        self.recorder.understood["header"] += 1

    def _air(self, line: int, cells: list[str]) -> None:
        self.recorder.temperature_c = number(cells[0])
        self.recorder.pressure_hpa = number(cells[1])
        self.recorder.understood["air"] += 1

    def _station(self, line: int, cells: list[str]) -> None:
        self.station = self.named = cells[0]
        self.height = number(cells[1]) * self.length
        self.recorder.setup(line, self.station, height=self.height)
        self.recorder.understood["set-up"] += 1

    def _coordinates(self, line: int, cells: list[str]) -> None:
        e, n, u = (number(cell) * self.length for cell in cells[:3])
        self.recorder.point(line, self.named, e, n, u)
        self.recorder.understood["coordinates"] += 1

    def _bearing(self, line: int, cells: list[str]) -> None:
        """Backsight, its azimuth and the circle reading there."""
        self.named = cells[0]
        azimuth, circle = angle(cells[1], self.angle), angle(cells[2], self.angle)
        self.recorder.backsight(line, self.station, cells[0], azimuth, circle)
        self.recorder.understood["backsight"] += 1

    def _header(self, line: int, cells: list[str]) -> None:
        self.target = self.named = cells[0]
        self.target_height = number(cells[1]) * self.length
        self.code = cells[2]
        self.recorder.understood["header of a sight"] += 1

    def _sight(self, line: int, cells: list[str]) -> None:
        """Direction, zenith angle and, after ``SD``, slope distance."""
        distance = number(cells[2]) * self.length
        self._add(line, angle(cells[0], self.angle), angle(cells[1], self.angle), distance)

    def _horizontal(self, line: int, cells: list[str]) -> None:
        """Direction, horizontal distance, height difference."""
        level, rise = number(cells[1]) * self.length, number(cells[2]) * self.length
        zenith = math.atan2(level, rise)
        self._add(line, angle(cells[0], self.angle), zenith, math.hypot(level, rise))

    def _add(self, line: int, direction: float, zenith: float, distance: float) -> None:
        self.recorder.shot(
            line, self.target, direction=direction, zenith=zenith, distance=distance,
            height=self.target_height, code=self.code,
        )  # fmt: skip
        self.recorder.understood["sight"] += 1
