"""LAS, LAZ and COPC, read in chunks.

The format says nothing about a scanner: it is assumed at (0, 0, 0) where that lies among the
points. Every dimension passes through under its own name, ``gps_time`` as ``time``.

What the header promises is checked against the size of the file before anything is read: laspy
takes what is missing for zeros and believes every count, and lazrs reserves memory for as many
chunks, points of a chunk and bytes of a layer as a file names, so that a few wrong bytes would cost
all memory or end the process. Positions are those of LAS 1.4 R15, tables 3 (header), 6 (record
headers), and of LASzip (Isenburg 2013, PE&RS 79:209, and the layered chunks of its version 3):
record 22204, chunk table, and the sizes of layers at the beginning of each layered chunk.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import laspy
import lazrs
import numpy as np
from laspy.point.dims import COMPOSED_FIELDS
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.crs import CompoundCRS
from pyproj.exceptions import CRSError

from tribrach.errors import InputError
from tribrach.io.scans.facts import told_facts
from tribrach.io.scans.origin import assumed_origin, scan_name
from tribrach.io.scans.text_scan import off_by_one
from tribrach.io.scans.units import LINEAR, unit_of_crs
from tribrach.kernels import in_threads
from tribrach.scan.length_unit import METRES, LengthUnit
from tribrach.scan.scan import CHUNK, Chunk, Field, Lattice, Scan

CURE = "copy the file again from its source"
#: bytes of the header of a record before the points, and of one after them
_RECORD, _EXTENDED = 54, 60
#: bytes of the shortest header, and of that of LAS 1.4
_SHORTEST, _LONG = 227, 375
#: bit of the point format that says that points are compressed
_COMPRESSED = 0x80
#: user and number of the record with the facts of our own writer
FACTS = ("tribrach", 1)
#: the fact that names the extra dimension with the intensities as measured
LIGHT = "intensity_field"
#: dimensions that are not called as in the file
_RENAMED = {"gps_time": "time", "time": "time_2"}
_COORDINATES = ("X", "Y", "Z")
#: user and number of the record that says how points are compressed, and its fixed bytes
_LASZIP, _LASZIP_ID, _LASZIP_FIXED = b"laszip encoded", 22204, 34
#: layered chunks, and the number of layers of each kind of item; bytes have a layer each
_LAYERED, _LAYERS, _BYTES = 3, {10: 9, 11: 1, 12: 2, 13: 1}, 14
#: parts of a point by their kind
_ITEMS = {
    **dict(zip((0, 6, 7, 8, 9), ("bytes", "point", "GPS time", "RGB", "wave packet"), strict=True)),
    10: "point 1.4",
    11: "RGB 1.4",
    12: "RGB and NIR 1.4",
    13: "wave packet 1.4",
    14: "bytes 1.4",
}
#: where a COPC file says that it is one, in the header and the first record
_COPC_AT = 377
#: chunks of a stated number of points each have this one
_VARIABLE = 0xFFFFFFFF
#: the points of one chunk may need this much memory in any file, and this many times its size
_CHUNK_BYTES, _CHUNK_GROWTH = 1 << 26, 300
#: user and number of the records with GeoTIFF keys, number of that with a WKT
_GEO_KEYS, _WKT_RECORD = ("LASF_Projection", 34735), 2112
#: keys for the linear unit of the plane, the vertical system, and the unit of heights
_PLANE_UNIT, _VERTICAL, _HEIGHT_UNIT = 3076, 4096, 4099
#: linear units by their number in the EPSG data set
_UNITS_EPSG = {9001: "metre", 9002: "foot", 9003: "US survey foot"}
#: scales and offsets beyond these are no lengths in metres
_COARSEST, _FARTHEST = 1e3, 1e12


def check_header(path: Path) -> None:
    """Refuse a header that promises more than its file can hold."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_COPC_AT + 4)
        if not head.startswith(b"LASF"):
            return
        if len(head) < _SHORTEST:
            raise _refused(f"the header has {_SHORTEST} bytes and the file has {size}", path)
        length, begin, records = struct.unpack_from("<HII", head, 94)
        if begin > size:
            raise _refused(f"the points begin at byte {begin} and the file has {size} bytes", path)
        if not _SHORTEST <= length <= begin:
            raise _refused(f"the header says that it has {length} bytes", path)
        if _RECORD * records > begin - length:
            raise _refused(f"the header names {records} records, more than fit", path)
        if head[25] >= 4 and length >= _LONG <= len(head):
            _check_extended(file, head, size, path)
        width = struct.unpack_from("<H", head, 105)[0]
        if not head[104] & _COMPRESSED:
            if _points(head) * width > size - begin and _whole_points(head, size) is None:
                told = f"the header promises {_points(head)} points of {width} bytes, and the file"
                raise _refused(f"{told} has {size - begin} bytes of points", path)
        else:
            zipped = _laszip(file, length, records, begin, path)
            if zipped.chunk == 0 and head[_COPC_AT:].startswith(b"copc"):
                # as LAStools and lasR write chunks of any size into COPC
                zipped = replace(zipped, chunk=_VARIABLE)
            zipped.check(width, size, path)
            end = _check_chunks(file, begin, size, zipped.chunks_of(_points(head)), path)
            lengths = None if end is None else _chunk_lengths(file, zipped, begin, end, path)
            if zipped.layered:
                last = size if end is None else end
                _check_layers(file, zipped, begin, last, lengths, _points(head), path)


def _whole_points(head: bytes, size: int) -> int | None:
    """Points of a file whose count is off by one; None where it is right or off by more.

    Some programs count so. The points are not compressed, fill the file and nothing follows them.
    """
    if not head.startswith(b"LASF") or len(head) < _SHORTEST:
        return None
    (begin,), (width,) = struct.unpack_from("<I", head, 96), struct.unpack_from("<H", head, 105)
    extended = head[25] >= 4 and len(head) >= _LONG and struct.unpack_from("<QI", head, 235)[1]
    if head[104] & _COMPRESSED or extended or width == 0 or (size - begin) % width:
        return None
    there = (size - begin) // width
    return there if there > 0 and abs(there - _points(head)) == 1 else None


def _check_extended(file: BinaryIO, head: bytes, size: int, path: Path) -> None:
    """Refuse records after the points that reach beyond the end of the file."""
    at, records = struct.unpack_from("<QI", head, 235)
    if records and at + _EXTENDED * records > size:
        raise _refused(f"the header names {records} records at byte {at}, more than fit", path)
    for end in _ends(file, at, records):
        if end > size:
            raise _refused(f"a record ends at byte {end} and the file has {size} bytes", path)


def _ends(file: BinaryIO, at: int, records: int) -> Iterator[int]:
    """Where each of the records after the points ends."""
    for _ in range(records):
        file.seek(at)
        head = file.read(_EXTENDED)
        at += _EXTENDED + (struct.unpack_from("<Q", head, 20)[0] if len(head) == _EXTENDED else 0)
        yield at


@dataclass(frozen=True)
class _LasZip:
    """What a file says of its compression."""

    layered: bool  #: each attribute of a chunk is a layer of its own
    chunk: int  #: points in a chunk
    items: tuple[tuple[int, int], ...]  #: kind and bytes of each part of a point
    versions: tuple[int, ...]  #: version of the compression of each part
    record: bytes  #: the record as it stands, which lazrs reads

    @property
    def names(self) -> list[str]:
        """The parts of a point, as LASzip calls them."""
        return [_ITEMS.get(kind, f"kind {kind}") for kind, _ in self.items]

    @property
    def width(self) -> int:
        """Bytes of a point."""
        return sum(size for _, size in self.items)

    def chunks_of(self, points: int) -> int:
        """Chunks that hold so many points at least."""
        return min(points, 1) if self.chunk == _VARIABLE else -(-points // self.chunk)

    @property
    def layers(self) -> int:
        """Layers of a chunk."""
        return sum(size if kind == _BYTES else _LAYERS.get(kind, 0) for kind, size in self.items)

    def check(self, width: int, size: int, path: Path) -> None:
        """Refuse points of another width than the header's, and chunks that need all memory."""
        if self.width != width:
            raise _refused(
                f"a point has {width} bytes and its compressed parts have {self.width}", path
            )
        newer = [
            f"{k} version {v}" for k, v in zip(self.names, self.versions, strict=True) if v > 3
        ]
        if newer:
            raise InputError(
                f"the points are compressed as items of a newer version ({', '.join(newer)}), "
                "which the decoder here does not know; the file may be sound",
                file=path,
                cure="write it as LAS, or as LAZ of LASzip 3, with LAStools (laszip) or PDAL 2.9",
            )
        if self.layered and any(k not in _LAYERS and k != _BYTES for k, _ in self.items):
            raise _refused("the points are compressed in layers of a kind that is none", path)
        if not self.layered and any(k in _LAYERS or k == _BYTES for k, _ in self.items):
            # the decoder goes by the items, and would reserve what layers claim
            raise _refused("the points are compressed in layers, and the file denies it", path)
        most = max(_CHUNK_BYTES, _CHUNK_GROWTH * size)
        if self.chunk == 0 or (self.chunk != _VARIABLE and self.chunk * width > most):
            raise _refused(
                f"the points are said to lie in chunks of {self.chunk}, in a file of {size} bytes",
                path,
            )


def _laszip(file: BinaryIO, at: int, records: int, begin: int, path: Path) -> _LasZip:
    """The record on compression, which stands before the points."""
    for _ in range(records):
        file.seek(at)
        head = file.read(_RECORD)
        if len(head) < _RECORD:
            break
        number, length = struct.unpack_from("<HH", head, 18)
        at += _RECORD + length
        if at > begin:
            break
        if number != _LASZIP_ID or head[2:18].rstrip(b"\0") != _LASZIP:
            continue
        record = file.read(length)
        if length < _LASZIP_FIXED:
            break
        (compressor,) = struct.unpack_from("<H", record)
        (chunk,) = struct.unpack_from("<I", record, 12)
        (count,) = struct.unpack_from("<H", record, 32)
        if length < _LASZIP_FIXED + 6 * count:
            break
        items = [struct.unpack_from("<HHH", record, _LASZIP_FIXED + 6 * k) for k in range(count)]
        parts, versions = tuple((k, size) for k, size, _ in items), tuple(v for *_, v in items)
        return _LasZip(compressor == _LAYERED, chunk, parts, versions, record)
    raise _refused("the points are compressed, and nothing whole says how", path)


def _check_chunks(file: BinaryIO, begin: int, size: int, least: int, path: Path) -> int | None:
    """Refuse more chunks of compressed points than there are bytes for, and fewer than needed."""
    file.seek(begin)
    at = _integer(file)
    if at == -1:
        # written as a stream: the position stands at the end
        file.seek(size - 8)
        at = _integer(file)
    if at < begin + 8 or at + 8 > size:
        # a stream without a table is read in sequence
        return None
    file.seek(at + 4)
    chunks = int.from_bytes(file.read(4), "little")
    if chunks > size // 8:
        raise _refused(f"the points are said to lie in {chunks} chunks, more than fit", path)
    if chunks < least:
        raise _refused(f"the points lie in {chunks} chunks, and {least} are needed", path)
    return at


def _points(head: bytes) -> int:
    """The number of points that a header states."""
    if head[25] >= 4 and len(head) >= _LONG:
        return int(struct.unpack_from("<Q", head, 247)[0])
    return int(struct.unpack_from("<I", head, 107)[0])


def _chunk_lengths(file: BinaryIO, zipped: _LasZip, begin: int, end: int, path: Path) -> list[int]:
    """Bytes of each chunk as the table at the end says; they must fit before it.

    lazrs reserves them before it reads.
    """
    file.seek(begin)
    table = lazrs.read_chunk_table(file, lazrs.LazVlr(zipped.record))
    lengths = [int(length) for _, length in table]
    room = end - begin - 8
    if sum(lengths) > room:
        raise _refused(f"its table of chunks tells of more bytes than the {room} before it", path)
    return lengths


def _check_layers(
    file: BinaryIO,
    zipped: _LasZip,
    begin: int,
    last: int,
    lengths: list[int] | None,
    points: int,
    path: Path,
) -> None:
    """Refuse layers that reach beyond their chunk, and a table that tells of other chunks.

    lazrs reserves what the beginning of a chunk says before it reads it.
    """
    at, number, told = begin + 8, 0, 0
    form = f"<{1 + zipped.layers}I"
    fixed = zipped.width + struct.calcsize(form)
    # behind the chunks of a stream other records may follow
    while at < last and told < points if lengths is None else number < len(lengths):
        number += 1
        file.seek(at)
        head = file.read(fixed)
        if len(head) < fixed:
            # the end of a stream, or a chunk that is cut, which the decoder sees as well
            if lengths is None:
                return
            raise _refused(f"chunk {number} begins at byte {at} and the file ends there", path)
        count, *sizes = struct.unpack_from(form, head, zipped.width)
        told += count
        length = fixed + sum(sizes)
        if at + length > last or (lengths is not None and length != lengths[number - 1]):
            raise _refused(
                f"the layers of chunk {number} have {length} bytes, and the chunk has "
                f"{last - at if lengths is None else lengths[number - 1]}",
                path,
            )
        at += length


def _integer(file: BinaryIO) -> int:
    """The next eight bytes as a signed integer."""
    return int.from_bytes(file.read(8), "little", signed=True)


def _refused(what: str, path: Path) -> InputError:
    return InputError(what, file=path, cure=CURE)


@dataclass(frozen=True)
class LasScan(Scan):
    """The points of a LAS, LAZ or COPC file."""

    #: the extra dimension with the intensities as measured, None without one
    light: str | None = None

    @property
    def certain_points(self) -> int:
        """Every record is a point, but for other faces and beams without return."""
        left_out = 0 if self.no_return is None else self.no_return.points
        return 0 if self.face is not None else (self.records or 0) - left_out

    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points in the file's order."""
        records = self.records or 0
        with _damage(self.path):
            file = laspy.open(self.path, laz_backend=_backends())
        with file:
            # which may be off by one
            file.header.point_count = records
            if 0 < start < records:
                with _damage(self.path):
                    file.seek(start)
            read = start
            while read < records:
                with _damage(self.path):
                    points = file.read_points(min(size, records - read))
                if len(points) == 0:
                    raise _short(self.path, read, records)
                read += len(points)
                yield self._chunk(points)

    def _chunk(self, points: laspy.ScaleAwarePointRecord) -> Chunk:
        """Coordinates and values of some records."""
        array = points.array
        xyz = np.empty((len(points), 3))
        values: dict[str, NDArray[Any]] = {}
        copies: list[tuple[NDArray[Any], NDArray[Any]]] = []
        packed = COMPOSED_FIELDS[points.point_format.id]
        for name in array.dtype.names:
            if name in packed:
                values |= _unpacked(array[name], packed[name])
            elif name not in _COORDINATES and not (name == "intensity" and self.light):
                ours = "intensity" if name == self.light else _RENAMED.get(name, name)
                columns = array[name].reshape(len(points), -1).T
                for each, theirs in zip(_parts(ours, array[name].shape[1:]), columns, strict=True):
                    kind = np.float32 if ours == "intensity" else theirs.dtype
                    values[each] = np.empty(len(points), dtype=kind)
                    copies.append((theirs, values[each]))

        def fill(first: int, last: int) -> None:
            """Copy some records: numpy works without the interpreter's lock."""
            for k, name in enumerate(_COORDINATES):
                column = xyz[first:last, k]
                np.multiply(array[name][first:last], points.scales[k], out=column)
                column += points.offsets[k]
            for theirs, ours in copies:
                ours[first:last] = theirs[first:last]

        in_threads(fill, len(points))
        for dimension in points.point_format.extra_dimensions:
            if dimension.is_scaled:
                name = _RENAMED.get(dimension.name, dimension.name)
                scaled = np.asarray(points[dimension.name], dtype=np.float64)
                names = _parts(name, scaled.shape[1:])
                values |= dict(zip(names, scaled.reshape(len(points), -1).T, strict=True))
        return Chunk(xyz, values)


def _unpacked(column: NDArray[np.uint8], parts: Any) -> dict[str, NDArray[Any]]:
    """The bit fields of a byte; those of bytes that are zero throughout are left out."""
    column = np.ascontiguousarray(column)  # looked at more than once
    low, high = int(column.min()), int(column.max())
    if high == 0:
        return {}
    out = {}
    for part in parts:
        shift = (part.mask & -part.mask).bit_length() - 1
        if low == high:
            out[part.name] = np.full(len(column), (low & part.mask) >> shift, dtype=np.uint8)
        else:
            out[part.name] = (column & part.mask) >> np.uint8(shift)
    return out


def _check_steps(header: laspy.LasHeader, path: Path) -> None:
    """Refuse a header whose scales and offsets make no coordinates of the integers."""
    scales, offsets = np.asarray(header.scales, float), np.asarray(header.offsets, float)
    good = (scales > 0) & (scales < _COARSEST) & (np.abs(offsets) < _FARTHEST)
    if not good.all():
        k = int(np.argmin(good))
        raise InputError(
            f"the header has the scale {scales[k]:g} and the offset {offsets[k]:g} for "
            f"{'xyz'[k]}, which are none",
            file=path,
            cure=CURE,
        )


def read(path: Path) -> tuple[Scan, ...]:
    """The one scan of a file."""
    with _damage(path):
        check_header(path)
    with path.open("rb") as start:
        there = _whole_points(start.read(_LONG), path.stat().st_size)
    with _damage(path), laspy.open(path, laz_backend=_backends()) as file:
        header = file.header
        wkt, unit = _wkt(header), _key_unit(header)
        _check_steps(header, path)
        steps, offsets = header.scales.tolist(), header.offsets.tolist()
        bounds = np.stack([header.mins, header.maxs]).astype(float)
        records = int(header.point_count)
        warnings: tuple[str, ...] = ()
        if there is not None:
            warnings = (off_by_one(path, records, there),)
            records = there
        facts = _facts(header)
        light = facts.pop(LIGHT, None)
        # what says how the other column is stretched is what these lie between
        limits = _limits(facts.pop("intensity", "")) if light is not None else (None, None)
        given = [d for d in header.point_format.dimensions if not _coordinate(d.name)]
        fields = tuple(f for d in given for f in _fields(d, light, limits))
    return (
        LasScan(
            name=scan_name(path),
            path=path,
            records=records,
            fields=fields,
            origin=assumed_origin(bounds if records else None),
            crs=wkt,
            bounds=bounds if records else None,
            warnings=warnings,
            unit=METRES if unit is None else unit,
            lattice=Lattice(tuple(steps), tuple(offsets)),
            light=light,
            facts={"scales": " ".join(f"{s:g}" for s in header.scales)} | facts,
        ),
    )


def _facts(header: laspy.LasHeader) -> dict[str, str]:
    """What our own writer says of the cloud; nothing of other files."""
    for record in header.vlrs:
        if (record.user_id, record.record_id) == FACTS:
            return told_facts(bytes(record.record_data_bytes()))
    return {}


def _limits(told: str) -> tuple[float | None, float | None]:
    """Limits of an intensity from their text, such as ``0.0 to 1.0``."""
    try:
        low, high = map(float, told.split(" to "))
    except ValueError:
        return None, None
    return (low, high) if np.isfinite([low, high]).all() and low < high else (None, None)


def _fields(
    dimension: Any, light: str | None, limits: tuple[float | None, float | None]
) -> Iterator[Field]:
    """Name, type and limits of a dimension; of an array, of each of its values."""
    name = _RENAMED.get(dimension.name, dimension.name)
    if name == "intensity":
        if light is None:
            yield Field(name, "float32", 0.0, 65535.0, step=1.0)
        return
    if name == light:
        yield Field("intensity", "float32", *limits)
        return
    kind, description = dimension.dtype, str(dimension.description or "")
    if kind is None:
        yield Field(name, "uint8", description=description)
        return
    scaled = np.dtype(np.float64) if dimension.is_scaled else np.dtype(kind).base
    for each in _parts(name, np.dtype(kind).shape):
        yield Field(each, scaled.name, description=description)


def _parts(name: str, shape: tuple[int, ...]) -> list[str]:
    """Names of the values of an array; its own of a single value."""
    return [f"{name}_{k}" for k in range(shape[0])] if shape else [name]


def _coordinate(name: str) -> bool:
    return name in _COORDINATES


def _wkt(header: laspy.LasHeader) -> str | None:
    """The reference system of the coordinates, if the file has one that PROJ knows."""
    try:
        crs = header.parse_crs()
    except Exception:  # PROJ and VLR parsing raise whatever they meet
        return None
    if crs is None:
        return None
    keys = _geo_keys(header)
    if not crs.is_compound and len(crs.axis_info) == 2 and _VERTICAL in keys:
        try:
            height = CRS.from_epsg(keys[_VERTICAL])
            crs = CompoundCRS(f"{crs.name} + {height.name}", [crs, height])
        except CRSError:
            pass
    return str(crs.to_wkt())


def _geo_keys(header: laspy.LasHeader) -> dict[int, int]:
    """The keys of GeoTIFF whose values are short numbers, unless a WKT takes their place."""
    if any(record.record_id == _WKT_RECORD for record in header.vlrs):
        return {}
    for record in header.vlrs:
        if (record.user_id, record.record_id) == _GEO_KEYS:
            try:
                whole = np.frombuffer(bytes(record.record_data_bytes()), dtype="<u2")
            except Exception:  # what laspy parsed it may not write again
                return {}
            entries = whole[4 : 4 + len(whole[4:]) // 4 * 4].reshape(-1, 4).tolist()
            return {key: value for key, where, _, value in entries if where == 0}
    return {}


def _key_unit(header: laspy.LasHeader) -> LengthUnit | None:
    """The unit that keys of GeoTIFF state, which goes before that of the system's code.

    So do GDAL and all that read through it.
    """
    keys = _geo_keys(header)
    plane = _UNITS_EPSG.get(keys.get(_PLANE_UNIT, 0))
    height = _UNITS_EPSG.get(keys.get(_HEIGHT_UNIT, 0))
    if plane is None and height is None:
        return None
    of_crs = None if (wkt := _wkt(header)) is None else unit_of_crs(wkt)
    if of_crs is not None and of_crs.factors is None:
        return None
    known = of_crs or METRES
    x = plane or known.names[0]
    z = height or (known.names[2] if _VERTICAL in keys or plane is None else x)
    names = (x, x, z)
    factors = tuple(LINEAR[name] for name in names)
    return LengthUnit(names, (factors[0], factors[1], factors[2]), "its GeoTIFF keys")


def _backends() -> list[laspy.LazBackend]:
    return [laspy.LazBackend.LazrsParallel, laspy.LazBackend.Lazrs]


def _short(path: Path, read: int, records: int) -> InputError:
    return InputError(
        f"the header states {records} points and the file holds {read}", file=path, cure=CURE
    )


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """Turn what laspy and lazrs raise about a damaged file into an InputError."""
    try:
        yield
    except (InputError, GeneratorExit, KeyboardInterrupt, SystemExit):
        raise
    except FileNotFoundError as error:
        raise InputError("there is no such file", file=path, cure="check its name") from error
    except BaseException as error:
        # a panic of the decoder is no Exception
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        words = str(error).strip().rstrip(".") or type(error).__name__
        raise InputError(
            f"the file is damaged or no LAS file ({words})", file=path, cure=CURE
        ) from error
