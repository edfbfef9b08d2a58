"""Carlson RW5 (``.rw5``), also as Leica and Spectra write it.

A record and its fields between commas; each field begins with its own letters. ``MO`` gives the
units, ``OC`` and ``BK`` the set-up, ``LS`` the heights; ``BD``, ``BR``, ``FD``, ``FR`` are readings
of sets in both faces, ``TR`` and ``SS`` single ones. Degrees are packed ``DDD.MMSS``. Distances
contain the corrections of the instrument. Format: Carlson SurvPC manual, "Raw data".
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

_LENGTHS = {"0": UNITS["ft"], "1": 1.0, "2": UNITS["usft"]}
_FACES = {"BD": 1, "FD": 1, "BR": 2, "FR": 2, "TR": 0, "SS": 0}
#: letters that fields begin with, the longer ones first
_FIELDS = (
    "N ", "E ", "EL", "PN", "OP", "BP", "FP", "BS", "BC", "HI", "HR", "AD", "UN", "SF", "EC", "EO",
    "AU", "AR", "AL", "AZ", "BR", "DR", "DL", "ZE", "VA", "CE", "SD", "HD", "NM", "DT", "TM",
)  # fmt: skip
_PRISM = re.compile(r"P\.C\.\s*mm\s*Applied:\s*(-?[\d.]+)", re.IGNORECASE)


def sniff(text: str) -> bool:
    """True if a text has a job and a mode record, as a record or in a comment."""
    return re.search(r"^(--)?(JB,NM|MO,AD\d)", text, re.MULTILINE) is not None


def read(path: Path) -> RawFile:
    """Read a file."""
    lines = read_lines(path)
    recorder = Recorder(path, "Carlson RW5")
    reader = _Reader(recorder)
    modes = [(i, x.removeprefix("--")) for i, x in enumerate(lines, start=1) if "MO,AD" in x[:7]]
    if modes and not any(line.startswith("MO,") for line in lines):
        reader.record(*modes[0])
        recorder.note("The units are those of a mode record that stands in a comment.")
    elif not modes:
        recorder.note("The file has no mode record; lengths are taken as feet, angles as degrees.")
    for line, record in enumerate(lines, start=1):
        if record.strip("\x1a "):
            reader.record(line, record.strip("\x1a "))
    return recorder.finish()


class _Reader:
    """Turns records into set-ups, sights and coordinates."""

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder
        self.angle, self.length = "dms", UNITS["ft"]
        self.station, self.backsight = "", ""
        self.height, self.azimuth, self.circle = math.nan, math.nan, math.nan
        self._handlers: dict[str, Callable[[int, dict[str, str]], None]] = {
            "MO": self._mode,
            "JB": lambda line, fields: None,
            "SP": self._point,
            "OC": self._occupy,
            "BK": self._back,
            "LS": self._heights,
        }

    def record(self, line: int, record: str) -> None:
        """One record; if it cannot be right it is left out and counted."""
        if record.startswith("--"):
            prism = _PRISM.search(record)
            if prism is not None:
                self.recorder.prism = float(prism[1]) / 1000
            self.recorder.understood["comment"] += 1
            return
        body, _, note = record.partition(",--")
        kind, *cells = body.split(",")
        kind = kind.strip()
        fields = {name.strip(): cell[2:].strip() for cell in cells for name in _name(cell)}
        fields["--"] = note.strip()
        try:
            if kind in _FACES:
                self._sight(line, fields, _FACES[kind])
            elif kind in self._handlers:
                self._handlers[kind](line, fields)
                self.recorder.understood[kind] += 1
            else:
                self.recorder.unknown[f"record {kind[:12]}"] += 1
        except ValueError as error:
            self.recorder.problem(line, str(error))

    def _mode(self, line: int, fields: dict[str, str]) -> None:
        """Units of lengths and angles."""
        unit = fields.get("UN", "0")
        if unit not in _LENGTHS:
            raise ValueError(f"the unit of lengths {unit!r} is unknown")
        self.length = _LENGTHS[unit]
        self.angle = "gon" if fields.get("AU", "0") == "1" else "dms"

    def _length(self, text: str) -> float:
        return number(text) * self.length

    def _point(self, line: int, fields: dict[str, str]) -> None:
        e, n, u = (self._length(fields.get(name, "")) for name in ("E", "N", "EL"))
        self.recorder.point(line, fields.get("PN", ""), e, n, u, code=fields["--"])

    def _occupy(self, line: int, fields: dict[str, str]) -> None:
        self.station = fields.get("OP", "")
        self.backsight, self.azimuth, self.circle = "", math.nan, math.nan
        if "N" in fields:
            e, n, u = (self._length(fields.get(name, "")) for name in ("E", "N", "EL"))
            # coordinates of an occupied point are those that the instrument had at hand
            self.recorder.point(line, self.station, e, n, u, given=False)

    def _back(self, line: int, fields: dict[str, str]) -> None:
        self.backsight = fields.get("BP", "")
        self.azimuth = angle(fields.get("BS", ""), self.angle)
        self.circle = angle(fields.get("BC", ""), self.angle)

    def _heights(self, line: int, fields: dict[str, str]) -> None:
        if "HI" in fields:
            self.height = self._length(fields["HI"])
        if "HR" in fields:
            self.recorder.target_height = self._length(fields["HR"])

    def _sight(self, line: int, fields: dict[str, str], face: int) -> None:
        """Readings; the set-up is the current one unless something about it has changed."""
        station = fields.get("OP", self.station)
        if station != self.station:
            self.station, self.backsight = station, ""
            self.azimuth, self.circle = math.nan, math.nan
        zenith = self._zenith(fields)
        distance = self._length(fields.get("SD", ""))
        if "HD" in fields:
            if math.sin(zenith) == 0:
                raise ValueError("a sight along the vertical axis has a horizontal distance")
            distance = self._length(fields["HD"]) / abs(math.sin(zenith))
        self.recorder.setup(
            line, station, height=self.height, backsight=self.backsight, azimuth=self.azimuth,
            circle=self.circle, merge=True,
        )  # fmt: skip
        self.recorder.shot(
            line, fields.get("FP", ""), direction=self._direction(fields), zenith=zenith,
            distance=distance, face=face, code=fields["--"],
        )  # fmt: skip
        self.recorder.understood["sight"] += 1

    def _zenith(self, fields: dict[str, str]) -> float:
        """Zenith angle [rad] from a zenith or vertical angle."""
        if "CE" in fields:
            raise ValueError("a sight with a change of elevation has no zenith angle")
        if "VA" in fields:
            return math.pi / 2 - angle(fields["VA"], self.angle)
        return angle(fields.get("ZE", ""), self.angle)

    def _direction(self, fields: dict[str, str]) -> float:
        """Circle reading [rad] from angles to the right or left, deflections, or an azimuth."""
        signs = {"AR": (1, 0), "AL": (-1, 0), "AZ": (1, 0), "DR": (1, math.pi), "DL": (-1, math.pi)}
        for name, (sign, start) in signs.items():
            if name in fields:
                return (start + sign * angle(fields[name], self.angle)) % (2 * math.pi)
        if "BR" in fields:
            raise ValueError("a sight with a bearing of a quadrant is not read")
        return math.nan


def _name(cell: str) -> tuple[str, ...]:
    """The letters that a field begins with, if they are known."""
    start = cell[:2].upper()
    return (start,) if start in _FIELDS else ()
