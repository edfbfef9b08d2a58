"""The writer of a cloud by the suffix of its file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.clouds.copc import CopcWriter
from tribrach.io.clouds.e57 import E57Writer
from tribrach.io.clouds.header import CloudHeader, CloudWriter
from tribrach.io.clouds.las import LasWriter
from tribrach.io.clouds.ply import PlyWriter

__all__ = ["WRITERS", "create"]

#: by suffix, the longest first
WRITERS: dict[str, Callable[[Path, CloudHeader], CloudWriter]] = {
    ".e57": E57Writer,
    ".las": LasWriter,
    ".copc.laz": CopcWriter,
    ".laz": LasWriter,
    ".ply": PlyWriter,
}


def create(path: Path, header: CloudHeader) -> CloudWriter:
    """A writer for a new cloud.

    Raises
    ------
    InputError : no format has this suffix, or the file cannot be written.
    """
    for suffix, writer in WRITERS.items():
        if path.name.lower().endswith(suffix):
            return writer(path, header)
    raise InputError(
        f"no cloud is written with the suffix {path.suffix or path.name!r}",
        file=path,
        cure="use " + ", ".join(WRITERS),
    )
