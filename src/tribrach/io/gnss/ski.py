"""Leica SKI-ASCII (``.asc``): points and baselines of SKI-Pro, Geo Office and Infinity.

A line begins with two characters that say what it holds. ``@%`` is the head, ``@#`` a point with
geocentric coordinates; a baseline is ``@+`` with its reference point and that point's coordinates,
``@-`` with the other point and the vector between the marks, and ``@=`` with the standard deviation
of unit weight and the upper half of the cofactors, whose product is the covariance. ``@*`` is the
first common epoch. Antenna heights (``@:``, ``@;``) are applied already; ``@&`` and ``@E`` repeat
what the baselines tell.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy import frames
from tribrach.io.gnss.records import GnssRecords
from tribrach.io.gnss.vector_text import covariance, numbers
from tribrach.io.totalstation.text import read_lines

_HEAD = re.compile(r"@%\s*([^:]+?)\s*:\s*(.*?)\s*$")
#: a name, which may have blanks in it, and three numbers
_PLACE = re.compile(r"@.(?P<name>.*?\S)\s+(?P<x>\S+)\s+(?P<y>\S+)\s+(?P<z>\S+)\s*$")
_POINT = re.compile(
    r"@#(?P<name>.*?\S)\s+(?P<x>[-+.\d]\S*)\s+(?P<y>[-+.\d]\S*)\s+(?P<z>[-+.\d]\S*)"
    r"(?:\s+(?P<kind>[A-Z]+)\b.*)?$"
)
#: points of which the file is surest come first
_RANK = ("REF", "ADJ", "MEAN", "AVGE", "MEAS")
#: what a line is cured with that has another number of values
_EXPORT = "export the file again as SKI-ASCII"


def sniff(text: str) -> bool:
    """True if a text begins as a SKI-ASCII file."""
    return re.match(r"\s*@%\s*(Unit|Coordinate type|Reference ellipsoid)\s*:", text) is not None


@dataclass
class _Baseline:
    """A baseline whose lines have been read so far."""

    line: int
    start: str
    end: str = ""
    vector: Array | None = None
    covariance: Array | None = None
    broken: bool = False  #: one of its lines is refused


def read_ski(path: Path) -> GnssRecords:
    """Points and baselines of a SKI-ASCII file."""
    reader = _Reader(path)
    with RefusalCollector() as refused:
        for line, text in enumerate(read_lines(path), start=1):
            reader.line(line, text, refused)
        reader.close(refused)
        refused.settle()
        if not reader.vectors:
            raise InputError(
                "the file has no baselines",
                file=path,
                cure="export them with their vectors and covariances",
            )
    records = reader.records
    records.vectors, records.blocks = np.array(reader.vectors), np.array(reader.blocks)
    return records


class _Reader:
    """Goes through the lines of a file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.records = GnssRecords()
        self.ranks: dict[str, int] = {}
        self.open: _Baseline | None = None
        self.vectors: list[Array] = []
        self.blocks: list[Array] = []

    def line(self, line: int, text: str, refused: RefusalCollector) -> None:
        """One line; one that is refused breaks its baseline."""
        takes = {
            "@%": self._head,
            "@#": self._point,
            "@-": self._vector,
            "@=": self._precision,
            "@*": self._epoch,
        }
        start = text[:2]
        if start in ("@+", "@#"):
            self.close(refused)
        before = refused.count
        with refused.record():
            if start == "@+":
                self._reference(line, text)
            elif start in takes:
                takes[start](line, text)
        if refused.count > before and self.open is not None:
            self.open.broken = True

    def close(self, refused: RefusalCollector) -> None:
        """Take the baseline that is open."""
        baseline, self.open = self.open, None
        if baseline is None or baseline.broken:
            return
        if baseline.vector is None or baseline.covariance is None:
            what = "vector (@-)" if baseline.vector is None else "covariance (@=)"
            refused.add(self._error(baseline.line, f"the baseline has no {what}", _EXPORT))
            return
        self.vectors.append(baseline.vector)
        self.blocks.append(baseline.covariance)
        self.records.start.append(baseline.start)
        self.records.end.append(baseline.end)
        self.records.vector_sources.append(f"{self.path.name}:{baseline.line}")

    def _error(self, line: int, what: str, cure: str | None = None) -> InputError:
        return InputError(what, file=self.path, line=line, cure=cure)

    def _head(self, line: int, text: str) -> None:
        """Units and kind of the coordinates."""
        match = _HEAD.match(text)
        if match is None:
            return
        key, value = match[1].lower(), match[2]
        if key == "unit" and value.lower() not in ("m", "meter", "metre", "meters", "metres"):
            raise self._error(line, f"lengths are in {value!r}", "export the file in metres")
        if key == "coordinate type" and value.lower() != "cartesian":
            cure = "export the file with WGS 84 Cartesian coordinates"
            raise self._error(line, f"coordinates are {value!r}, not Cartesian", cure)

    def _point(self, line: int, text: str) -> None:
        """Approximate coordinates of a point, the surest of those that the file has."""
        match = _POINT.match(text)
        if match is None:
            raise self._error(line, "a point needs a name and three coordinates", _EXPORT)
        kind = match["kind"] or ""
        rank = _RANK.index(kind) if kind in _RANK else len(_RANK)
        xyz = numbers([match[axis] for axis in "xyz"], "the coordinates", self.path, line)
        self._approximate(match["name"], xyz, rank)

    def _approximate(self, name: str, xyz: Array, rank: int) -> None:
        if rank < self.ranks.get(name, len(_RANK) + 2) and np.linalg.norm(xyz) > 1e6:
            self.ranks[name], self.records.approximate[name] = rank, xyz

    def _reference(self, line: int, text: str) -> None:
        """Begin a baseline: its reference point and that point's coordinates."""
        match = _PLACE.match(text)
        if match is None:
            raise self._error(line, "a reference point needs a name and coordinates", _EXPORT)
        self.open = _Baseline(line, match["name"])
        xyz = numbers([match[axis] for axis in "xyz"], "the coordinates", self.path, line)
        self._approximate(match["name"], xyz, len(_RANK) + 1)

    def _vector(self, line: int, text: str) -> None:
        match = _PLACE.match(text)
        if match is None or self.open is None or self.open.vector is not None:
            raise self._error(line, "a vector (@-) stands without a reference point (@+)", _EXPORT)
        if match["name"] == self.open.start:
            raise self._error(line, f"the baseline begins and ends at {self.open.start}")
        self.open.end = match["name"]
        self.open.vector = numbers([match[axis] for axis in "xyz"], "the vector", self.path, line)

    def _precision(self, line: int, text: str) -> None:
        """Standard deviation of unit weight and cofactors of the vector."""
        words = text[2:].split()
        if len(words) != 7 or self.open is None:
            raise self._error(
                line, "a covariance (@=) needs sigma0, six cofactors and a baseline", _EXPORT
            )
        sigma0, *upper = numbers(words, "the covariance", self.path, line)
        self.open.covariance = covariance(sigma0**2 * np.array(upper), self.path, line)

    def _epoch(self, line: int, text: str) -> None:
        """The first epoch of the first baseline is that of the file."""
        words = text[2:].split()
        if words and self.records.epoch is None:
            try:
                self.records.epoch = frames.decimal_year(words[0])
            except InputError as error:
                raise self._error(line, error.what, error.cure) from error
