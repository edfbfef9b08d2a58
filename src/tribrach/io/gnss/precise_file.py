"""Precise orbits: reads SP3 files and writes the one SP3-c file that the engine needs.

The engine reads SP3 by line numbers: more satellites than 85, more comments than four or lines of
correlations put it out of step. So files are read here, several of them (neighbouring days) are put
together, and an SP3-c file of the satellites of the session is written. S. Hilla (2010, 2016), The
Extended Standard Product 3 Orbit Format, SP3-c and SP3-d.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.gnss.observation_file import seconds_of

__all__ = ["MOST_SATELLITES", "PreciseOrbits", "is_sp3", "joined", "read_sp3", "sp3_text"]


#: satellites that an SP3-c file can hold
MOST_SATELLITES = 85
#: seconds that time systems of SP3 are ahead of GPS time
_AHEAD = {"GPS": 0.0, "GAL": 0.0, "QZS": 0.0, "IRN": 0.0, "ccc": 0.0, "": 0.0, "BDT": -14.0,
          "TAI": 19.0}  # fmt: skip
#: the value of a clock that is not known [microseconds]
_NO_CLOCK = 999_999.0
_EPOCH = re.compile(rb"^\*  (\d{4}) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d\.\d+)", re.M)
_POSITION = re.compile(rb"^P([ A-Z][ \d]\d)(.*)$", re.M)
#: a line that none of the records of SP3 begins like
_LINE = re.compile(rb"^(?!\*  \d|P[ A-Z][ \d]\d|V|E[PVO]|/\*|[ \r]*$).*$", re.M)


@dataclass(frozen=True, eq=False)
class PreciseOrbits:
    """Orbits of satellites at epochs, in the Earth-fixed frame of the file.

    Attributes
    ----------
    path
        Where they were read.
    satellites
        m names such as ``G01``.
    times : (n,)
        GPS time [s] since 1980-01-06.
    xyz : (n, m, 3)
        Positions [m], NaN where there are none.
    clocks : (n, m)
        Errors of the clocks [s], NaN where there are none.
    """

    path: Path
    satellites: tuple[str, ...]
    times: Array
    xyz: Array
    clocks: Array


def is_sp3(data: bytes) -> bool:
    """True if the data begin as SP3 files do."""
    return re.match(rb"#[a-d][PV]", data) is not None


def read_sp3(path: Path, data: bytes) -> PreciseOrbits:
    """The orbits of an SP3 file.

    Parameters
    ----------
    path
        For messages.
    data
        Its unpacked content.

    Raises
    ------
    InputError
        Damaged, truncated, without orbits, or in a time system that is not known.
    """
    again = "download or transfer it again"
    begin = re.search(rb"^\*", data, re.M)
    if begin is None:
        raise InputError("the SP3 file has no epochs", file=path, cure=again)
    shift = _time_system(path, data[: begin.start()])
    if bad := _LINE.search(data, begin.start()):
        line = data.count(b"\n", 0, bad.start()) + 1
        raise InputError("the SP3 file is damaged", file=path, line=line, cure=again)
    if re.search(rb"^EOF", data, re.M) is None:
        raise InputError("the SP3 file ends before its last line", file=path, cure=again)
    epochs = list(_EPOCH.finditer(data, begin.start()))
    positions = list(_POSITION.finditer(data, begin.start()))
    if not positions or len(epochs) != len(re.findall(rb"^\*", data, re.M)):
        raise InputError("the SP3 file is damaged: epochs", file=path, cure=again)
    names = [match.group(1).replace(b" ", b"0").decode() for match in positions]
    names = [f"G{name[1:]}" if name[0] == "0" else name for name in names]
    values = _values(path, data, positions)
    at = np.searchsorted([e.start() for e in epochs], [match.start() for match in positions]) - 1
    satellites, which = np.unique(names, return_inverse=True)
    xyz = np.full((len(epochs), len(satellites), 3), np.nan)
    clocks = np.full(xyz.shape[:2], np.nan)
    there = (values[:, :3] != 0).all(axis=1)
    xyz[at[there], which[there]] = 1e3 * values[there, :3]
    known = there & (np.abs(values[:, 3]) < _NO_CLOCK)
    clocks[at[known], which[known]] = 1e-6 * values[known, 3]
    times = np.array(_times(path, epochs)) - shift
    return PreciseOrbits(path, tuple(satellites.tolist()), times, xyz, clocks)


def _time_system(path: Path, header: bytes) -> float:
    """Seconds that the times of a file are ahead of GPS time."""
    line = re.search(rb"^%c .{6}(\w{3})", header, re.M)
    name = "" if line is None else line.group(1).decode()
    if name not in _AHEAD:
        raise InputError(
            f"the times of the SP3 file are in {name}, which is not read",
            file=path,
            cure="give one in GPS time",
        )
    return _AHEAD[name]


def _values(path: Path, data: bytes, positions: Sequence[re.Match[bytes]]) -> Array:
    """X, Y, Z [km] and clock [microseconds] (n, 4) of position lines."""
    cells = [match.group(2)[k : k + 14] for match in positions for k in (0, 14, 28, 42)]
    cells = [cell.strip() or b"999999.999999" for cell in cells]
    try:
        out: Array = np.array(cells).astype(float).reshape(-1, 4)
        whole = bool(np.isfinite(out).all() and (np.abs(out[:, :3]) < 1e6 - 1).all())
    except ValueError:
        whole = False
    if not whole:
        number = re.compile(rb"( *-?\d+\.\d+){3}")
        bad = next((m for m in positions if number.match(m.group(2)[:42]) is None), positions[0])
        raise InputError(
            "the SP3 file is damaged: no numbers",
            file=path,
            line=data.count(b"\n", 0, bad.start()) + 1,
            cure="download or transfer it again",
        )
    return out


def _times(path: Path, epochs: Sequence[re.Match[bytes]]) -> list[float]:
    """Seconds (n,) of epoch lines in their own time system."""
    words = [tuple(float(word) for word in match.groups()) for match in epochs]
    rest = [(int(m), int(d), int(h), int(n), s) for _, m, d, h, n, s in words]
    try:
        return seconds_of([int(y) for y, *_ in words], rest)
    except ValueError as error:
        raise InputError(
            "the SP3 file has a date that does not exist",
            file=path,
            cure="download or transfer it again",
        ) from error


def joined(files: Sequence[PreciseOrbits]) -> PreciseOrbits:
    """Several files as one; where two have the same epoch and satellite, the later file counts."""
    satellites = sorted({name for file in files for name in file.satellites})
    times = np.unique(np.concatenate([file.times for file in files]))
    xyz = np.full((len(times), len(satellites), 3), np.nan)
    clocks = np.full(xyz.shape[:2], np.nan)
    for file in files:
        i = np.searchsorted(times, file.times)
        j = np.searchsorted(satellites, file.satellites)
        here = np.isfinite(file.xyz[:, :, 0])
        row, column = np.broadcast_to(i[:, None], here.shape), np.broadcast_to(j, here.shape)
        xyz[row[here], column[here]] = file.xyz[here]
        clocks[row[here], column[here]] = file.clocks[here]
    return PreciseOrbits(files[0].path, tuple(satellites), times, xyz, clocks)


def sp3_text(orbits: PreciseOrbits, wanted: Collection[str]) -> bytes:
    """An SP3-c file of some of the satellites.

    Parameters
    ----------
    orbits
        Times are written as GPS time.
    wanted
        Names of the satellites; the first 85 are written.
    """
    chosen = [k for k, name in enumerate(orbits.satellites) if name in wanted][:MOST_SATELLITES]
    names = [orbits.satellites[k] for k in chosen]
    lines = _header(names, orbits.times)
    for i, time in enumerate(orbits.times):
        lines.append(f"*  {_calendar(float(time))}")
        for name, k in zip(names, chosen, strict=True):
            x, y, z = np.nan_to_num(orbits.xyz[i, k]) / 1e3
            clock = 1e6 * orbits.clocks[i, k] if np.isfinite(orbits.clocks[i, k]) else 999999.999999
            lines.append(f"P{name}{x:14.6f}{y:14.6f}{z:14.6f}{clock:14.6f}")
    return "\n".join([*lines, "EOF", ""]).encode()


def _header(names: Sequence[str], times: Array) -> list[str]:
    """The 22 lines that an SP3-c file begins with."""
    first, step = float(times[0]), float(np.median(np.diff(times)))
    week, seconds = divmod(first, 604_800.0)
    days, share = divmod(first, 86_400.0)
    fill = [*names, *["  0"] * (MOST_SATELLITES - len(names))]
    count = f"+   {len(names):2d}   "
    system = "cccc cccc cccc cccc ccccc ccccc ccccc ccccc"
    return [
        f"#cP{_calendar(first)} {len(times):7d} ORBIT ITRF  HLM  TRI",
        f"## {int(week):4d} {seconds:15.8f} {step:14.8f} {44_244 + int(days):5d} "
        f"{share / 86_400:15.13f}",
        *(
            (count if k == 0 else "+        ") + "".join(fill[k : k + 17])
            for k in range(0, MOST_SATELLITES, 17)
        ),
        *["++       " + "  0" * 17] * 5,
        f"%c M  cc GPS ccc {system}",
        f"%c cc cc ccc ccc {system}",
        "%f  0.0000000  0.000000000  0.00000000000  0.000000000000000",
        "%f  0.0000000  0.000000000  0.00000000000  0.000000000000000",
        *["%i    0    0    0    0      0      0      0      0         0"] * 2,
        *["/*"] * 4,
    ]


def _calendar(seconds: float) -> str:
    """Date and time of an SP3 epoch."""
    at = datetime(1980, 1, 6) + timedelta(seconds=seconds)
    return (
        f"{at.year:4d} {at.month:2d} {at.day:2d} {at.hour:2d} {at.minute:2d} "
        f"{at.second + at.microsecond / 1e6:11.8f}"
    )
