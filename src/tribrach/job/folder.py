"""What lies in a folder: every file by its content, whatever its name.

Scans are known by how they begin, raw files and networks by their readers' own tests, RINEX by its
first line, tables by their header. A file that nobody understands is named with the reason.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.csv_rows import AS_FOUND, ListForm
from tribrach.io.gnss.files import vector_reader
from tribrach.io.gnss.observation_file import header_text
from tribrach.io.levels import files as levels
from tribrach.io.opened_files import contents
from tribrach.io.scans.formats import read_scans
from tribrach.io.survey import ngs
from tribrach.io.survey.csv.columns import COORDINATES, SIGHT_KINDS
from tribrach.io.survey.csv.file import CsvTable, read_table
from tribrach.io.survey.csv.headings import AxesQuestion, HeadQuestion
from tribrach.io.survey.formats import SUFFIXES, format_of
from tribrach.io.survey.starnet import recognition as starnet
from tribrach.io.totalstation import formats as raw
from tribrach.io.unpacking import unpacked
from tribrach.scan.scan import Scan
from tribrach.scan.unit_doubt import doubt_at_first

Kind = Literal[
    "scans", "points", "survey", "receiver", "orbits", "antennas", "project", "not understood"
]
#: which way X of a list points, or its first column of coordinates where it has no heads
Axes = Literal["east", "north"]
AXES: tuple[Axes, ...] = ("east", "north")

#: folders that hold no measurements
_PASSED = re.compile(r"\.|__pycache__$|node_modules$")
#: files of these kinds are named and not tried
_OTHERS = {
    "pictures": ".jpg .jpeg .png .tif .tiff .bmp .gif .heic .svg .dng",
    "documents": ".pdf .doc .docx .odt .rtf .ppt .pptx .md .html .htm .log",
    "drawings": ".dwg .dxf .dgn .skp .ifc .rvt",
    "films and sounds": ".mp4 .mov .avi .mp3 .wav",
    "packed folders: unpack them": ".zip .7z .rar .tar .tgz",
    "projects of other programs: export their scans as E57 or LAZ": (
        ".rcp .rcs .lgs .lgsx .imp .fls .lsproj .zfs .zfprj .rdbx .tzf .tzs .cl3 .clr .rxp"
    ),
    "meshes or models": ".obj .stl .glb .gltf .fbx",
}
_REASONS = {suffix: what for what, suffixes in _OTHERS.items() for suffix in suffixes.split()}
_SCAN_STARTS = (b"LASF", b"ASTM-E57", b"ply", b"# .PCD")
_PACKED = (b"\x1f\x8b", b"\xfd7zXZ", b"BZh", b"\x1f\x9d")
#: a text of numbers that is smaller is no scan [bytes]
_SCAN = 30_000
#: the most files and levels that are looked at
_FILES, _DEPTH = 5000, 6
#: rows of numbers whose first is no whole number, as names are
_POINTS = re.compile(rb"\s*[+-]?\d*[.,]\d+([eE][+-]?\d+)?[\s,;]+[\s\d.,;+\-eE]*$")


@dataclass(frozen=True)
class Satellites:
    """A RINEX file of a receiver, as its header has it."""

    #: names of the marker and the antenna, and the day of the first epoch
    marker: str
    antenna: str
    date: str
    #: latitude and longitude [degrees] and height [m], None where the header has no place
    place: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class FolderFile:
    """A file of a folder."""

    path: Path  #: the file
    kind: Kind  #: what it is
    format: str = ""  #: name of its format
    words: str = ""  #: what is in it, for a reader; the reason where it is not understood
    scans: tuple[Scan, ...] = ()  #: its scans, by their headers
    table: CsvTable | None = None  #: its table, of points or of observations
    form: ListForm = AS_FOUND  #: how the list is to be read where its heads leave a question
    #: what was guessed, one sentence each without the stop
    remarks: tuple[str, ...] = field(default=())
    satellites: Satellites | None = None  #: of a receiver
    #: which way the first coordinate of a list was taken to point, where nothing in it tells
    assumed_axes: Axes | None = None


def look_through(folder: Path, axes: Axes | None = None) -> list[FolderFile]:
    """Contents of all files in a folder and below it, by name."""
    if not folder.is_dir():
        raise InputError("there is no such folder", file=folder, cure="check its name")
    found: list[FolderFile] = []
    for path in _files(folder, _DEPTH):
        if len(found) == _FILES:
            what = f"the folder holds more than {_FILES} files"
            raise InputError(what, file=folder, cure="name the folder of one job")
        found.append(known_file(path, axes))
    return found


def _files(folder: Path, depth: int) -> Iterator[Path]:
    """Files to look at, in the order of their names."""
    try:
        entries = sorted(folder.iterdir(), key=lambda path: _natural(path.name))
    except OSError as error:
        raise InputError(
            f"the folder cannot be read ({error.strerror})", file=folder, cure="check its rights"
        ) from error
    if (folder / "report.html").is_file() and (folder / "result.json").is_file():
        return
    for path in entries:
        if _PASSED.match(path.name):
            continue
        if path.is_dir():
            if depth:
                yield from _files(path, depth - 1)
        elif path.is_file():
            yield path


def _natural(name: str) -> list[tuple[int, str]]:
    """A key that puts S2 before S10."""
    parts = re.split(r"(\d+)", name.lower())
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def known_file(path: Path, axes: Axes | None = None) -> FolderFile:
    """A file by its content."""
    try:
        return _recognised(path, axes)
    except InputError as error:
        cure = f"; {error.cure}" if error.cure else ""
        line = "" if error.line is None else f"line {error.line}: "
        return FolderFile(path, "not understood", words=f"{line}{error.what}{cure}")
    except OSError as error:
        words = f"it cannot be read ({error.strerror})"
        return FolderFile(path, "not understood", words=words)


def _recognised(path: Path, axes: Axes | None) -> FolderFile:
    """A file by its content."""
    suffix = path.suffix.lower()
    if suffix in _REASONS:
        return FolderFile(path, "not understood", words=f"one of the {_REASONS[suffix]}")
    if suffix == ".toml":
        # not read: it may be the project file that is to be written
        return FolderFile(path, "project", words="a project file, or one of an instrument")
    start = contents(path, 4096)
    if not start.strip():
        raise InputError("it is empty", file=path, cure="copy it again from its source")
    counted = suffix == ".pts" and start.split(b"\n", 1)[0].strip(b"\xef\xbb\xbf \t\r").isdigit()
    if start.startswith(_SCAN_STARTS) or suffix == ".ptx" or counted:
        return _of_scans(path)
    if start.startswith(b"PK\x03\x04"):
        return _of_table(path, axes)
    if not _is_text(start) and not start.startswith(
        (b"\x1f\x8b", b"\xfd7zXZ", b"BZh", b"\x1f\x9d")
    ):
        raise InputError("it is no text and of no format that is known", file=path)
    satellites = _of_satellites(path)
    if satellites is not None:
        return satellites
    if suffix in (".gz", ".xz", ".bz2"):
        return _of_scans(path)
    return _of_text(path, axes, start)


def _is_text(start: bytes) -> bool:
    """True if bytes may be text, of two bytes for a letter too."""
    return start.startswith((b"\xff\xfe", b"\xfe\xff")) or (
        b"\0" not in start and not set(start) & {*range(1, 8), *range(14, 26)}
    )


def _of_satellites(path: Path) -> FolderFile | None:
    """Files of receivers, orbits and antennas, packed or not; None for others."""
    try:
        with unpacked(path) as stream:
            start = stream.read(60_000)
    except InputError:
        return None
    first = start[:400]
    if b"ANTEX VERSION" in first:
        return FolderFile(path, "antennas", "ANTEX", "antennas")
    if re.match(rb"#[a-dP][PV]\d{4} ", start):
        return FolderFile(path, "orbits", "SP3", "precise orbits")
    compact = b"CRINEX VERS" in first
    if b"RINEX VERSION / TYPE" not in first and not compact:
        return None
    at = start.find(b"RINEX VERSION / TYPE")
    kind = start[max(at - 60, 0) : at][20:21]
    if kind == b"C":
        raise InputError("satellite clocks, which the orbits bring", file=path)
    if kind != b"O" and not compact:
        return FolderFile(path, "orbits", "RINEX", "broadcast orbits")
    lines = dict(reversed(header_text(path, start)[0]))
    marker = lines.get("MARKER NAME", "").strip() or path.name.split(".")[0]
    antenna = lines.get("ANT # / TYPE", "")[20:40].strip()
    date = "-".join(lines.get("TIME OF FIRST OBS", "").split()[:3])
    words = f"a receiver over {marker}, from {date}"
    receiver = Satellites(marker, antenna, date, _place(lines.get("APPROX POSITION XYZ", "")))
    return FolderFile(path, "receiver", "RINEX", words, satellites=receiver)


def _place(text: str) -> tuple[float, float, float] | None:
    """Latitude, longitude [degrees] and height [m] of the place in a RINEX header."""
    try:
        ecef = np.array([float(word) for word in text.split()[:3]])
    except ValueError:
        return None
    if ecef.shape != (3,) or not 6e6 < float(np.linalg.norm(ecef)) < 7e6:
        return None
    site = EllipsoidSite.centred(ecef[None])
    latitude, longitude = np.degrees([site.latitude, site.longitude])
    return float(latitude), float(longitude), float(site.ellipsoidal_height)


def _of_text(path: Path, axes: Axes | None, start: bytes) -> FolderFile:
    """Text: a network, a raw file, a table or a scan."""
    suffix = path.suffix.lower()
    if suffix == ".xml":
        lower = start.lower()
        marks = (b"<landxml", b"<gvx", b"gama-local", b"<dnaxmlformat", b"<jobfile")
        if not any(mark in lower for mark in marks):
            raise InputError("XML of no format that is known", file=path)
    if suffix == ".prj" and start.lstrip().startswith((b"PROJC", b"GEOGC", b"PROJCRS", b"GEOGCRS")):
        raise InputError("a coordinate system of a GIS", file=path, cure="give it as --crs")
    if suffix not in SUFFIXES and ngs.recognised(path):
        return _of_survey(path, "ngs")
    if vector_reader(path) is not None:
        return _of_survey(path, "gnss")
    if suffix not in SUFFIXES and levels.recognised(path):
        return _of_survey(path, "levels", levels.format_name(path))
    if suffix not in SUFFIXES and raw.recognised(path):
        return _of_survey(path, "totalstation", raw.format_of(path))
    if suffix not in SUFFIXES and starnet.recognised(path):
        return _of_survey(path, "starnet")
    if suffix == ".xml" or (suffix in SUFFIXES and SUFFIXES[suffix] != "csv"):
        return _of_survey(path, format_of(path))
    rows = [row for row in start.splitlines()[:-1] or start.splitlines() if row.strip()]
    large = path.stat().st_size > _SCAN
    if all(map(_POINTS.match, rows)):
        if not large:
            raise InputError("numbers without heads, too few for a scan", file=path)
        return _of_scans(path)
    try:
        return _of_table(path, axes)
    except InputError as error:
        if re.match(rb"(\s*#[^\n]*\n)*\s*name\s*[,;\t]\s*x(min)?\s*[,;\t]", start, re.IGNORECASE):
            what = "test sites of a comparison, which a section [[comparison]] names"
            raise InputError(what, file=path) from error
        if large and len(rows) > 5 and all(map(_POINTS.match, rows[1:])):
            return _of_scans(path)
        if suffix in (".csv", ".xlsx", ".tsv") or _is_list(rows):
            raise
        raise InputError("text of no format that is known", file=path) from error


#: a name and two or more numbers, with whatever stands between them and for decimals
_LISTED = re.compile(
    rb"\s*[^\s,;|]+(?:[\s;|]+|,\s*)[+-]?\d+(?:[.,]\d*)?(?:[\s;|]+|,\s*)[+-]?\d+(?:[.,]\d*)?\b"
)


def _is_list(rows: list[bytes]) -> bool:
    """True if nearly all rows, but perhaps a header, are a name and numbers."""
    fitting = sum(_LISTED.match(row) is not None for row in rows)
    return fitting > 1 and fitting >= 0.8 * (len(rows) - 1)


def _of_survey(path: Path, format: str, name: str = "") -> FolderFile:
    """A file of observations, which its reader says more about."""
    words = name or {
        "gama": "a network of GNU Gama",
        "dynaml": "DynaML of DynAdjust",
        "dna": "a file of DynAdjust",
        "ngs": "a G-, B- or A-file of NGS",
        "comp3d": "a file of Comp3D",
        "starnet": "a file of STAR*NET",
        "riscan": "a project of RiSCAN PRO",
        "gnss": "GNSS vectors or positions",
    }.get(format, format)
    return FolderFile(path, "survey", format, words)


def _of_scans(path: Path) -> FolderFile:
    """A file of scans, by its headers."""
    scans = read_scans(path)
    if not scans:
        raise InputError("there is no scan in it", file=path)
    records = [scan.records for scan in scans if scan.records is not None]
    if len(records) == len(scans) and not any(records):
        raise InputError("its scan has no points", file=path, cure="export it again")
    count = f"{sum(records):,} points" if len(records) == len(scans) else "points"
    posed = sum(scan.pose is not None for scan in scans)
    words = f"{len(scans)} scan{'s' * (len(scans) > 1)}, {count}"
    if posed:
        words += ", with a pose" if len(scans) == 1 else f", {posed} with poses"
    doubts = [doubt.sentence for scan in scans if (doubt := doubt_at_first(scan)) is not None]
    remarks = tuple(dict.fromkeys([*(text for scan in scans for text in scan.warnings), *doubts]))
    form = path.suffix.lower().lstrip(".")
    return FolderFile(path, "scans", form, words, scans, remarks=remarks)


def reread(one: FolderFile, axes: Axes, why: str) -> FolderFile:
    """A list whose axes were assumed, read the way that something else tells."""
    return _of_table(one.path, axes, why)


def _of_table(path: Path, axes: Axes | None, why: str = "as asked for") -> FolderFile:
    """A table of points or of observations."""
    form, remarks, assumed = AS_FOUND, tuple[str, ...](), None
    try:
        table = read_table(path)
    except HeadQuestion as question:
        form, remarks, assumed = _answered(path, question, axes, why)
        table = read_table(path, form)
    rows = f"{len(table)} row{'s' * (len(table) > 1)}"
    remarks = (*remarks, *table.remarks)
    if table.layout is not COORDINATES:
        measured = [k.facts.title for n, (k, _) in SIGHT_KINDS.items() if table.has(n)]
        what = f"{measured[0]}s" if len(measured) == 1 else table.layout.name
        words = f"{rows} of {what}"
        return FolderFile(path, "survey", "csv", words, table=table, remarks=remarks)
    sigmas = "with sigmas" if _has_sigmas(table) else "without sigmas"
    words = f"{len(table)} point{'s' * (len(table) > 1)} with coordinates, {sigmas}"
    return FolderFile(
        path,
        "points",
        "csv",
        words,
        table=table,
        form=form,
        remarks=remarks,
        assumed_axes=assumed,
    )


def _has_sigmas(table: CsvTable) -> bool:
    """True if a table of coordinates states how good they are."""
    return any(table.has(name) for name in ("sigma_e", "sigma_u", "cee", "cxx"))


def _answered(
    path: Path, question: HeadQuestion, axes: Axes | None, told: str
) -> tuple[ListForm, tuple[str, ...], Axes | None]:
    """How a list is read whose heads leave east open, and the sentence on it."""
    first, second, *rest = question.coordinates
    columns: dict[str, str | int] = {"point": question.point}
    if rest and not isinstance(question, AxesQuestion):
        columns["height"] = rest[0]
    assumed: Axes | None = None
    if axes is None:
        axes = _by_size(path, columns | {"easting": first, "northing": second})
        told = "as the size of the numbers tells"
    if axes is None:
        axes = assumed = question.usual
        other = "east" if axes == "north" else "north"
        told = f"as is usual in such lists; say --axes {other} if it is the other way round"
    east, north = (first, second) if axes == "east" else (second, first)
    columns |= {"easting": east, "northing": north}
    name = {True: "column {}", False: "{}"}
    words = [name[isinstance(one, int)].format(one) for one in (east, north)]
    said = f"{words[0]} is taken as easting and {words[1]} as northing, {told}"
    return ListForm(columns), (said,), assumed


def _by_size(path: Path, columns: dict[str, str | int]) -> Axes | None:
    """Which way the first column points, by the digits of UTM and grids like it, or None."""
    table = read_table(path, ListForm(columns))
    first, second = (float(np.nanmedian(np.abs(table.number(axis)))) for axis in "en")
    if 1e5 <= first < 1e6 <= second < 1e7:
        return "east"
    if 1e5 <= second < 1e6 <= first < 1e7:
        return "north"
    return None
