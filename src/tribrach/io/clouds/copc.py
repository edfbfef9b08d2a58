"""COPC 1.0: LAZ whose chunks are the nodes of an octree, so that viewers load what they show.

The format is that of https://copc.io: point records 6 or 7, the record ``copc`` 1 first in the
file, chunks of variable size, the hierarchy in pages as extended record ``copc`` 1000 after them.
Fields, steps, offsets and facts are those of LAS. The order of points is that of the octree. The
same points in the same order give the same bytes.

**The octree.** Each point goes into the coarsest node in which its cell of a grid of 128 x 128 x
128 is still free; the first point in the file's order wins a cell. Two departures keep the number
of nodes small: a node that few points reach keeps them all, and a child that would get very few
leaves them to its parent. Places are integers: parts of the root's side, 2^31 of them, so that the
path of a point down the tree is in its bits and nothing depends on rounding.

**Clouds larger than memory.** The tree can only be built once all points are known, so they are
spooled beside the destination first (:class:`PointSpool`). Nodes that very many points reach
(the upper nodes of :class:`OctreeDivision`) take theirs in one pass over the whole cloud, with a
bit for each cell; the remaining subtrees (tiles) are small enough to be built one after the other
in memory.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import lazrs
import numpy as np
from laspy.vlrs.known import LasZipVlr
from laspy.vlrs.vlr import VLR
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.io.clouds.header import CloudHeader, CloudWriter
from tribrach.io.clouds.las import LasRecords, forget_date
from tribrach.io.clouds.staged import Staged
from tribrach.kernels import njit

Places = NDArray[np.int32]
Records = NDArray[np.void]

#: bits of a place; the grid within a node takes the last of them
_BITS, _GRID_BITS = 31, 7
#: cells of a node along each axis
GRID = 1 << _GRID_BITS
#: words of 32 bits that hold a bit for each cell of a node
_WORDS = GRID**3 // 32
#: nodes that at most so many points reach keep them; leaves are then between a quarter of it and
#: all of it, 30,000 to 50,000 on the average, which viewers load in one go
_LEAF = 100_000
#: children with fewer points leave them to their parent
_FEW = 10_000
#: nodes of a page of the hierarchy, about: 16 kB
_PAGE = 512
#: levels over which points are counted before the cloud is divided
_COUNTED = 7
#: points of a block of the spool, and of a subtree that is built in memory
_BLOCK, _TILE = 500_000, 1_000_000
#: bytes of the record ``copc`` 1 and of the offset before the first chunk
_INFO_BYTES, _TABLE_OFFSET = 160, 8
#: head of an extended record, and an entry of the hierarchy
_EVLR = struct.Struct("<H16sHQ32s")
_ENTRY = np.dtype([("key", "<i4", 4), ("offset", "<u8"), ("size", "<i4"), ("points", "<i4")])


@dataclass(frozen=True)
class Cube:
    """The root node in integer coordinates, in steps."""

    corner: Index  #: (3,), lowest corner
    side: int  #: length of its sides

    @classmethod
    def around(cls, low: Index, high: Index) -> Cube:
        """The smallest cube at the lowest corner of a box, at least one step large.

        It is no larger, because some readers take the cube from the bounds in the header.
        """
        return cls(low, max(int((high - low).max()), 1))

    @property
    def deepest(self) -> int:
        """The deepest level: its cells are no larger than one coordinate step."""
        return min(max((self.side - 1).bit_length() - _GRID_BITS, 0), _BITS - _GRID_BITS)

    def places(self, x: NDArray[Any], y: NDArray[Any], z: NDArray[Any]) -> Places:
        """Places (n, 3) of points by their integer coordinates (n,)."""
        out = np.empty((len(x), 3), dtype=np.int32)
        for k, column in enumerate((x, y, z)):
            _place(column, self.corner[k], self.side, out[:, k])
        return out


@dataclass(frozen=True)
class Nodes:
    """Nodes in the order of their points."""

    keys: NDArray[np.int32]  #: (m, 4), level, x, y, z
    ends: Index  #: (m,), number of points up to the end of each node


class OctreeDivision:
    """How a cloud is divided: upper nodes that are filled in one pass, and tiles below them.

    Buckets are the upper nodes, level by level, and then the tiles.

    ``counts`` (128, 128, 128): points in each cell of the root's grid, x first; ``deepest``: level
    that is not divided any more; ``keys`` (m, 4): level, x, y, z of each bucket's node.
    """

    def __init__(self, counts: Index, tile: int, deepest: int) -> None:
        tables, upper, tiles = [], [], []
        many = np.ones((1, 1, 1), dtype=bool)
        for level in range(_COUNTED + 1):
            reached = _coarser(counts, _COUNTED - level)
            parents = many
            if level:
                parents = many.repeat(2, axis=0).repeat(2, axis=1).repeat(2, axis=2)
            many = parents & (reached > tile) & (level < min(deepest, _COUNTED))
            upper.append(_keys(level, many))
            tiles.append(_keys(level, parents & ~many & (reached > 0)))
            tables.append(np.full(reached.size, -1, dtype=np.int32))
        self.upper = sum(map(len, upper))
        self.keys = np.concatenate(upper + tiles)
        starts = np.cumsum([0] + [len(table) for table in tables])
        self._starts, self._table = starts, np.concatenate(tables)
        level, x, y, z = self.keys.T.astype(np.int64)
        self._table[starts[level] + ((x << level) + y << level) + z] = np.arange(len(self.keys))
        self._cells = np.zeros((self.upper, _WORDS), dtype=np.uint32)

    @staticmethod
    def count(places: Places, counts: Index) -> None:
        """Add points, by their places (n, 3), to the counts that a division is made from."""
        _count(places, counts)

    @staticmethod
    def no_counts() -> Index:
        """Counts of a cloud without points."""
        return np.zeros((1 << _COUNTED,) * 3, dtype=np.int64)

    def buckets(self, places: Places) -> NDArray[np.int32]:
        """Bucket (n,) of the next points of the cloud; the cells that they take stay taken."""
        out = np.empty(len(places), dtype=np.int32)
        _descend(places, self._table, self._starts, self._cells, out)
        return out


def subtree(places: Places, level: int, deepest: int) -> tuple[NDArray[np.int64], Nodes]:
    """The nodes of a tile, depth first; the points of a node keep their order.

    ``places`` (n, 3): of the points of the tile; ``deepest``: level that is not divided any more.
    Returns ``order`` (n,): indices of the points in the order of the nodes.
    """
    bound = (_BITS + 1) * (len(places) // _FEW + 1)
    order = np.arange(len(places))
    levels, ends = np.empty(bound, dtype=np.int32), np.empty(bound, dtype=np.int64)
    number = _grow(places, level, deepest, order, levels, ends)
    levels, ends = levels[:number], ends[:number]
    first = places[order[np.concatenate([[0], ends[:-1]])]]
    keys = np.column_stack([levels, first >> (_BITS - levels)[:, None]]).astype(np.int32)
    return order, Nodes(keys, ends)


def _coarser(counts: Index, steps: int) -> Index:
    """Counts in cells that are 2^steps as large."""
    size = len(counts) >> steps
    cells = counts.reshape(size, 1 << steps, size, 1 << steps, size, 1 << steps)
    summed: Index = cells.sum(axis=(1, 3, 5))
    return summed


def _keys(level: int, chosen: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Level, x, y, z of the chosen nodes of a level."""
    places = np.argwhere(chosen)
    return np.insert(places, 0, level, axis=1).astype(np.int32)


@njit(cache=True, nogil=True)
def _place(column, corner, side, out):  # type: ignore[no-untyped-def]
    """Integer coordinates as parts of the side; those on the far face are in the last part."""
    last = np.uint64(2**31 - 1)
    for n in range(len(column)):
        steps = np.int64(column[n]) - corner
        part = (np.uint64(steps) << np.uint64(31)) // np.uint64(side)
        out[n] = np.int32(min(part, last))


@njit(cache=True, nogil=True)
def _count(places, counts):  # type: ignore[no-untyped-def]
    """Count points (n, 3) in the cells of the root's grid."""
    shift = _BITS - _COUNTED
    for n in range(len(places)):
        counts[places[n, 0] >> shift, places[n, 1] >> shift, places[n, 2] >> shift] += 1


@njit(cache=True, nogil=True, inline="always")
def _takes(place, level, cells):  # type: ignore[no-untyped-def]
    """Take the cell of a place in a node of this level; False if it was taken before."""
    shift = _BITS - _GRID_BITS - level
    cell = 0
    for k in range(3):
        cell = (cell << _GRID_BITS) | ((place[k] >> shift) & (GRID - 1))
    bit = np.uint32(1) << np.uint32(cell & 31)
    word = cell >> 5
    if cells[word] & bit:
        return False
    cells[word] |= bit
    return True


@njit(cache=True, nogil=True)
def _descend(places, table, starts, cells, out):  # type: ignore[no-untyped-def]
    """The bucket of each point, in order: the first upper node with a free cell, or a tile."""
    for n in range(len(places)):
        level = 0
        while True:
            shift = _BITS - level
            index = 0
            for k in range(3):
                index = (index << level) + (places[n, k] >> shift)
            bucket = table[starts[level] + index]
            if bucket >= len(cells) or _takes(places[n], level, cells[bucket]):
                break
            level += 1
        out[n] = bucket


@njit(cache=True, nogil=True)
def _grow(places, level, deepest, order, levels, ends):  # type: ignore[no-untyped-def]
    """Divide a tile depth first; nodes, their ends and the order are written into the arguments."""
    cells, scratch = np.empty(_WORDS, dtype=np.uint32), np.empty_like(order)
    part = np.empty(len(order), dtype=np.uint8)
    stack = [(0, len(order), level)]
    nodes = 0
    while len(stack):
        begin, end, level = stack.pop()
        stay = end
        if end - begin > _LEAF and level < deepest:
            cells[:] = 0
            sizes = _shares(places, level, order[begin:end], cells, part)
            _sorted_by_part(order[begin:end], part, sizes, scratch)
            stay = begin + sizes[0]
            for octant in range(8, 0, -1):
                if sizes[octant]:
                    stack.append((end - sizes[octant], end, level + 1))
                    end -= sizes[octant]
        levels[nodes], ends[nodes] = level, stay
        nodes += 1
    return nodes


@njit(cache=True, nogil=True)
def _shares(places, level, order, cells, part):  # type: ignore[no-untyped-def]
    """Part of each point, 0 for the node itself, 1 to 8 for its children, and their sizes (9,)."""
    sizes = np.zeros(9, dtype=np.int64)
    shift = _BITS - 1 - level
    for n in range(len(order)):
        place = places[order[n]]
        part[n] = 0
        if not _takes(place, level, cells):
            for k in range(3):
                part[n] |= ((place[k] >> shift) & 1) << k
            part[n] += 1
        sizes[part[n]] += 1
    few = np.zeros(9, dtype=np.bool_)
    for octant in range(1, 9):
        if sizes[octant] < _FEW:
            few[octant] = True
            sizes[0] += sizes[octant]
            sizes[octant] = 0
    for n in range(len(order)):
        if few[part[n]]:
            part[n] = 0
    return sizes


@njit(cache=True, nogil=True)
def _sorted_by_part(order, part, sizes, scratch):  # type: ignore[no-untyped-def]
    """Sort the order by part, stable within each part."""
    at = np.cumsum(sizes) - sizes
    for n in range(len(order)):
        scratch[at[part[n]]] = order[n]
        at[part[n]] += 1
    order[:] = scratch[: len(order)]


class PointSpool:
    """Points in a hidden file beside the destination, in the order they came.

    Only a block of points is in memory at a time. :meth:`divide` sorts each block by bucket in its
    place; a bucket is then a run of points in every block.
    """

    def __init__(self, path: Path, kind: np.dtype[Any]) -> None:
        self._staged = Staged(path.with_name(f"{path.name}.points"))
        self._kind, self._points = kind, 0
        self._runs = np.zeros((0, 1), dtype=np.int64)

    def append(self, records: Records) -> None:
        """Append points (n,)."""
        self._staged.file.write(np.ascontiguousarray(records).view(np.uint8).data)
        self._points += len(records)

    def blocks(self) -> Iterator[Records]:
        """All points, in blocks."""
        for start in range(0, self._points, _BLOCK):
            yield self._read(start, min(_BLOCK, self._points - start))

    def divide(self, bucket: Callable[[Records], NDArray[np.int32]], number: int) -> None:
        """Sort the points of each block by their ``bucket`` (n,), stable within each."""
        runs = []
        for n, records in enumerate(self.blocks()):
            buckets = bucket(records)
            self._staged.file.seek(n * _BLOCK * self._kind.itemsize)
            in_order = records.take(np.argsort(buckets, kind="stable"))
            self._staged.file.write(in_order.view(np.uint8).data)
            sizes = np.bincount(buckets, minlength=number)
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
        """Some points from a place on."""
        self._staged.file.seek(start * self._kind.itemsize)
        data = self._staged.file.read(size * self._kind.itemsize)
        if len(data) != size * self._kind.itemsize:
            raise OSError(5, "a temporary file was cut while it was read")
        return np.frombuffer(data, dtype=self._kind)


class CopcWriter(LasRecords, CloudWriter):
    """Takes points chunk by chunk; builds the octree and writes the file when the block ends."""

    _failures = (lazrs.LazrsError,)

    def __init__(self, path: Path, header: CloudHeader) -> None:
        # its cubes have one side, and so its steps are alike: the finest of them
        super().__init__(path, replace(header, step=float(header.steps.min())))
        self._las.partial_reset()
        self._las.global_encoding.wkt = True  # what point formats from 6 on always say
        space = "the folder and the space on its disk, which takes the points twice"
        self._staged = Staged(path, space)
        try:
            self._spool = PointSpool(path, self._las.point_format.dtype())
        except BaseException:
            self._staged.discard()
            raise
        self._low, self._high = np.full(3, 2**31), np.full(3, -(2**31))
        self._times = [np.nan, np.nan]

    def write(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> None:
        """Append points (n, 3) [m] and their values (n,) by name of the field."""
        if len(xyz) == 0:
            return
        record = self.record(xyz, values)
        self._las.grow(record)
        for k, name in enumerate(("X", "Y", "Z")):
            self._low[k] = min(self._low[k], record.array[name].min())
            self._high[k] = max(self._high[k], record.array[name].max())
        times = record.array["gps_time"]
        self._times = [np.fmin(self._times[0], times.min()), np.fmax(self._times[1], times.max())]
        with self._staged.writing(lazrs.LazrsError):
            self._spool.append(record.array)

    def _discard(self) -> None:
        self._spool.remove()
        super()._discard()

    def _finish(self) -> None:
        """Write everything from the header to the hierarchy."""
        las, file = self._las, self._staged.file
        if las.point_count == 0:
            las.mins, las.maxs = np.zeros(3), np.zeros(3)
            self._low = self._high = np.zeros(3, dtype=np.int64)
        cube = Cube.around(self._low, self._high)
        laz = lazrs.LazVlr.new_for_compression(
            las.point_format.id, las.point_format.num_extra_bytes, True
        )
        las.are_points_compressed = True
        las.vlrs.insert(0, VLR("copc", 1, "COPC info VLR", bytes(_INFO_BYTES)))
        las.vlrs.append(LasZipVlr(laz.record_data()))
        las.write_to(file)
        keys = self._write_nodes(cube, laz)
        end = file.seek(0, 2)
        file.seek(las.offset_to_point_data)
        entries = _entries(keys, lazrs.read_chunk_table(file, laz), las.offset_to_point_data)
        pages, root = paged_hierarchy(entries, end + _EVLR.size, _PAGE)
        file.seek(end)
        file.write(_EVLR.pack(0, b"copc", 1000, len(pages), b"EPT hierarchy") + pages)
        las.start_of_first_evlr, las.number_of_evlrs = end, 1
        las.vlrs[0] = VLR("copc", 1, "COPC info VLR", self._info(cube, end, root))
        file.seek(0)
        las.write_to(file, ensure_same_size=True)
        forget_date(file)

    def _write_nodes(self, cube: Cube, laz: Any) -> NDArray[np.int32]:
        """Compress all nodes; their keys (m, 4) in the order of the chunks."""
        counts = OctreeDivision.no_counts()
        for records in self._spool.blocks():
            OctreeDivision.count(_places(cube, records), counts)
        division = OctreeDivision(counts, _TILE, cube.deepest)
        self._spool.divide(lambda block: division.buckets(_places(cube, block)), len(division.keys))
        compressor = lazrs.ParLasZipCompressor(self._staged.file, laz)
        compressor.reserve_offset_to_chunk_table()
        keys = [np.zeros((0, 4), dtype=np.int32)]
        for number, key in enumerate(division.keys):
            records = self._spool.bucket(number)
            if number < division.upper:
                nodes, ends = key[None], np.array([len(records)])
            elif len(records):
                order, tree = subtree(_places(cube, records), int(key[0]), cube.deepest)
                records, nodes, ends = records.take(order), tree.keys, tree.ends
            else:
                continue
            compressor.compress_chunks(_parts(records, ends))
            keys.append(nodes)
        compressor.done()
        return np.concatenate(keys)

    def _info(self, cube: Cube, end: int, size: int) -> bytes:
        """The record ``copc`` 1, with place and size of the root page of the hierarchy."""
        step, offset = float(self._header.steps[0]), np.asarray(self._header.offset, dtype=float)
        half = cube.side * step / 2
        center = (cube.corner + cube.side / 2) * step + offset
        times = np.nan_to_num(self._times)
        values = struct.pack("<5d", *center, half, 2 * half / GRID)
        values += struct.pack("<2Q2d", end + _EVLR.size, size, *times)
        return values.ljust(_INFO_BYTES, b"\0")


def _places(cube: Cube, records: Records) -> NDArray[np.int32]:
    """Places (n, 3) of packed records."""
    return cube.places(records["X"], records["Y"], records["Z"])


def _parts(records: Records, ends: NDArray[np.int64]) -> list[memoryview]:
    """The bytes of the points of each node."""
    data = records.view(np.uint8).data
    size = records.itemsize
    starts = [0, *ends[:-1].tolist()]
    return [data[a * size : b * size] for a, b in zip(starts, ends.tolist(), strict=True)]


def _entries(
    keys: NDArray[np.int32], chunks: Sequence[tuple[int, int]], start: int
) -> NDArray[np.void]:
    """Entries (m,) of the hierarchy.

    ``keys`` (m, 4): nodes in the order of the chunks.
    """
    out = np.zeros(max(len(keys), 1), dtype=_ENTRY)  # a cloud without points has an empty root
    if len(keys):
        table = np.array(chunks, dtype=np.int64)
        out["key"], out["points"], out["size"] = keys, table[:, 0], table[:, 1]
        out["offset"] = start + _TABLE_OFFSET + np.cumsum(table[:, 1]) - table[:, 1]
    return out


def paged_hierarchy(entries: NDArray[np.void], start: int, most: int) -> tuple[bytes, int]:
    """The pages of the hierarchy, that of the root first.

    A page has the nodes below one node, level by level, as long as there is room for a whole level;
    below the last level each node is the root of a page of its own, which the page above refers to
    with a number of points of -1.
    """
    level, places = entries["key"][:, 0], entries["key"][:, 1:].astype(np.int64)
    pending = [np.arange(len(entries))]
    pages: list[NDArray[np.void]] = []
    # places in pages of the entries that refer to others, filled once these have their place
    referring: list[tuple[int, int]] = []
    number = 0
    while number < len(pending):
        members = pending[number]
        top = int(level[members].min())
        sizes = np.bincount(level[members] - top)
        sums = np.cumsum(sizes)
        # what fits with references to the level below
        below = np.append(sizes[1:], 0)
        fits = np.flatnonzero(sums + below <= most)
        last = top + (int(fits[-1]) if len(fits) else 0)
        inside = members[level[members] <= last]
        page = entries[inside]
        deeper = members[level[members] > last]
        if len(deeper):
            # the node of the level below that each of them is or lies under
            up = (level[deeper] - last - 1)[:, None]
            roots, under = np.unique(places[deeper] >> up, axis=0, return_inverse=True)
            more = np.zeros(len(roots), dtype=_ENTRY)
            more["key"] = np.column_stack([np.full(len(roots), last + 1), roots])
            more["points"] = -1
            for k in range(len(roots)):
                referring.append((number, len(page) + k))
                pending.append(deeper[under.ravel() == k])
            page = np.concatenate([page, more])
        pages.append(page)
        number += 1
    starts = start + np.cumsum([0, *(page.nbytes for page in pages)])
    for child, (parent, at) in enumerate(referring, start=1):
        pages[parent]["offset"][at] = starts[child]
        pages[parent]["size"][at] = pages[child].nbytes
    return b"".join(page.tobytes() for page in pages), pages[0].nbytes
