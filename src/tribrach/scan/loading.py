"""A whole scan in memory, for work that needs every neighbour at once (targets, planes).

What is held (:func:`hold`) is decoded once for everything that is made of it: whoever reads its
chunks, loads it or lays it out gets what is in memory, in the very chunks of the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.scan.range_image import RangeImage, organise
from tribrach.scan.scan import CHUNK, Chunk, NoReturn, Scan

#: scans with more points than this are refused; 2.4 GB of coordinates
LIMIT = 100_000_000
#: points that arrays are laid out for at first
_FIRST = 1_000_000
#: what is kept besides coordinates, in the order of :class:`Loaded`
_FIELDS = {"intensity": np.float32, "row": np.int32, "column": np.int32}


@dataclass(frozen=True, eq=False)
class Loaded:
    """A whole scan in memory."""

    xyz: Array  #: (n, 3), points of the scanner frame, float64 [m]
    #: (n,), float32 in the file's unit; None if the scan has none
    intensity: NDArray[np.float32] | None = None
    #: (n,), int32, of the scanner's grid; None if the scan has none
    row: NDArray[np.int32] | None = None
    column: NDArray[np.int32] | None = None


def load(scan: Scan, limit: int = LIMIT) -> Loaded:
    """Read all valid points of a scan into arrays; refuse too many by the header, unread."""
    held = scan if isinstance(scan, HeldScan) else hold(scan, limit)
    if not len(held.points.xyz):
        raise InputError("the scan has no valid points", file=scan.path, record=scan.name)
    return held.points


def laid_out(scan: Scan) -> tuple[Loaded, RangeImage]:
    """Load a scan and lay it out as a range image; one that is held is laid out once."""
    held = scan if isinstance(scan, HeldScan) else hold(scan)
    return load(held), held.image


def hold(scan: Scan, limit: int = LIMIT, *, stored: bool = False) -> HeldScan:
    """Read the points of a scan once, to be read from memory from then on."""
    if scan.certain_points > limit:
        raise _too_many(scan, limit)
    rows = _Rows(scan.records)
    for chunk in scan.measured() if stored else scan.chunks():
        if rows.total + len(chunk) > limit:
            raise _too_many(scan, limit)
        rows.add(chunk)
    known = {field.name: getattr(scan, field.name) for field in fields(Scan)}
    ends, dropped = tuple(rows.ends), tuple(rows.dropped)
    return HeldScan(
        **known, file=scan, points=rows.loaded(), ends=ends, dropped=dropped, raw=stored
    )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class HeldScan(Scan):
    """A scan whose points are in memory, in the chunks of its file.

    Chunks have the fields of :class:`Loaded` alone. Blocks of other sizes or from other places are
    read from memory where every record is a point, else from the file, whose reader knows where
    records without a point are.
    """

    file: Scan  #: the scan that was read
    points: Loaded  #: its points
    ends: tuple[int, ...]  #: number of the points up to the end of each chunk
    dropped: tuple[int, ...]  #: records of each chunk that hold no point
    #: true if the points are those of the file (:meth:`stored`), not those that count
    #: (:meth:`chunks`)
    raw: bool = False

    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points as the file has them, from memory if they are held so."""
        return self._kept(size, start) if self.raw else self.file.measured(size, start)

    def measured(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points as the file has them; what is held is metres."""
        return self.stored(size, start)

    def chunks(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points, from memory unless a block of them is not to be found there."""
        return super().chunks(size, start) if self.raw else self._kept(size, start)

    def _kept(self, size: int, start: int) -> Iterator[Chunk]:
        bounds: Iterable[tuple[int, int, int]]
        if (size, start) == (CHUNK, 0):
            bounds = zip((0, *self.ends), self.ends, self.dropped, strict=False)
        elif len(self.points.xyz) == self.records and self.file.even_chunks:
            last = len(self.points.xyz)
            bounds = ((k, min(k + size, last), 0) for k in range(start, last, size))
        else:
            yield from (
                self.file.measured(size, start) if self.raw else self.file.chunks(size, start)
            )
            return
        named = {name: getattr(self.points, name) for name in _FIELDS}
        known = {name: values for name, values in named.items() if values is not None}
        for first, end, dropped in bounds:
            values = {name: array[first:end] for name, array in known.items()}
            yield Chunk(self.points.xyz[first:end], values, dropped)

    def without(self, no_return: NoReturn | None) -> HeldScan:
        """Do to points that are held as the file has them what the project knows better.

        The arrays are used again; what held them before must not be read any more.
        """
        file = replace(self.file, no_return=no_return)
        if file.as_stored and no_return is None:
            return replace(self, file=file, no_return=None, raw=False)
        arrays = [a for a in (self.points.xyz, *self._values()) if a is not None]
        known, ends, dropped, end = replace(self, no_return=no_return), [], [], 0
        for chunk in known.chunks():
            first, end = end, end + len(chunk)
            for array, new in zip(arrays, _columns(chunk), strict=True):
                array[first:end] = new
            ends.append(end)
            dropped.append(chunk.dropped)
        kept = [None if a is None else a[:end] for a in self._values()]
        points = Loaded(self.points.xyz[:end], *kept)
        return replace(
            known, file=file, points=points, ends=tuple(ends), dropped=tuple(dropped), raw=False
        )

    def _values(self) -> tuple[NDArray[Any] | None, ...]:
        return tuple(getattr(self.points, name) for name in _FIELDS)

    @cached_property
    def image(self) -> RangeImage:
        """The range image of the points."""
        return organise(self.points.xyz, self.points.row, self.points.column)


def _columns(chunk: Chunk) -> list[NDArray[Any]]:
    return [chunk.xyz, *(chunk.values[name] for name in _FIELDS if name in chunk.values)]


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
        self.ends: list[int] = []
        self.dropped: list[int] = []
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
        self.ends.append(end)
        self.dropped.append(chunk.dropped)

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
