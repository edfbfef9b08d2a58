"""DNA text files of DynAdjust: stations (``.stn``), measurements (``.msr``), geoid (``.geo``).

Fixed columns of versions 3.00 and 3.01. A geoid file has names in the first forty columns, then the
geoid height [m] and the deflections in the meridian and in the prime vertical [arc seconds].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.io.opened_files import lines_of
from tribrach.io.survey.dynadjust.records import (
    ARCSEC,
    SIGHTS,
    Entry,
    GnssCluster,
    RecordPlace,
    Records,
    StationRecord,
    TerrestrialRecord,
    number,
    packed_dms,
)
from tribrach.io.xml_file import read_bytes


def _columns(*edges: tuple[int, int]) -> tuple[slice, ...]:
    """Slices of columns from (start, width)."""
    return tuple(slice(start, start + width) for start, width in edges)


@dataclass(frozen=True)
class _Layout:
    """Columns of one version: station fields, GNSS value and variances, GNSS header."""

    station: tuple[slice, ...]
    gnss: tuple[slice, ...]
    header: tuple[slice, ...]


_LAYOUTS = {
    "3.00": _Layout(
        _columns((0, 20), (20, 3), (24, 3), (27, 14), (41, 14), (55, 14), (69, 3)),
        _columns((62, 14), (76, 14), (90, 14), (104, 14)),
        _columns((62, 7), (69, 7), (76, 7), (83, 7), (90, 14), (104, 14)),
    ),
    "3.01": _Layout(
        _columns((0, 20), (20, 3), (24, 3), (27, 20), (47, 20), (67, 20), (87, 3)),
        _columns((62, 20), (82, 20), (102, 20), (122, 20)),
        _columns((62, 10), (72, 10), (82, 10), (92, 10), (102, 20), (122, 20)),
    ),
}


#: columns that all versions have: stations, value, sigma and heights
_FIRST, _SECOND, _THIRD = _columns((2, 20), (22, 20), (42, 20))
_LINEAR, _DEGREES, _MINUTES, _SECONDS = _columns((62, 14), (76, 4), (80, 2), (82, 8))
_SIGMA, _INSTRUMENT, _TARGET = _columns((90, 9), (99, 7), (106, 7))


def parse(path: Path, refused: RefusalCollector) -> Records:
    """Records of one DNA file."""
    try:
        lines = lines_of(read_bytes(path).decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(
            "the file is not UTF-8 text", file=path, cure="save it as UTF-8"
        ) from error
    if path.suffix.lower() == ".geo":
        return _geoid(path, lines, refused)
    head = lines[0]
    layout = _LAYOUTS.get(head[6:12].strip())
    kind = head[12:15].upper()
    if head[:6].upper() != "!#=DNA" or layout is None or kind not in ("STN", "MSR"):
        raise InputError(
            "the first line is not the header of a DNA 3 station or measurement file",
            file=path,
            line=1,
            cure="it reads like '!#=DNA 3.01 STN  13.12.2018  GDA2020  01.01.2020  43'",
        )
    records = Records(str(path), head[29:43].strip(), head[43:57].strip())
    reader = _Reader(records, layout, lines, refused)
    if kind == "STN":
        reader.stations()
    else:
        reader.measurements()
    return records


#: columns of names in a geoid file
_GEOID_NAME = 40
#: limits of what a geoid file can mean: geoid heights [m], deflections [arc seconds]
_GEOID_LIMITS = (200.0, 200.0, 200.0)


def _geoid(path: Path, lines: Sequence[str], refused: RefusalCollector) -> Records:
    """Geoid heights and deflections of a file, by the names of stations."""
    records = Records(str(path), "", "")
    for number_, line in enumerate(lines, start=1):
        if not line.strip() or line.startswith(("#", "*", "!")):
            continue
        place = RecordPlace(records.file, number_)
        name, words = line[:_GEOID_NAME].strip(), line[_GEOID_NAME:].split()
        with refused.record():
            if not name or len(words) != 3:
                raise place.error(
                    "a line of a geoid file is a name and three numbers",
                    "give geoid height and both deflections behind column 40",
                )
            n, xi, eta = (number(word, f"the geoid at {name}", place) for word in words)
            if not all(abs(v) < most for v, most in zip((n, xi, eta), _GEOID_LIMITS, strict=True)):
                raise place.error(
                    f"the geoid at {name} has {n:g} m, {xi:g} and {eta:g} arcsec",
                    "give metres and arc seconds",
                )
            if name in records.geoid:
                raise place.error(f"the geoid at {name} is there twice", "remove one")
            records.geoid[name] = (n, xi * ARCSEC, eta * ARCSEC)
    return records


class _Reader:
    """Goes through the lines of a file."""

    def __init__(
        self, records: Records, layout: _Layout, lines: Sequence[str], refused: RefusalCollector
    ) -> None:
        self.records, self.layout, self.refused = records, layout, refused
        self.lines = [
            (RecordPlace(records.file, number), line)
            for number, line in enumerate(lines, start=1)
            if number > 1 and line.strip() and not line.startswith("*")
        ]
        self.next = 0

    def stations(self) -> None:
        """All stations."""
        for place, line in self.lines:
            name, constraints, kind, *values, zone = (line[c].strip() for c in self.layout.station)
            if not name or not constraints or not kind:
                what = "a station line needs a name, constraints and a coordinate type"
                self.refused.add(place.error(what))
                continue
            x, y, z = values
            self.records.stations.append(
                StationRecord(name, constraints, kind, (x, y, z), zone, place)
            )

    def measurements(self) -> None:
        """All measurements."""
        while self.next < len(self.lines):
            before = self.refused.count
            with self.refused.record():
                self.measurement()
            if self.refused.count > before:
                self.skip()

    def measurement(self) -> None:
        """The next measurement with all of its lines."""
        place, line = self.take("a measurement")
        kind, ignored = line[0].upper(), line[1:2] == "*"
        if kind in "GXY":
            self.cluster(kind, ignored, place, line)
        elif kind == "D":
            self.directions(ignored, place, line)
        elif kind in SIGHTS:
            self.sight(kind, ignored, place, line)
        else:
            self.records.refuse(kind, ignored, place)

    def skip(self) -> None:
        """Go on to the next line that begins a measurement; clusters and sets have their count."""
        while self.next < len(self.lines):
            line = self.lines[self.next][1]
            counted = line[_THIRD].strip().isdigit() and line[_FIRST].strip()
            if not line[0].isspace() and (line[0].upper() not in "XYD" or counted):
                return
            self.next += 1

    def take(self, what: str) -> tuple[RecordPlace, str]:
        """The next line."""
        if self.next == len(self.lines):
            raise RecordPlace(self.records.file, None).error(
                f"the file ends where {what} should follow"
            )
        self.next += 1
        return self.lines[self.next - 1]

    def cluster(self, kind: str, ignored: bool, place: RecordPlace, line: str) -> None:
        """Header and entries of a G, X or Y measurement."""
        n = 1 if kind == "G" else _count(line, place)
        *scales, frame, epoch = (line[c].strip() for c in self.layout.header)
        v, p, lam, h = (number(text or "1", "a scale", place) for text in scales)
        entries = [self.entry(place, line, n - 1, ignored)]
        for k in range(1, n):
            where, entry = self.take(f"entry {k + 1} of {n} of the cluster")
            if entry[0].upper() != kind:
                raise where.error(
                    f"entry {k + 1} of {n} of the {kind} cluster of {place} is missing"
                )
            entries.append(self.entry(where, entry, n - 1 - k, ignored))
        self.records.clusters.append(
            GnssCluster(
                kind,
                (line[_SECOND].strip() or "XYZ") if kind == "Y" else "XYZ",
                entries,
                (v, p, lam, h),
                frame or self.records.frame,
                epoch or self.records.epoch,
                place,
            )
        )

    def entry(self, place: RecordPlace, line: str, following: int, ignored: bool) -> Entry:
        """Three lines of values and variances, then three lines for each covariance block."""
        rows = [self.take("the components of a GNSS measurement") for _ in range(3)]
        value, *columns = self.layout.gnss
        variance = [
            number(rows[i][1][columns[j]], "a variance", rows[i][0])
            for j in range(3)
            for i in range(j, 3)
        ]
        blocks = [self.block() for _ in range(following)]
        x, y, z = (text[value].strip() for _, text in rows)
        return Entry(
            line[_FIRST].strip(),
            line[_SECOND].strip(),
            (x, y, z),
            tuple(variance),
            blocks,
            ignored or line[1:2] == "*",
            place,
        )

    def block(self) -> Array:
        """A 3x3 covariance block."""
        rows = [self.take("a covariance block") for _ in range(3)]
        return np.array(
            [
                [number(line[c], "a covariance", place) for c in self.layout.gnss[1:]]
                for place, line in rows
            ]
        )

    def directions(self, ignored: bool, place: RecordPlace, line: str) -> None:
        """A set: the first line names instrument, first target and how many directions follow."""
        name = f"orientation of {line[_FIRST].strip()} ({place})"
        first = line[_FIRST].strip()
        self.add("D", (first, line[_SECOND].strip()), ignored, place, line, name)
        for k in range(_count(line, place)):
            where, entry = self.take(f"direction {k + 2} of the set")
            if entry[0].upper() != "D" or entry[_FIRST].strip():
                raise where.error(f"direction {k + 2} of the set of {place} is missing")
            off = ignored or entry[1:2] == "*"
            self.add("D", (first, entry[_THIRD].strip()), off, where, entry, name)

    def sight(self, kind: str, ignored: bool, place: RecordPlace, line: str) -> None:
        """A measurement on one line."""
        names = tuple(line[c].strip() for c in (_FIRST, _SECOND, _THIRD)[: SIGHTS[kind][0]])
        self.add(kind, names, ignored, place, line, "")

    def add(
        self,
        kind: str,
        names: tuple[str, ...],
        ignored: bool,
        place: RecordPlace,
        line: str,
        set_name: str,
    ) -> None:
        """Add the measurement of one line."""
        if not all(names):
            raise place.error(f"a measurement of type {kind} needs {len(names)} station names")
        angular = SIGHTS[kind][1]
        if angular and len(names) == 1 and line[_LINEAR].strip():
            # a latitude or longitude stands where lengths do, as degrees.minutesseconds
            value = packed_dms(line[_LINEAR], "the value", place)
        else:
            value = _angle(line, place) if angular else number(line[_LINEAR], "the value", place)
        sigma = number(line[_SIGMA], "the standard deviation", place)
        instrument, target = (
            number(line[c].strip() or "0", "a height", place) for c in (_INSTRUMENT, _TARGET)
        )
        sigma *= ARCSEC if angular else 1.0
        self.records.sights.append(
            TerrestrialRecord(
                kind, names, value, sigma, instrument, target, ignored, place, set_name
            )
        )


def _count(line: str, place: RecordPlace) -> int:
    """Number of entries in a cluster or of further directions in a set."""
    text = line[_THIRD].strip()
    if not text.isdigit() or int(text) < 1:
        raise place.error(f"the number of entries is {text!r}, not a count")
    return int(text)


def _angle(line: str, place: RecordPlace) -> float:
    """Degrees, minutes and seconds in their columns [rad]."""
    degrees, minutes, seconds = (line[c].strip() for c in (_DEGREES, _MINUTES, _SECONDS))
    d, m, s = (number(text, "an angle", place) for text in (degrees, minutes, seconds))
    if not (0 <= m < 60 and 0 <= s < 60):
        raise place.error(f"minutes {minutes} and seconds {seconds} do not stay below 60")
    sign = -1.0 if degrees.startswith("-") else 1.0
    return sign * (abs(d) + m / 60 + s / 3600) * pi / 180
