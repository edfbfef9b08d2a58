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
from math import comb
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.gnss.observation_file import seconds_of

#: satellites that an SP3-c file can hold
MOST_SATELLITES = 85
#: seconds that time systems of SP3 are ahead of GPS time
_AHEAD = {"GPS": 0.0, "GAL": 0.0, "QZS": 0.0, "IRN": 0.0, "ccc": 0.0, "": 0.0, "BDT": -14.0,
          "TAI": 19.0}  # fmt: skip
#: the value of a clock that is not known [microseconds]
_NO_CLOCK = 999_999.0
#: positions are between these distances from the centre of the Earth [m]
_LOWEST, _HIGHEST = 6.5e6, 5e7
#: order of the differences that show a position beside its orbit, and from where on [m]: manoeuvres
#: of 1 m/s make a tenth of it
_ORDER, _STRANGE = 8, 3.5e5
#: epochs are told apart by this [s], so that none lie closer
_SAME_TIME = 1e-3
#: the Earth: gravitational constant [m^3/s^2], rotation [rad/s]
_GM, _OMEGA = 3.986004418e14, 7.292115e-5
_AGAIN = "download or transfer it again"
_EPOCH = re.compile(rb"^\*  (\d{4}) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d\.\d+)", re.M)
_POSITION = re.compile(rb"^P([ A-Z][ \d]\d)(.*)$", re.M)
#: a line that none of the records of SP3 begins like
_LINE = re.compile(rb"^(?!\*  \d|P[ A-Z][ \d]\d|V|E[PVO]|/\*|[ \r]*$).*$", re.M)


@dataclass(frozen=True, eq=False)
class PreciseOrbits:
    """Orbits of satellites at epochs, in the Earth-fixed frame of the file."""

    path: Path  #: where they were read
    satellites: tuple[str, ...]  #: m names such as ``G01``
    times: Array  #: (n,), GPS time [s] since 1980-01-06
    xyz: Array  #: (n, m, 3), positions [m], NaN where there are none
    clocks: Array  #: (n, m), errors of the clocks [s], NaN where there are none


def is_sp3(data: bytes) -> bool:
    """True if the data begin as SP3 files do."""
    return re.match(rb"#[a-d][PV]", data) is not None


def read_sp3(path: Path, data: bytes) -> PreciseOrbits:
    """The orbits of an SP3 file."""
    again = _AGAIN
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
    header = _Header.of(path, data[: begin.start()])
    own_times = np.array(_times(path, epochs))
    _check_times(path, data, header, epochs, own_times)
    names = [_name(match.group(1)) for match in positions]
    values = _values(path, data, positions)
    at = np.searchsorted([e.start() for e in epochs], [match.start() for match in positions]) - 1
    satellites, which = np.unique(names, return_inverse=True)
    lines = np.full((len(epochs), len(satellites)), -1)
    for k, (i, j) in enumerate(zip(at.tolist(), which.tolist(), strict=True)):
        if lines[i, j] >= 0:
            raise _at(path, data, positions[k], f"has {names[k]} twice at one epoch")
        lines[i, j] = k
    _check_satellites(path, data, header, epochs, satellites.tolist(), lines >= 0)
    xyz = np.full((len(epochs), len(satellites), 3), np.nan)
    clocks = np.full(xyz.shape[:2], np.nan)
    there = (values[:, :3] != 0).all(axis=1)
    xyz[at[there], which[there]] = 1e3 * values[there, :3]
    known = there & (np.abs(values[:, 3]) < _NO_CLOCK)
    clocks[at[known], which[known]] = 1e-6 * values[known, 3]
    found = _strange_place(own_times, xyz)
    if found is not None:
        i, j, what = found
        raise _at(path, data, positions[lines[i, j]], f"has {satellites[j]} {what}")
    return PreciseOrbits(path, tuple(satellites.tolist()), own_times - shift, xyz, clocks)


@dataclass(frozen=True)
class _Header:
    """What the header of a file promises."""

    epochs: int  #: number of epochs
    step: float  #: seconds between them
    satellites: tuple[str, ...]  #: names, in the order of the header

    @classmethod
    def of(cls, path: Path, header: bytes) -> _Header:
        """The header of a file."""
        lines = header.splitlines()
        listed = [line for line in lines if line[:1] == b"+" and line[:2] != b"++"]
        second = next((line for line in lines if line.startswith(b"##")), b"")
        try:
            count, step = int(lines[0][32:39]), float(second[24:38])
            many = int(listed[0][3:6])
            cells = [line[k : k + 3] for line in listed for k in range(9, 60, 3)][:many]
            names = tuple(_name(cell) for cell in cells)
            if not (_SAME_TIME <= step < 1e6 and len(names) == many and len(set(names)) == many):
                raise ValueError("no header")
        except (ValueError, IndexError) as error:
            raise InputError(
                "the header of the SP3 file is damaged: number of epochs, interval or satellites",
                file=path,
                line=1,
                cure=_AGAIN,
            ) from error
        return cls(count, step, names)


def _name(cell: bytes) -> str:
    """A satellite such as ``G01``; SP3-a has numbers only."""
    name = cell.replace(b" ", b"0").decode("ascii")
    return f"G{name[1:]}" if name[0] == "0" else name


def _at(path: Path, data: bytes, match: re.Match[bytes], what: str) -> InputError:
    """The error of a line."""
    line = data.count(b"\n", 0, match.start()) + 1
    return InputError(f"the SP3 file {what}", file=path, line=line, cure=_AGAIN)


def _check_times(
    path: Path, data: bytes, header: _Header, epochs: Sequence[re.Match[bytes]], times: Array
) -> None:
    """Refuse epochs that are doubled, out of order, out of step or not as many as promised."""
    steps = np.diff(times)
    # an epoch may be missing where the header knows it
    share = np.abs(steps / header.step - np.rint(steps / header.step))
    wrong = np.flatnonzero((steps <= 0) | (share * header.step > _SAME_TIME))
    if len(wrong):
        k = int(wrong[0])
        raise _at(
            path,
            data,
            epochs[k + 1],
            f"has an epoch {steps[k]:g} s after the one before, and its header says every "
            f"{header.step:g} s",
        )
    if len(epochs) != header.epochs:
        gap = int(np.argmax(steps)) + 1 if len(steps) and steps.max() > 1.5 * header.step else 0
        after = f", and a gap of {steps.max():g} s ends here" if gap else ""
        words = f"has {len(epochs)} epochs and its header promises {header.epochs}{after}"
        raise _at(path, data, epochs[gap], words)


def _check_satellites(
    path: Path,
    data: bytes,
    header: _Header,
    epochs: Sequence[re.Match[bytes]],
    satellites: Sequence[str],
    there: NDArray[np.bool_],
) -> None:
    """Refuse epochs (n, m) that lack a satellite of the header; unknown places are zeros."""
    for name in satellites:
        if name not in header.satellites:
            k = int(np.argmax(there[:, satellites.index(name)]))
            raise _at(path, data, epochs[k], f"has {name} at this epoch and not in its header")
    missing = np.flatnonzero(there.sum(axis=1) != len(header.satellites))
    if len(missing):
        k = int(missing[0])
        here = {name for name, is_there in zip(satellites, there[k], strict=True) if is_there}
        lost = next(name for name in header.satellites if name not in here)
        raise _at(path, data, epochs[k], f"has no line of {lost} at this epoch, as its header says")


def _strange_place(times: Array, xyz: Array) -> tuple[int, int, str] | None:
    """Epoch and satellite of a position that no orbit goes through, and what is wrong with it.

    Positions (n, m, 3) [m] of nine epochs in a row lie on a polynomial as far as their eighth
    difference shows: that of a circle of radius r is below ``r (w h)^8``, with w the angular speed
    against the turning Earth and h the step, metres for satellites of navigation every 15 minutes;
    a single position that is wrong by d makes up to 70 d of it, and d where it is first or last.
    """
    with np.errstate(invalid="ignore"):
        radius = np.linalg.norm(xyz, axis=2)
        bad = np.argwhere((radius < _LOWEST) | (radius > _HIGHEST))
    if len(bad):
        i, j = bad[0].tolist()
        return i, j, f"{radius[i, j] / 1e3:.0f} km from the centre of the Earth"
    weights = np.array([comb(_ORDER, k) * (-1) ** k for k in range(_ORDER + 1)], dtype=float)
    n = len(times) - _ORDER
    steps = np.diff(times)
    if n < 1:
        return None
    even = np.array([np.ptp(steps[k : k + _ORDER]) < _SAME_TIME for k in range(n)])
    moved = sum(w * xyz[k : k + n] for k, w in enumerate(weights))
    size = np.linalg.norm(moved, axis=2)
    speed = np.sqrt(_GM / radius[:n] ** 3) + _OMEGA
    natural = radius[:n] * (speed * steps[:n, None]) ** _ORDER
    with np.errstate(invalid="ignore"):
        excess = np.where(even[:, None] & (size > _STRANGE + 4 * natural), size, 0.0)
    if not excess.any():
        return None
    k = int(np.argmax(excess.max(axis=0)))
    # the epoch whose single error explains the differences around it
    apart = np.arange(len(times))[:, None] - np.arange(n)
    share = np.where((apart >= 0) & (apart <= _ORDER), weights[np.clip(apart, 0, _ORDER)], 0.0)
    wrong = np.nan_to_num(np.where(even[:, None], moved[:, k], 0.0))
    error = share @ wrong / np.square(share).sum(axis=1)[:, None]
    explained = np.square(error).sum(axis=1) * np.square(share).sum(axis=1)
    i = int(np.argmax(explained))
    return i, k, f"{np.linalg.norm(error[i]) / 1e3:.0f} km beside its orbit"


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
    """An SP3-c file of some of the satellites."""
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
