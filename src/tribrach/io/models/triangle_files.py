"""Triangles of a model from STL (text or binary) and OBJ files, in the unit of the file.

Elements are the solids of an STL file in text, and the objects or groups of an OBJ file.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.io.models.formats import RawModel
from tribrach.io.xml_file import MAX_BYTES

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEAD = 84
_VERTEX = re.compile(rb"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.MULTILINE)
_SOLID = re.compile(rb"^[ \t]*solid\b[ \t]*([^\r\n]*)", re.MULTILINE)


def read(path: Path, data: bytes) -> RawModel:
    """The triangles of a file; polygons are cut into triangles from their first corner."""
    parts = _stl(path, data) if path.suffix.lower() == ".stl" else _obj(path, data)
    return RawModel(Mesh.of(parts))


def _name(words: bytes, path: Path) -> str:
    """The name of an element, that of the file where it has none."""
    return words.decode("utf-8", "replace").strip() or path.stem


def _stl(path: Path, data: bytes) -> list[tuple[str, Array]]:
    """Triangles of an STL file: binary where the size fits the count, else text."""
    if len(data) >= _HEAD:
        count = int(np.frombuffer(data, "<u4", 1, 80)[0])
        if len(data) == _HEAD + count * _RECORD.itemsize:
            corners = np.frombuffer(data, _RECORD, count, _HEAD)["corners"]
            return [(path.stem, corners.astype(np.float64))]
    if not data.lstrip().startswith(b"solid"):
        raise InputError("this is no STL file, or a truncated one", file=path, cure="export again")
    solids = list(_SOLID.finditer(data))
    ends = [*(solid.end() for solid in solids), len(data)]
    out = []
    for solid, (begin, end) in zip(solids, pairwise(ends), strict=True):
        vertices = _VERTEX.findall(data, begin, end)
        if len(vertices) % 3:
            raise InputError("the last triangle is not whole", file=path, cure="export again")
        try:
            corners = np.array(vertices, dtype=np.float64).reshape(-1, 3, 3)
        except ValueError as error:
            raise InputError(
                "a vertex is no three numbers", file=path, cure="export again"
            ) from error
        out.append((_name(solid[1], path), corners))
    return out


def _obj(path: Path, data: bytes) -> list[tuple[str, Array]]:
    """Triangles of lines ``v x y z`` and ``f a b c ...``; what follows a slash is not used."""
    vertices: list[list[float]] = []
    parts: dict[str, list[tuple[int, int, int]]] = {}
    name = path.stem
    for number, line in enumerate(data.splitlines(), start=1):
        words = line.split()
        if not words or words[0] not in (b"v", b"f", b"o", b"g"):
            continue
        if words[0] in (b"o", b"g"):
            name = _name(b" ".join(words[1:]), path)
            continue
        try:
            if words[0] == b"v":
                x, y, z = (float(word) for word in words[1:4])
                vertices.append([x, y, z])
            else:
                around = [_corner(word, len(vertices)) for word in words[1:]]
                parts.setdefault(name, []).extend(
                    (around[0], b, c) for b, c in pairwise(around[1:])
                )
        except ValueError as error:
            raise InputError(
                "the line is no vertex and no face", file=path, line=number, cure="export again"
            ) from error
    at = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    out = []
    for name, faces in parts.items():
        corners = np.array(faces, dtype=np.int64).reshape(-1, 3)
        if len(corners) and (corners.min() < 0 or corners.max() >= len(at)):
            raise InputError(
                "a face names a vertex that is not there", file=path, cure="export again"
            )
        out.append((name, at[corners]))
    return out


def _corner(word: bytes, count: int) -> int:
    """Index of a vertex from zero; negative numbers count back from the last vertex so far."""
    index = int(word.split(b"/")[0])
    if abs(index) > MAX_BYTES:
        raise ValueError("more vertices than a file can hold")
    return index - 1 if index > 0 else count + index
