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

__all__ = ["NavigationFile", "read_navigation"]

#: first line of a record in RINEX 2 and 3: satellite, date and time
_RECORD_2 = re.compile(
    rb"^([ \d]\d) (\d\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d)((?: {2}| \d|\d\d)\d\.\d)", re.M
)
_RECORD_3 = re.compile(
    rb"^([GREJCIS])([ \d]\d) (\d{4}) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d)", re.M
)
_LINE = re.compile(rb"^.+$", re.M)
#: what a line of a record may consist of
_NUMBERS = re.compile(rb"^(?:[GREJCIS][ \d]\d)?[ \d+.DEde-]*\r?$")
#: RINEX 2 keeps one system in a file: the letter of the file's type gives it
_SYSTEMS_2 = {"N": "G", "G": "R", "H": "S"}


@dataclass(frozen=True)
class NavigationFile:
    """Broadcast orbits of one file.

    Attributes
    ----------
    path
        Where it was read.
    text
        Plain RINEX.
    satellites : (n,)
        Names such as ``G07``.
    times : (n,)
        Of their clocks [s] since 1980-01-06.
    """

    path: Path
    text: bytes
    satellites: NDArray[np.str_]
    times: NDArray[np.float64]


def read_navigation(path: Path) -> NavigationFile:
    """Satellites and times of a navigation file.

    Raises
    ------
    InputError
        Not a navigation file, damaged, or without orbits.
    """
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
    _check_lines(path, data, start, records)
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


def _check_lines(path: Path, data: bytes, start: int, records: list[re.Match[bytes]]) -> None:
    """Refuse lines that are no numbers, and a last record shorter than the one before it."""
    for match in _LINE.finditer(data, start):
        if not _NUMBERS.match(match.group()):
            raise InputError(
                "the navigation file is damaged: no numbers",
                file=path,
                line=data.count(b"\n", 0, match.start()) + 1,
                cure="download or transfer it again",
            )
    if len(records) < 2:
        return
    last = data[records[-1].start() :].rstrip()
    # other systems have other lengths: the shortest record has four lines
    same = [m for m in records[:-1] if m.group()[:1] == last[:1]] or records[:-1]
    k = records.index(same[-1])
    whole = data[records[k].start() : records[k + 1].start()].rstrip()
    lines, model = last.split(b"\n"), whole.split(b"\n")
    # without its newline the last line may have lost its end
    cut = not data.endswith((b"\n", b"\r")) and len(lines[-1]) < len(model[-1])
    if len(lines) != len(model) or cut:
        raise InputError(
            "the navigation file ends within a record",
            file=path,
            line=data.count(b"\n") + 1,
            cure="download or transfer it again",
        )
