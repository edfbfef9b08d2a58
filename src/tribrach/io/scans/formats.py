"""Chooses the reader for a file of scans: by how the file begins, else by its suffix.

Formats that their suffix alone tells, such as one of text without a header, go by the suffix.

Readers are modules in this package with a function ``read``, loaded for the first file of theirs.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from tribrach.errors import InputError
from tribrach.io.keeping import keep
from tribrach.io.poses.names import POSE_FILES
from tribrach.io.scans.origin import seen_from_zero
from tribrach.io.scans.reading import reading
from tribrach.io.scans.text import Lines
from tribrach.io.scans.units import in_metres
from tribrach.io.text_form import heads, text_start
from tribrach.io.unpacking import unpacked
from tribrach.scan.scan import Scan

#: modules of this package by suffix
READERS: dict[str, str] = {
    ".e57": "e57",
    ".las": "las",
    ".laz": "las",
    ".ptx": "ptx",
    ".pts": "pts",
    ".ply": "ply",
    ".pcd": "pcd",
    ".xyz": "xyz",
    ".txt": "xyz",
    ".csv": "xyz",
    ".asc": "xyz",
}

#: modules of this package by what files begin with
_MAGIC: tuple[tuple[re.Pattern[bytes], str], ...] = (
    (re.compile(rb"LASF"), "las"),
    (re.compile(rb"ASTM-E57"), "e57"),
    (re.compile(rb"ply\s"), "ply"),
    (re.compile(rb"(# \.PCD|(#.*\s+)*VERSION\s+\.?[0-9])"), "pcd"),
)
#: readers of lines of numbers, also compressed ones
_OF_LINES = ("ptx", "pts", "xyz")
#: readers of formats whose points are in the scanner's frame unless something says otherwise
_SCANNER_FRAME = ("e57", "ptx")
_PACKED = (".gz", ".xz", ".bz2")
#: readers whose suffix says less than how a file begins
_BY_CONTENT = frozenset((*_OF_LINES, *(reader for _, reader in _MAGIC)))


def read_scans(path: Path) -> tuple[Scan, ...]:
    """The scans of a file, in metres; only headers are read, and some points where need be."""
    if not path.is_file():
        raise InputError("there is no such file", file=path, cure="check its name and folder")
    keep([path], beside=[path.with_name(name) for name in POSE_FILES])
    with unpacked(path) as file:
        start = file.read(4096)
    if not start:
        raise InputError("the file is empty", file=path, cure="copy it again from its source")
    reader = _reader(path, start)
    with path.open("rb") as plain:
        packed = plain.read(4) != start[:4]
    if packed and reader not in _OF_LINES:
        raise InputError("only text is read from compressed files", file=path, cure="unpack it")
    scans: tuple[Scan, ...] = _module(reader).read(path)
    if reader not in _SCANNER_FRAME:
        scans = tuple(seen_from_zero(scan) for scan in scans)
    return tuple(in_metres(scan, reading().unit) for scan in scans)


def _module(reader: str) -> Any:
    """The module of a reader."""
    return import_module(f"tribrach.io.scans.{reader}")


def _reader(path: Path, start: bytes) -> str:
    """The reader for the first bytes of a file, or for its suffix where they do not tell."""
    for magic, reader in _MAGIC:
        if magic.match(start):
            return reader
    suffixes = [suffix.lower() for suffix in path.suffixes]
    while suffixes and suffixes[-1] in _PACKED:
        suffixes.pop()
    named = READERS.get(suffixes[-1]) if suffixes else None
    if named is not None and named not in _BY_CONTENT:
        return named
    if _is_text(start):
        shaped = _shape(path)
        if shaped is not None or named in _OF_LINES:
            return shaped or named or "xyz"
        if named is None and not suffixes:
            return "xyz"
    if named is not None:
        return named
    suffix = "".join(suffixes[-1:])
    raise InputError(
        f"scans with the suffix {suffix!r} are not known, and the file begins like none that are",
        file=path,
        cure="use " + ", ".join(READERS),
    )


def _is_text(start: bytes) -> bool:
    """True if the bytes look like text."""
    return b"\0" not in start and sum(byte < 9 for byte in start) == 0


def _shape(path: Path) -> str | None:
    """PTX, PTS or other lines of numbers, from the first lines; None without numbers."""
    ptx, xyz = _module("ptx"), _module("xyz")
    with unpacked(path) as file:
        lines = Lines(file, path).peek(len(ptx.HEADER))
    if not all(map(xyz.numeric, lines)):
        if lines[0].isdigit():
            return None
        points = heads(text_start(path))[1]
        if len(points) == 1 and not xyz.numeric(points[0].replace(";", " ").encode()):
            return None
        return "xyz" if points and xyz.row_of_numbers(points) else None
    widths = tuple(len(line.split()) for line in lines)
    if widths == ptx.HEADER:
        return "ptx"
    if widths[:1] == (1,) and lines[0].isdigit() and set(widths[1:]) <= {3, 4, 6, 7}:
        return "pts"
    return "xyz" if widths and min(widths) >= 3 else None
