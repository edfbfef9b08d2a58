"""Chooses the writer of a cloud by the suffix of its file."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.clouds.header import CloudHeader, CloudWriter

#: module in this package and its class by suffix, the longest first
WRITERS: dict[str, tuple[str, str]] = {
    ".e57": ("e57", "E57Writer"),
    ".las": ("las", "LasWriter"),
    ".copc.laz": ("copc", "CopcWriter"),
    ".laz": ("las", "LasWriter"),
    ".ply": ("ply", "PlyWriter"),
}


def create(path: Path, header: CloudHeader) -> CloudWriter:
    """A writer for a new cloud."""
    for suffix, (module, name) in WRITERS.items():
        if path.name.lower().endswith(suffix):
            kind = getattr(import_module(f"tribrach.io.clouds.{module}"), name)
            writer: CloudWriter = kind(path, header)
            return writer
    raise InputError(
        f"no cloud is written with the suffix {path.suffix or path.name!r}",
        file=path,
        cure="use " + ", ".join(WRITERS),
    )
