"""PLY: text, or binary of either byte order; the points are the element ``vertex``.

The format has no place for a scanner. Elements after the vertices (faces) are passed over. Comments
``crs: ...`` give the reference system, as our own writer puts it there; others are kept as facts.

The header is read here and not by plyfile, whose licence (GPL-3) does not go with ours.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tribrach.errors import InputError
from tribrach.io.scans.columns import arranged
from tribrach.io.scans.origin import assumed_origin, bounds_of, scan_name
from tribrach.io.scans.records import RecordScan, sampled
from tribrach.io.scans.text import Lines, Mark
from tribrach.io.scans.text_scan import TextScan, rows, short
from tribrach.io.unpacking import unpacked
from tribrach.scan.scan import Scan

#: longest header [bytes]
_HEADER = 1 << 18
_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
_Order = Literal["=", "<", ">"]
_ORDERS: dict[str, _Order] = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_CURE = "export the file again"


class PlyScan(RecordScan):
    """The vertices of a binary file."""


class PlyTextScan(TextScan):
    """The vertices of an ASCII file."""


@dataclass
class _Element:
    """An element of the header."""

    #: as in the file
    name: str
    count: int
    #: numpy type of each property by name, None for a list
    types: dict[str, str | None] = field(default_factory=dict)

    @property
    def fixed(self) -> bool:
        """True if all records of the element have the same length."""
        return None not in self.types.values()

    def dtype(self, order: _Order) -> np.dtype[Any]:
        """A record of this element without its lists."""
        pairs = [(n, np.dtype(t).newbyteorder(order)) for n, t in self.types.items() if t]
        return np.dtype(pairs)


@dataclass
class _Header:
    """The header of a file."""

    order: _Order | None  #: byte order, ``=`` for text
    elements: list[_Element]  #: in the file's order
    facts: dict[str, str]  #: comments by their key
    #: bytes and lines of the header
    size: int
    lines: int


def read(path: Path) -> tuple[Scan, ...]:
    """The one scan of a file."""
    header = _header(path)
    before: list[_Element] = []
    for element in header.elements:
        if element.name == "vertex":
            break
        before.append(element)
    else:
        raise InputError("the file has no element vertex", file=path, cure=_CURE)
    after = header.elements[len(before) + 1 :]
    if not element.fixed:
        raise InputError("vertices with lists of values are not read", file=path, cure=_CURE)
    if not all(e.fixed for e in before) and header.order != "=":
        what = "elements of varying length lie before the vertices"
        raise InputError(what, file=path, cure="write the vertices first")
    if header.order == "=":
        return (_text(path, header, element, before, after),)
    return (_binary(path, header, element, before, after),)


def _header(path: Path) -> _Header:
    """The header, bounded in size and checked word by word."""
    with path.open("rb") as file:
        raw = file.read(_HEADER)
    end = re.search(rb"^end_header[ \t]*(\r\n|\n|\r(?!\n))", raw, re.MULTILINE)
    if not raw.startswith(b"ply") or end is None:
        raise InputError("the header has no end or is none", file=path, cure=_CURE)
    lines = re.split(r"\r\n|\n|\r", raw[: end.start()].decode("utf-8", errors="replace"))
    header = _Header(None, [], {}, end.end(), len([x for x in lines if x.strip()]) + 1)
    for number, line in enumerate(lines[1:], start=2):
        words = line.split()
        try:
            _header_line(header, words, line)
        except (IndexError, KeyError, ValueError, OverflowError) as error:
            what = f"the header's line {line[:60]!r} is not understood"
            raise InputError(what, file=path, line=number, cure=_CURE) from error
    if header.order is None:
        raise InputError("the header does not say its format", file=path, cure=_CURE)
    return header


def _header_line(header: _Header, words: list[str], line: str) -> None:
    """Take one line into the header; errors are KeyError, IndexError or ValueError."""
    if not words:
        return
    if words[0] == "format":
        header.order = _ORDERS[words[1]]
    elif words[0] in ("comment", "obj_info"):
        text = line.lstrip().removeprefix(words[0])[1:]
        key, colon, value = text.partition(": ")
        if not colon:
            key, value = words[0], text
        separator = "" if colon else "; "
        known = header.facts.get(key)
        header.facts[key] = value if known is None else known + separator + value
    elif words[0] == "element":
        if not words[2].isdigit():
            raise ValueError(words[2])
        header.elements.append(_Element(words[1], int(words[2])))
    elif words[0] == "property":
        types = header.elements[-1].types
        if words[-1] in types:
            raise ValueError(words[-1])
        is_list = words[1] == "list"
        types[words[-1]] = None if is_list else _TYPES[words[1]]
        if len(words) != (5 if is_list else 3):
            raise ValueError(line)
    else:
        raise ValueError(words[0])


def _binary(
    path: Path, header: _Header, vertex: _Element, before: list[_Element], after: list[_Element]
) -> PlyScan:
    """The scan of a binary file, if its size fits the header."""
    order = header.order or "="
    dtype = vertex.dtype(order)
    offset = header.size + sum(e.count * e.dtype(order).itemsize for e in before)
    there = path.stat().st_size - offset
    if there < vertex.count * dtype.itemsize:
        raise short(path, vertex.count, max(there, 0) // max(dtype.itemsize, 1))
    if all(e.fixed for e in after):
        more = there - vertex.count * dtype.itemsize
        more -= sum(e.count * e.dtype(order).itemsize for e in after)
        if more < 0 or more > 2:  # some writers end with a newline
            what = f"the file is {abs(more)} bytes {'longer' if more > 0 else 'shorter'} than its "
            raise InputError(what + "header states", file=path, cure=_CURE)
    sample = sampled(path, offset, dtype, vertex.count) if dtype.names else {}
    types = {name: np.dtype(kind).name for name, kind in vertex.types.items() if kind}
    layout = arranged(types, sample, path)
    return PlyScan(
        name=scan_name(path),
        path=path,
        records=vertex.count,
        fields=layout.fields,
        origin=assumed_origin(bounds_of(layout.coordinates(sample))),
        crs=header.facts.pop("crs", None),
        facts=header.facts,
        offset=offset,
        dtype=dtype,
        columns=layout,
    )


def _text(
    path: Path, header: _Header, vertex: _Element, before: list[_Element], after: list[_Element]
) -> PlyTextScan:
    """The scan of an ASCII file; its lines are counted."""
    types = {name: np.dtype(kind).name for name, kind in vertex.types.items() if kind}
    first = sum(e.count for e in before)
    with unpacked(path) as file:
        lines = Lines(file, path, mark=Mark(header.size, 0, header.lines))
        lines.skip(first)
        mark = lines.mark
        records, sample = lines.survey(vertex.count)
        if records != vertex.count:
            raise short(path, vertex.count, records)
        rest = sum(e.count for e in after)
        if lines.skip(rest) != rest or lines.peek(1):
            what = "the file has more or fewer lines than its header states"
            raise InputError(what, file=path, cure=_CURE)
    values = rows(sample, len(types)) if types else np.zeros((0, 0))
    with np.errstate(invalid="ignore"):  # whoever reads the points meets values that do not fit
        columns = {
            name: column.astype(kind if kind[0] == "u" else float)
            for (name, kind), column in zip(types.items(), values.T, strict=True)
        }
    layout = arranged(types, columns, path)
    return PlyTextScan(
        name=scan_name(path),
        path=path,
        records=records,
        fields=layout.fields,
        origin=assumed_origin(bounds_of(layout.coordinates(columns))),
        crs=header.facts.pop("crs", None),
        facts=header.facts,
        mark=mark,
        first=first,
        types=types,
        columns=layout,
    )
