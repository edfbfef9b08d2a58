"""Trimble and Zeiss DiNi: M5 (lines of ``For M5|``) and REC 500 (``.dat``, ``.raw``, ``.rec``).

``Rb``, ``Rf`` and ``Rz`` (German ``Lr``, ``Lv``, ``Lz``) are readings to backsight, foresight and
intermediate points, ``HD`` (``E``) their distance, ``Z`` heights; text lines begin and end a line
and say in which order a set-up is read. Sums (``Sh``, ``Db``, ``Df``, ``dz``) repeat what was read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tribrach.io.levels.readings import LevelBook, LevelFile, StaffReading
from tribrach.io.opened_files import lines_of
from tribrach.io.totalstation.text import read_lines
from tribrach.units import LARGEST, UNITS

_READINGS = {"Rb": "back", "Rf": "fore", "Rz": "side", "Lr": "back", "Lv": "fore", "Lz": "side"}
_DISTANCES = ("HD", "E", "D")
#: values of a record: type, number and unit
_VALUE = re.compile(
    r"(?:^|[\s|])(Rb|Rf|Rz|Lr|Lv|Lz|HD|E|D|Z|Sh|Sr|Sv|Db|Df|dz|dL)\s+"
    r"([+-]?\d+(?:\.\d+)?)(?:\s+(m|ft))?(?=\s|\||$)"
)
_START = re.compile(r"start[- ]?lin|linienanfang|anfang[- ]linie|beginn|start of line", re.I)
_END = re.compile(r"end[- ]?line|linienende|ende[- ]linie|end of line", re.I)
_REC = re.compile(r"\s*\d{1,6} ")


@dataclass
class _Record:
    """A line with a name and values, or a text."""

    line: int
    name: str
    values: dict[str, float]
    text: str = ""


def sniff(text: str) -> bool:
    """True if a text is of a DiNi: M5 or REC 500 with staff readings."""
    rows = lines_of(text)
    m5 = [row for row in rows if re.match(r"\s*For[ _]M5\|", row)]
    looked = m5 or [row for row in rows if _REC.match(row)]
    if not looked or (not m5 and len(looked) < 0.8 * len([r for r in rows if r.strip()])):
        return False
    types = {found[1] for row in looked for found in _VALUE.finditer(row)}
    other = re.search(r"\|(?:Hz|V1|SD)\s", "\n".join(m5)) is not None
    return bool(types & set(_READINGS)) and not other


def read(path: Path) -> LevelFile:
    """Read a file."""
    lines = read_lines(path)
    m5 = any(re.match(r"\s*For[ _]M5\|", line) for line in lines)
    records = list(_m5(lines) if m5 else _rec500(lines))
    book = LevelBook()
    for record in records:
        if record.text:
            if _START.search(record.text) or _END.search(record.text):
                book.close()
            continue
        kinds = [kind for kind in record.values if kind in _READINGS]
        distance = next((record.values[d] for d in _DISTANCES if d in record.values), float("nan"))
        for kind in kinds:
            what = _READINGS[kind]
            height = record.values.get("Z", float("nan"))
            value = record.values[kind]
            reading = StaffReading(what, record.name, value, distance, record.line, height)
            book.add(reading)
        sums = {"Sh", "Sr", "Sv", "Db", "Df", "dz"} & record.values.keys()
        own = record.name and record.name not in book.computed and not kinds and not sums
        if own and abs(record.values.get("Z", LARGEST)) < LARGEST:
            book.given.setdefault(record.name, (record.values["Z"], record.line))
    return book.file(path, "DiNi M5" if m5 else "DiNi REC 500")


def _values(text: str) -> dict[str, float]:
    """Values by type [m]."""
    return {
        found[1]: float(found[2]) * UNITS.get(found[3] or "m", 1.0)
        for found in _VALUE.finditer(text)
    }


def _m5(lines: list[str]) -> Iterator[_Record]:
    """Records of M5: the second block has the type, name, code, time and number of the line."""
    for number, line in enumerate(lines, start=1):
        parts = line.strip("\x02\x03\x04\x1a").split("|")
        if len(parts) < 4 or not re.match(r"\s*For[ _]M5$", parts[0]):
            continue
        block = parts[2]
        kind, rest = block[:3].strip(), block[3:]
        values = _values("|".join(parts[3:]))
        if kind.startswith(("TO", "TI")):
            yield _Record(number, "", {}, rest.strip() or " ")
        elif values:
            # the name stands in the first 8 characters after the type, or before the first gap
            words = rest.split()
            yield _Record(number, words[0] if words else "", values)


def _rec500(lines: list[str]) -> Iterator[_Record]:
    """Records of REC 500: address, then name and code, then values; or a text."""
    for number, line in enumerate(lines, start=1):
        text = line.strip("\x02\x03\x04\x1a")
        found = _REC.match(text)
        if found is None:
            continue
        rest = text[found.end() :]
        values = _values(rest)
        if not values:
            yield _Record(number, "", {}, rest.strip() or " ")
            continue
        first = _VALUE.search(rest)
        assert first is not None
        words = rest[: first.start()].split()
        yield _Record(number, words[0] if words else "", values)
