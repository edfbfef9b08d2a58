"""Triangles of the faces of a drawing: 3DFACE, MESH and polyface meshes; elements are layers."""

from __future__ import annotations

import io
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.io.models.formats import RawModel
from tribrach.io.scans.units import named_unit
from tribrach.scan.length_unit import LengthUnit

#: units by the number of ``$INSUNITS``
_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 7: "km", 10: "yd", 14: "dm", 21: "usft"}
#: bodies whose faces only their own modeller knows
_BODIES = ("3DSOLID", "BODY", "REGION", "SURFACE", "EXTRUDEDSURFACE", "LOFTEDSURFACE")


def read(path: Path, data: bytes) -> RawModel:
    """The triangles of all faces in the model space, those of blocks in place."""
    parts: dict[str, list[Array]] = {}
    bodies = 0
    try:
        document = _document(path, data)
        primitives: Any = import_module("ezdxf.disassemble")
        for entity in primitives.recursive_decompose(document.modelspace()):
            kind = entity.dxftype()
            bodies += kind in _BODIES
            if kind not in ("3DFACE", "MESH", "POLYLINE"):
                continue
            parts.setdefault(str(entity.dxf.layer), []).extend(_faces(entity, kind))
        unit = _unit(document)
    # a damaged drawing fails anywhere in its library
    except Exception as error:
        what = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(
            f"the drawing cannot be read ({what})", file=path, cure="save it as DXF again"
        ) from error
    if bodies and not any(parts.values()):
        raise InputError(
            "the drawing has solids (3DSOLID) and no faces",
            file=path,
            cure="convert them to meshes or 3D faces",
        )
    said = f"{bodies} solids of {path.name} are not read: convert them to meshes"
    whole = [(layer, np.array(faces).reshape(-1, 3, 3)) for layer, faces in parts.items()]
    return RawModel(Mesh.of(whole, sentences=(said,) if bodies else ()), unit)


def _document(path: Path, data: bytes) -> Any:
    """The drawing, from its binary form or from text, which is mended where it can be."""
    if data.startswith(b"AutoCAD Binary DXF"):
        return import_module("ezdxf").readfile(path)
    return import_module("ezdxf.recover").read(io.BytesIO(data))[0]


def _unit(document: Any) -> LengthUnit | None:
    """What the drawing says of its unit."""
    word = _UNITS.get(int(document.header.get("$INSUNITS", 0)))
    return None if word is None else named_unit(word)


def _faces(entity: Any, kind: str) -> list[Array]:
    """Triangles (3, 3) of one entity."""
    if kind == "3DFACE":
        around = [tuple(corner) for corner in entity.wcs_vertices()]
        rings = [around]
    elif kind == "MESH":
        corners = [tuple(corner) for corner in entity.vertices]
        rings = [[corners[k] for k in face] for face in entity.faces]
    elif entity.is_poly_face_mesh or entity.is_polygon_mesh:
        builder = import_module("ezdxf.render").MeshBuilder.from_polyface(entity)
        rings = [[tuple(builder.vertices[k]) for k in face] for face in builder.faces]
    else:
        rings = []
    return [
        np.array([ring[0], b, c], dtype=np.float64) for ring in rings for b, c in pairwise(ring[1:])
    ]
