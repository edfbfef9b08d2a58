"""A whole scan in memory, for work that needs every neighbour at once (targets, planes)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.scan.scan import Chunk, Scan

__all__ = ["LIMIT", "Loaded", "load"]

#: scans with more points than this are refused; 2.4 GB of coordinates
LIMIT = 100_000_000
#: points that arrays are laid out for at first
_FIRST = 1_000_000
#: what is kept besides coordinates, in the order of :class:`Loaded`
_FIELDS = {"intensity": np.float32, "row": np.int32, "column": np.int32}


@dataclass(frozen=True, eq=False)
class Loaded:
    """A whole scan in memory.

    Attributes
    ----------
    xyz : array (n, 3)
        Points of the scanner frame, float64 [m].
    intensity : array (n,)
        float32 in the file's unit; None if the scan has none.
    row, column : array (n,)
        int32, of the scanner's grid; None if the scan has none.
    """

    xyz: Array
    intensity: NDArray[np.float32] | None = None
    row: NDArray[np.int32] | None = None
    column: NDArray[np.int32] | None = None


def load(scan: Scan, limit: int = LIMIT) -> Loaded:
    """Read all valid points of a scan into arrays laid out for them.

    A scan whose header says that it has too many is refused before anything is decoded.

    Parameters
    ----------
    scan
        The scan.
    limit
        Points at most.

    Returns
    -------
    Loaded
        Points, and what the search for targets needs besides.

    Raises
    ------
    InputError
        More than ``limit`` points, none at all, or a damaged file.
    """
    if scan.certain_points > limit:
        raise _too_many(scan, limit)
    rows = _Rows(scan.records)
    for chunk in scan.chunks():
        if rows.total + len(chunk) > limit:
            raise _too_many(scan, limit)
        rows.add(chunk)
    if rows.total == 0:
        raise InputError("the scan has no valid points", file=scan.path, record=scan.name)
    return rows.loaded()


def _too_many(scan: Scan, limit: int) -> InputError:
    what = f"the scan has more than {limit} points, too many to search at once"
    return InputError(what, file=scan.path, record=scan.name, cure="thin or split it")


class _Rows:
    """Arrays laid out for the points of a scan and filled chunk by chunk.

    They grow, by doubling, up to what the header states, so that a header that lies costs nothing;
    large arrays grow without being copied where the system can move pages.
    """

    def __init__(self, records: int | None) -> None:
        self.total = 0
        self._most = records
        self._xyz: Array = np.empty((0, 3))
        self._values: dict[str, NDArray[Any]] | None = None

    def add(self, chunk: Chunk) -> None:
        """Append the points of a chunk; fields that it lacks are dropped."""
        if self._values is None:
            self._values = {name: np.empty(0, dtype=kind) for name, kind in _FIELDS.items()}
        kept = {name: v for name, v in self._values.items() if name in chunk.values}
        end = self.total + len(chunk)
        if end > len(self._xyz):
            self._grow(end, kept)
        here = slice(self.total, end)
        self._xyz[here] = chunk.xyz
        for name, values in kept.items():
            # numbers beyond the type are taken as astype takes them
            values[here] = np.asarray(chunk.values[name]).astype(values.dtype, copy=False)
        self._values, self.total = kept, end

    def loaded(self) -> Loaded:
        """The arrays without what was laid out in vain."""
        values = self._values or {}
        self._resize(self.total, values)
        return Loaded(self._xyz, *(values.get(name) for name in _FIELDS))

    def _grow(self, least: int, values: dict[str, NDArray[Any]]) -> None:
        size = max(2 * len(self._xyz), _FIRST)
        if self._most is not None:
            size = min(size, self._most)
        self._resize(max(size, least), values)

    def _resize(self, size: int, values: dict[str, NDArray[Any]]) -> None:
        self._xyz.resize((size, 3), refcheck=False)
        for array in values.values():
            array.resize(size, refcheck=False)
