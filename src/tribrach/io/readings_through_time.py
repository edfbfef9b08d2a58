"""Readings of total stations through time: ``time,station,target,direction_gon,zenith_gon,...``.

A CSV table as robotic total stations leave it. ``time`` is ISO 8601 (UTC where no offset is given;
local times over the end of summer time are refused, since one hour is there twice);
directions and zenith angles in gon or degrees, slope distances in metres, and if there are any
``prism_constant_mm``, which is added, and ``height_target_m``. Sights form a cycle until a pause.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import InputError, RefusalCollector
from tribrach.io.csv_rows import read_rows
from tribrach.io.number_table import time_of
from tribrach.units import GON, LARGEST, MM

#: of one sight: seconds, both ends, numbers and line
_Row = tuple[float, str, str, tuple[float, ...], int]
_HOUR = 3600.0
#: months in which summer time ends somewhere, and hours to which clocks are put back
_ENDS, _BACK = (2, 3, 4, 9, 10, 11), (23, 0, 1, 2)
_NAMES = ("time", "station", "target")
_ANGLES = {"_gon": GON, "_deg": float(np.pi / 180)}


@dataclass(frozen=True, eq=False)
class TimedReadings:
    """Sights in the order of time."""

    path: Path  #: of the file
    seconds: Array  #: (n,), since 1970, UTC
    #: names of both ends
    stations: tuple[str, ...]
    targets: tuple[str, ...]
    #: (n,), in radians
    direction: Array
    zenith: Array
    distance: Array  #: (n,), slope distances with the constants of the prisms [m]
    height_target: Array  #: (n,), over the marks [m]
    lines: Index  #: (n,), in the file

    def cycles(self, pause: float) -> list[Index]:
        """Numbers of the sights of each cycle; a pause [s] ends one."""
        ends = np.flatnonzero(np.diff(self.seconds) > pause) + 1
        return [part for part in np.split(np.arange(len(self.seconds)), ends) if len(part)]

    def digest(self, sights: Index) -> str:
        """What tells a cycle from any other."""
        parts = [self.seconds, self.direction, self.zenith, self.distance, self.height_target]
        text = "\n".join(f"{self.stations[k]}\t{self.targets[k]}" for k in sights.tolist())
        data = b"".join(np.ascontiguousarray(part[sights]).tobytes() for part in parts)
        return hashlib.sha256(text.encode() + data).hexdigest()[:16]


def read_timed_readings(path: Path) -> TimedReadings:
    """Read a table of readings through time."""
    given = read_rows(path)
    head, *cells = given.cells
    top, *lines = given.lines
    titles = [cell.strip().lower() for cell in head]
    places: dict[str, tuple[int, float]] = {}
    for k, title in enumerate(titles):
        name, factor = _column(title)
        if name is None:
            raise InputError(
                f"column {title!r} is unknown", file=path, line=top,
                cure="known are time, station, target, direction_gon or _deg, zenith_gon or _deg, "
                "slope_distance_m, prism_constant_mm, height_target_m",
            )  # fmt: skip
        if name in places:
            raise InputError(f"column {title!r} is there twice", file=path, line=top)
        places[name] = (k, factor)
    wanted = (*_NAMES, "direction", "zenith", "slope_distance")
    missing = [name for name in wanted if name not in places]
    if missing:
        raise InputError(f"there is no column {missing[0]}", file=path, line=top)
    table: list[_Row] = []
    with RefusalCollector() as refused:
        for line, row in zip(lines, cells, strict=True):
            with refused.record():
                table.append(_row(path, line, row, len(titles), places))
    if not table:
        raise InputError("the table has no readings", file=path, cure="give some")
    _refuse_double_hour(path, table, [cells[k][places["time"][0]] for k in range(len(cells))])
    table.sort(key=lambda row: row[0])
    values = np.array([row[3] for row in table])
    return TimedReadings(
        path,
        np.array([row[0] for row in table]),
        tuple(row[1] for row in table),
        tuple(row[2] for row in table),
        values[:, 0],
        values[:, 1],
        values[:, 2],
        values[:, 3],
        np.array([row[4] for row in table], dtype=np.int64),
    )


def _refuse_double_hour(path: Path, table: list[_Row], written: list[str]) -> None:
    """Refuse local times that an hour repeats, where the file is in the order of time otherwise.

    A clock that is put back steps back once, by an hour at most, for every station alike.
    """
    last: dict[str, int] = {}
    back: dict[str, list[int]] = {}
    for k, (seconds, station, *_) in enumerate(table):
        before = last.get(station)
        if before is not None and seconds < table[before][0]:
            back.setdefault(station, []).append(k)
        last[station] = k
    for station, steps in back.items():
        k = steps[0]
        before = max(j for j in range(k) if table[j][1] == station)
        when = datetime.fromtimestamp(table[k][0], UTC)
        zoned = datetime.fromisoformat(written[k].strip().replace("Z", "+00:00")).tzinfo is not None
        if (
            len(steps) == 1
            and not zoned
            and table[before][0] - table[k][0] <= _HOUR
            and when.month in _ENDS
            and when.hour in _BACK
        ):
            raise InputError(
                f"the times of {station} go back from {written[before].strip()} to "
                f"{written[k].strip()}, as local times do when summer time ends",
                file=path,
                line=table[k][4],
                cure="write UTC, or each time with its offset, such as 2025-10-26T02:00:00+02:00",
            )


def _column(title: str) -> tuple[str | None, float]:
    """What a column holds, and the factor to metres and radians."""
    if title in _NAMES:
        return title, 1.0
    for name in ("direction", "zenith"):
        for end, factor in _ANGLES.items():
            if title == name + end:
                return name, factor
    lengths = {
        "slope_distance_m": ("slope_distance", 1.0),
        "prism_constant_mm": ("prism_constant", MM),
        "height_target_m": ("height_target", 1.0),
    }
    return lengths.get(title, (None, 1.0))


def _row(
    path: Path, line: int, cells: list[str], width: int, places: dict[str, tuple[int, float]]
) -> _Row:
    """One sight."""
    if len(cells) != width:
        raise InputError(f"{len(cells)} cells instead of {width}", file=path, line=line)

    def text(name: str) -> str:
        cell = cells[places[name][0]].strip()
        if not cell:
            raise InputError(f"{name} is empty", file=path, line=line)
        return cell

    def value(name: str) -> float:
        if name not in places:
            return 0.0
        try:
            found = float(text(name))
        except ValueError:
            raise InputError(
                f"{name} is {text(name)!r}, which is no number", file=path, line=line
            ) from None
        if not abs(found) <= LARGEST:
            raise InputError(f"{name} is beyond any measurement", file=path, line=line)
        return found * places[name][1]

    seconds = time_of(path, line, text("time"))
    distance = value("slope_distance") + value("prism_constant")
    if not distance > 0:
        raise InputError("the slope distance is not positive", file=path, line=line)
    numbers = (value("direction"), value("zenith"), distance, value("height_target"))
    return seconds, text("station"), text("target"), numbers, line
