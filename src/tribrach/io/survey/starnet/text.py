"""Lines of STAR*NET data files, and their words: numbers, angles, bearings, units.

Everything from ``#`` on is a comment, everything from an apostrophe on that follows a blank is a
description, and so is what two hyphens begin, as some exports write it. Codes and options are
written in capitals or not. Angles are ``D-M-S`` (seconds and minutes may be left out), packed
``D.MMSSss``, or gon; bearings are azimuths or quadrants such as ``N36-50-17W``.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.opened_files import contents, text_of_bytes
from tribrach.units import GON, LARGEST, UNITS, circle_passed, from_dms, too_large

#: largest file that is read [bytes]
MAX_BYTES = 200_000_000

#: metres, by the names that STAR*NET has for units of length
LINEAR_UNITS = {
    "METERS": 1.0,
    "FEETUS": UNITS["usft"],
    "USFEET": UNITS["usft"],
    "FEETINT": UNITS["ft"],
    "INTFEET": UNITS["ft"],
    "FEET": UNITS["usft"],
    "FT": UNITS["usft"],
    "M": 1.0,
}

_DESCRIPTION = re.compile(r"(?:^|\s)(?:['‘’`]|--(?![\d.]))")
_SEXAGESIMAL = re.compile(r"([+-]?)(\d+)(?:-(\d+)(?:-(\d+(?:\.\d*)?))?)?$")
_PACKED = re.compile(r"([+-]?)(\d*)\.(\d*)$")
_MARKS = re.compile(r"[!*&]{2,}$")
_QUADRANT = re.compile(r"([NS])(.+)([EW])$", re.IGNORECASE)


@dataclass(frozen=True)
class DataLine:
    """One line with data."""

    file: str  #: as named in messages
    label: str  #: as named in sources of observations
    number: int  #: of the line, from 1
    code: str  #: data type in capitals, or an option with its period
    words: tuple[str, ...]  #: what follows, without comment and description
    folder: Path  #: where files named on the line are looked for
    description: str = ""  #: behind an apostrophe

    @property
    def source(self) -> str:
        """``label:line``."""
        return f"{self.label}:{self.number}"

    def error(self, what: str, cure: str | None = None) -> InputError:
        """The error of this line."""
        return InputError(what, file=self.file, line=self.number, cure=cure)


def data_line(text: str, path: Path, label: str, number: int) -> DataLine | None:
    """One line in words, None if it has no data."""
    text = text.split("#", 1)[0]
    description = _DESCRIPTION.search(text)
    words_of_it = "" if description is None else text[description.end() :].strip()
    if description:
        text = text[: description.start()]
    words = text.split()
    if not words:
        return None
    if any(map(_MARKS.match, words)):
        # marks of standard errors that run together, as &&* and !!*
        words = [part for word in words for part in (word if _MARKS.match(word) else (word,))]
    code, rest = words[0].upper(), tuple(words[1:])
    return DataLine(str(path), label, number, code, rest, path.parent, words_of_it)


def text_of(path: Path) -> str:
    """The text of a file."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"larger than {MAX_BYTES // 1_000_000} MB", file=path)
        data = contents(path)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    if b"\0" in data:
        raise InputError("not a text file ", file=path)
    return text_of_bytes(data)


def number_of(word: str, what: str, line: DataLine) -> float:
    """A finite number."""
    try:
        value = float(word)
    except ValueError:
        raise line.error(f"{what} is {word!r}, not a number") from None
    if not math.isfinite(value):
        raise line.error(f"{what} is {word!r}, not a finite number")
    if too_large(value):
        raise line.error(f"{what} is {word}, beyond any measurement")
    return value


def angle_of(word: str, what: str, line: DataLine, *, gon: bool = False) -> float:
    """An angle [rad], as it is written: no turns are added or taken away."""
    value = number_of(word, what, line) * GON if gon else _degrees(word, what, line)
    if circle_passed(value):
        raise line.error(f"{what} is {word}, beyond the circle", "check the angle and its unit")
    return value


def _degrees(word: str, what: str, line: DataLine) -> float:
    """An angle [rad] in degrees, minutes and seconds."""
    match = _SEXAGESIMAL.match(word)
    if match:
        sign, degrees, minutes, seconds = match.groups()
        parts = int(degrees), int(minutes or 0), float(seconds or 0)
    else:
        packed = _PACKED.match(word)
        if packed is None or not (packed[2] or packed[3]):
            raise line.error(
                f"{what} is {word!r}, not an angle", "write degrees-minutes-seconds, or D.MMSSss"
            )
        sign, digits = packed[1], packed[3].ljust(4, "0")
        seconds_text = digits[2:4] + "." + digits[4:]
        parts = int(packed[2] or 0), int(digits[:2]), float(seconds_text)
    if parts[0] > LARGEST:
        raise line.error(f"{what} is {word}, beyond the circle", "check the angle and its unit")
    try:
        value = from_dms(*parts, word)
    except ValueError as error:
        raise line.error(
            f"{what}: {error}", "write degrees-minutes-seconds, or packed as D.MMSSss"
        ) from None
    return -value if sign == "-" else value


def azimuth_of(word: str, what: str, line: DataLine, *, gon: bool = False) -> float:
    """An azimuth or a quadrant bearing, as azimuth [rad] in [0, 2 pi)."""
    quadrant = _QUADRANT.match(word)
    if quadrant is None:
        return angle_of(word, what, line, gon=gon) % (2 * math.pi)
    value = angle_of(quadrant[2], what, line, gon=gon)
    if not 0 <= value <= math.pi / 2 * (1 + 1e-12):
        raise line.error(f"{what} is {word!r}, with more than 90 degrees in its quadrant")
    if quadrant[1].upper() == "S":
        value = math.pi - value
    if quadrant[3].upper() == "W":
        value = -value
    return value % (2 * math.pi)
