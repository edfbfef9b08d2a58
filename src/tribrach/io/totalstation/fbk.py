"""Field books of Autodesk Survey and Civil 3D (``.fbk``), as many data collectors write them.

A command and its values on a line, between blanks; ``!`` begins a comment and quotes hold a
description. ``UNIT``, ``HORIZ ANGLE`` and ``VERT ANGLE`` say how values are written, ``STN`` and
``BS`` are the set-up, ``PRISM`` the height of the target; ``F1`` and ``F2`` are circle readings in
both faces, ``AD``, ``DD``, ``ZD`` and ``BD`` angles from the backsight, deflections, azimuths and
bearings. ``VA`` behind them adds a vertical angle, which makes the distance a slope distance,
``VD`` a vertical distance. ``NE`` and ``NEZ`` are coordinates. Degrees are packed ``DDD.MMSS``.
Format: Autodesk Civil 3D user's guide, "Survey command language".
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

_WORD = re.compile(r'"[^"]*"|\S+')
_LENGTHS = {"FOOT": UNITS["ft"], "FEET": UNITS["ft"], "METER": 1.0, "METRE": 1.0, "METERS": 1.0}
_ANGLES = {
    "DMS": "dms", "DEG": "deg", "DECDEG": "deg", "DECDEGREES": "deg", "DD": "deg", "GRAD": "gon",
    "GRADS": "gon", "GON": "gon", "GONS": "gon", "MIL": "mil", "MILS": "mil", "RAD": "rad",
    "RADIANS": "rad",
}  # fmt: skip
_FACES = {"F1": 1, "F2": 2}
_SIGHTS = ("F1", "F2", "AD", "DD", "ZD", "BD")
#: settings that are told if they are not off, and not applied
_SETTINGS = {
    "PRISM CONSTANT": "PRISM CONSTANT", "PRISM OFFSET": "PRISM OFFSET", "EDM OFFSET": "EDM OFFSET",
    "SCALE FACTOR": "SCALE FACTOR", "ATMOSPHERE": "ATMOSPHERE", "COLLIMATION": "COLLIMATION",
    "CR": "CR",
}  # fmt: skip
_OFF = ("OFF", "")
#: commands that draw, print or describe
_SILENT = (
    "JOB", "CREW", "DATE", "TEMP", "TEMPERATURE", "PRESS", "PRESSURE", "BEG", "BEGIN", "CONT",
    "CONTINUE", "END", "CLOSE", "C3", "CRV", "MCS", "MCE", "PC", "PT", "RT", "XC", "FIG", "START",
    "SET", "POINT", "OFFSET", "MAPCHECK", "AREA", "INVERSE", "OUTPUT", "EDITOR", "HISTORY", "BATCH",
    "NOTE", "EXIT", "H", "PAUSE", "MOD", "DISP",
)  # fmt: skip


def sniff(text: str) -> bool:
    """True if a text has the settings of a field book, or a set-up and sights of its language."""

    def has(pattern: str) -> bool:
        return re.search(rf"^\s*{pattern}", text, re.MULTILINE | re.IGNORECASE) is not None

    sights = has(r"(F1|F2|AD|DD|ZD|BD)\s+(VA|VD)\s+\S+\s+[-+.\d]")
    unit = has(r"UNITS?\s+(FOOT|FEET|METER|METRE)S?\b")
    angles = has(r"(HORIZ|VERT)\s+ANGLE\s")
    return (unit and (angles or sights)) or (has(r"STN\s+\S+") and sights)


def read(path: Path) -> RawFile:
    """Read a file."""
    reader = _Reader(Recorder(path, "Autodesk field book"))
    for line, record in enumerate(read_lines(path), start=1):
        words = _WORD.findall(record)
        if words and not words[0].startswith("!"):
            reader.record(line, words)
    reader.close()
    return reader.recorder.finish()


class _Reader:
    """The settings, the set-up and the next number of a point as the file goes on."""

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder
        self.length, self.angle = math.nan, "dms"
        self.sign, self.vertical = 1.0, "ZENITH"
        self.station, self.height, self.place = "", math.nan, 0
        self.backsight, self.circle = "", math.nan
        self.azimuths: dict[tuple[str, str], float] = {}
        self.next: int | None = None
        self.flat = 0
        self._handlers: dict[str, Callable[[int, list[str]], None]] = {
            "UNIT": self._unit,
            "UNITS": self._unit,
            "HORIZ": self._horizontal,
            "VERT": self._vertical,
            "PRISM": self._prism,
            "STN": self._occupy,
            "BS": self._back,
            "AZ": self._azimuth,
            "BRG": self._bearing,
            "NE": self._point,
            "NEZ": self._point,
            "AP": self._automatic,
        }

    def record(self, line: int, words: list[str]) -> None:
        """One line; what cannot be right is noted with its line, what is unknown counted."""
        command, values = words[0].upper(), words[1:]
        two = f"{command} {values[0].upper()}" if values else command
        try:
            if two in _SETTINGS:
                self._setting(_SETTINGS[two], values[1:])
            elif command in _SETTINGS:
                self._setting(_SETTINGS[command], values)
            elif command in _SIGHTS:
                self._sight(line, command, values)
            elif command in self._handlers:
                self._handlers[command](line, values)
                self.recorder.understood[command] += 1
            elif command in _SILENT:
                self.recorder.understood["command of drawing or office"] += 1
            else:
                self.recorder.unknown[f"command {command[:12]}"] += 1
        except (ValueError, IndexError) as error:
            short = isinstance(error, IndexError)
            what = f"{command} has too few values" if short else str(error)
            self.recorder.problem(line, what)

    def close(self) -> None:
        """Report remarks that concern the whole file."""
        if self.flat:
            self.recorder.note(
                f"{self.flat} sights have a horizontal distance and no vertical one (AD, F1 or F2 "
                "without VA or VD): their directions are used, their distances are not."
            )

    def _setting(self, name: str, values: list[str]) -> None:
        """Report a correction of the office program unless it changes nothing."""
        value = " ".join(values).upper()
        neutral = 1.0 if name == "SCALE FACTOR" else 0.0
        try:
            nothing = value in _OFF or float(value) == neutral
        except ValueError:
            nothing = False
        if not nothing:
            self.recorder.note(f"{name} {value} is not applied: readings are taken as they stand.")
        self.recorder.understood["setting"] += 1

    def _unit(self, line: int, values: list[str]) -> None:
        """Units of lengths and angles, in either order."""
        for word in (value.upper() for value in values):
            if word in _LENGTHS:
                self.length = _LENGTHS[word]
                if self.length != 1.0:
                    self.recorder.note("Feet are taken as international feet of 0.3048 m.")
            elif word in _ANGLES:
                self.angle = _ANGLES[word]
            else:
                raise ValueError(f"the unit {word!r} is unknown")

    def _horizontal(self, line: int, values: list[str]) -> None:
        """``HORIZ ANGLE RIGHT`` or ``LEFT``."""
        self.sign = {"RIGHT": 1.0, "LEFT": -1.0}[_one_of(values[-1], ("RIGHT", "LEFT"))]

    def _vertical(self, line: int, values: list[str]) -> None:
        """``VERT ANGLE`` and where it is counted from."""
        self.vertical = _one_of(values[-1], ("ZENITH", "NADIR", "HORIZ", "HORIZON"))

    def _metres(self, text: str) -> float:
        """A length; metres if the file does not say, which is noted."""
        if math.isnan(self.length):
            self.length = 1.0
            self.recorder.note("The file has no UNIT; lengths are taken as metres.")
        return _finite(text) * self.length

    def _prism(self, line: int, values: list[str]) -> None:
        self.recorder.target_height = self._metres(values[0])

    def _occupy(self, line: int, values: list[str]) -> None:
        """``STN point (height) (description)``."""
        self.place = line
        self.station = _name(values[0])
        given = len(values) > 1 and _is_number(values[1])
        self.height = self._metres(values[1]) if given else math.nan
        self.backsight, self.circle = "", math.nan

    def _back(self, line: int, values: list[str]) -> None:
        """``BS point (circle reading)``; the reading is zero if it is not given."""
        self.place = line
        self.backsight = _name(values[0])
        given = len(values) > 1 and _is_number(values[1])
        self.circle = self._turn(values[1]) if given else 0.0

    def _azimuth(self, line: int, values: list[str]) -> None:
        """``AZ from to azimuth``."""
        ends = _name(values[0]), _name(values[1])
        self.azimuths[ends] = angle(values[2], self.angle)

    def _bearing(self, line: int, values: list[str]) -> None:
        """``BRG from to bearing quadrant``."""
        ends = _name(values[0]), _name(values[1])
        self.azimuths[ends] = self._of_quadrant(values[2], values[3])

    def _of_quadrant(self, text: str, quadrant: str) -> float:
        """Azimuth [rad] of a bearing in the quadrants NE, SE, SW, NW, numbered from 1."""
        bearing = angle(text, self.angle)
        number_ = _one_of(quadrant, ("1", "2", "3", "4"))
        return {"1": 0, "2": math.pi, "3": math.pi, "4": 2 * math.pi}[number_] + (
            bearing if number_ in "13" else -bearing
        )

    def _automatic(self, line: int, values: list[str]) -> None:
        """``AP ON (number)`` or ``AP OFF``: points get the next number by themselves."""
        if _one_of(values[0], ("ON", "OFF")) == "OFF":
            self.next = None
        else:
            self.next = int(_finite(values[1])) if len(values) > 1 else self.next or 1

    def _named(self, values: list[str], numbers: int) -> tuple[str, list[str]]:
        """Name of a point and the values behind it; the next number where none is given."""
        if len(values) > numbers and all(map(_is_number, values[1 : numbers + 1])):
            return _name(values[0]), values[1:]
        if self.next is None or len(values) < numbers:
            raise ValueError(f"a point and {numbers} numbers are needed")
        self.next += 1
        return str(self.next - 1), values

    def _point(self, line: int, values: list[str]) -> None:
        """``NE`` or ``NEZ``: northing, easting and, with Z, the height."""
        if values and values[0].upper() == "SS":
            values = values[1:]
        count = 3 if len(values) > 3 and _is_number(values[3]) else 2
        name, rest = self._named(values, count)
        north, east, *up = (self._metres(text) for text in rest[:count])
        self.recorder.point(line, name, east, north, up[0] if up else math.nan)

    def _sight(self, line: int, command: str, values: list[str]) -> None:
        """A sight of the current set-up."""
        if not self.station:
            raise ValueError("a sight stands before the first STN")
        how = values[0].upper() if values and values[0].upper() in ("VA", "VD") else ""
        values = values[1:] if how else values
        quadrants = 1 if command == "BD" else 0
        name, rest = self._named(values, 2 + quadrants + bool(how))
        horizontal, rest = rest[0], rest[1:]
        if command == "BD":
            direction, rest = self._of_quadrant(horizontal, rest[0]), rest[1:]
        else:
            direction = self._direction(command, horizontal)
        distance, zenith = self._line(how, self._metres(rest[0]), rest[1] if how else "")
        rest = rest[2 if how else 1 :]
        azimuths = command in ("ZD", "BD")
        self.recorder.setup(
            self.place,
            self.station,
            height=self.height,
            backsight="" if azimuths else self.backsight,
            azimuth=math.nan if azimuths else self._to_backsight(),
            circle=math.nan if azimuths else self.circle,
            merge=True,
        )
        self.recorder.shot(
            line,
            name,
            direction=direction % (2 * math.pi),
            zenith=zenith,
            distance=distance,
            face=_FACES.get(command, 0 if zenith > math.pi else 1),
            code=" ".join(rest).strip('"'),
        )
        self.recorder.understood["sight"] += 1

    def _to_backsight(self) -> float:
        """Azimuth of the backsight [rad], NaN if the file does not give it."""
        there = self.azimuths.get((self.station, self.backsight))
        if there is not None:
            return there
        return self.azimuths.get((self.backsight, self.station), math.nan) + math.pi

    def _turn(self, text: str) -> float:
        """A horizontal angle, clockwise [rad]."""
        return self.sign * angle(text, self.angle)

    def _direction(self, command: str, text: str) -> float:
        """Circle reading of a sight, or its azimuth [rad]."""
        if command == "ZD":
            return angle(text, self.angle)
        turned = self._turn(text)
        if command == "DD":
            start = 0.0 if math.isnan(self.circle) else self.circle
            return start + math.pi + turned
        return turned

    def _line(self, how: str, distance: float, text: str) -> tuple[float, float]:
        """Slope distance [m] and zenith angle [rad] of a sight."""
        if how == "VA":
            return distance, self._zenith(text)
        if how == "VD":
            rise = self._metres(text)
            return math.hypot(distance, rise), math.atan2(distance, rise)
        self.flat += distance != 0
        return math.nan, math.nan

    def _zenith(self, text: str) -> float:
        """Zenith angle [rad] of a vertical angle, wherever that is counted from."""
        value = angle(text, self.angle)
        if self.vertical == "ZENITH":
            return value
        start = math.pi if self.vertical == "NADIR" else math.pi / 2
        return (start - value) % (2 * math.pi)


def _name(word: str) -> str:
    return word.strip('"').strip()


def _one_of(word: str, known: tuple[str, ...]) -> str:
    """A word that must be one of several."""
    if word.upper() not in known:
        raise ValueError(f"{word!r} is none of {', '.join(known)}")
    return word.upper()


def _is_number(word: str) -> bool:
    """True for a plain number; one in quotes is a description."""
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)", word) is not None


def _finite(word: str) -> float:
    value = number(word)
    if math.isnan(value):
        raise ValueError("a number is missing")
    return value
