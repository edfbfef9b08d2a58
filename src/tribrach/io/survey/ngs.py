"""Files of the NGS program ADJUST: G-file (vectors), B-file (stations), A-file (what is held).

Fixed columns, as the Blue Book of the National Geodetic Survey has them. Stations are numbers in
all three files; the names are those of the B-file. Vectors are turned from their frame to
NAD83(2011), in which the coordinates are. A height without the code ``E`` is orthometric and made
ellipsoidal by the geoid height of the B-file. A sigma of the A-file weights the value that is
given, an empty one holds it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.io.survey.dynadjust.assembly import assemble
from tribrach.io.survey.dynadjust.records import (
    Entry,
    GnssCluster,
    RecordPlace,
    Records,
    StationRecord,
    number,
)
from tribrach.io.totalstation.text import head, read_lines
from tribrach.network.survey import Survey

#: what a file of each sort begins with
_SORTS = {
    "G": re.compile(r"A.{2}[ \d]{8}[ \d]{8}.*\n+B\d{4}[ \d]{20}"),
    "B": re.compile(r"[ \d]{6}\*[A-Z0-9]{2}\*"),
    "A": re.compile(r"(?:(?:\*|[A-Z]{2}).*\n+)*?(?:CC.{8}[ \d]{3}\d|DD[123]\b|MM[0-3][YN ])"),
}
#: frame of the coordinates, and the date that it is for
_FRAME, _EPOCH = "NAD83(2011)", "01.01.2010"
#: frames of vectors by their code; those of the IGS are aligned with these
_FRAMES = {
    2: _FRAME,
    4: _FRAME,
    18: "ITRF96",
    19: "ITRF97",
    21: "ITRF2000",
    25: "ITRF2005",
    26: "ITRF2005",
    27: "ITRF2008",
    28: "ITRF2008",
}
#: records of an A-file that change nothing, or only what is printed
_SILENT = {"AA", "EE", "HC", "HD", "II", "LY", "MM", "NL", "PP", "QQ"}
#: records of terrestrial observations in a B-file
_SIGHTS = re.compile(r"\*(2[0-4]|3\d|4[0-7]|5[0-8]|6\d)\*")
#: a vector: columns of its components and sigmas, and the codes of one that is rejected
_VECTOR = {"C": (11, 57), "F": (13, 63)}
_REJECTED = "ROF"


def recognised(path: Path) -> bool:
    """True if a file is one of these."""
    return _sort(head(path)) is not None


def _sort(text: str) -> str | None:
    """G, B, A or None, by how a file begins."""
    # the last line may be cut off
    whole = text.rpartition("\n")[0].replace("\r", "") + "\n"
    return next((sort for sort, begins in _SORTS.items() if begins.match(whole.lstrip("\n"))), None)


@dataclass
class _Session:
    """Vectors that have one covariance matrix."""

    place: RecordPlace
    count: int  #: vectors that it says it has
    frame: str
    date: str
    entries: list[Entry] = field(default_factory=list)  #: with their sigmas as variance
    #: (row, column) of components, from 1, and their correlation
    correlations: dict[tuple[int, int], float] = field(default_factory=dict)


@dataclass
class _Files:
    """What the files hold so far."""

    stations: dict[str, StationRecord] = field(default_factory=dict)  #: by number
    geoid: dict[str, float] = field(default_factory=dict)  #: geoid heights [m] by number
    held: list[tuple[RecordPlace, str]] = field(default_factory=list)  #: records ``CC``
    sessions: list[_Session] = field(default_factory=list)
    factors: tuple[float, float] = (1.0, 1.0)  #: on sigmas of vectors, in plan and in height
    undulation: float = 0.0  #: where the B-file has none [m]
    warnings: list[str] = field(default_factory=list)


def read(paths: Sequence[Path]) -> Survey:
    """Survey of the files of one project."""
    files = _Files()
    readers: dict[str | None, Callable[[_Files, RecordPlace, str], None]] = {
        "G": _vectors,
        "B": _station,
        "A": _option,
    }
    options: Path | None = None
    with RefusalCollector() as refused:
        for path in paths:
            lines = read_lines(path)
            sort = _sort("\n".join([*lines[:60], ""]))
            take = readers.get(sort)
            if take is None:
                raise InputError("this is no G-, B- or A-file of NGS", file=path)
            if sort == "A" and options is not None:
                raise InputError(
                    f"what is held stands in {options.name} already",
                    file=path,
                    cure="give one A-file",
                )
            options = path if sort == "A" else options
            for line, text in enumerate(lines, start=1):
                with refused.record():
                    if text.strip():
                        take(files, RecordPlace(path.name, line), text.ljust(80))
        refused.settle()
        if not files.sessions or not files.stations:
            what, name = ("vectors", "G") if not files.sessions else ("stations", "B")
            raise InputError(f"there are no {what}", file=paths[0], cure=f"give the {name}-file")
        for place, text in files.held:
            with refused.record():
                _hold(files, place, text)
        clusters = []
        for session in files.sessions:
            with refused.record():
                clusters.append(_cluster(files, session))
        refused.settle()
        records = Records(str(paths[0]), _FRAME, _EPOCH, _named(files), clusters)
        records.warnings = files.warnings
        survey = assemble([records], refused)
    return survey


def _integer(text: str, what: str, place: RecordPlace) -> int:
    """A number of figures with blanks around, which stand for zeros behind."""
    if not re.fullmatch(r"\s*-?\d+\s*", text):
        raise place.error(f"{what} is {text.strip()!r}, not a number")
    return int(text.replace(" ", "0") if text[:1].isdigit() else text)


def _vectors(files: _Files, place: RecordPlace, text: str) -> None:
    """A line of a G-file."""
    kind = text[0]
    session = files.sessions[-1] if files.sessions else None
    if kind == "B":
        code = _integer(text[51:53], "the code of the frame", place)
        if code not in _FRAMES:
            known = ", ".join(f"{k:02d}" for k in _FRAMES)
            raise place.error(f"the frame of code {code:02d} is not known", f"known are {known}")
        year, month, day = (text[k:n].strip() for k, n in ((1, 5), (5, 7), (7, 9)))
        count = _integer(text[25:27], "the number of vectors", place)
        date = f"{day}.{month}.{year}"
        files.sessions.append(_Session(place, count, _FRAMES[code], date))
    elif kind in _VECTOR and session:
        width, end = _VECTOR[kind]
        starts = [9 + k * (width + 5) for k in range(3)]
        value = [_integer(text[k : k + width], "a component", place) / 1e4 for k in starts]
        cells = [text[k + width : k + width + 5] for k in starts]
        sx, sy, sz = (_integer(cell, "a sigma", place) / 1e4 for cell in cells)
        if min(sx, sy, sz) <= 0:
            raise place.error("a sigma of the vector is not above zero")
        first, second = _number(text[1:5], place), _number(text[5:9], place)
        x, y, z = (f"{v:.4f}" for v in value)
        off = text[end] in _REJECTED
        session.entries.append(Entry(first, second, (x, y, z), (sx, sy, sz), [], off, place))
    elif kind == "D" and session:
        for cell in (text[k : k + 15] for k in range(1, 76, 15)):
            if cell.strip():
                ends = _integer(cell[:3], "a row", place), _integer(cell[3:6], "a column", place)
                session.correlations[ends] = _integer(cell[6:], "a correlation", place) / 1e7
    elif kind not in "AGHI":
        raise place.error(
            f"records {kind!r} of G-files are not read",
            "write vectors as C or F, correlations as D",
        )


def _number(text: str, place: RecordPlace) -> str:
    """The number of a station."""
    return f"{_integer(text, 'the number of a station', place):04d}"


def _station(files: _Files, place: RecordPlace, text: str) -> None:
    """A line of a B-file."""
    code = text[7:9]
    if _SIGHTS.match(text[6:10]):
        raise place.error(
            f"terrestrial observations (*{code}*) of B-files are not read", "leave them out"
        )
    if code == "80":
        latitude, longitude = _places(text, place)
        name = _number(text[10:14], place)
        height = text[69:75].strip()
        given = f"{_integer(text[69:75], 'the height', place) / 100:.3f}" if height else "0"
        files.stations[name] = StationRecord(
            text[14:44].strip() or name, "FFF", "LLh", (latitude, longitude, given), "", place
        )
    elif code == "86" and (name := _number(text[10:14], place)) in files.stations:
        station = files.stations[name]
        orthometric, ellipsoidal = (
            _integer(cell, "a height", place) / 1000 if cell.strip() else None
            for cell in (text[16:23], text[45:52])
        )
        best = ellipsoidal if ellipsoidal is not None else orthometric
        if best is not None:
            values = (station.values[0], station.values[1], f"{best:.4f}")
            files.stations[name] = replace(station, values=values)
        if orthometric is not None and ellipsoidal is not None:
            files.geoid[name] = ellipsoidal - orthometric


def _places(text: str, place: RecordPlace) -> tuple[str, str]:
    """Latitude and longitude as degrees.minutesseconds."""
    out = []
    for cell, sides, what in ((text[44:56], "NS", "latitude"), (text[56:69], "EW", "longitude")):
        digits, side = cell[:-1].replace(" ", "0"), cell[-1]
        if not digits.isdigit() or side not in sides:
            raise place.error(f"the {what} is {cell.strip()!r}, not degrees, minutes, seconds")
        out.append(f"{'-' if side in 'SW' else ''}{digits[:-9]}.{digits[-9:]}")
    return out[0], out[1]


def _option(files: _Files, place: RecordPlace, text: str) -> None:
    """A line of an A-file."""
    kind = text[:2]
    if kind == "CC":
        files.held.append((place, text))
    elif kind == "VS":
        if text[18:].strip():
            raise place.error("factors of single projects are not read", "give one VS for all")
        horizontal, up = (number(text[k : k + 8], "a factor", place) for k in (2, 10))
        files.factors = horizontal, up
    elif kind == "GG":
        files.undulation = number(text[2:9], "the geoid height", place)
    elif kind == "DD" and text[2] == "3":
        pass
    elif text.startswith("VVHU"):
        files.warnings.append(
            f"{place}: variance factors are to be estimated (VVHU): vectors keep their sigmas; "
            "write the factors that ADJUST lists as a record VS"
        )
    elif kind not in _SILENT and kind[0] != "*":
        raise place.error(
            f"the record {text[:4].strip()} of A-files is not read",
            "three dimensions without further unknowns are: take the record out",
        )


def _hold(files: _Files, place: RecordPlace, text: str) -> None:
    """What a record ``CC`` gives of a station, held or weighted."""
    name = _number(text[10:14], place)
    station = files.stations.get(name)
    if station is None:
        raise place.error(f"station {name} has no record *80* in the B-file")
    values, letters = list(station.values), list(station.constraints)
    sigmas = [
        number(cell, "a sigma", place) / 100 if cell.strip() else 0.0
        for cell in (text[14:20], text[20:26], text[26:32])
    ]
    if text[44:69].strip():
        values[:2] = _places(text, place)
        letters[:2] = "CC"
    if text[69:76].strip():
        height = _integer(text[69:76], "the height", place) / 1000
        if text[76] != "E":
            if name not in files.geoid and not files.undulation:
                files.warnings.append(
                    f"{place}: the B-file has no geoid height of {station.name}: its height is "
                    "taken as ellipsoidal"
                )
            height += files.geoid.get(name, files.undulation)
        values[2], letters[2] = f"{height:.4f}", "C"
    if min(sigmas) < 0 or "C" not in letters:
        what = "a sigma is below zero" if min(sigmas) < 0 else "the record gives no coordinate"
        raise place.error(what)
    files.stations[name] = replace(
        station,
        values=(values[0], values[1], values[2]),
        constraints="".join(letters),
        sigmas=(sigmas[0], sigmas[1], sigmas[2]),
        place=place,
    )


def _names(files: _Files) -> dict[str, str]:
    """Names of stations by number, with the number where two have the same name."""
    names = [station.name for station in files.stations.values()]
    return {
        key: one.name if names.count(one.name) == 1 else f"{one.name} ({key})"
        for key, one in files.stations.items()
    }


def _named(files: _Files) -> list[StationRecord]:
    """The stations by name."""
    names = _names(files)
    return [replace(station, name=names[key]) for key, station in files.stations.items()]


def _cluster(files: _Files, session: _Session) -> GnssCluster:
    """The vectors of a session with their covariance."""
    n = len(session.entries)
    if n != session.count:
        raise session.place.error(f"the session says {session.count} vectors and has {n}")
    names = _names(files)
    matrix = np.diag(np.concatenate([entry.variance for entry in session.entries]) ** 2)
    sigma = np.sqrt(np.diag(matrix))
    for (i, j), value in session.correlations.items():
        if not (1 <= i <= 3 * n and 1 <= j <= 3 * n and i != j and abs(value) < 1):
            raise session.place.error(f"the correlation of components {i} and {j} is {value:g}")
        matrix[i - 1, j - 1] = matrix[j - 1, i - 1] = value * sigma[i - 1] * sigma[j - 1]
    if np.linalg.eigvalsh(matrix / np.outer(sigma, sigma))[0] <= 0:
        raise session.place.error("the correlations of the session contradict each other")
    blocks: list[list[Array]] = [list(np.split(row, n, 1)) for row in np.split(matrix, n)]
    entries = []
    for k, entry in enumerate(session.entries):
        for end in (entry.first, entry.second):
            if end not in names:
                raise entry.place.error(f"station {end} has no record *80* in the B-file")
        variance = tuple(float(v) for v in blocks[k][k][np.triu_indices(3)])
        first, second, behind = names[entry.first], names[entry.second], blocks[k][k + 1 :]
        changed = replace(entry, first=first, second=second, variance=variance, blocks=behind)
        entries.append(changed)
    plan, up = (factor**2 for factor in files.factors)
    return GnssCluster(
        "X", "XYZ", entries, (1.0, plan, plan, up), session.frame, session.date, session.place
    )
