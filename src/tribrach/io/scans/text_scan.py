"""Scans whose points are lines of text; each format adds its header and what its columns mean."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.scans.columns import Columns, cast
from tribrach.io.scans.text import BLANKS, Block, Lines, Mark, opened
from tribrach.io.scans.text_table import table
from tribrach.scan.scan import CHUNK, Chunk, Scan

__all__ = ["TextScan", "short"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TextScan(Scan):
    """Points in lines.

    mark : shortly before the first point; first : lines, not counting blank ones, before it;
    blanks : what separates values; types : numpy types by name, of every column in order.
    """

    mark: Mark = Mark()
    first: int = 0
    blanks: bytes = BLANKS
    types: Mapping[str, str] | None = None
    columns: Columns = Columns(("x", "y", "z"), (), (), ())

    def chunks(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """The points in the file's order.

        Raises
        ------
        InputError : a malformed line, or the file has become shorter.
        """
        records, done = self.records or 0, start
        with opened(self.path) as file:
            lines = Lines(file, self.path, self.blanks, self.mark)
            lines.skip(self.first + start - lines.ordinal)
            while done < records:
                block = lines.take(min(size, records - done))
                if block.count == 0:
                    raise short(self.path, records, done, self.name)
                values = self._values(lines, block)
                yield self._chunk(values, done)
                done += block.count

    def _values(self, lines: Lines, block: Block) -> dict[str, NDArray[Any]]:
        """The columns of a block in the types that the file declares; coordinates in float64."""
        types = self.types or {}
        numbers = self._numbers(lines, block, len(types))
        return {
            name: column
            if dtype == "float64" or name in self.columns.xyz
            else cast(column, np.dtype(dtype), name, self.path)
            for (name, dtype), column in zip(types.items(), numbers, strict=True)
        }

    def _numbers(self, lines: Lines, block: Block, columns: int) -> list[Array]:
        return table(lines, block, columns)

    def _chunk(self, values: dict[str, NDArray[Any]], done: int) -> Chunk:
        """The points of columns, before which there are ``done`` records."""
        return self.columns.chunk(values, self.path)


def short(path: Path, stated: int, found: int, record: str | None = None) -> InputError:
    """The sentence about a header that does not count right."""
    return InputError(
        f"the header states {stated} points and the file holds {found}",
        file=path,
        record=record,
        cure="copy the file again from its source",
    )
