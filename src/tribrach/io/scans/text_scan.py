"""Scans whose points are lines of text; each format adds its header and what its columns mean.

The lines of a block become columns all at once; if that fails, the line at fault is looked for.
"""

from __future__ import annotations

import io
import re
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic_core import from_json

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.scans.columns import ColumnRoles, cast
from tribrach.io.scans.text import BLANKS, LineBlock, Lines, Mark
from tribrach.io.unpacking import unpacked
from tribrach.scan.scan import CHUNK, Chunk, Scan

#: what programs write for a value that is no number; nan and inf are known to parsers
_ODD = re.compile(rb"(?i)(?<![^ \n])[-+]?(?:1\.#\w+|nan\(\w*\)|n/a|null)(?![^ \n])")

#: bytes that are parsed at a time
_PIECE = 1 << 19
#: what numbers of JSON are made of, NaN among them; its true and false are not
_OF_JSON = b"0123456789+-.eE naN\n"
#: translation of the blanks between numbers, and of nan
_TO_JSON = bytes.maketrans(b" \nn", b",,N")
_NO_BLANKS = bytes(set(range(256)) - set(b" \n"))


def table(lines: Lines, block: LineBlock, columns: int) -> list[Array]:
    """The numbers of a block, as one array (n,) for each column."""
    parsed = _parsed(block.text, columns)
    if parsed is None:
        replaced, changes = _ODD.subn(b"nan", block.text)
        parsed = _parsed(replaced, columns) if changes else None
    if parsed is None or (columns and len(parsed[0]) != block.count):
        raise malformed(lines, block, columns)
    return parsed


def _parsed(text: bytes, columns: int) -> list[Array] | None:
    """The columns, None if any line is wrong."""
    out = np.empty((columns, text.count(b"\n")))
    done, at = 0, 0
    while at < len(text):
        end = text.find(b"\n", min(at + _PIECE, len(text) - 1)) + 1 or len(text)
        numbers = _table_of(text[at:end], columns)
        if numbers is None:
            return None
        out[:, done : done + len(numbers)] = numbers.T
        done, at = done + len(numbers), end
    return list(out)


def _table_of(text: bytes, columns: int) -> Array | None:
    """The numbers of whole lines, (n, columns), None if any line is wrong.

    Numbers as nearly all programs write them are numbers of JSON, whose parser is three times as
    fast as numpy's. For whatever it refuses, such as ``.5`` or ``+1``, numpy is asked.
    """
    count = text.count(b"\n")
    if text.translate(None, _NO_BLANKS) != (b" " * (columns - 1) + b"\n") * count:
        return None
    if not text.translate(None, _OF_JSON):
        try:
            numbers = array("d", from_json(b"[" + text[:-1].translate(_TO_JSON) + b"]"))
            return np.frombuffer(numbers).reshape(count, columns)
        except (ValueError, OverflowError):
            pass
    try:
        return np.loadtxt(io.BytesIO(text), delimiter=" ", comments=None, ndmin=2)
    except ValueError:
        return None


def malformed(lines: Lines, block: LineBlock, columns: int) -> InputError:
    """The error of the first wrong line of a block."""
    k, what = 0, "a line cannot be read"
    for k, line in enumerate(_ODD.sub(b"nan", block.text).split(b"\n")[:-1]):  # noqa: B007
        values = line.split(b" ")
        if len(values) != columns:
            what = f"the line has {len(values)} values where {columns} are expected"
            break
        wrong = [value for value in values if not is_number(value)]
        if wrong:
            what = f"{wrong[0][:40].decode(errors='replace')!r} is no number"
            break
    cure = "correct the line or copy the file again"
    return InputError(what, file=lines.path, line=lines.number(block, k), cure=cure)


def is_number(value: bytes) -> bool:
    """True if a value is a number."""
    try:
        float(value)
    except ValueError:
        return False
    return b"_" not in value


def rows(sample: list[bytes], columns: int) -> Array:
    """The sampled lines that have as many numbers as there are columns, as rows (k, columns)."""
    whole = [line for line in sample if line.count(b" ") == columns - 1]
    numbers = _table_of(b"".join(line + b"\n" for line in whole), columns) if whole else None
    if numbers is None:
        cells = [line.split(b" ") for line in whole]
        kept = [[float(cell) for cell in row] for row in cells if all(map(is_number, row))]
        numbers = np.array(kept, dtype=float).reshape(-1, columns)
    return numbers


@dataclass(frozen=True)
class TextScan(Scan):
    """Points in lines of text."""

    mark: Mark = Mark()  #: A place shortly before the first point
    first: int = 0  #: lines before the first point, blank ones not counted
    blanks: bytes = BLANKS  #: translation table that makes spaces of the delimiters
    fill: bytes = b""  #: regular expression of cells with nothing in them
    types: Mapping[str, str] | None = None  #: numpy types by name, of every column in order
    #: which columns are coordinates and which are values
    columns: ColumnRoles = ColumnRoles(("x", "y", "z"), (), (), ())

    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points in the file's order."""
        records, done = self.records or 0, start
        with unpacked(self.path) as file:
            lines = Lines(file, self.path, self.blanks, self.mark, self.fill)
            lines.skip(self.first + start - lines.ordinal)
            while done < records:
                block = lines.take(min(size, records - done))
                if block.count == 0:
                    raise short(self.path, records, done, self.name)
                values = self._values(lines, block)
                yield self._chunk(values, done)
                done += block.count

    def _values(self, lines: Lines, block: LineBlock) -> dict[str, NDArray[Any]]:
        """The columns of a block in the types that the file declares; coordinates in float64."""
        types = self.types or {}
        numbers = self._numbers(lines, block, len(types))
        return {
            name: column
            if dtype == "float64" or name in self.columns.xyz
            else cast(column, np.dtype(dtype), name, self.path)
            for (name, dtype), column in zip(types.items(), numbers, strict=True)
        }

    def _numbers(self, lines: Lines, block: LineBlock, columns: int) -> list[Array]:
        """The table of a block; formats with exceptions override it."""
        return table(lines, block, columns)

    def _chunk(self, values: dict[str, NDArray[Any]], done: int) -> Chunk:
        """The points of some columns; ``done`` records lie before them."""
        return self.columns.chunk(values, self.path)


#: scans in one file of text; each is looked for from the last block of lines on
_MOST_SCANS = 1000


def refuse_many(path: Path, scans: int) -> None:
    """Refuse more scans in one file of text than anybody takes."""
    if scans > _MOST_SCANS:
        raise InputError(
            f"the file has more than {_MOST_SCANS} scans",
            file=path,
            cure="write fewer into one file, or check the numbers of points",
        )


def short(path: Path, stated: int, present: int, record: str | None = None) -> InputError:
    """The error of a header that states more points than there are."""
    return InputError(
        f"the header states {stated} points and the file holds {present}",
        file=path,
        record=record,
        cure="copy the file again from its source",
    )


def off_by_one(path: Path, stated: int, present: int, record: str | None = None) -> str:
    """Sentence for a count that is wrong by one point, as some programs write it."""
    if abs(stated - present) != 1 or present == 0:
        raise short(path, stated, present, record)
    return f"the header states {stated} points and the file holds {present}: all of them are read"
