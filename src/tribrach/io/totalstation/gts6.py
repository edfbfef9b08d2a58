"""Topcon GTS-6 and GTS-210 memory (``.210``): one stream of marked fields.

``_'`` a station, ``_(`` its code, ``_)`` the height of the instrument, ``_+`` a target with its
readings, ``_*`` its code, ``_,`` its height. ``?`` begins slope distance [mm], zenith angle,
direction, horizontal distance; ``<`` angles alone; ``x``, ``y``, ``z`` coordinates [mm]. Some
files come in packets of 128 characters with a checksum.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from pathlib import Path

from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import angle, number, read_lines
from tribrach.units import UNITS

_START = re.compile(r"_'[^_]*_\([^_]*_\)")
_RECORD = re.compile(
    r"_'(?P<station>[^_]*)(?:_\((?P<code>[^_]*)_\)(?P<height>[^_]*))?"
    r"|_\+(?P<target>[^_]*)_ (?P<reading>[^_]*)(?:_\*(?P<mark>[^_]*))?(?:_,(?P<rod>[^_]*))?"
    r"|_(?P<other>.)[^_]*"
)
_POLAR = re.compile(r"\?([+-]\d{8})([mf])(\d{7})([+-]\d{7})([dg])")
_ANGLES = re.compile(r"<(\d{7})([+-]\d{7})([dg])")


def sniff(text: str) -> bool:
    """True if a text begins with a station of the stream."""
    return _START.match(text.lstrip("\x02\r\n ")) is not None


def read(path: Path) -> RawFile:
    """Read a file."""
    stream, starts = _stream(read_lines(path))
    recorder = Recorder(path, "Topcon GTS-6")
    for match in _RECORD.finditer(stream):
        line = bisect_right(starts, match.start())
        try:
            _record(recorder, line, match)
        except ValueError as error:
            recorder.problem(line, str(error))
    return recorder.finish()


def _stream(lines: list[str]) -> tuple[str, list[int]]:
    """The lines as one text, without the frame of packets, and the offset at which each begins."""
    parts: list[str] = []
    starts: list[int] = []
    size = 0
    for line in lines:
        part = line.strip("\x04\x1a")
        if part.startswith("\x02"):
            part = part[1:].split("\x03")[0][:-4]
        starts.append(size)
        parts.append(part)
        size += len(part)
    return "".join(parts), starts


def _record(recorder: Recorder, line: int, match: re.Match[str]) -> None:
    """One marked field of a station or a target."""
    field = match.groupdict()
    if field["other"] == " ":
        return  # blanks that fill the last packet
    if field["other"] is not None:
        recorder.unknown[f"field _{field['other']}"] += 1
    elif field["station"] is not None:
        height = number(field["height"] or "")
        recorder.setup(line, field["station"].strip(), height=height)
        recorder.understood["set-up"] += 1
    else:
        _sight(recorder, line, field)


def _sight(recorder: Recorder, line: int, field: dict[str, str | None]) -> None:
    """A target with its readings."""
    reading = field["reading"] or ""
    polar, angles = _POLAR.match(reading), _ANGLES.match(reading)
    if polar is not None:
        length, metric, zenith, direction, unit = polar.groups()
        distance = int(length) * (1e-3 if metric == "m" else 1e-3 * UNITS["ft"])
    elif angles is not None:
        zenith, direction, unit = angles.groups()
        distance = math.nan
    else:
        recorder.unknown[f"reading {reading[:1]}"] += 1
        return
    recorder.shot(
        line,
        (field["target"] or "").strip(),
        direction=_angle(direction, unit),
        zenith=_angle(zenith, unit),
        distance=distance,
        height=number(field["rod"] or ""),
        code=(field["mark"] or "").strip(),
    )
    recorder.understood["sight"] += 1


def _angle(digits: str, unit: str) -> float:
    """An angle written as ``DDDMMSS``, or in gon with four decimals."""
    return angle(f"{digits[:-4]}.{digits[-4:]}", "dms" if unit == "d" else "gon")
