"""Text with one point in a line: .xyz, .txt, .csv, .asc, plain or compressed.

Columns are named by a first line of words, as a comment or not; otherwise their number tells.
Values are separated by blanks, commas, semicolons or tabs. A count of the points may stand before
them. The format has no place for a scanner.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.scans.columns import arranged, known_name
from tribrach.io.scans.origin import assumed_origin, bounds_of, scan_name
from tribrach.io.scans.text import BLANKS, LineBlock, Lines, Mark, delimiters
from tribrach.io.scans.text_scan import TextScan, rows, short
from tribrach.io.unpacking import unpacked
from tribrach.scan.scan import Scan

__all__ = ["XyzScan", "numeric", "read"]


_COMMENTS = (b"#", b"//", b"%", b"!", b"'")
#: lines before the points, at most
_HEAD = 200
#: colours are whole numbers up to this
_COLOUR = 65535


class XyzScan(TextScan):
    """The points of a text file."""


@dataclass
class _Head:
    """The lines before the points."""

    #: of the columns, empty if they are not named
    names: list[str]
    #: of the points, None if it is not stated
    count: int | None
    #: how many lines
    lines: int


def numeric(line: bytes) -> bool:
    """True for a line of numbers with blanks between them."""
    values = line.split()
    try:
        return bool(values) and [float(v) for v in values] != []
    except ValueError:
        return False


def read(path: Path) -> tuple[Scan, ...]:
    """The one scan of a file; the lines are counted on the way.

    Raises
    ------
    InputError
        No points, or no columns for x, y and z.
    """
    with unpacked(path) as file:
        lines = Lines(file, path)
        blanks = _blanks(lines.peek(_HEAD))
    with unpacked(path) as file:
        lines = Lines(file, path, blanks, Mark())
        head = _head(lines)
        lines.skip(head.lines)
        mark = lines.mark
        records, sample = lines.survey()
    if head.count is not None and head.count != records:
        raise short(path, head.count, records)
    if records == 0 and not head.names:
        raise InputError("the file has no points", file=path, cure="export it again")
    return (_scan(path, head, sample, records, blanks, mark),)


def _scan(
    path: Path, head: _Head, sample: list[bytes], records: int, blanks: bytes, mark: Mark
) -> XyzScan:
    """The scan, once its columns are known."""
    width = sample[0].count(b" ") + 1 if sample else len(head.names)
    values = rows(sample, width)
    warnings = []
    names = _unique(head.names)
    if len(names) != width or not {"x", "y", "z"} <= {known_name(n) for n in names}:
        if names and any(known_name(n) for n in names):
            what = f"{len(names)} columns are named ({', '.join(names[:12])}) and lines have "
            raise InputError(
                f"{what}{width} values", file=path, cure="name x, y, z and all other columns"
            )
        if width < 3:
            raise InputError("the file has no points x y z", file=path, cure="export it again")
        names = _guessed(values, width)
        if width > 3:
            warnings.append(f"the columns have no names; they are taken as {' '.join(names)}")
    types = dict.fromkeys(names, "float64")
    columns = dict(zip(names, values.T, strict=True))
    layout = arranged(types, columns, path)
    return XyzScan(
        name=scan_name(path),
        path=path,
        records=records,
        fields=layout.fields,
        origin=assumed_origin(bounds_of(layout.coordinates(columns))),
        warnings=tuple(warnings),
        mark=mark,
        first=head.lines,
        blanks=blanks,
        types=types,
        columns=layout,
    )


def _blanks(lines: list[bytes]) -> bytes:
    """Translation table for the delimiters of the first line of several numbers."""
    for line in lines:
        if line[:1] in b"+-.0123456789" and not line.isdigit():
            return delimiters(line)
    return BLANKS


def _head(lines: Lines) -> _Head:
    """The lines before the first line of several numbers."""
    head = _Head([], None, 0)
    following = lines.peek(_HEAD + 1)
    for k, line in enumerate(following[:_HEAD]):
        comment = line.startswith(_COMMENTS)
        if comment or not numeric(line):
            bare = line.lstrip(b"#/%!'").strip().decode("utf-8", errors="replace")
            known = {known_name(word) for word in bare.split()}
            if {"x", "y", "z"} <= known:
                head.names = bare.split()
            elif not comment:
                what = f"{bare[:40]!r} names no columns x, y and z, and is no point"
                number = lines.number(LineBlock(b"", 0, 0, Mark()), k)
                raise InputError(what, file=lines.path, line=number, cure="name the columns")
        elif line.isdigit() and head.count is None and _several(following[k + 1 : k + 2]):
            head.count = int(line[:30])
        else:
            break
        head.lines = k + 1
    return head


def _several(lines: list[bytes]) -> bool:
    """True if the first of these lines has three values or more."""
    return bool(lines) and len(lines[0].split()) >= 3


def _unique(names: list[str]) -> list[str]:
    """Names of which none occurs twice."""
    out: list[str] = []
    for name in names:
        while name in out:
            name += "_2"
        out.append(name)
    return out


def _guessed(values: Array, width: int) -> list[str]:
    """Names by the values of the columns: colours are whole numbers, normals have length one."""
    rest, names = values[:, 3:], ["x", "y", "z"]
    k = 0
    while k < width - 3:
        three = rest[:, k : k + 3]
        if three.shape[1] == 3 and "red" not in names and _colours(three):
            names += ["red", "green", "blue"]
            k += 3
        elif three.shape[1] == 3 and "nx" not in names and _normals(three):
            names += ["nx", "ny", "nz"]
            k += 3
        else:
            names.append("intensity" if "intensity" not in names else f"column_{k + 4}")
            k += 1
    return names


def _colours(three: Array) -> bool:
    """True if three columns hold whole numbers from 0 to 65535."""
    whole = (np.rint(three) == three).all() and (three >= 0).all() and (three <= _COLOUR).all()
    return bool(whole and len(three) > 0)


def _normals(three: Array) -> bool:
    """True if three columns are vectors of length one."""
    square = (np.clip(three, -2, 2) ** 2).sum(axis=1)
    return bool(len(three) > 0 and (np.abs(square - 1) < 0.02).mean() > 0.9)
