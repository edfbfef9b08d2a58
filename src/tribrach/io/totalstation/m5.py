"""Trimble and Zeiss M5 (``.m5``): lines of 119 characters in five blocks.

``For M5|Adr 00001|PI1 name|.. value unit|.. value unit|.. value unit|``; text lines (``TI``) name
the program of the instrument. A point marked ``S`` is a station, ``A`` to ``J`` its backsights,
whose readings stand before it. Distances contain the corrections of the instrument. Format: Trimble
M3 User Guide, "Data formats".
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import angle, number, read_lines
from tribrach.units import UNITS

_ANGLES = {"dms": "dms", "gon": "gon", "grd": "gon", "grad": "gon", "deg": "deg", "mil": "mil"}
_PRESSURES = {"hpa": 1.0, "torr": 1013.25 / 760, "mmhg": 1013.25 / 760, "inhg": 33.8639}
_LENGTHS = ("SD", "HD", "h", "ih", "th", "X", "Y", "Z", "PC", "A", "x", "y", "z")
_CIRCLES = ("Hz", "V1", "V2", "V3", "Om", "i", "c", "SZ", "SK")
#: columns of code and name where the file does not say them (0-based)
_CODE, _NAME = 10, 15


def sniff(text: str) -> bool:
    """True if the first line has the mark of the format."""
    return re.match(r"\s*For[ _]M5\|", text) is not None


def read(path: Path) -> RawFile:
    """Read a file."""
    lines = read_lines(path)
    reader = _Reader(Recorder(path, "Trimble M5"), lines)
    for line, record in enumerate(lines, start=1):
        record = record.strip("\x02\x03\x04\x1a")
        if not record.strip() or record.startswith("END"):
            continue
        try:
            reader.record(line, record)
        except ValueError as error:
            reader.recorder.problem(line, str(error))
    return reader.recorder.finish()


class _Reader:
    """Turns lines into set-ups, sights and coordinates."""

    def __init__(self, recorder: Recorder, lines: list[str]) -> None:
        self.recorder = recorder
        self.code, self.name = _CODE, _NAME
        points = [line[21:48].ljust(27) for line in lines if line[17:19] == "PI"]
        #: point numbers that end before the code, as the Elta instruments write them
        self.code_last = bool(points) and all(p[26] == " " for p in points)
        #: readings to backsights, until the station is named
        self.waiting: list[tuple[int, str, dict[str, float], float]] = []
        self.height = math.nan

    def record(self, line: int, record: str) -> None:
        """One line."""
        if not sniff(record):
            self.recorder.unknown["line of another format"] += 1
            return
        values = self._values(record)
        block = record[21:48].ljust(27)
        if record[17:19] == "TI":
            self._text(line, block.strip(), values)
        elif record[17:19] == "PI":
            name, code = self._point_name(block)
            self._point(line, name, code, values)
        else:
            self.recorder.unknown[f"block {record[17:20].strip() or 'without a type'}"] += 1

    def _values(self, record: str) -> dict[str, float]:
        """Metres, radians, hPa and degrees Celsius by type."""
        out: dict[str, float] = {}
        for start in (49, 72, 95):
            kind = record[start : start + 2].strip()
            text, unit = record[start + 3 : start + 17].strip(), record[start + 18 : start + 22]
            unit = unit.strip().rstrip("|").lower()
            if kind in ("01", "02", "03"):
                self.recorder.instrument = f"{self.recorder.instrument} {text}".strip()
            elif kind in _LENGTHS:
                out[kind] = number(text) * (UNITS["ft"] if unit == "ft" else 1.0)
            elif kind in _CIRCLES:
                if unit not in _ANGLES:
                    raise ValueError(f"{kind} has the unknown unit {unit!r}")
                out[kind] = angle(text, _ANGLES[unit])
            elif kind == "P":
                out[kind] = number(text) * _PRESSURES.get(unit, math.nan)
            elif kind == "T_":
                value = number(text)
                out[kind] = (value - 32) / 1.8 if unit == "f" else value
            elif kind in ("20", "21", "22"):
                out[kind] = number(text)
            elif kind not in ("", "m", "04", "05", "06"):
                self.recorder.unknown[f"type {kind}"] += 1
        return out

    def _text(self, line: int, program: str, values: dict[str, float]) -> None:
        """Heights, prism, air, and the columns of names."""
        if "21" in values and "22" in values:
            self.code, self.name = int(values["21"]) - 1, int(values["22"]) - 1
        # a change of the distance mode writes 0 for a height that it does not know
        if "th" in values and (values["th"] > 0 or program not in ("PR", "DR")):
            self.recorder.target_height = values["th"]
        if values.get("ih", 0) > 0:
            self.height = values["ih"]
            self.recorder.height_instrument(line, values["ih"])
        self.recorder.prism = values.get("PC", self.recorder.prism)
        self.recorder.temperature_c = values.get("T_", self.recorder.temperature_c)
        self.recorder.pressure_hpa = values.get("P", self.recorder.pressure_hpa)
        self.recorder.understood["text"] += 1

    def _point_name(self, block: str) -> tuple[str, str]:
        """Name and code of a point."""
        if self.code_last:
            return block[:19].strip(), block[19:].strip()
        return block[self.name : self.name + 12].strip(), block[self.code : self.code + 5].strip()

    def _point(self, line: int, name: str, code: str, values: dict[str, float]) -> None:
        if code == "S":
            self._station(line, name)
        if {"X", "Y"} <= values.keys() or "Z" in values:
            # X is north and Y is east
            xyz = [values.get(axis, math.nan) for axis in "YXZ"]
            self.recorder.point(line, name, *xyz, given=code in ("S", "A", "B"))
            self.recorder.understood["coordinates"] += 1
        if "Hz" in values or "V1" in values or "SD" in values:
            if re.fullmatch("[A-J]", code):
                self.waiting.append((line, name, values, self.recorder.target_height))
            else:
                self._sight(line, name, code, values, self.recorder.target_height)

    def _station(self, line: int, name: str) -> None:
        self.recorder.setup(line, name)
        self.recorder.understood["set-up"] += 1
        for where, target, values, height in self.waiting:
            self._sight(where, target, "", values, height)
        self.waiting = []

    def _sight(
        self, line: int, name: str, code: str, values: dict[str, float], height: float
    ) -> None:
        zenith = values.get("V1", math.nan)
        if "V3" in values:
            zenith = (math.pi / 2 - values["V3"]) % (2 * math.pi)
        distance = values.get("SD", math.nan)
        if "HD" in values:
            distance = math.hypot(values["HD"], values.get("h", math.nan))
            zenith = math.atan2(values["HD"], values.get("h", math.nan))
        self.recorder.shot(
            line, name, direction=values.get("Hz", math.nan), zenith=zenith, distance=distance,
            height=height, code=code,
        )  # fmt: skip
        self.recorder.understood["sight"] += 1
