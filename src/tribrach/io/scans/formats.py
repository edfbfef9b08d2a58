"""Which reader reads a file of scans? The one of what the file begins with, else of its suffix."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.scans import e57, las, pcd, ply, pts, ptx, xyz
from tribrach.io.scans.text import Lines, delimiters, opened
from tribrach.scan.scan import Scan

__all__ = ["READERS", "read_scans"]

Reader = Callable[[Path], tuple[Scan, ...]]

#: by suffix
READERS: dict[str, Reader] = {
    ".e57": e57.read,
    ".las": las.read,
    ".laz": las.read,
    ".ptx": ptx.read,
    ".pts": pts.read,
    ".ply": ply.read,
    ".pcd": pcd.read,
    ".xyz": xyz.read,
    ".txt": xyz.read,
    ".csv": xyz.read,
    ".asc": xyz.read,
}

#: what files begin with
_MAGIC: tuple[tuple[re.Pattern[bytes], Reader], ...] = (
    (re.compile(rb"LASF"), las.read),
    (re.compile(rb"ASTM-E57"), e57.read),
    (re.compile(rb"ply\s"), ply.read),
    (re.compile(rb"(# \.PCD|(#.*\s+)*VERSION\s+\.?[0-9])"), pcd.read),
)
#: readers of lines of numbers, also compressed ones
_OF_LINES = (ptx.read, pts.read, xyz.read)
_PACKED = (".gz", ".xz", ".bz2")


def read_scans(path: Path) -> tuple[Scan, ...]:
    """The scans of a file, headers only.

    Raises
    ------
    InputError : no such file, an unknown format, or what the reader has to say.
    """
    if not path.is_file():
        raise InputError("there is no such file", file=path, cure="check its name and folder")
    with opened(path) as file:
        start = file.read(4096)
    if not start:
        raise InputError("the file is empty", file=path, cure="copy it again from its source")
    reader = _reader(path, start)
    with path.open("rb") as plain:
        packed = plain.read(4) != start[:4]
    if packed and reader not in _OF_LINES:
        raise InputError("only text is read from compressed files", file=path, cure="unpack it")
    return reader(path)


def _reader(path: Path, start: bytes) -> Reader:
    """The reader for the first bytes of a file, or for its suffix if they say nothing."""
    for magic, reader in _MAGIC:
        if magic.match(start):
            return reader
    suffixes = [suffix.lower() for suffix in path.suffixes]
    while suffixes and suffixes[-1] in _PACKED:
        suffixes.pop()
    named = READERS.get(suffixes[-1]) if suffixes else None
    if _is_text(start):
        shaped = _shape(path)
        if shaped is not None or named in _OF_LINES:
            return shaped or named or xyz.read
        if named is None and not suffixes:
            return xyz.read
    if named is not None:
        return named
    suffix = "".join(suffixes[-1:])
    raise InputError(
        f"scans with the suffix {suffix!r} are not known, and the file begins like none that are",
        file=path,
        cure="use " + ", ".join(READERS),
    )


def _is_text(start: bytes) -> bool:
    return b"\0" not in start and sum(byte < 9 for byte in start) == 0


def _shape(path: Path) -> Reader | None:
    """PTX, PTS or other lines of numbers, by the first of them; None if they are none."""
    with opened(path) as file:
        lines = Lines(file, path).peek(len(ptx.HEADER))
    if not all(map(xyz.numeric, lines)):
        parted = (line.translate(delimiters(line)) for line in lines[-2:])
        several = [len(line.split()) for line in parted if xyz.numeric(line)]
        return xyz.read if several and min(several) >= 3 else None
    widths = tuple(len(line.split()) for line in lines)
    if widths == ptx.HEADER:
        return ptx.read
    if widths[:1] == (1,) and lines[0].isdigit() and set(widths[1:]) <= {3, 4, 6, 7}:
        return pts.read
    return xyz.read if widths and min(widths) >= 3 else None
