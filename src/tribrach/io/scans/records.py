"""Scans whose points are binary records of one length, read by blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.io.scans.columns import ColumnRoles
from tribrach.io.scans.text_scan import short
from tribrach.scan.scan import CHUNK, Chunk, Scan

#: places in the file and records at each that are looked at beforehand
_PLACES, _RECORDS = 64, 256


@dataclass(frozen=True)
class RecordScan(Scan):
    """Points in binary records."""

    offset: int = 0  #: byte of the file where the points begin
    dtype: np.dtype[Any] = np.dtype(np.uint8)  #: type of a record
    #: which fields of a record are coordinates and which are values
    columns: ColumnRoles = ColumnRoles(("x", "y", "z"), (), (), ())

    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points in the file's order."""
        records, done = self.records or 0, start
        with self.path.open("rb") as file:
            file.seek(self.offset + start * self.dtype.itemsize)
            while done < records:
                data = np.fromfile(file, dtype=self.dtype, count=min(size, records - done))
                if len(data) == 0:
                    raise short(self.path, records, done, self.name)
                yield self._chunk(native(data), done)
                done += len(data)

    def _chunk(self, values: dict[str, NDArray[Any]], done: int) -> Chunk:
        """The points of some columns; ``done`` records lie before them."""
        return self.columns.chunk(values, self.path)


def native(data: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """The fields of records (n,) by name, in the byte order of this machine."""
    return {
        name: data[name].astype(data[name].dtype.newbyteorder("="), copy=False)
        for name in data.dtype.names or ()
    }


def sampled(
    path: Path, offset: int, dtype: np.dtype[Any], records: int
) -> Mapping[str, NDArray[Any]]:
    """Records from all over a file, by field."""
    parts = [np.zeros(0, dtype=dtype)]
    starts = np.unique(np.linspace(0, max(records - _RECORDS, 0), _PLACES).astype(np.int64))
    with path.open("rb") as file:
        for start in starts:
            file.seek(offset + int(start) * dtype.itemsize)
            parts.append(np.fromfile(file, dtype=dtype, count=min(_RECORDS, records)))
    return native(np.concatenate(parts))
