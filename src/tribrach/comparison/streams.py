"""Clouds too large for memory: chunks, and points waiting on disk for their turn.

A stream is a function that begins anew each time it is called and gives chunks (n, 3) [m]; one
with light gives the intensity of each point in a fourth column, NaN where it is unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from tribrach._types import Array

Stream = Callable[[], Iterator[Array]]

#: points at a time from disk
_CHUNK = 1_000_000


class Spool:
    """Points in temporary files by number, in order; three columns, four with light."""

    def __init__(self, folder: Path, count: int, columns: int = 3) -> None:
        self._paths = [folder / f"{number}.points" for number in range(count)]
        self.counts = [0] * count
        self.columns = columns

    def add(self, number: int, points: Array) -> None:
        """Append points (n, columns)."""
        if len(points):
            with self._paths[number].open("ab") as file:
                file.write(np.ascontiguousarray(points, dtype=np.float64).tobytes())
            self.counts[number] += len(points)

    def stream(self, number: int) -> Stream:
        """The points of a number, in chunks."""

        def chunks() -> Iterator[Array]:
            left = self.counts[number]
            if left == 0:
                return
            with self._paths[number].open("rb") as file:
                while left:
                    some = min(left, _CHUNK)
                    flat = np.fromfile(file, np.float64, self.columns * some)
                    yield flat.reshape(some, self.columns)
                    left -= some

        return chunks

    def points(self, number: int) -> Array:
        """The points (n, 3) of a number, all at once."""
        return joined(self.stream(number)())

    def drop(self, number: int) -> None:
        """Forget the points of a number."""
        self._paths[number].unlink(missing_ok=True)
        self.counts[number] = 0


def joined(chunks: Iterator[Array]) -> Array:
    """All chunks as one array (n, 3)."""
    return np.concatenate([np.empty((0, 3)), *chunks])
