"""Which reader reads a file of scans? By its suffix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.scans import e57, las
from tribrach.scan.scan import Scan

__all__ = ["READERS", "read_scans"]

#: by suffix
READERS: dict[str, Callable[[Path], tuple[Scan, ...]]] = {
    ".e57": e57.read,
    ".las": las.read,
    ".laz": las.read,
}


def read_scans(path: Path) -> tuple[Scan, ...]:
    """The scans of a file, headers only.

    Raises
    ------
    InputError : no such file, an unknown format, or what the reader has to say.
    """
    if not path.is_file():
        raise InputError("there is no such file", file=path, cure="check its name and folder")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"scans with the suffix {path.suffix!r} are not known",
            file=path,
            cure="use " + ", ".join(READERS),
        )
    return reader(path)
