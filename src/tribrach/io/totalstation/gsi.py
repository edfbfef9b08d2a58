"""Leica GSI: words of 8 or of 16 characters (``.gsi``).

A line is a block of words: two digits of word index, four characters of information, a sign and
8 or, after an asterisk, 16 characters of data. The last character of the information is the unit.
Blocks begin with word 11 (a point) or 41 (a code). A block of a point with words 84 to 86 or 88
and without readings is a set-up. Distances contain the corrections of word 51. Format: Leica
Geosystems, "GSI Online for TPS and DNA".
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import packed_dms, read_lines
from tribrach.units import GON, UNITS

_WORDS = {
    8: re.compile(r"(\d\d)(.{4})([+-])(.{8})(?: |$)"),
    16: re.compile(r"(\d\d)(.{4})([+-])(.{16})(?: |$)"),
}
_CONSTANTS = re.compile(r"([+-]\d+)([+-]\d+)$")
_LENGTH = {"0": 1e-3, "1": 1e-3 * UNITS["ft"], "6": 1e-4, "7": 1e-4 * UNITS["ft"], "8": 1e-5}
_ANGLE = {"2": GON * 1e-5, "3": math.pi / 180 * 1e-5, "5": math.pi / 3200 * 1e-4}
_ANGLES = ("21", "22", "25")
_LENGTHS = ("31", "32", "33", "81", "82", "83", "84", "85", "86", "87", "88")
#: known words that carry no reading, and those that are read otherwise
_SILENT = (
    "11", "51", "58", "59",
    "12", "13", "14", "15", "16", "17", "18", "19", "32", "33", "35", "36", "37", "52", "53", "54",
    "57", "71", "72", "73", "74", "75", "76", "77", "78", "79", "25",
)  # fmt: skip
#: heights of an instrument that a code may carry [mm]
_HEIGHTS = range(100, 3001)


@dataclass(slots=True)
class Word:
    """A word of a block."""

    index: str  #: two or three digits
    information: str  #: four characters; the last is the unit
    sign: str  #: + or -
    data: str  #: 8 or 16 characters

    @property
    def text(self) -> str:
        """The data as a name, without the zeros and blanks that fill it up."""
        return self.data.strip().lstrip("0") or ("0" if "0" in self.data else "")

    @property
    def value(self) -> float:
        """The data in metres or radians, NaN where the instrument had none."""
        digits, unit = self.data.strip(), self.information[3]
        if not digits.strip("-") or digits.endswith("-"):
            return math.nan
        if not digits.isdecimal():
            raise ValueError(f"word {self.index} has {digits!r} for a number")
        sign = -1.0 if self.sign == "-" else 1.0
        if self.index in _ANGLES:
            if unit == "4":
                return sign * packed_dms(f"{digits[:-5] or '0'}.{digits[-5:]}")
            if unit in _ANGLE:
                return sign * int(digits) * _ANGLE[unit]
        elif unit in _LENGTH:
            return sign * int(digits) * _LENGTH[unit]
        raise ValueError(f"word {self.index} has the unit {unit!r}, which it cannot have")


def parse_words(line: str) -> list[Word]:
    """Words of a line; a leading asterisk means 16 characters of data."""
    line = line.strip("\x02\x03\x04\x1a\t ") + " "
    wide = line.startswith("*")
    words = []
    for match in _WORDS[16 if wide else 8].finditer(line[1:] if wide else line):
        index, information, sign, data = match.groups()
        if information[0].isdigit() and index not in ("11", "41"):
            index += information[0]
        words.append(Word(index, information, sign, data))
    return words


def sniff(text: str) -> bool:
    """True if a text begins with blocks of words."""
    lines = [line.strip("\x02 ") for line in re.split(r"[\r\n]+", text) if line.strip()]
    pattern = re.compile(r"\*?(11|41)\d{4}[+-]")
    return bool(lines) and pattern.match(lines[0]) is not None


def read(path: Path) -> RawFile:
    """Read a file."""
    lines = read_lines(path)
    recorder = Recorder(path, "Leica GSI")
    blocks = list(_blocks(lines, recorder))
    reader = _Reader(recorder, _station_code(blocks))
    for number, words in blocks:
        try:
            reader.block(number, words)
        except ValueError as error:
            recorder.problem(number, str(error))
    if not reader.sights and any(w.index[:2] == "33" for _, ws in blocks for w in ws):
        raise InputError(
            "the file holds staff readings of a level (words 330 and following), no sights of a "
            "total station",
            file=path,
            cure="give height differences as CSV",
        )
    return recorder.finish()


def _blocks(lines: list[str], recorder: Recorder) -> Iterator[tuple[int, list[Word]]]:
    """Lines with words; other lines are counted."""
    for number, line in enumerate(lines, start=1):
        if not line.strip("\x02\x03\x04\x1a\t "):
            continue
        words = parse_words(line)
        if words and words[0].index in ("11", "41"):
            yield number, words
        else:
            recorder.unknown["line that is no block"] += 1


def _station_code(blocks: list[tuple[int, list[Word]]]) -> str | None:
    """The code whose blocks are set-ups: name in word 42, height in millimetres in word 43.

    Codes are a surveyor's own. They are taken as set-ups only if the file has no others, all its
    codes are the same one, and all their heights are those of an instrument.
    """
    indices = [{w.index for w in words} for _, words in blocks]
    if any(("84" in i or "88" in i) and "21" not in i for i in indices):
        return None
    codes = [ws for _, ws in blocks if ws[0].index == "41"]
    if not codes or len({ws[0].text for ws in codes}) > 1:
        return None
    for words in codes:
        by_index = {w.index: w for w in words}
        height = by_index["43"].data.strip() if {"42", "43"} <= by_index.keys() else ""
        if not height.isdecimal() or int(height) not in _HEIGHTS:
            return None
    return codes[0][0].text


class _Reader:
    """Turns blocks into set-ups, sights and coordinates."""

    def __init__(self, recorder: Recorder, station_code: str | None) -> None:
        self.recorder, self.station_code = recorder, station_code
        self.sights = 0
        if station_code is not None:
            recorder.note(
                f"Code {station_code} is taken as a set-up: word 42 its station, word 43 the "
                "height of the instrument in millimetres."
            )

    def block(self, line: int, words: list[Word]) -> None:
        """One line."""
        if words[0].index == "41":
            self._code(line, words)
            return
        by_index = {word.index: word for word in words}
        values = {i: w.value for i, w in by_index.items() if i in _LENGTHS or i in _ANGLES}
        for index in by_index:
            if index not in values and index not in _SILENT:
                self.recorder.unknown[f"word {index}"] += 1
        self._constants(by_index)
        name = by_index["11"].text
        reading = any(i in by_index for i in ("21", "22", "31"))
        if not reading and ("84" in by_index or "88" in by_index):
            self._setup(line, name, values)
        elif reading:
            self._sight(line, name, by_index, values)
        if any(i in by_index for i in ("81", "82", "83")):
            xyz = [values.get(i, math.nan) for i in ("81", "82", "83")]
            self.recorder.point(
                line, name, xyz[0], xyz[1], xyz[2], given=not reading, code=_remark(by_index)
            )
            self.recorder.understood["coordinates"] += 1

    def _code(self, line: int, words: list[Word]) -> None:
        """A code block: a set-up, or something of the surveyor's own."""
        if words[0].text != self.station_code:
            self.recorder.unknown["code block"] += 1
            return
        by_index = {word.index: word for word in words}
        height = int(by_index["43"].data) / 1000
        self.recorder.setup(line, by_index["42"].text, height=height)
        self.recorder.understood["set-up"] += 1

    def _setup(self, line: int, name: str, values: dict[str, float]) -> None:
        height = values.get("88", math.nan)
        # written twice before the first sight, it is still one set-up
        self.recorder.setup(line, name, height=height, merge=not self.recorder.current_used)
        self.recorder.understood["set-up"] += 1
        if "84" in values:
            xyz = [values.get(i, math.nan) for i in ("84", "85", "86")]
            self.recorder.point(line, name, xyz[0], xyz[1], xyz[2])

    def _constants(self, by_index: dict[str, Word]) -> None:
        """Word 51: parts per million and prism constant in millimetres; also as 59 and 58."""
        if "51" in by_index:
            both = _CONSTANTS.match(by_index["51"].sign + by_index["51"].data.strip())
            if both is None:
                raise ValueError(f"word 51 has {by_index['51'].data!r} for its constants")
            self.recorder.ppm = float(both[1])
            self.recorder.prism = float(both[2]) / 1000
        if "58" in by_index and by_index["58"].data.strip().isdecimal():
            sign = -1 if by_index["58"].sign == "-" else 1
            self.recorder.prism = sign * int(by_index["58"].data) * 1e-4

    def _sight(
        self, line: int, name: str, by_index: dict[str, Word], values: dict[str, float]
    ) -> None:
        if "88" in values and not math.isnan(values["88"]):
            self.recorder.height_instrument(line, values["88"])
        self.recorder.shot(
            line,
            name,
            direction=values.get("21", math.nan),
            zenith=values.get("22", math.nan),
            distance=values.get("31", math.nan),
            height=values.get("87", math.nan),
            code=_remark(by_index),
        )
        self.sights += 1
        self.recorder.understood["sight"] += 1


def _remark(by_index: dict[str, Word]) -> str:
    """The code of a point, word 71."""
    return by_index["71"].text.strip("-") if "71" in by_index else ""
