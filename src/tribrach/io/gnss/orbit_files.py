"""Files of orbits for a baseline: broadcast ones (RINEX) and precise ones (SP3).

Precise orbits take the place of the broadcast ones; these are still needed for the times at which
signals were sent. Satellite clocks cancel in the differences of a baseline, so files of clocks
have nothing to add.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.gnss.navigation_file import NavigationFile, read_navigation
from tribrach.io.gnss.precise_file import PreciseOrbits, is_sp3, joined, read_sp3
from tribrach.io.unpacking import unpacked_bytes

# RTKLIB leaves Galileo satellites out for two reasons that do not concern a baseline. It takes only
# records of the message I/NAV (bit 9 of the data sources: clocks of E5b and E1), while some
# receivers and simulators write those of F/NAV (bit 8: E5a and E1) or no source at all: the orbits
# of both are the same, their clocks differ by a group delay that cancels. And it takes an accuracy
# (SISA) beyond the 6 m that the signal can state for none, although the file gives it in metres;
# only -1 means that there is none (no accuracy prediction available). Format: RINEX 3.05, table A8.

#: the largest accuracy that the signal can state [m]
LARGEST_SISA = 6.0
#: bits of the data sources: clocks of F/NAV and of I/NAV
_FNAV, _INAV = 1 << 8, 1 << 9
#: a whole record: its first line and seven more
_RECORD = re.compile(rb"^E[ \d]\d .*\n(?: {4}.*(?:\n|\Z)){7}", re.M)
_MARGIN, _WIDTH = 4, 19
#: line and column of data sources and accuracy
_SOURCE, _SISA = (5, 1), (6, 0)


@dataclass(frozen=True)
class GalileoRecords:
    """A navigation file whose Galileo records the engine takes."""

    text: bytes  #: plain RINEX
    #: satellites that state an accuracy beyond the scale of the signal
    coarse: tuple[str, ...] = ()
    accuracy: float = 0.0  #: the largest that they state [m], 0 without any


def galileo_records(text: bytes) -> GalileoRecords:
    """Rewrite data sources and accuracies that keep the engine from using satellites."""
    if text[:9].strip()[:1] != b"3":
        return GalileoRecords(text)
    records = list(_RECORD.finditer(text))
    complete = {_name(match) for match in records if int(_number(match.group(), _SOURCE)) & _INAV}
    parts: list[bytes] = []
    coarse: dict[str, float] = {}
    last = 0
    for match in records:
        record, name = match.group(), _name(match)
        if name not in complete:
            source = int(_number(record, _SOURCE))
            record = _with_number(record, _SOURCE, float(source & ~_FNAV | _INAV))
        accuracy = _number(record, _SISA)
        if accuracy > LARGEST_SISA:
            coarse[name] = max(accuracy, coarse.get(name, 0.0))
            record = _with_number(record, _SISA, LARGEST_SISA)
        parts += [text[last : match.start()], record]
        last = match.end()
    whole = b"".join([*parts, text[last:]])
    return GalileoRecords(whole, tuple(sorted(coarse)), max(coarse.values(), default=0.0))


def _name(match: re.Match[bytes]) -> str:
    """Satellite of a record, such as ``E05``."""
    return match.group()[:3].decode().replace(" ", "0")


def _cell(record: bytes, where: tuple[int, int]) -> tuple[int, int]:
    """Beginning and end of a number in a record."""
    line, column = where
    start = 0
    for _ in range(line):
        start = record.index(b"\n", start) + 1
    start += _MARGIN + _WIDTH * column
    return start, start + _WIDTH


def _number(record: bytes, where: tuple[int, int]) -> float:
    """A number of a record, 0 where its column is blank."""
    start, end = _cell(record, where)
    word = record[start:end].split(b"\n")[0].strip().upper().replace(b"D", b"E")
    return float(word) if word else 0.0


def _with_number(record: bytes, where: tuple[int, int], value: float) -> bytes:
    """The record with another number; a line that ends before its column stays as it is."""
    start, end = _cell(record, where)
    if b"\n" in record[start:end] or len(record) < end:
        return record
    return record[:start] + f"{value:19.12E}".replace("E", "D").encode() + record[end:]


@dataclass(frozen=True, eq=False)
class Orbits:
    """Orbits of a baseline."""

    broadcast: tuple[NavigationFile, ...]  #: one entry for each navigation file
    #: precise orbits of all SP3 files together, None without any
    precise: PreciseOrbits | None = None
    names: tuple[str, ...] = ()  #: names of the SP3 files
    #: galileo satellites whose accuracy is beyond the scale of the signal
    coarse: tuple[str, ...] = ()
    accuracy: float = 0.0  #: the largest that they state [m]

    def for_engine(self) -> Orbits:
        """The same with Galileo records as the engine takes them."""
        records = [galileo_records(file.text) for file in self.broadcast]
        return replace(
            self,
            broadcast=tuple(
                replace(file, text=own.text)
                for file, own in zip(self.broadcast, records, strict=True)
            ),
            coarse=tuple(sorted({name for own in records for name in own.coarse})),
            accuracy=max((own.accuracy for own in records), default=0.0),
        )


def read_orbits(paths: Sequence[Path]) -> Orbits:
    """Read navigation files and SP3 files, told apart by their content."""
    broadcast: list[NavigationFile] = []
    precise: list[PreciseOrbits] = []
    for path in paths:
        data = unpacked_bytes(path)
        if is_sp3(data):
            precise.append(read_sp3(path, data))
        elif b"CLOCK DATA" in data[:60]:
            raise InputError(
                "this is a file of satellite clocks, which cancel in a baseline",
                file=path,
                cure="leave it out",
            )
        else:
            broadcast.append(read_navigation(path))
    if precise and not broadcast:
        raise InputError(
            "precise orbits alone do not suffice: broadcast ones give the times of transmission",
            file=precise[0].path,
            cure="give the navigation file of the day as well",
        )
    if not precise:
        return Orbits(tuple(broadcast))
    names = tuple(file.path.name for file in precise)
    return Orbits(tuple(broadcast), joined(precise), names)
