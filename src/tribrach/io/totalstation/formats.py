"""Chooses the reader of a raw file by how the file begins, whatever its suffix."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.totalstation import fbk, gsi, gts6, gts7, jobxml, landxml, m5, nikon, rw5, sdr
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import head

Sniff = Callable[[str], bool]
Read = Callable[[Path], RawFile]

#: name, test of the beginning, reader; asked in this order
READERS: dict[str, tuple[Sniff, Read]] = {
    "Trimble JobXML": (jobxml.sniff, jobxml.read),
    "LandXML": (landxml.sniff, landxml.read),
    "Trimble M5": (m5.sniff, m5.read),
    "Sokkia SDR": (sdr.sniff, sdr.read),
    "Leica GSI": (gsi.sniff, gsi.read),
    "Topcon GTS-6": (gts6.sniff, gts6.read),
    "Topcon GTS-7": (gts7.sniff, gts7.read),
    "Nikon RAW": (nikon.sniff, nikon.read),
    "Carlson RW5": (rw5.sniff, rw5.read),
    "Autodesk field book": (fbk.sniff, fbk.read),
}

#: formats that are known and not read: what they are, and how they begin
UNREAD: tuple[tuple[str, str], ...] = (
    ("a Leica IDX database", r"\s*HEADER\s+VERSION"),
    ("a listing of a Leica System 1200 export", r"\s*System 1200 Data Export"),
    ("a listing of a Leica TPS700 export", r"[^\n]*\n(\s*\n)*JOB\s[^\n]*\n\s*OPERATOR"),
    ("a coordinate file of a Zeiss Rec memory (R4, R5)", r"\s*For R\d\|"),
    ("a coordinate file of a Zeiss Rec 500 memory", r"\s*0001 OR\.COOR"),
    ("a Geodimeter job or area file", r"\s*\d{1,2}=[^\n]*\n\s*\d{1,2}="),
    ("a FOIF measurement file", r" \w+(,\d+){6,}"),
    ("a GeoProfi field book", r"(AR|FN|DT|AP) [^\n]*\n(AR|FN|DT|AP) "),
    ("a GeoZseni field book", r"GJK,"),
    ("a Sokkia SCR file", r"A,SET\w+,"),
    ("a Nikon field book of MD records", r"\d+ , \d+ , MD ,"),
    ("a table that Total Open Station exported", r"Rec_Desc\tRec_Type\t"),
)


def recognised(path: Path) -> bool:
    """True if a file begins as one of the formats that are read, or that are known and not read."""
    text = head(path)
    return _known(text) is not None or _unread(text) is not None


def format_of(path: Path) -> str:
    """Name of a raw file's format."""
    text = head(path)
    name = _known(text)
    if name is not None:
        return name
    what = _unread(text)
    cure = "export it as one of " + ", ".join(READERS)
    if what is not None:
        raise InputError(f"this is {what}, which is not read", file=path, cure=cure)
    raise InputError("this is no raw file of a known total station", file=path, cure=cure)


def read(path: Path) -> RawFile:
    """Read a raw file."""
    path = Path(path)
    if not path.is_file():
        raise InputError("there is no such file", file=path, cure="check the path")
    _, reader = READERS[format_of(path)]
    return reader(path)


def _known(text: str) -> str | None:
    """Name of the format that a text begins like, None if it is not one of those that are read."""
    return next((name for name, (sniff, _) in READERS.items() if sniff(text)), None)


def _unread(text: str) -> str | None:
    """The format that a text begins like among those that are known and not read."""
    return next((what for what, start in UNREAD if re.match(start, text)), None)
