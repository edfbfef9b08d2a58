"""Satellites and times of the broadcast orbits in a RINEX navigation file.

The engine reads the orbits themselves; here the file is checked to be whole.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.gnss.observation_file import header_of, header_text, seconds_of
from tribrach.io.gnss.rinex_file import read_rinex

#: first line of a record in RINEX 2 and 3: satellite, date and time
_RECORD_2 = re.compile(
    rb"^([ \d]\d) (\d\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d)((?: {2}| \d|\d\d)\d\.\d)", re.M
)
_RECORD_3 = re.compile(
    rb"^([GREJCIS])([ \d]\d) (\d{4}) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d)", re.M
)
#: a number of a record, in a column of its own
_NUMBER = re.compile(rb" *[-+]?(?:\d+\.?\d*|\.\d+)(?:[DdEe][-+ ]?\d{1,3})? *")
_WIDTH = 19
#: lines of a record by system; since RINEX 3.05 GLONASS may have one more
_LINES = dict.fromkeys("GECJI", (8, 8)) | {"R": (4, 5), "S": (4, 4)}
#: numbers that every line has at least: clocks, and elements of which some are spare
_FIRST, _MIDDLE = 3, 3
#: and the last line, with the time of transmission; records of four lines have no spare numbers
_LAST = dict.fromkeys("GECJI", 1) | dict.fromkeys("RS", 4)
_AGAIN = "download or transfer it again"
#: RINEX 2 keeps one system in a file: the letter of the file's type gives it
_SYSTEMS_2 = {"N": "G", "G": "R", "H": "S"}


@dataclass(frozen=True)
class NavigationFile:
    """Broadcast orbits of one file."""

    path: Path  #: where it was read
    text: bytes  #: plain RINEX
    satellites: NDArray[np.str_]  #: (n,), names such as ``G07``
    times: NDArray[np.float64]  #: (n,), of their clocks [s] since 1980-01-06


def read_navigation(path: Path) -> NavigationFile:
    """Satellites and times of a navigation file."""
    data = read_rinex(path)
    lines, start = header_text(path, data)
    version, kind = header_of(path, lines)
    letter = kind[:1].upper()
    if letter not in _SYSTEMS_2:
        raise InputError(
            f"this is RINEX of type {kind[:20].strip() or '?'}, not navigation data",
            file=path,
            cure="give the navigation file here",
        )
    names, years, rest = [], [], []
    records = list((_RECORD_3 if version >= 3 else _RECORD_2).finditer(data, start))
    _check_records(path, data, start, records, None if version >= 3 else _SYSTEMS_2[letter])
    for match in records:
        words = match.groups()
        system = words[0].decode() if version >= 3 else _SYSTEMS_2[letter]
        number, year, *date = (float(word) for word in words[version >= 3 :])
        names.append(f"{system}{int(number):02d}")
        years.append(int(year) if year > 99 else int(year) + (1900 if year >= 80 else 2000))
        seconds = date[4] if len(date) > 4 else 0.0
        rest.append((int(date[0]), int(date[1]), int(date[2]), int(date[3]), seconds))
    if not names:
        raise InputError("the file has no orbits", file=path, cure="give a whole navigation file")
    try:
        times = np.array(seconds_of(years, rest))
    except ValueError as error:
        raise InputError(
            "the navigation file has a date that does not exist",
            file=path,
            cure="download or transfer it again",
        ) from error
    return NavigationFile(path, data, np.array(names), times)


def _check_records(
    path: Path, data: bytes, start: int, records: list[re.Match[bytes]], system: str | None
) -> None:
    """Refuse records that have other lines or numbers than those of their system."""
    if not records:
        return
    ends = [match.start() for match in records[1:]] + [len(data)]
    if data[start : records[0].start()].strip():
        raise _damaged(path, data, start, "is damaged: no record begins here")
    before: dict[str, list[bytes]] = {}
    for match, end in zip(records, ends, strict=True):
        lines = data[match.start() : end].rstrip().split(b"\n")
        name = system or match.group(1).decode()
        at = match.start()
        for k, line in enumerate(lines):
            least = _FIRST if k == 0 else _LAST[name] if k == _LINES[name][0] - 1 else _MIDDLE
            margin = (22 if k == 0 else 3) + (system is None)
            _check_line(path, data, at, line.rstrip(b"\r"), margin, least)
            at += len(line) + 1
        model = before.get(name)
        low, high = _LINES[name] if model is None else (len(model), len(model))
        last = end == len(data)
        if not low <= len(lines) <= high:
            words = f"has {len(lines)} lines in a record of {name} where {low} belong"
            raise _damaged(
                path, data, at - 1, f"ends within a record: it {words}" if last else words
            )
        if last and not data.endswith((b"\n", b"\r")):
            # without its newline the last line may have lost its end
            short = model is not None and len(lines[-1]) < len(model[-1].rstrip())
            if short or (len(lines[-1]) - margin) % _WIDTH:
                raise _damaged(path, data, at - 1, "ends within a record")
        before[name] = lines


def _check_line(path: Path, data: bytes, at: int, line: bytes, margin: int, least: int) -> None:
    """Refuse a line with too few numbers, or with anything else in their columns."""
    cells = [line[k : k + _WIDTH] for k in range(margin, len(line), _WIDTH)]
    if len(cells) < least:
        raise _damaged(path, data, at, f"has {len(cells)} numbers in a line of at least {least}")
    for cell in cells:
        if not _NUMBER.fullmatch(cell) and cell.strip():
            raise _damaged(path, data, at, "is damaged: no numbers")
    if line[:margin].strip() and margin < 22:
        raise _damaged(path, data, at, "is damaged: numbers outside of their columns")


def _damaged(path: Path, data: bytes, at: int, what: str) -> InputError:
    """The error at a byte of a file."""
    line = data.count(b"\n", 0, min(at, len(data))) + 1
    return InputError(f"the navigation file {what}", file=path, line=line, cure=_AGAIN)
