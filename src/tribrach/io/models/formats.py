"""Chooses the reader for a model of surfaces, and refuses or mends what no model may have.

Readers are modules in this package with a function ``read``, loaded for the first file of theirs.
They give triangles in the unit of the file and what the file says of that unit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.io.scans.units import named_unit
from tribrach.io.xml_file import read_bytes
from tribrach.scan.length_unit import LengthUnit
from tribrach.sentences import Sentence

#: modules of this package by suffix
MODELS: dict[str, str] = {
    ".stl": "triangle_files",
    ".obj": "triangle_files",
    ".ply": "by_trimesh",
    ".glb": "by_trimesh",
    ".gltf": "by_trimesh",
    ".dxf": "dxf",
    ".xml": "landxml",
    ".landxml": "landxml",
    ".tif": "terrain",
    ".tiff": "terrain",
}
#: what begins a PLY file that has triangles; heads are no longer
_HEAD = 20_000
#: no site is larger, and no model of one smaller [m]
_LARGEST, _SMALLEST = 500_000.0, 0.02
#: triangles with a lesser height over their longest side than this have no area
_FLAT = 1e-10


@dataclass(frozen=True, eq=False)
class RawModel:
    """A model as its file has it."""

    mesh: Mesh
    unit: LengthUnit | None = None  #: what the file says of its unit, None if nothing


def model_unit(word: str | None) -> LengthUnit | None:
    """Unit of a model as the user states it; None if not stated."""
    if word is None:
        return None
    unit = named_unit(word)
    if unit is None or unit.factors is None:
        raise InputError(f"{word!r} is no unit of length", cure="say m, mm, cm, ft or usft")
    return replace(unit, source="as given")


def is_model(path: Path) -> bool:
    """True for a file of surfaces; a PLY file is one if it has faces, else it is a cloud."""
    suffix = path.suffix.lower()
    if suffix != ".ply":
        return suffix in MODELS
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(_HEAD).partition(b"end_header")[0]
    counts = [line.split()[2] for line in head.splitlines() if line.startswith(b"element face ")]
    return any(count != b"0" for count in counts)


def read_model(path: Path, unit: LengthUnit | None = None) -> Mesh:
    """The triangles of a file in metres.

    ``unit``: what its coordinates are counted in, where the user says so.
    """
    module = MODELS.get(path.suffix.lower())
    if module is None:
        raise InputError(
            f"{path.suffix or 'no suffix'} is no model",
            file=path,
            cure=f"use {', '.join(MODELS)}",
        )
    if not path.is_file():
        raise InputError("there is no such file", file=path, cure="check its name and folder")
    reader: Any = import_module(f"tribrach.io.models.{module}")
    raw: RawModel = reader.read(path, read_bytes(path, _MOST_BYTES))
    return _checked(path, raw, unit)


#: larger models are refused [bytes]
_MOST_BYTES = 1_000_000_000


def _checked(path: Path, raw: RawModel, unit: LengthUnit | None) -> Mesh:
    """The model in metres, without triangles that have no area."""
    mesh, said = raw.mesh, unit or raw.unit
    if len(mesh) == 0:
        raise InputError("the model has no triangles", file=path, cure="export its surfaces")
    if not np.isfinite(mesh.triangles).all():
        raise InputError("the model has corners that are not finite", file=path, cure="repair it")
    sentences = list(mesh.sentences)
    if said is not None and not said.metric:
        if said.factors is None:
            raise InputError(
                "the model is in degrees", file=path, cure="export it in a projected system"
            )
        mesh = replace(mesh, triangles=mesh.triangles * np.array(said.factors))
        sentences.append(f"{path.name} is in the unit {said.words} ({said.source})")
    low, high = mesh.corners
    extent = float(np.linalg.norm(high - low))
    if not _SMALLEST < extent < _LARGEST:
        raise InputError(
            f"the model is {extent:.3g} m large",
            file=path,
            cure="export it in metres, or say its unit",
        )
    sides = np.linalg.norm(mesh.triangles - np.roll(mesh.triangles, 1, axis=1), axis=2).max(axis=1)
    empty = 2 * mesh.areas <= _FLAT * np.maximum(sides, extent * 1e-9) ** 2
    if empty.all():
        raise InputError("no triangle of the model has an area", file=path, cure="export again")
    if empty.any():
        sentences.append(
            Sentence(
                "{count} of {all} triangles of {name} have no area and are left out",
                count=int(empty.sum()),
                all=len(mesh),
                name=path.name,
            )
        )
        mesh = mesh.subset(~empty)
    return replace(mesh, sentences=tuple(sentences))
