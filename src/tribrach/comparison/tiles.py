"""Two clouds of any size as tiles: boxes that share space, each with the points that matter to it.

Both clouds are read once. Small ones stay in memory as one tile. Others pass through a folder of
temporary files: boxes are cut so that about so many points of either cloud lie in and around each,
every point is written to the file of its box, and what lies around a box is read from the files
of its neighbours, up to whatever margin a method needs. A tile is therefore known without any
other: its points, how many come before it, and where its share of a sample begins. A method takes
the tiles in any order, or at several places at once, and joins what it finds in the order of their
numbers. Metres.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from tribrach._types import Array, Index
from tribrach.comparison.nearest import corners
from tribrach.comparison.sites import ComparisonSite
from tribrach.comparison.streams import Stream
from tribrach.errors import InputError
from tribrach.kernels import njit
from tribrach.scratch import scratch_folder

#: points of either cloud in and around a tile: 24 bytes each, and three times that with their tree
SIZE = 2_000_000
#: points at a time from disk
_CHUNK = 1_000_000
#: points of each cloud that say where boxes are cut
_SAMPLE = 200_000
#: columns of a block of rows of a file: first row, rows, corners of the box that holds them
_FIRST, _ROWS, _LOW, _HIGH = 0, 1, slice(2, 5), slice(5, 8)


@dataclass(frozen=True, eq=False)
class Cuts:
    """Boxes and the way to the box of a point."""

    boxes: Array  #: (k, 2, 3), their corners [m]
    #: of each cut (c,): its axis, its place [m], and what lies below and above it (c, 2): the
    #: number of another cut, or less one than minus the number of a box
    axis: Index
    at: Array
    below: Index

    @classmethod
    def of(cls, samples: Sequence[Array], most: Sequence[float], limit: float) -> Cuts:
        """Boxes with at most so many points of the sample of any cloud in and around each.

        Cut at the median of the points along the longest side, again and again.
        """
        boxes: list[Array] = []
        axes: list[int] = []
        places: list[float] = []
        below: list[list[int]] = []

        def cut(box: Array, near: list[Array]) -> int:
            here = [some[((some >= box[0]) & (some < box[1])).all(axis=1)] for some in near]
            inside = np.concatenate([np.empty((0, 3)), *here])
            extent = np.ptp(inside, axis=0) if len(inside) else np.zeros(3)
            axis = int(np.argmax(extent))
            few = all(len(some) <= bound for some, bound in zip(near, most, strict=True))
            if few or extent[axis] < 8 * limit:
                boxes.append(box)
                return -len(boxes)
            first, at = inside[:, axis].min(), float(np.median(inside[:, axis]))
            if at <= first:  # most of them lie on one plane
                at = float(first + extent[axis] / 2)
            number = len(axes)
            axes.append(axis)
            places.append(at)
            below.append([0, 0])
            for side in (0, 1):
                half = box.copy()
                half[1 - side, axis] = at
                around = [
                    s[((s >= half[0] - limit) & (s <= half[1] + limit)).all(axis=1)] for s in near
                ]
                below[number][side] = cut(half, around)
            return number

        cut(np.array([[-np.inf] * 3, [np.inf] * 3]), list(samples))
        return cls(
            np.array(boxes),
            np.array(axes, dtype=np.int64),
            np.array(places, dtype=np.float64),
            np.array(below, dtype=np.int64).reshape(-1, 2),
        )

    def numbers(self, rows: Array) -> Index:
        """Number (n,) of the box that each row is in."""
        return np.asarray(_boxes_of(rows, self.axis, self.at, self.below))


@dataclass(frozen=True, eq=False)
class TiledCloud:
    """A cloud by tiles, in files or in memory."""

    columns: int  #: of its rows: three, or with light four
    #: (b, 8), for each tile the blocks of its file: first row, rows, least and largest coordinates
    #: [m]
    blocks: tuple[Array, ...]
    folder: Path | None = None  #: where the files are, None where the rows are in memory
    #: (n, columns), all rows of the only tile, None where they are in files
    rows: Array | None = None

    def count(self, number: int) -> int:
        """Points in a tile."""
        return int(self.blocks[number][:, _ROWS].sum())

    def stream(self, number: int) -> Iterator[Array]:
        """Rows (n, columns) of a tile, in chunks, in the order in which they came."""
        left = self.count(number)
        if self.rows is not None:
            for first in range(0, left, _CHUNK):
                yield self.rows[first : first + _CHUNK]
        elif left:
            with self._path(number).open("rb") as file:
                while left:
                    some = min(left, _CHUNK)
                    flat = np.fromfile(file, np.float64, self.columns * some)
                    yield flat.reshape(some, self.columns)
                    left -= some

    def between(self, low: Array, high: Array) -> Array:
        """Rows (n, columns) of all tiles within a box of corners (3,), borders included."""
        if self.rows is not None:
            return self.rows
        chosen = [
            (number, *(int(x) for x in block[: _ROWS + 1]))
            for number, blocks in enumerate(self.blocks)
            for block in blocks
            if (block[_LOW] <= high).all() and (block[_HIGH] >= low).all()
        ]
        # memory that is not filled is not taken
        out = np.empty((sum(rows for _, _, rows in chosen), self.columns))
        filled = 0
        for number, first, rows in chosen:
            begin = 8 * self.columns * first
            flat = np.fromfile(self._path(number), np.float64, self.columns * rows, offset=begin)
            filled = _copy(flat.reshape(rows, self.columns), low, high, out, filled)
        return out[:filled]

    def _path(self, number: int) -> Path:
        """The file of a tile."""
        assert self.folder is not None
        return self.folder / f"{number}.points"


@dataclass(frozen=True, eq=False)
class Tiles:
    """Two clouds cut into tiles."""

    cuts: Cuts  #: the boxes, which fill space
    #: clouds A and B
    compared: TiledCloud
    reference: TiledCloud
    asked: Index  #: (k,), points of A in each box that are asked for
    origin: Array | None  #: (3,), the first of them as they came [m], None where there is none
    site: ComparisonSite | None  #: points of A outside of it are not asked for; None where all are

    def __iter__(self) -> Iterator[Tile]:
        """The tiles that something is asked in, in their order."""
        for number in np.flatnonzero(self.asked):
            yield Tile(self, int(number))

    @property
    def on_disk(self) -> bool:
        """True if tiles are small values that name files; else the only one holds the points."""
        return self.compared.folder is not None and self.reference.folder is not None

    @property
    def total(self) -> int:
        """Points of A that are asked for."""
        return int(self.asked.sum())

    def queries(self) -> Iterator[Array]:
        """All points (n, 3) of A that are asked for, tile by tile, in chunks."""
        for tile in self:
            yield from tile.queries()

    def numbers(self, points: Array) -> Index:
        """Number (n,) of the tile that each point (n, 3) is in."""
        return self.cuts.numbers(points)


@dataclass(frozen=True, eq=False)
class Tile:
    """One tile: a value that a task on another machine can be given, where it sees the files."""

    tiles: Tiles  #: all of them
    number: int  #: of this one

    @property
    def before(self) -> int:
        """Points that are asked for in the tiles before this one."""
        return int(self.tiles.asked[: self.number].sum())

    @property
    def asked(self) -> int:
        """Points that are asked for in this one."""
        return int(self.tiles.asked[self.number])

    def queries(self) -> Iterator[Array]:
        """The points (n, 3) of A in the box that are asked for, in chunks."""
        site = self.tiles.site
        for rows in self.tiles.compared.stream(self.number):
            xyz = np.ascontiguousarray(rows[:, :3])
            yield xyz if site is None else xyz[site.inside(xyz)]

    def compared(self, margin: float) -> Array:
        """Rows (n, columns) of A in the box or within a margin [m] of it, asked for or not."""
        return self._around(self.tiles.compared, margin)

    def reference(self, margin: float) -> Array:
        """Rows (n, columns) of B in the box or within a margin [m] of it."""
        return self._around(self.tiles.reference, margin)

    def near(self, points: Array, margin: float) -> Index:
        """Which points (n, 3) are in the box or within a margin [m] of it: their rows."""
        low, high = self.tiles.cuts.boxes[self.number]
        near = ((points >= low - margin) & (points <= high + margin)).all(axis=1)
        return np.flatnonzero(near)

    def _around(self, cloud: TiledCloud, margin: float) -> Array:
        """Rows of a cloud in and around the box."""
        low, high = self.tiles.cuts.boxes[self.number]
        return cloud.between(low - margin, high + margin)


@contextmanager
def tiles(
    compared: Stream,
    reference: Stream,
    limit: float,
    *,
    site: ComparisonSite | None = None,
    size: int | None = None,
    progress: Callable[[str, int], None] = lambda which, points: None,
) -> Iterator[Tiles]:
    """Cut two clouds so that about ``size`` points of either are in memory at a time.

    Boxes are eight limits wide at least. Clouds up to the size are not cut; else both pass through
    a temporary folder. Reference points matter within ``limit`` of a query, those of a site alone.
    """
    if not (np.isfinite(limit) and limit > 0):
        raise ValueError("the limit must be above zero and finite")
    size = SIZE if size is None else size
    with ExitStack() as stack:
        made: list[Path] = []

        def folder() -> Path:
            if not made:
                made.append(stack.enter_context(scratch_folder()))
            return made[0]

        a = _read(compared, lambda: folder() / "a.all", size, site, partial(progress, "A"))
        b = _read(reference, lambda: folder() / "b.all", size, None, partial(progress, "B"))
        if a.held is not None and b.held is not None:
            first = TiledCloud(a.columns, (_block(0, a.held),), rows=a.held)
            second = TiledCloud(b.columns, (_block(0, b.held),), rows=b.held)
            asked = np.array([a.asked], dtype=np.int64)
            yield Tiles(Cuts.of([], [], limit), first, second, asked, a.origin, site)
            return
        most = [size * len(cloud.sample) / max(cloud.count, 1) for cloud in (a, b)]
        cuts = Cuts.of([a.sample, b.sample], most, limit)
        shared = []
        for name, one in (("a", a), ("b", b)):
            (folder() / name).mkdir()
            shared.append(_shared(one, cuts, folder() / name, site))
            if one.path is not None:
                one.path.unlink()
        yield Tiles(cuts, shared[0][0], shared[1][0], shared[0][1], a.origin, site)


@dataclass(frozen=True, eq=False)
class _Read:
    """A cloud that was read once."""

    columns: int  #: of its rows
    #: its points, and those that are asked for
    count: int
    asked: int
    sample: Array  #: (m, 3), some of them, evenly [m]
    origin: Array | None  #: (3,), the first that is asked for [m], None without any
    path: Path | None  #: A file of all rows, None if they are held
    held: Array | None  #: (n, columns), all rows, None if they are too many

    def chunks(self) -> Iterator[Array]:
        """All rows (n, columns), in chunks."""
        blocks = np.zeros((1, 8))
        blocks[0, _ROWS] = self.count
        if self.held is not None:
            yield from TiledCloud(self.columns, (blocks,), rows=self.held).stream(0)
            return
        assert self.path is not None
        with self.path.open("rb") as file:
            while len(flat := np.fromfile(file, np.float64, self.columns * _CHUNK)):
                yield flat.reshape(-1, self.columns)


def _read(
    stream: Stream,
    at: Callable[[], Path],
    size: int,
    site: ComparisonSite | None,
    progress: Callable[[int], None],
) -> _Read:
    """Read a cloud: held in memory if it is not too long, else written to a file."""
    held: list[Array] = []
    origin: Array | None = None
    sample, count, asked, step, columns = np.empty((0, 3)), 0, 0, 1, 3
    path, file = None, None
    try:
        for chunk in stream():
            rows = np.ascontiguousarray(chunk, dtype=np.float64)
            if len(rows) == 0:
                continue
            xyz, columns = rows[:, :3], rows.shape[1]
            if not np.isfinite(corners(xyz)).all():
                raise InputError("a point has a coordinate that is not a number: all are finite")
            wanted = xyz if site is None else xyz[site.inside(xyz)]
            if origin is None and len(wanted):
                origin = wanted[0].copy()
            sample = np.concatenate([sample, xyz[-count % step :: step]])
            while len(sample) > _SAMPLE:
                sample, step = sample[::2], 2 * step
            count, asked = count + len(rows), asked + len(wanted)
            held.append(rows)
            if count > size:
                if file is None or path is None:
                    path = at()
                    file = path.open("wb")
                for some in held:
                    file.write(some.tobytes())
                held = []
            progress(count)
    finally:
        if file is not None:
            file.close()
    whole = np.concatenate([np.empty((0, columns)), *held]) if file is None else None
    return _Read(columns, count, asked, sample, origin, path, whole)


def _shared(
    cloud: _Read, cuts: Cuts, folder: Path, site: ComparisonSite | None
) -> tuple[TiledCloud, Index]:
    """Every row in the file of its box, and how many of each box are asked for."""
    boxes = len(cuts.boxes)
    blocks: list[list[Array]] = [[] for _ in range(boxes)]
    written, asked = np.zeros(boxes, dtype=np.int64), np.zeros(boxes, dtype=np.int64)
    for chunk in cloud.chunks():
        number = cuts.numbers(chunk)
        rows = chunk[np.argsort(number, kind="stable")]
        ends = np.cumsum(np.bincount(number, minlength=boxes))
        for k in np.flatnonzero(np.diff(ends, prepend=0)):
            some = rows[ends[k - 1] if k else 0 : ends[k]]
            with (folder / f"{k}.points").open("ab") as file:
                file.write(some.tobytes())
            blocks[k].append(_block(int(written[k]), some))
            written[k] += len(some)
            asked[k] += len(some) if site is None else site.inside(some[:, :3]).sum()
    tables = tuple(np.concatenate([np.empty((0, 8)), *some]) for some in blocks)
    return TiledCloud(cloud.columns, tables, folder), asked


def _block(first: int, rows: Array) -> Array:
    """Where rows begin, how many they are, and their corners: (1, 8)."""
    return np.array([[first, len(rows), *corners(rows[:, :3]).ravel()]])


@njit(cache=True, nogil=True)
def _boxes_of(rows, axis, at, below):  # type: ignore[no-untyped-def]
    """Follow the cuts to the box of each row."""
    out = np.zeros(len(rows), np.uint16)
    if len(axis) == 0:
        return out
    for k in range(len(rows)):
        node = 0
        while node >= 0:
            node = below[node, 0 if rows[k, axis[node]] < at[node] else 1]
        out[k] = -node - 1
    return out


@njit(cache=True, nogil=True)
def _copy(rows, low, high, out, filled):  # type: ignore[no-untyped-def]
    """Copy the rows within a box behind those that are there; how many there are then."""
    for k in range(len(rows)):
        x, y, z = rows[k, 0], rows[k, 1], rows[k, 2]
        if low[0] <= x <= high[0] and low[1] <= y <= high[1] and low[2] <= z <= high[2]:
            for c in range(rows.shape[1]):
                out[filled, c] = rows[k, c]
            filled += 1
    return filled
