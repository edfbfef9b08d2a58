"""Triangles of the surfaces of LandXML files, one element for each surface."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.io import xml_file
from tribrach.io.models.formats import RawModel
from tribrach.io.scans.units import named_unit

_SPACES = [f"{{http://www.landxml.org/schema/LandXML-{v}}}" for v in ("1.2", "1.1", "1.0", "2.0")]


def read(path: Path, data: bytes) -> RawModel:
    """The triangles of all surfaces, in east, north and height."""
    root = xml_file.load(path, *(space + "LandXML" for space in _SPACES), "LandXML")
    parts, hidden = [], 0
    for number, surface in enumerate(_all(root, "Surface"), start=1):
        triangles, out_of_sight = _triangles(path, surface)
        parts.append((surface.get("name") or f"surface {number}", triangles))
        hidden += out_of_sight
    words = next((u.get("linearUnit") for u in root.iter() if u.get("linearUnit")), None)
    sentences = (f"{hidden} hidden triangles of {path.name} are left out",) if hidden else ()
    unit = None if words is None else named_unit(words)
    return RawModel(Mesh.of(parts, sentences=sentences), unit)


def _all(element: Any, name: str) -> list[Any]:
    """Elements of a name below one, whatever their version."""
    return [e for e in element.iter() if isinstance(e.tag, str) and e.tag.split("}")[-1] == name]


def _triangles(path: Path, surface: Any) -> tuple[Array, int]:
    """Triangles (n, 3, 3) of a surface, and how many of its file are hidden."""
    places: dict[str, tuple[float, float, float]] = {}
    out, hidden = [], 0
    for element in (*_all(surface, "P"), *_all(surface, "F")):
        words = (element.text or "").split()
        try:
            if element.tag.split("}")[-1] == "P":
                north, east, up = (float(word) for word in words[:3])
                places[element.get("id", "")] = (east, north, up)
            elif element.get("i") == "1":
                hidden += 1
            else:
                around = [places[word] for word in words]
                out += [(around[0], b, c) for b, c in pairwise(around[1:])]
        except (ValueError, LookupError) as error:
            raise InputError(
                "the line is no point and no face of a surface",
                file=path,
                line=xml_file.line_of(element),
                cure="export the surface with its triangles",
            ) from error
    return np.array(out, dtype=np.float64).reshape(-1, 3, 3), hidden
