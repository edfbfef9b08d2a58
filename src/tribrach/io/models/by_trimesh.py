"""Triangles of PLY and glTF files through trimesh; elements are the parts of the scene.

glTF has metres and its y axis up; what is read has z up (glTF 2.0, section 3.4).
"""

from __future__ import annotations

import io
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.io.models.formats import RawModel
from tribrach.scan.length_unit import METRES

_GLTF = (".glb", ".gltf")
#: z up from y up
_UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def read(path: Path, data: bytes) -> RawModel:
    """The triangles of a file."""
    if find_spec("trimesh") is None:
        raise InputError(
            f"meshes of {path.suffix} need trimesh, which is not installed",
            file=path,
            cure="install tribrach[models]",
        )
    trimesh: Any = import_module("trimesh")
    suffix = path.suffix.lower()
    try:
        resolver = trimesh.resolvers.FilePathResolver(str(path))
        scene = trimesh.load_scene(
            io.BytesIO(data), file_type=suffix[1:], resolver=resolver, process=False
        )
        parts = [_part(scene, node, path) for node in scene.graph.nodes_geometry]
    # its readers let through whatever a damaged file makes of them
    except Exception as error:
        what = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(
            f"the model cannot be read ({what})", file=path, cure="export it again"
        ) from error
    if suffix in _GLTF:
        parts = [(name, corners @ _UPRIGHT.T) for name, corners in parts]
        return RawModel(Mesh.of(parts), METRES)
    return RawModel(Mesh.of([(path.stem, corners) for _, corners in parts]))


def _part(scene: Any, node: str, path: Path) -> tuple[str, Array]:
    """Name and triangles of a part of a scene; no triangles if it has no faces."""
    transform, key = scene.graph[node]
    geometry = scene.geometry[key]
    faces = getattr(geometry, "faces", None)
    if faces is None:
        return str(node), np.empty((0, 3, 3))
    corners = np.asarray(geometry.vertices, dtype=np.float64)[np.asarray(faces)]
    with np.errstate(all="ignore"):  # what is not finite is refused by who asked for it
        placed = corners @ transform[:3, :3].T + transform[:3, 3]
        # a mirrored part turns its triangles over
        return str(node), placed if np.linalg.det(transform[:3, :3]) > 0 else placed[:, ::-1]
