"""LAS and LAZ 1.4: integers of a stated step, sigmas as described extra dimensions, CRS as WKT.

The same points and header give the same bytes: no date is written. Epoch and facts travel as JSON
in a record of their own (user id ``tribrach``, record 1).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import laspy
import numpy as np
from laspy.vlrs.known import WktCoordinateSystemVlr
from laspy.vlrs.vlr import VLR
from lazrs import LazrsError
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.clouds.header import CloudHeader, CloudWriter, exactly
from tribrach.io.clouds.staged import Staged
from tribrach.io.json_text import json_text
from tribrach.io.scans.las import FACTS, LIGHT
from tribrach.kernels import in_threads, njit
from tribrach.scan.scan import Field

#: our names of the format's own dimensions
_RENAMED = {"time": "gps_time"}
_RGB = ("red", "green", "blue")
#: the extra dimension with intensities that 16 bits do not hold
_LIGHT = "intensity_as_measured"
#: bytes of the name of an extra dimension, and names that the library keeps for itself
_NAME_BYTES, _NEVER = 31, frozenset("xyz")
#: numpy types of extra dimensions; others become float64
_TYPES = {"u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"}
#: day and year of creation in the header
_DATE, _DATE_BYTES = 90, 4
#: place and bits of the options of an extra dimension that say it has limits, place of the limits
_OPTIONS, _LIMITED, _LIMITS = 3, 0b110, slice(64, 112)


def las_header(header: CloudHeader) -> laspy.LasHeader:
    """The header of a file with these fields: point format 6, or 7 with colours."""
    colours = set(_RGB) <= {field.name for field in header.fields}
    las = laspy.LasHeader(point_format=7 if colours else 6, version="1.4")
    las.scales, las.offsets = header.steps, np.asarray(header.offset, dtype=float)
    las.system_identifier, las.generating_software = "", "Tribrach"
    light = _light_field(header)
    for field, name in _places(header).items():
        if name not in las.point_format.dimension_names:
            las.add_extra_dim(_extra(field, name))
    if light is not None:
        las.add_extra_dim(_extra(light, _LIGHT))
    _without_limits(las)
    if header.crs is not None:
        las.vlrs.append(WktCoordinateSystemVlr(_wkt(CRS.from_user_input(header.crs))))
        las.global_encoding.wkt = True
    facts = {"name": header.name, "epoch": header.epoch, "intensity": _stretch(header)}
    facts |= dict(header.facts)
    facts |= {} if light is None else {LIGHT: _LIGHT}
    record = json_text(facts, sort_keys=True).encode()
    las.vlrs.append(VLR(*FACTS, "facts as JSON", record))
    return las


def _wkt(crs: CRS) -> str:
    """WKT as LAS 1.4 asks for it (OGC 01-009); of systems that it cannot hold, that of 2019."""
    try:
        wkt = str(crs.to_wkt("WKT1_GDAL"))
    except CRSError:
        return str(crs.to_wkt())
    return wkt


def _without_limits(las: laspy.LasHeader) -> None:
    """Let extra dimensions state no limits: laspy takes them from the first point of each chunk."""
    for record in las.vlrs.get("ExtraBytesVlr"):
        for dimension in record.extra_bytes_structs:
            raw = memoryview(dimension).cast("B")
            raw[_OPTIONS] &= ~_LIMITED & 0xFF
            raw[_LIMITS] = bytes(_LIMITS.stop - _LIMITS.start)


def forget_date(file: BinaryIO) -> None:
    """Zero the day of creation that laspy writes, so that the same points give the same bytes."""
    file.seek(_DATE)
    file.write(bytes(_DATE_BYTES))


def _places(header: CloudHeader) -> dict[Field, str]:
    """Names of the dimensions of fields: the format's own, or 31 bytes at most, each but once."""
    own = {*_own_dimensions(header), _LIGHT}
    names: dict[Field, str] = {}
    for field in header.fields:
        name = _RENAMED.get(field.name, field.name)
        if name not in own or name == _LIGHT:
            wanted, number = name, 2
            name = wanted.encode()[:_NAME_BYTES].decode(errors="ignore")
            while name in own or name in _NEVER:
                end = f"_{number}"
                cut = wanted.encode()[: _NAME_BYTES - len(end)].decode(errors="ignore")
                name, number = cut + end, number + 1
            own.add(name)
        names[field] = name
    return names


def _own_dimensions(header: CloudHeader) -> set[str]:
    """The dimensions that the point format has by itself."""
    colours = set(_RGB) <= {field.name for field in header.fields}
    return set(laspy.PointFormat(7 if colours else 6).dimension_names)


def _light_field(header: CloudHeader) -> Field | None:
    """The intensity, where 16 bits do not hold it as it is."""
    for field in header.fields:
        if field.name == "intensity":
            whole = field.step is not None and field.step > 0 and field.step % 1 == 0
            known = field.low is not None and field.high is not None
            if whole and known and field.low >= 0 and field.high <= 65535:  # type: ignore[operator]
                return None
            return field
    return None


def _extra(field: Field, name: str) -> laspy.ExtraBytesParams:
    """A described extra dimension; descriptions have 32 bytes."""
    kind = np.dtype(field.dtype)
    kind = kind if kind.str[1:] in _TYPES else np.dtype(np.float64)
    description = field.description.encode()[:32].decode(errors="ignore")
    return laspy.ExtraBytesParams(name, kind, description)


def _stretch(header: CloudHeader) -> list[float] | None:
    """Limits of an intensity that is stretched to 0 to 65535; None if it is kept as it is."""
    for field in header.fields:
        if field.name == "intensity" and field.low is not None and field.high is not None:
            kept = field.low >= 0 and 255 <= field.high <= 65535
            return None if kept or field.high <= field.low else [field.low, field.high]
    return None


class LasRecords:
    """Points as the packed records of a file."""

    def __init__(self, path: Path, header: CloudHeader) -> None:
        self._path, self._header = path, header
        self._stretch = _stretch(header)
        self._las = las_header(header)
        self._light_field, self._places = _light_field(header), _places(header)

    def record(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> laspy.PackedPointRecord:
        """Packed records of points (n, 3) [m] and their values (n,) by name of the field."""
        record = laspy.PackedPointRecord.zeros(len(xyz), self._las.point_format)
        whole = np.empty((3, len(xyz)), dtype=np.int32)
        beyond = np.zeros(1, dtype=bool)
        given = np.ascontiguousarray(xyz), self._header.offset, self._header.steps
        in_threads(_integers, len(xyz), *given, whole, beyond)
        if beyond[0]:
            self._refuse(xyz)
        columns: dict[str, NDArray[Any]] = dict(zip(("X", "Y", "Z"), whole, strict=True))
        one = np.ones(len(xyz), dtype=np.uint8)
        columns |= dict.fromkeys(("return_number", "number_of_returns"), one)
        for field in self._header.fields:
            if field.name in values:
                columns[self._places[field]] = values[field.name]
                if field == self._light_field:
                    columns[_LIGHT] = values[field.name]

        def fill(first: int, last: int) -> None:
            """Copy some points: numpy works without the interpreter's lock."""
            some = record[first:last]
            for name, column in columns.items():
                part = column[first:last]
                part = self._light(part) if name == "intensity" else part
                types = some.array.dtype
                if name in (types.names or ()):
                    kind = types[name]
                    some.array[name] = exactly(part, kind, name, self._path)
                else:
                    # a few bits of a byte that has others as well
                    some[name] = exactly(part, np.uint8, name, self._path)

        try:
            in_threads(fill, len(xyz))
        except OverflowError as error:
            # laspy: of a byte with several fields none may spill into its neighbour
            raise InputError(
                f"a value does not fit the bits that LAS has for it ({error})",
                file=self._path,
                cure="write the cloud as PLY or E57",
            ) from error
        return record

    def _light(self, intensity: NDArray[Any]) -> NDArray[np.uint16]:
        """Intensities (n,) as the integers of the format."""
        if self._stretch is not None:
            low, high = self._stretch
            intensity = (intensity.astype(np.float64) - low) * (65535 / (high - low))
        known = np.nan_to_num(intensity, nan=0.0, posinf=65535.0, neginf=0.0)
        whole: NDArray[np.uint16] = np.clip(np.rint(known), 0, 65535).astype(np.uint16)
        return whole

    def _refuse(self, xyz: Array) -> None:
        """Raise the error that tells which coordinates do not fit."""
        if not np.isfinite(xyz).all():
            raise InputError("a coordinate is not a number", file=self._path)
        far = float(np.abs(xyz - self._header.offset).max())
        raise InputError(
            f"coordinates {far:.0f} m from the offset do not fit steps of "
            f"{1e3 * self._header.steps.max():g} mm",
            file=self._path,
            cure="write separate clouds, or take a coarser step",
        )


class LasWriter(LasRecords, CloudWriter):
    """Writes points chunk by chunk, compressed if the suffix of the file is ``.laz``."""

    _failures = (LazrsError,)

    def __init__(self, path: Path, header: CloudHeader) -> None:
        super().__init__(path, header)
        self._staged = Staged(path)
        with self._staged.writing(LazrsError):
            self._writer = laspy.LasWriter(
                self._staged.file,
                self._las,
                do_compress=path.suffix.lower() == ".laz",
                laz_backend=laspy.LazBackend.LazrsParallel,
                closefd=False,
            )

    def write(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> None:
        """Append points (n, 3) [m] and their values (n,) by name of the field."""
        if len(xyz) == 0:
            return
        record = self.record(xyz, values)
        with self._staged.writing(LazrsError):
            self._writer.write_points(record)

    def _finish(self) -> None:
        self._writer.close()
        forget_date(self._staged.file)


@njit(cache=True, nogil=True)
def _integers(first, last, xyz, offset, step, out, beyond):  # type: ignore[no-untyped-def]
    """Steps from the offset, rounded to even; ``beyond`` (1,) is set if one exceeds 32 bits."""
    for n in range(first, last):
        for k in range(3):
            value = np.rint((xyz[n, k] - offset[k]) / step[k])
            if abs(value) < 2147483647.0:
                out[k, n] = np.int32(value)
            else:
                beyond[0] = True
