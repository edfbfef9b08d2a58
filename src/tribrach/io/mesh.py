"""Triangles of a model from STL (text or binary) and OBJ files, coordinates as in the file [m]."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.xml_file import MAX_BYTES, read_bytes

__all__ = ["MESHES", "read_mesh"]


#: suffixes of meshes
MESHES = (".stl", ".obj")
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEAD = 84
_VERTEX = re.compile(rb"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.MULTILINE)


def read_mesh(path: Path) -> Array:
    """Triangles (n, 3, 3) of a file; polygons are cut into triangles from their first corner."""
    data = read_bytes(path)
    suffix = path.suffix.lower()
    if suffix not in MESHES:
        raise InputError(
            f"{suffix or 'no suffix'} is no mesh", file=path, cure=f"use {' or '.join(MESHES)}"
        )
    triangles = _stl(path, data) if suffix == ".stl" else _obj(path, data)
    if len(triangles) == 0:
        raise InputError("the model has no triangles", file=path, cure="export its surfaces")
    if not np.isfinite(triangles).all():
        raise InputError("the model has corners that are not finite", file=path, cure="repair it")
    return triangles


def _stl(path: Path, data: bytes) -> Array:
    """Triangles of an STL file: binary where the size fits the count, else text."""
    if len(data) >= _HEAD:
        count = int(np.frombuffer(data, "<u4", 1, 80)[0])
        if len(data) == _HEAD + count * _RECORD.itemsize:
            corners = np.frombuffer(data, _RECORD, count, _HEAD)["corners"]
            return corners.astype(np.float64)
    if not data.lstrip().startswith(b"solid"):
        raise InputError("this is no STL file, or a truncated one", file=path, cure="export again")
    vertices = _VERTEX.findall(data)
    if len(vertices) % 3:
        raise InputError("the last triangle is not whole", file=path, cure="export again")
    try:
        return np.array(vertices, dtype=np.float64).reshape(-1, 3, 3)
    except ValueError as error:
        raise InputError("a vertex is no three numbers", file=path, cure="export again") from error


def _obj(path: Path, data: bytes) -> Array:
    """Triangles of lines ``v x y z`` and ``f a b c ...``; what follows a slash is not used."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for number, line in enumerate(data.splitlines(), start=1):
        words = line.split()
        if not words or words[0] not in (b"v", b"f"):
            continue
        try:
            if words[0] == b"v":
                x, y, z = (float(word) for word in words[1:4])
                vertices.append([x, y, z])
            else:
                around = [_corner(word, len(vertices)) for word in words[1:]]
                faces += [(around[0], b, c) for b, c in pairwise(around[1:])]
        except ValueError as error:
            raise InputError(
                "the line is no vertex and no face", file=path, line=number, cure="export again"
            ) from error
    corners = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if len(corners) and (corners.min() < 0 or corners.max() >= len(vertices)):
        raise InputError("a face names a vertex that is not there", file=path, cure="export again")
    return np.array(vertices, dtype=np.float64).reshape(-1, 3)[corners]


def _corner(word: bytes, count: int) -> int:
    """Index of a vertex from zero; negative numbers count back from the last vertex so far."""
    index = int(word.split(b"/")[0])
    if abs(index) > MAX_BYTES:
        raise ValueError("more vertices than a file can hold")
    return index - 1 if index > 0 else count + index
