"""Meshes: STL in both forms, OBJ with all sorts of faces, what is wrong in a sentence."""

import struct
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.models.formats import read_model

CORNERS = np.array([[[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 0, 3], [1, 0, 3], [0, 2, 3]]])


def binary(corners: np.ndarray, solid: bool = False) -> bytes:
    head = (b"solid like text" if solid else b"").ljust(80, b" ")
    body = b"".join(
        struct.pack("<12fH", *np.zeros(3), *triangle.ravel(), 0) for triangle in corners
    )
    return head + struct.pack("<I", len(corners)) + body


def text(corners: np.ndarray) -> bytes:
    facets = "".join(
        "facet normal 0 0 1\n outer loop\n"
        + "".join(f"  vertex {x} {y} {z}\n" for x, y, z in triangle)
        + " endloop\nendfacet\n"
        for triangle in corners
    )
    return f"solid wall\n{facets}endsolid wall\n".encode()


@pytest.mark.parametrize("data", [binary(CORNERS), binary(CORNERS, True), text(CORNERS)])
def test_stl(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "wall.STL"
    path.write_bytes(data)
    assert read_model(path).triangles == pytest.approx(CORNERS)


def test_obj(tmp_path: Path) -> None:
    path = tmp_path / "wall.obj"
    path.write_text(
        "# wall\nmtllib x.mtl\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n"
        "f 1/1/1 2/2/1 3//1 4\nf -4 -3 -2\n"
    )
    found = read_model(path).triangles
    square = [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]]
    assert found[:2] == pytest.approx(np.array(square))
    assert found[2] == pytest.approx(np.array(square[0]))


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.stl", b"", "empty"),
        ("a.stl", b"x" * 100, "no STL file"),
        ("a.stl", binary(CORNERS)[:-3], "no STL file, or a truncated one"),
        ("a.stl", b"solid x\nvertex 1 2 3\n", "not whole"),
        ("a.stl", b"solid x\nvertex 1 2 a\n vertex 1 2 3\n vertex 1 2 3\n", "no three numbers"),
        ("a.stl", b"solid x\nendsolid\n", "no triangles"),
        ("a.stl", binary(np.full((1, 3, 3), np.nan)), "not finite"),
        ("a.obj", b"v 1 2\n", "a.obj:1: the line is no vertex"),
        ("a.obj", b"v 1 2 3\nf 1 2 x\n", "a.obj:2"),
        ("a.obj", b"v 1 2 3\nf 1 2 3\n", "not there"),
        ("a.obj", b"v 1 2 3\nf -1 -2 -3\n", "not there"),
        ("a.obj", b"v 1 2 3\nf 1 1 99999999999999999999/1\n", "a.obj:2"),
        ("a.obj", b"v 1 2 3\n", "no triangles"),
        ("a.dae", b"x", "is no model"),
    ],
)
def test_wrong_meshes(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError, match=words):
        read_model(path)
