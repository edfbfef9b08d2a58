"""Triangles of a grid of terrain heights in a GeoTIFF file, two for each cell.

A height stands at the middle of its pixel unless the file says that it stands at the corner
(OGC 19-008r4, GTRasterTypeGeoKey). Cells beside a pixel without height are left out.
"""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.io.models.formats import RawModel
from tribrach.io.scans.units import unit_of_crs

#: more pixels are refused: two triangles each
_MOST = 4_000_000
#: tags of the grid, its keys, and what stands for no height
_STEP, _TIE, _MATRIX, _KEYS, _NONE = 33550, 33922, 34264, 34735, 42113
#: keys: kind of system, point or area, codes of the systems; what a user defines
_KIND, _RASTER, _PROJECTED, _GEOGRAPHIC, _OWN = 1024, 1025, 3072, 2048, 32767


@contextmanager
def _unheard() -> Iterator[None]:
    """A block in which libtiff, which knows no other way, prints nothing on the terminal."""
    terminal = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(terminal, 2)
        os.close(terminal)


def read(path: Path, data: bytes) -> RawModel:
    """The triangles of a grid."""
    image: Any = import_module("PIL.Image")
    cure = "export it as GeoTIFF with one band of heights"
    before = image.MAX_IMAGE_PIXELS
    try:
        # its size is looked at below, before any pixel is read
        image.MAX_IMAGE_PIXELS = None
        with (
            warnings.catch_warnings(action="ignore"),
            image.open(io.BytesIO(data), formats=["TIFF"]) as picture,
        ):
            tags = dict(picture.tag_v2)
            columns, rows = picture.size
            if rows * columns > _MOST or rows < 2 or columns < 2:
                raise InputError(
                    f"the grid has {rows} x {columns} heights",
                    file=path,
                    cure=f"cut out the site, at least 2 x 2 and at most {_MOST} heights",
                )
            if len(picture.getbands()) != 1 or picture.mode in ("P", "1", "L"):
                raise InputError(
                    f"the picture has colours (mode {picture.mode}) and no heights",
                    file=path,
                    cure=cure,
                )
            with _unheard():
                heights: Array = np.array(picture, dtype=np.float64)
        east, north = _places(tags, rows, columns)
        keys = _keys(tags)
        gap = str(tags.get(_NONE, "")).strip("\0 ")
        missing = float(gap) if gap else np.nan
    except InputError:
        raise
    # a damaged file fails anywhere in its library
    except Exception as error:
        why = str(error) or type(error).__name__
        if "BytesIO" in why:
            why = "it is no TIFF, or damaged"
        raise InputError(
            f"the grid of heights cannot be read ({why})",
            file=path,
            cure=cure,
        ) from error
    finally:
        image.MAX_IMAGE_PIXELS = before
    if keys.get(_KIND) == 2:
        raise InputError(
            "the grid is in degrees", file=path, cure="project it to metres, as gdalwarp does"
        )
    crs = _system(keys)
    known = np.isfinite(heights) & (heights != missing)
    corners = np.stack([east, north, heights], axis=2)
    nw, ne, sw, se = (
        (slice(row, row - 1 or None), slice(column, column - 1 or None))
        for row in (0, 1)
        for column in (0, 1)
    )
    whole = known[nw] & known[ne] & known[sw] & known[se]
    halves = ((nw, sw, ne), (ne, sw, se))
    triangles = np.concatenate(
        [np.stack([corners[k][whole] for k in three], axis=1) for three in halves]
    )
    left = int((~whole).sum())
    said = (f"{left} cells of {path.name} without heights are left out",) if left else ()
    mesh = Mesh.of([(path.stem, triangles)], crs=crs, sentences=said)
    return RawModel(mesh, None if crs is None else unit_of_crs(crs))


def _keys(tags: dict[int, Any]) -> dict[int, int]:
    """Keys of the reference system whose values stand beside them."""
    words = [int(word) for word in tags.get(_KEYS, ())]
    rows = [words[k : k + 4] for k in range(4, len(words) - 3, 4)]
    return {key: value for key, at, _, value in rows if at == 0}


def _system(keys: dict[int, int]) -> str | None:
    """WKT of the projected system, if the file names one."""
    code = keys.get(_PROJECTED, _OWN)
    if code == _OWN:
        return None
    try:
        return CRS.from_epsg(code).to_wkt()
    except CRSError:
        return None


def _places(tags: dict[int, Any], rows: int, columns: int) -> tuple[Array, Array]:
    """East and north (rows, columns) of the heights."""
    if _MATRIX in tags:
        matrix = np.array(tags[_MATRIX], dtype=float).reshape(4, 4)
    else:
        dx, dy = (float(v) for v in tags[_STEP][:2])
        i, j, _, x, y = (float(v) for v in tags[_TIE][:5])
        matrix = np.array([[dx, 0, 0, x - i * dx], [0, -dy, 0, y + j * dy], [0] * 4, [0] * 4])
    middle = 0.0 if _keys(tags).get(_RASTER) == 2 else 0.5
    column, row = np.meshgrid(np.arange(columns) + middle, np.arange(rows) + middle)
    return (
        matrix[0, 0] * column + matrix[0, 1] * row + matrix[0, 3],
        matrix[1, 0] * column + matrix[1, 1] * row + matrix[1, 3],
    )
