"""PCD of the Point Cloud Library: ascii, binary, binary_compressed.

``VIEWPOINT`` is the pose unless it is the identity that every program writes. The format does not
say which frame the points are in: the scanner is assumed at (0, 0, 0) where that lies among them.

Compressed files hold column after column in one run of LZF. Libraries unpack such a run in memory
as a whole, up to 4 GB; the few lines at the end of this file unpack it into a temporary file that
is mapped, so that memory stays bounded as with any other format.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.scans.columns import ColumnRoles, arranged, cast
from tribrach.io.scans.origin import assumed_origin, bounds_of, scan_name
from tribrach.io.scans.records import RecordScan, native, sampled
from tribrach.io.scans.text import LineBlock, Lines, Mark
from tribrach.io.scans.text_scan import TextScan, rows, short, table
from tribrach.io.scans.units import stated_unit
from tribrach.io.unpacking import unpacked
from tribrach.kernels import njit
from tribrach.scan.length_unit import METRES
from tribrach.scan.scan import CHUNK, Chunk, Field, Scan

#: longest header [bytes]; longest match of the compression for each 3 bytes of it
_HEADER, _LONGEST = 1 << 16, 264
_KINDS = {"F": "f", "I": "i", "U": "u"}
_ENCODINGS = ("ascii", "binary", "binary_compressed")
_GRID = {"row", "column"}
_CURE = "export the file again"


@dataclass
class _Header:
    """The header of a file."""

    words: dict[str, list[str]]  #: words after each keyword, and lines of comments
    #: bytes and lines of the header
    size: int
    lines: int
    names: list[str] = field(default_factory=list)  #: of the fields
    #: of a record; fields with several values have a shape
    dtype: np.dtype[Any] = field(default_factory=lambda: np.dtype([]))
    #: points in a row, and rows
    width: int = 0
    height: int = 1
    pose: Pose | None = None  #: world from scanner, None if there is none

    @property
    def points(self) -> int:
        """The number of points."""
        return self.width * self.height


@dataclass(frozen=True)
class PcdScan(RecordScan):
    """The points of a binary file."""

    def _chunk(self, values: dict[str, NDArray[Any]], done: int) -> Chunk:
        extra = _place(self.grid, self.columns, len(values[self.columns.xyz[0]]), done)
        return self.columns.chunk(_coloured(values), self.path, extra=extra)


@dataclass(frozen=True)
class PcdTextScan(TextScan):
    """The points of an ASCII file."""

    layout: np.dtype[Any] = np.dtype(np.uint8)

    def _values(self, lines: Lines, block: LineBlock) -> dict[str, NDArray[Any]]:
        width = _width(self.layout)
        numbers = np.stack(table(lines, block, width), axis=1)
        return _typed(numbers, self.layout, self.columns.xyz, self.path)

    def _chunk(self, values: dict[str, NDArray[Any]], done: int) -> Chunk:
        extra = _place(self.grid, self.columns, len(values[self.columns.xyz[0]]), done)
        return self.columns.chunk(_coloured(values), self.path, extra=extra)


@dataclass(frozen=True)
class PcdCompressedScan(PcdScan):
    """The points of a compressed file, unpacked into a temporary file first."""

    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points in the file's order."""
        records = self.records or 0
        with tempfile.TemporaryFile() as scratch:
            columns = _unpacked(self.path, self.offset, self.dtype, records, scratch)
            for done in range(start, records, size):
                part = {k: np.array(v[done : done + size]) for k, v in columns.items()}
                yield self._chunk(part, done)


def read(path: Path) -> tuple[Scan, ...]:
    """The one scan of a file."""
    header = _header(path)
    encoding = header.words["DATA"][0].lower()
    common: dict[str, Any] = {
        "name": scan_name(path),
        "path": path,
        "records": header.points,
        "pose": header.pose,
        "unit": stated_unit(header.words.get("#", [])) or METRES,
        "grid": (header.height, header.width) if header.height > 1 else None,
    }
    if encoding == "ascii":
        sample, common = _text(path, header, common)
        kind: Callable[..., Scan] = PcdTextScan
    elif encoding == "binary":
        there = path.stat().st_size - header.size
        if there < header.points * header.dtype.itemsize:
            raise short(path, header.points, there // header.dtype.itemsize)
        sample = dict(sampled(path, header.size, header.dtype, header.points))
        common |= {"offset": header.size, "dtype": header.dtype}
        kind = PcdScan
    else:
        with tempfile.TemporaryFile() as scratch:
            columns = _unpacked(path, header.size, header.dtype, header.points, scratch)
            step = max(header.points // 20_000, 1)
            sample = {name: np.array(column[::step]) for name, column in columns.items()}
        common |= {"offset": header.size, "dtype": header.dtype}
        kind = PcdCompressedScan
    sample = _coloured(sample)
    types = {name: column.dtype.name for name, column in sample.items()}
    layout = arranged(types, sample, path)
    fields = layout.fields
    if common["grid"] is not None and _GRID.isdisjoint(f.name for f in fields):
        fields += (Field("row", "int32"), Field("column", "int32"))
    origin = assumed_origin(bounds_of(layout.coordinates(sample)))
    return (kind(**common, columns=layout, fields=fields, origin=origin),)


def _text(
    path: Path, header: _Header, common: dict[str, Any]
) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """A sample of an ASCII file, and the further fields of its scan; its lines are counted."""
    with unpacked(path) as file:
        lines = Lines(file, path, mark=Mark(header.size, 0, header.lines))
        mark = lines.mark
        records, lines_seen = lines.survey()
    if records != header.points:
        raise short(path, header.points, records)
    width = _width(header.dtype)
    numbers = rows(lines_seen, width)
    sample = _typed(numbers, header.dtype, ("x", "y", "z"), path)
    return sample, common | {"mark": mark, "layout": header.dtype}


def _header(path: Path) -> _Header:
    """The header, bounded in size and checked word by word."""
    with path.open("rb") as file:
        raw = file.read(_HEADER)
    words: dict[str, list[str]] = {}
    at = number = 0
    while "DATA" not in words:
        end = raw.find(b"\n", at)
        if end < 0:
            raise InputError("the header has no end or is none", file=path, cure=_CURE)
        line = raw[at:end].decode("utf-8", errors="replace").split()
        at, number = end + 1, number + 1
        if line and line[0].startswith("#"):
            words.setdefault("#", []).append(" ".join(line).lstrip("# "))
        elif line:
            words[line[0].upper()] = line[1:]
    header = _Header(words, at, number)
    try:
        _understand(header)
    except (KeyError, IndexError, ValueError, TypeError, OverflowError) as error:
        what = f"the header is not understood ({error})"
        raise InputError(what, file=path, cure=_CURE) from error
    return header


def _understand(header: _Header) -> None:
    """Fill in types, counts and viewpoint; errors are KeyError, IndexError or ValueError."""
    words = header.words
    names = words["FIELDS"] if "FIELDS" in words else words["COLUMNS"]
    if not words["DATA"] or words["DATA"][0].lower() not in _ENCODINGS:
        raise ValueError("DATA is " + " ".join(words["DATA"]))
    counts = [int(c) for c in words.get("COUNT", ["1"] * len(names))]
    kinds = [_KINDS[t] + s for t, s in zip(words["TYPE"], words["SIZE"], strict=True)]
    fields: list[tuple[str, str, tuple[int, ...]]] = []
    for name, kind, count in zip(names, kinds, counts, strict=True):
        if not 0 <= count <= 4096:
            raise ValueError(f"COUNT is {count}")
        if count == 0:  # as drivers pad: the field has no bytes
            continue
        unique = name if name not in header.names and name != "_" else f"_{len(header.names)}"
        header.names.append(unique)
        fields.append((unique, kind, (count,) if count > 1 else ()))
    header.dtype = np.dtype(fields).newbyteorder("<")
    if not fields:
        raise ValueError("no FIELDS")
    header.width, header.height = int(words["WIDTH"][0]), int(words["HEIGHT"][0])
    if header.width < 0 or header.height < 0:
        raise ValueError("WIDTH or HEIGHT is negative")
    if "POINTS" in words and int(words["POINTS"][0]) != header.points:
        raise ValueError(f"{header.width} x {header.height} are not {words['POINTS'][0]} POINTS")
    view = [float(v) for v in words.get("VIEWPOINT", [])]
    if view and view != [0, 0, 0, 1, 0, 0, 0]:
        w, x, y, z = view[3:]
        turn = Rotation.from_quat([x, y, z, w]).as_matrix()
        if not np.isfinite(turn).all() or not np.isfinite(view[:3]).all():
            raise ValueError("VIEWPOINT is no pose")
        header.pose = Pose(turn, np.array(view[:3]))


def _values_of(dtype: np.dtype[Any]) -> int:
    """How many values a field has."""
    return int(np.prod(dtype.shape)) if dtype.shape else 1


def _width(layout: np.dtype[Any]) -> int:
    """How many values a line has."""
    return sum(_values_of(layout[name]) for name in layout.names or ())


def _typed(
    numbers: Array, layout: np.dtype[Any], xyz: tuple[str, ...], path: Path
) -> dict[str, NDArray[Any]]:
    """Columns of text (n, k) in the types of the header; coordinates stay float64."""
    out: dict[str, NDArray[Any]] = {}
    at = 0
    for name in layout.names or ():
        width, kind = _values_of(layout[name]), layout[name].base.newbyteorder("=")
        column = numbers[:, at : at + width] if width > 1 else numbers[:, at]
        out[name] = column.copy() if name in xyz else cast(column, kind, name, path)
        at += width
    return out


def _coloured(values: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Packed colours as three columns; columns of padding left out."""
    out: dict[str, NDArray[Any]] = {}
    for name, column in values.items():
        if name.lower() in ("rgb", "rgba") and column.dtype.itemsize == 4 and column.ndim == 1:
            packed = np.ascontiguousarray(column).view(np.uint32)
            for shift, channel in ((16, "red"), (8, "green"), (0, "blue")):
                out[channel] = ((packed >> np.uint32(shift)) & np.uint32(255)).astype(np.uint8)
        elif not (name.startswith("_") and name[1:].isdigit()):
            out[name] = column
    return out


def _place(
    grid: tuple[int, int] | None, columns: ColumnRoles, n: int, done: int
) -> dict[str, NDArray[Any]]:
    """Row and column of n records after ``done`` others, if the file is a grid without them."""
    if grid is None or not _GRID.isdisjoint(f.name for f in columns.fields):
        return {}
    place = np.arange(done, done + n)
    return {
        "row": (place // grid[1]).astype(np.int32),
        "column": (place % grid[1]).astype(np.int32),
    }


def _unpacked(
    path: Path, offset: int, dtype: np.dtype[Any], records: int, scratch: Any
) -> dict[str, NDArray[Any]]:
    """The columns of a compressed file, mapped from the temporary file ``scratch``."""
    if records == 0:
        return native(np.zeros(0, dtype=dtype))
    there = path.stat().st_size - offset - 8
    with path.open("rb") as file:
        file.seek(offset)
        sizes = np.fromfile(file, dtype="<u4", count=2)
    packed, length = (int(s) for s in sizes) if len(sizes) == 2 else (0, 0)
    if packed > there or length != records * dtype.itemsize or length > packed * _LONGEST:
        raise short(path, records, min(length, max(there, 0) * _LONGEST) // dtype.itemsize)
    data = np.memmap(path, dtype=np.uint8, mode="r", offset=offset + 8, shape=(packed,))
    scratch.truncate(length)
    plain = np.memmap(scratch, dtype=np.uint8, mode="r+", shape=(length,))
    if packed == length:
        plain[:] = data  # stored as it is, for it does not get shorter
    elif _unpack(data, plain) != length:
        raise InputError("the compressed data are damaged", file=path, cure=_CURE)
    out, at = {}, 0
    for name in dtype.names or ():
        kind = dtype[name]
        size = records * kind.itemsize
        column = plain[at : at + size].view(kind.base)
        out[name] = column.reshape(records, *kind.shape)
        at += size
    return out


@njit(cache=True, nogil=True)
def _unpack(data, out):  # type: ignore[no-untyped-def]
    """Undo the compression LZF."""
    at = made = 0
    while at < len(data):
        control = int(data[at])
        at += 1
        if control < 32:
            count = control + 1
            if at + count > len(data) or made + count > len(out):
                return -1
            out[made : made + count] = data[at : at + count]
            at += count
        else:
            count = (control >> 5) + 2
            if count == 9:
                if at >= len(data):
                    return -1
                count += int(data[at])
                at += 1
            if at >= len(data):
                return -1
            back = made - ((control & 31) << 8) - int(data[at]) - 1
            at += 1
            if back < 0 or made + count > len(out):
                return -1
            for k in range(count):
                out[made + k] = out[back + k]
        made += count
    return made
