"""Packed points on disk beside a file in the making, and their division into buckets in place.

Only a block of points is in memory at a time. The division sorts each block by bucket where it
lies; a bucket is then a run of points in every block.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.io.clouds.staged import Staged

__all__ = ["PointSpool"]

Records = NDArray[np.void]

#: points of a block
_BLOCK = 500_000


class PointSpool:
    """Points of one structured type in a hidden file beside ``path``, in the order they came.

    Raises
    ------
    InputError : the file cannot be made.
    """

    def __init__(self, path: Path, kind: np.dtype[Any]) -> None:
        self._staged = Staged(path.with_name(f"{path.name}.points"))
        self._kind, self._points = kind, 0
        self._runs = np.zeros((0, 1), dtype=np.int64)

    def append(self, records: Records) -> None:
        """Points (n,) after those that are there; OSError if the disk is full."""
        self._staged.file.write(np.ascontiguousarray(records).view(np.uint8).data)
        self._points += len(records)

    def blocks(self) -> Iterator[Records]:
        """All points, in blocks."""
        for start in range(0, self._points, _BLOCK):
            yield self._read(start, min(_BLOCK, self._points - start))

    def divide(self, bucket: Callable[[Records], NDArray[np.int32]], number: int) -> None:
        """Sort the points of each block by bucket, 0 to number - 1, keeping their order in each.

        bucket : the bucket (n,) of each point of a block; blocks come in order.
        """
        runs = []
        for n, records in enumerate(self.blocks()):
            own = bucket(records)
            self._staged.file.seek(n * _BLOCK * self._kind.itemsize)
            in_order = records.take(np.argsort(own, kind="stable"))
            self._staged.file.write(in_order.view(np.uint8).data)
            sizes = np.bincount(own, minlength=number)
            runs.append(n * _BLOCK + np.concatenate([[0], np.cumsum(sizes)]))
        self._runs = np.array(runs, dtype=np.int64).reshape(-1, number + 1)

    def bucket(self, number: int) -> Records:
        """The points of a bucket in the order they came."""
        starts, ends = self._runs[:, number], self._runs[:, number + 1]
        out = np.empty(int((ends - starts).sum()), dtype=self._kind)
        done = 0
        for start, size in zip(starts.tolist(), (ends - starts).tolist(), strict=True):
            if size:
                out[done : done + size] = self._read(start, size)
                done += size
        return out

    def remove(self) -> None:
        """Delete the file."""
        self._staged.discard()

    def _read(self, start: int, size: int) -> Records:
        """Points from a place on; OSError if the file was cut meanwhile."""
        self._staged.file.seek(start * self._kind.itemsize)
        data = self._staged.file.read(size * self._kind.itemsize)
        if len(data) != size * self._kind.itemsize:
            raise OSError(5, "a temporary file was cut while it was read")
        return np.frombuffer(data, dtype=self._kind)
