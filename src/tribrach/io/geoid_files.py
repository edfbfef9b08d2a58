"""Grids of geoid heights, or of their sigmas, in the formats of agencies; the content decides.

NTv2 (``.gsb``, as for AUSGeoid), ``.byn`` of NRCan, ``.pgm`` of GeographicLib, ``.ggf`` of Trimble,
``.isg`` of the International Service for the Geoid and GTX are read here; PROJ reads GeoTIFF. The
nodes of binary files stay on disk until a place asks for them. Metres; another quantity is refused
where the file says so.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.height_table import HeightTable
from tribrach.io.keeping import keep

_CURE = "give a grid of geoid heights: GeoTIFF, GTX, .gsb, .byn, .pgm, .ggf or .isg"
#: largest text that is read [bytes], and rows or columns of any grid
_TEXT, _MOST = 400_000_000, 200_000
_GGF = b"TNL GRID FILE\0"
_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")


def read_geoid(path: Path) -> GeoidGrid:
    """A grid of geoid heights, known by its content."""
    if not path.is_file():
        raise InputError(
            "the geoid grid is not there",
            file=path,
            cure="put the grid of your region there; nothing is downloaded",
        )
    keep([path])
    with path.open("rb") as file:
        head = file.read(4096)
    if head[:4] in _TIFF:
        return GeoidGrid(path)
    for shown, read in _READERS:
        if shown(head, path.stat().st_size):
            try:
                table = read(path, head)
            except (ValueError, ArithmeticError, struct.error, LookupError) as error:
                raise InputError(
                    f"the geoid grid cannot be read ({error})", file=path, cure="copy it again"
                ) from error
            _refuse_shape(path, table)
            return GeoidGrid(path, table)
    raise InputError("this is no grid of geoid heights that is known", file=path, cure=_CURE)


def _refuse_shape(path: Path, table: HeightTable) -> None:
    """Refuse a grid that covers no area or lies beyond the poles."""
    rows, columns = table.values.shape
    north = table.south + (rows - 1) * table.dlat
    numbers = (table.south, table.west, table.dlat, table.dlon, table.scale, table.offset)
    fair = all(map(math.isfinite, numbers)) and min(table.dlat, table.dlon) > 1e-6
    fair = fair and max(table.dlat, table.dlon) < 90 and abs(table.west) < 1e4
    if not (fair and rows > 1 and columns > 1 and table.south > -90.01 and north < 90.01):
        raise InputError(
            f"the geoid grid has {rows} x {columns} nodes from latitude {table.south:g} in steps "
            f"of {table.dlat:g} degrees",
            file=path,
            cure="copy it again",
        )


def _nodes(path: Path, begin: int, rows: int, columns: int, kind: str) -> NDArray[Any]:
    """Nodes (rows, columns) of a binary file, which stay there."""
    if not (0 < rows <= _MOST and 0 < columns <= _MOST):
        raise ValueError(f"{rows} rows and {columns} columns")
    size = begin + rows * columns * np.dtype(kind).itemsize
    if path.stat().st_size < size:
        raise ValueError(f"the file ends before its {rows} x {columns} nodes do")
    return np.memmap(path, dtype=kind, mode="r", offset=begin, shape=(rows, columns))


# GTX: four doubles, two integers, rows from the south


def _is_gtx(head: bytes, size: int) -> bool:
    if len(head) < 40:
        return False
    south, west, dlat, dlon, rows, columns = struct.unpack(">4d2i", head[:40])
    fair = -91 < south < 91 and -361 < west < 361 and 0 < dlat < 20 and 0 < dlon < 20
    return bool(fair and rows > 0 and columns > 0 and size == 40 + 4 * rows * columns)


def _gtx(path: Path, head: bytes) -> HeightTable:
    south, west, dlat, dlon, rows, columns = struct.unpack(">4d2i", head[:40])
    values = _nodes(path, 40, rows, columns, ">f4")
    return HeightTable(south, west, dlat, dlon, values, missing=(-88.8888,))


# NTv2: records of 16 bytes, rows from the south, in a row from the east, longitudes to the west


def _is_gsb(head: bytes, size: int) -> bool:
    return head.startswith(b"NUM_OREC")


def _gsb(path: Path, head: bytes) -> HeightTable:
    order = "<" if struct.unpack("<i", head[8:12])[0] == 11 else ">"
    if struct.unpack(f"{order}i", head[8:12])[0] != 11:
        raise ValueError("its header has not 11 records")
    first = {
        head[k : k + 8].strip().decode("latin-1"): head[k + 8 : k + 16] for k in range(0, 352, 16)
    }
    grids = struct.unpack(f"{order}i", first["NUM_FILE"][:4])[0]
    if grids != 1:
        raise InputError(
            f"the geoid grid has {grids} parts", file=path, cure="give a file with one grid"
        )
    axes = [struct.unpack(f"{order}d", first[f"{axis}_{end}"])[0]
            for end in "FT" for axis in ("MAJOR", "MINOR")]  # fmt: skip
    if not np.allclose(axes[:2], axes[2:], rtol=0, atol=1e-3):
        raise InputError(
            "this NTv2 file holds shifts between two ellipsoids and no geoid heights",
            file=path,
            cure=_CURE,
        )
    # seconds of arc or their parts
    unit = {"SECONDS": 3600.0, "MINUTES": 60.0, "DEGREES": 1.0}.get(
        first["GS_TYPE"].strip(b" \0").decode("latin-1").upper(), 3600.0
    )
    south, north, east, west, dlat, dlon = (
        struct.unpack(f"{order}d", first[name])[0] / unit
        for name in ("S_LAT", "N_LAT", "E_LONG", "W_LONG", "LAT_INC", "LONG_INC")
    )
    rows, columns = round((north - south) / dlat) + 1, round((west - east) / dlon) + 1
    if struct.unpack(f"{order}i", first["GS_COUNT"][:4])[0] != rows * columns:
        raise ValueError("the number of its nodes is not that of its limits")
    four = _nodes(path, 352, rows, 4 * columns, f"{order}f4")
    return HeightTable(south, -west, dlat, dlon, four[:, ::4][:, ::-1])


# BYN: 80 bytes, rows from the north


def _is_byn(head: bytes, size: int) -> bool:
    if len(head) < 80:
        return False
    south, north, west, east, dlat, dlon, whole, kind = struct.unpack("<4i4h", head[:24])
    width, order, scaled = (struct.unpack("<h", head[k : k + 2])[0] for k in (32, 48, 50))
    if whole not in (0, 1) or not 0 <= kind <= 9 or width not in (2, 4) or order not in (0, 1):
        return False
    if scaled not in (0, 1) or min(dlat, dlon) <= 0 or not (south < north and west < east):
        return False
    rows, columns = (north - south) // dlat + 1, (east - west) // dlon + 1
    return bool(size == 80 + rows * columns * width)


def _byn(path: Path, head: bytes) -> HeightTable:
    south, north, west, east, dlat, dlon = struct.unpack("<4i2h", head[:20])
    (factor,) = struct.unpack("<d", head[24:32])
    width, order, scaled = (struct.unpack("<h", head[k : k + 2])[0] for k in (32, 48, 50))
    if not factor > 0:
        raise ValueError(f"its factor is {factor:g}")
    rows, columns = (north - south) // dlat + 1, (east - west) // dlon + 1
    second = (1000.0 if scaled else 1.0) / 3600.0
    values = _nodes(path, 80, rows, columns, f"{'<' if order else '>'}i{width}")[::-1]
    low = north - (rows - 1) * dlat
    missing = (32767.0,) if width == 2 else (9999.0 * factor,)
    return HeightTable(
        low * second, west * second, dlat * second, dlon * second, values,
        scale=1 / factor, missing=missing,
    )  # fmt: skip


# PGM: text, then whole numbers of 16 bits, rows from the north


def _is_pgm(head: bytes, size: int) -> bool:
    return head.startswith(b"P5") and b"# Offset" in head and b"# Scale" in head


def _pgm(path: Path, head: bytes) -> HeightTable:
    found = re.match(rb"P5\s+((?:#[^\n]*\n)+)\s*(\d+)\s+(\d+)\s+(\d+)\s", head)
    if found is None or int(found[4]) != 65535:
        raise ValueError("its head is not that of GeographicLib")
    said = dict(re.findall(r"# (\w+) ([^\n]*)", found[1].decode("latin-1")))
    origin = re.fullmatch(r"([\d.]+)([NS])\s+([\d.]+)([EW])", said.get("Origin", "90N 0E").strip())
    if origin is None:
        raise ValueError(f"its origin is {said['Origin']!r}")
    columns, rows = int(found[2]), int(found[3])
    north = float(origin[1]) * (1 if origin[2] == "N" else -1)
    west = float(origin[3]) * (1 if origin[4] == "E" else -1)
    if rows < 2 or columns < 2:
        raise ValueError(f"{rows} rows and {columns} columns")
    dlat, dlon = 180.0 / (rows - 1), 360.0 / columns
    values = _nodes(path, found.end(), rows, columns, ">u2")[::-1]
    return HeightTable(
        north - 180.0, west, dlat, dlon, values,
        scale=float(said["Scale"]), offset=float(said["Offset"]),
    )  # fmt: skip


# GGF: 146 bytes


def _is_ggf(head: bytes, size: int) -> bool:
    return head[2:16] == _GGF


def _ggf(path: Path, head: bytes) -> HeightTable:
    (version,) = struct.unpack("<H", head[:2])
    south, _, west, _, dlat, dlon = struct.unpack("<6d", head[48:96])
    rows, columns = struct.unpack("<2I", head[96:104])
    missing, scalar = struct.unpack("<2d", head[120:136])
    flags = head[138:146]
    if version > 1:
        raise ValueError(f"its version is {version}")
    if not flags[3] & 12:
        raise ValueError("its nodes are neither floats nor integers of 32 bits")
    values = _nodes(path, 146, rows, columns, "<f4" if flags[3] & 8 else "<i4")
    if flags[4] and not flags[4] & 1:
        values = values[::-1]
    if flags[5] and not flags[5] & 1:
        values = values[:, ::-1]
    scaled = bool(flags[0] & 2)
    if scaled and not abs(scalar) > 0:
        raise ValueError(f"its scale is {scalar:g}")
    # what is missing stands in metres, nodes in their own unit
    gaps = (missing * scalar if scaled else missing,) if flags[0] & 4 else ()
    return HeightTable(
        south, west, dlat, dlon, values, scale=1 / scalar if scaled else 1.0, missing=gaps
    )


# ISG: text, rows from the north


def _is_isg(head: bytes, size: int) -> bool:
    return b"begin_of_head" in head


def _isg(path: Path, head: bytes) -> HeightTable:
    with path.open("rb") as file:
        text = file.read(_TEXT + 1)
    if len(text) > _TEXT:
        raise ValueError(f"it has more than {_TEXT / 1e6:g} MB")
    before, mark, behind = text.decode("latin-1").partition("end_of_head")
    if not mark:
        raise ValueError("its head does not end")
    said = {
        key.strip().lower(): value.strip()
        for key, value in re.findall(r"^([^:=\n]+?)\s*[:=]\s*(.*?)\s*$", before, re.MULTILINE)
    }
    order = said.get("data ordering", "n-to-s, w-to-e").lower().replace(" ", "")
    if order not in ("n-to-s,w-to-e", "n-to-s,w-to-e.") or said.get("data format") == "sparse":
        raise ValueError(f"its nodes stand {said.get('data ordering', 'alone')}")
    if said.get("data units", "meters").lower()[:5] not in ("meter", "metre", "m"):
        raise ValueError(f"its unit is {said['data units']}")
    rows, columns = int(said["nrows"]), int(said["ncols"])
    if not (0 < rows <= _MOST and 0 < columns <= _MOST):
        raise ValueError(f"{rows} rows and {columns} columns")
    dlat, dlon = _degrees(said["delta lat"]), _degrees(said["delta lon"])
    south, north = _degrees(said["lat min"]), _degrees(said["lat max"])
    west = _degrees(said["lon min"])
    # limits are those of nodes, or of the cells around them
    if abs((north - south) / dlat - rows) < 0.25:
        south, west = south + dlat / 2, west + dlon / 2
    elif abs((north - south) / dlat - (rows - 1)) > 0.25:
        raise ValueError(f"{rows} rows do not fill its limits")
    numbers: Array = np.array(behind.partition("\n")[2].split(), dtype=float)
    if numbers.size != rows * columns:
        raise ValueError(f"it has {numbers.size} nodes and not {rows * columns}")
    gap = said.get("nodata", "-9999")
    missing = (float(gap),) if re.fullmatch(r"[-+.\deE]+", gap) else ()
    values = numbers.reshape(rows, columns)[::-1]
    return HeightTable(south, west, dlat, dlon, values, missing=missing)


def _degrees(text: str) -> float:
    """Degrees, or degrees with minutes and seconds."""
    parts = re.fullmatch(r"([+-]?)(\d+)[°d]\s*(\d+)['m]\s*([\d.]+)[\"s]?", text)
    if parts is None:
        return float(text)
    size = int(parts[2]) + int(parts[3]) / 60 + float(parts[4]) / 3600
    return -size if parts[1] == "-" else size


#: what shows a format, and its reader; GTX, which has no mark, is the last
_READERS: tuple[tuple[Callable[[bytes, int], bool], Callable[[Path, bytes], HeightTable]], ...] = (
    (_is_gsb, _gsb),
    (_is_pgm, _pgm),
    (_is_ggf, _ggf),
    (_is_isg, _isg),
    (_is_gtx, _gtx),
    (_is_byn, _byn),
)
