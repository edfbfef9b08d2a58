"""COPC 1.0: LAZ whose chunks are the nodes of an octree, so that viewers load what they show.

The format is that of https://copc.io: point records 6 or 7, the record ``copc`` 1 first in the
file, chunks of variable size, the hierarchy as extended record ``copc`` 1000 behind them. Fields,
steps, offsets and facts are those of LAS. The order of points is that of the octree.

The tree can only be built once all points are known: they are spooled beside the destination
first. The same points in the same order give the same bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import lazrs  # type: ignore[import-untyped]
import numpy as np
from laspy.vlrs.known import LasZipVlr
from laspy.vlrs.vlr import VLR
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.clouds.las import LasRecords, forget_date
from tribrach.io.clouds.octree import GRID, Cube, Plan, subtree
from tribrach.io.clouds.point_spool import PointSpool, Records
from tribrach.io.clouds.staged import Staged

__all__ = ["CopcWriter"]

Array = NDArray[np.float64]

#: points of a subtree that is built in memory
_TILE = 1_000_000
#: bytes of the record ``copc`` 1 and of the offset before the first chunk
_INFO_BYTES, _TABLE_OFFSET = 160, 8
_EVLR = struct.Struct("<H16sHQ32s")
_ENTRY = np.dtype([("key", "<i4", 4), ("offset", "<u8"), ("size", "<i4"), ("points", "<i4")])


class CopcWriter(LasRecords):
    """Takes points chunk by chunk; builds the octree and writes the file when the block ends.

    Raises
    ------
    InputError : the file cannot be written, or coordinates do not fit the integers of the step.
    """

    def __init__(self, path: Path, header: CloudHeader) -> None:
        super().__init__(path, header)
        self._las.partial_reset()
        self._las.global_encoding.wkt = True  # what point formats from 6 on always say
        self._staged = Staged(path)
        try:
            self._spool = PointSpool(path, self._las.point_format.dtype())
        except BaseException:
            self._staged.discard()
            raise
        self._low, self._high = np.full(3, 2**31), np.full(3, -(2**31))
        self._times = [np.nan, np.nan]

    def write(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> None:
        """Append points (n, 3) [m] and their values."""
        if len(xyz) == 0:
            return
        record = self.record(xyz, values)
        self._las.grow(record)
        for k, name in enumerate(("X", "Y", "Z")):
            self._low[k] = min(self._low[k], record.array[name].min())
            self._high[k] = max(self._high[k], record.array[name].max())
        times = record.array["gps_time"]
        self._times = [np.fmin(self._times[0], times.min()), np.fmax(self._times[1], times.max())]
        with _disk(self._path):
            self._spool.append(record.array)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if kind is None:
                with _disk(self._path):
                    self._finish()
                self._staged.commit()
        finally:
            self._spool.remove()
            self._staged.discard()

    def _finish(self) -> None:
        """Everything from the header to the hierarchy."""
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
        page = _hierarchy(keys, lazrs.read_chunk_table(file, laz), las.offset_to_point_data)
        file.seek(end)
        file.write(_EVLR.pack(0, b"copc", 1000, len(page), b"EPT hierarchy") + page)
        las.start_of_first_evlr, las.number_of_evlrs = end, 1
        las.vlrs[0] = VLR("copc", 1, "COPC info VLR", self._info(cube, end, len(page)))
        file.seek(0)
        las.write_to(file, ensure_same_size=True)
        forget_date(file)

    def _write_nodes(self, cube: Cube, laz: Any) -> NDArray[np.int32]:
        """Compress all nodes; their keys (m, 4) in the order of the chunks."""
        counts = Plan.no_counts()
        for records in self._spool.blocks():
            Plan.count(_places(cube, records), counts)
        plan = Plan(counts, _TILE, cube.deepest)
        self._spool.divide(lambda block: plan.buckets(_places(cube, block)), len(plan.keys))
        compressor = lazrs.ParLasZipCompressor(self._staged.file, laz)
        compressor.reserve_offset_to_chunk_table()
        keys = [np.zeros((0, 4), dtype=np.int32)]
        for number, key in enumerate(plan.keys):
            records = self._spool.bucket(number)
            if number < plan.upper:
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
        """The record ``copc`` 1; end : where the extended record begins; size : of its page."""
        step, offset = self._header.step, np.asarray(self._header.offset, dtype=float)
        half = cube.side * step / 2
        center = (cube.corner + cube.side / 2) * step + offset
        times = np.nan_to_num(self._times)
        values = struct.pack("<5d", *center, half, 2 * half / GRID)
        values += struct.pack("<2Q2d", end + _EVLR.size, size, *times)
        return values.ljust(_INFO_BYTES, b"\0")


def _places(cube: Cube, records: Records) -> NDArray[np.int32]:
    return cube.places(records["X"], records["Y"], records["Z"])


def _parts(records: Records, ends: NDArray[np.int64]) -> list[memoryview]:
    """The bytes of points up to each end."""
    data = records.view(np.uint8).data
    size = records.itemsize
    starts = [0, *ends[:-1].tolist()]
    return [data[a * size : b * size] for a, b in zip(starts, ends.tolist(), strict=True)]


def _hierarchy(keys: NDArray[np.int32], chunks: Sequence[tuple[int, int]], start: int) -> bytes:
    """One page with all nodes; chunks : points and bytes of each; start : of the point data."""
    page = np.zeros(max(len(keys), 1), dtype=_ENTRY)  # a cloud without points has an empty root
    if len(keys):
        table = np.array(chunks, dtype=np.int64)
        page["key"], page["points"], page["size"] = keys, table[:, 0], table[:, 1]
        page["offset"] = start + _TABLE_OFFSET + np.cumsum(table[:, 1]) - table[:, 1]
    return page.tobytes()


@contextmanager
def _disk(path: Path) -> Iterator[None]:
    """What the disk refuses, as a sentence."""
    try:
        yield
    except (OSError, lazrs.LazrsError) as error:
        words = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"the file cannot be written ({words})",
            file=path,
            cure="check the folder and the space on its disk, which takes the points twice",
        ) from error
