"""Header, epochs and satellites of a RINEX observation file, with a check that the file is whole.

The engine reads the measurements. Here every record is counted against what its epoch line
promises, so that a damaged or truncated file is refused and not silently shortened. Times in
seconds since 1980-01-06 in the file's own time system (GPS time in all but pure GLONASS files).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.gnss.rinex_file import read_rinex
from tribrach.io.opened_files import lines_of

_CLOCK = rb" ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d)((?: {2}| \d|\d\d)\d\.\d{7})"
#: epoch lines: date and time, flag, number of satellites or lines, and the rest; events other than
#: measurements may leave the date blank
_EPOCH_2 = re.compile(
    rb"^(?: ([ \d]\d)" + _CLOCK + rb"| {26})  (\d)((?: {2}| \d|\d\d)\d)(.*)$", re.M
)
_EPOCH_3 = re.compile(
    rb"^>(?: (\d{4})" + _CLOCK + rb"| {28})  (\d)((?: {2}| \d|\d\d)\d)(.*)$", re.M
)
_SATELLITE_3 = re.compile(rb"^[GREJCIS][ \d]\d", re.M)
#: what a line of measurements may consist of
_VALUES = re.compile(rb"^(?:[GREJCIS][ \d]\d)?[ \d.+-]*$")
_FIRST_DAY = np.datetime64("1980-01-06T00:00:00", "us")


@dataclass(frozen=True)
class RinexObservations:
    """One receiver's file."""

    path: Path  #: where it was read
    text: bytes  #: plain RINEX
    version: float  #: of RINEX
    marker: str  #: name of the station, "" if there is none
    #: (3,), ECEF coordinates of the header [m], NaN if there are none
    approximate: NDArray[np.float64]
    antenna: str  #: type with its dome
    #: (3,), height, east, north of the antenna reference point over the mark [m]
    delta: NDArray[np.float64]
    times: NDArray[np.float64]  #: (n,), of the epochs [s]
    satellites: frozenset[str]  #: names such as ``G07``
    #: epochs whose number of satellites was wrong in the file and is right in ``text``
    recounted: int = 0

    @property
    def interval(self) -> float:
        """Usual time between epochs [s]; 0 with a single epoch."""
        return float(np.median(np.diff(self.times))) if len(self.times) > 1 else 0.0

    @property
    def body(self) -> bytes:
        """The observations after the header."""
        return self.text.partition(b"END OF HEADER")[2].strip()

    @property
    def systems(self) -> frozenset[str]:
        """Letters of the satellite systems."""
        return frozenset(name[0] for name in self.satellites)


def header_text(path: Path, data: bytes) -> tuple[list[tuple[str, str]], int]:
    """Header lines, and where the body starts.

    Returns label and content of each line.
    """
    end = re.search(rb"END OF HEADER *\r?\n?", data[:1_000_000])
    if end is None:
        raise InputError(
            "the RINEX header has no end", file=path, cure="download or transfer it again"
        )
    lines = lines_of(data[: end.start()].decode("latin-1"))
    return [(line[60:].strip(), line[:60]) for line in lines if len(line) > 60], end.end()


def header_of(path: Path, lines: list[tuple[str, str]]) -> tuple[float, str]:
    """Version and type letters of the first header line."""
    first = next((text for label, text in lines if label == "RINEX VERSION / TYPE"), "")
    try:
        version = float(first[:9])
    except ValueError:
        version = 0.0
    if not 2 <= version < 4:
        raise InputError(
            f"RINEX version {first[:9].strip() or 'of the file'} is not read",
            file=path,
            line=1,
            cure="convert it to RINEX 2.11 or 3",
        )
    return version, first[20:60]


def read_observations(path: Path) -> RinexObservations:
    """Header, epochs and satellites of an observation file."""
    data = read_rinex(path)
    lines, start = header_text(path, data)
    version, kind = header_of(path, lines)
    if kind[:1].upper() != "O":
        raise InputError(
            f"this is RINEX of type {kind[:20].strip() or '?'}, not observations",
            file=path,
            cure="give the observation file of the receiver here",
        )
    if b"\x00" in data:
        raise _damaged(path, data, data.index(b"\x00"), "a zero byte")
    data, start = _in_columns(data, lines, start)
    read = _epochs_3 if version >= 3 else _epochs_2
    data, recounted, times, satellites = read(path, data, start, lines)
    if not len(times):
        raise InputError("the file has no epochs", file=path, cure="give a file with measurements")
    if (np.diff(times) < 0).any():
        raise InputError(
            "the epochs of the file run backwards in time",
            file=path,
            cure="splice files in the order of their measurement",
        )
    return RinexObservations(
        path,
        data,
        version,
        _first(lines, "MARKER NAME")[:60].strip(),
        _position(lines),
        _first(lines, "ANT # / TYPE")[20:40].strip(),
        _antenna_delta(path, data, lines),
        times,
        satellites,
        recounted,
    )


def _first(lines: list[tuple[str, str]], label: str) -> str:
    """Content of the first header line of a label, "" without one."""
    return next((text for name, text in lines if name == label), "")


_PLACE, _DELTA = "APPROX POSITION XYZ", "ANTENNA: DELTA H/E/N"


def _in_columns(data: bytes, lines: list[tuple[str, str]], start: int) -> tuple[bytes, int]:
    """The text with the numbers of position and antenna in their columns, and where its body is.

    Programs shift them by a column or two; the engine reads them by columns.
    """
    head = data[:start]
    for label in (_PLACE, _DELTA):
        text = _first(lines, label)
        values = _three(text)
        if values is None or _fields(text) == values:
            continue
        right = "".join(f"{value:14.4f}" for value in values).ljust(60).encode()
        old = re.compile(rb"^[^\r\n]{60}(?=" + re.escape(label.encode()) + rb")", re.M)
        head = old.sub(right, head, count=1)
    return head + data[start:], len(head)


def _fields(text: str) -> list[float] | None:
    """Three numbers in fields of 14 characters; None if one is not a number."""
    try:
        return [float(text[k : k + 14]) for k in (0, 14, 28)]
    except ValueError:
        return None


def _three(text: str) -> list[float] | None:
    """Three numbers between blanks, or in their fields where nothing parts them."""
    words = text.split()
    if len(words) == 3:
        try:
            return [float(word) for word in words]
        except ValueError:
            return None
    return _fields(text)


def _position(lines: list[tuple[str, str]]) -> NDArray[np.float64]:
    """Position (3,) of the header [m]; NaN where it cannot be read, and given ones are taken."""
    values = _three(_first(lines, _PLACE))
    known = values is not None and any(values) and np.isfinite(values).all()
    return np.array(values) if known else np.full(3, np.nan)


def _antenna_delta(path: Path, data: bytes, lines: list[tuple[str, str]]) -> NDArray[np.float64]:
    """Height, east and north (3,) of the antenna over the mark [m], zero without them."""
    text = _first(lines, _DELTA)
    if not text.strip():
        return np.zeros(3)
    values = _three(text)
    if values is None or not np.isfinite(values).all():
        raise InputError(
            f"{_DELTA} of the header is {' '.join(text.split())!r}, not three numbers",
            file=path,
            line=_line(data, data.index(_DELTA.encode())),
            cure="write height, east and north of the antenna in fields of 14 characters",
        )
    return np.array(values)


def seconds_of(years: list[int], rest: list[tuple[int, int, int, int, float]]) -> list[float]:
    """Seconds since 1980-01-06 of calendar dates."""
    days = np.array(
        [f"{y:04d}-{m:02d}-{d:02d}" for y, (m, d, *_) in zip(years, rest, strict=True)],
        dtype="datetime64[us]",
    )
    whole = (days - _FIRST_DAY).astype(np.int64) / 1e6
    return [float(w + h * 3600 + n * 60 + s) for w, (*_, h, n, s) in zip(whole, rest, strict=True)]


def _times(path: Path, data: bytes, epochs: list[re.Match[bytes]]) -> NDArray[np.float64]:
    """Seconds (n,) of epoch lines."""
    years, rest = [], []
    for match in epochs:
        year, month, day, hour, minute = (int(word) for word in match.groups()[:5])
        # two-digit years of RINEX 2: 80 to 99 and 00 to 79
        years.append(year if year > 99 else year + (1900 if year >= 80 else 2000))
        rest.append((month, day, hour, minute, float(match.group(6))))
    try:
        return np.array(seconds_of(years, rest))
    except ValueError as error:
        raise _damaged(path, data, epochs[0].start(), "a date that does not exist") from error


def _epochs_3(
    path: Path, data: bytes, start: int, lines: list[tuple[str, str]]
) -> tuple[bytes, int, NDArray[np.float64], frozenset[str]]:
    """The text, how many epochs were recounted, times and satellites of RINEX 3."""
    del lines
    epochs = list(_EPOCH_3.finditer(data, start))
    short = _check_records(path, data, start, epochs, 1)
    satellites = {m.group().decode().replace(" ", "0") for m in _SATELLITE_3.finditer(data[start:])}
    times = _times(path, data, _measured(epochs))
    return _recounted(data, epochs, short), len(short), times, frozenset(satellites)


def _recounted(data: bytes, epochs: list[re.Match[bytes]], short: dict[int, int]) -> bytes:
    """The text with right numbers of satellites in epochs ``short``; lines name their own."""
    if not short:
        return data
    parts, last = [], 0
    for k, count in short.items():
        parts += [data[last : epochs[k].start(8)], b"%3d" % count]
        last = epochs[k].end(8)
    return b"".join([*parts, data[last:]])


def _epochs_2(
    path: Path, data: bytes, start: int, lines: list[tuple[str, str]]
) -> tuple[bytes, int, NDArray[np.float64], frozenset[str]]:
    """The text, how many epochs were recounted (none), times and satellites of RINEX 2."""
    try:
        kinds = int(_first(lines, "# / TYPES OF OBSERV")[:6])
    except ValueError:
        raise InputError("the header does not say what is observed", file=path) from None
    epochs = list(_EPOCH_2.finditer(data, start))
    _check_records(path, data, start, epochs, -(-kinds // 5))
    names: set[str] = set()
    for match in _measured(epochs):
        names.update(name for name in _names_2(data, match)[0] if name)
    return data, 0, _times(path, data, _measured(epochs)), frozenset(names)


def _names_2(data: bytes, match: re.Match[bytes]) -> tuple[list[str], int]:
    """Satellites of an epoch of RINEX 2, "" where there is no name, and their further lines."""
    count = int(match.group(8))
    further = max(-(-count // 12) - 1, 0)
    text = match.group(9)[:36].ljust(36)
    # more than twelve names go on in further lines
    rest = data[match.end() + 1 : match.end() + 1 + 100 * further].split(b"\n")[:further]
    text += b"".join(line[32:68] for line in rest)
    words = [text[k : k + 3].decode("latin-1") for k in range(0, 3 * count, 3)]
    names = [(w[:1].strip() or "G") + w[1:].replace(" ", "0") if w.strip() else "" for w in words]
    return names, further


def records_2(file: RinexObservations, kinds: int) -> Iterator[tuple[str, int]]:
    """The measurements of a file of RINEX 2: satellite and offset of its lines in the text."""
    data = file.text
    for match in _measured(list(_EPOCH_2.finditer(data, header_text(file.path, data)[1]))):
        names, further = _names_2(data, match)
        at = _lines_on(data, match.end(), 1 + further)
        for name in names:
            yield name, at
            at = _lines_on(data, at, -(-kinds // 5))


def _lines_on(data: bytes, at: int, lines: int) -> int:
    """Where the line starts that is so many lines after the one at an offset."""
    for _ in range(lines):
        at = data.find(b"\n", at) + 1 or len(data)
    return at


def _measured(epochs: list[re.Match[bytes]]) -> list[re.Match[bytes]]:
    """Epochs with measurements: flag 0, or 1 after a power failure."""
    return [match for match in epochs if match.group(7) in b"01"]


def _check_records(
    path: Path, data: bytes, start: int, epochs: list[re.Match[bytes]], each: int
) -> dict[int, int]:
    """Check that every epoch has the lines it promises, ``each`` per satellite, and that all are
    numbers.

    The result are the epochs of RINEX 3 that list fewer satellites than they promise, with the
    number they list: some receivers write such files, and every line names its satellite.
    """
    if data[start : epochs[0].start() if epochs else len(data)].strip():
        raise _damaged(path, data, start, "no epoch where one is due")
    short: dict[int, int] = {}
    for k, match in enumerate(epochs):
        end = epochs[k + 1].start() if k + 1 < len(epochs) else len(data)
        flag, count = int(match.group(7)), int(match.group(8))
        # the first part is the rest of the epoch line, the last one what follows the last newline
        here = data[match.end() : end].split(b"\n")[1:]
        here = here[:-1] if here and not here[-1].strip() else here
        names = max(-(-count // 12) - 1, 0) if match.re is _EPOCH_2 and flag < 2 else 0
        expected = count if 1 < flag < 6 else names + count * each
        missing = expected - len(here)
        last = k + 1 == len(epochs)
        if missing > 0:
            whole = match.re is _EPOCH_3 and flag < 2 and (not last or (short and _ended(data)))
            if not whole:
                raise _short(path, data, match, last)
            short[k] = len(here)
        elif last and not _ended(data) and _cut(match, here):
            raise _short(path, data, match, last)
        if any(line.strip() for line in here[expected:]):
            raise _damaged(path, data, match.end(), "a line that belongs to no epoch")
        if not 1 < flag < 6:
            _check_values(path, data, match, here[names:expected])
    return short


def _check_values(path: Path, data: bytes, match: re.Match[bytes], lines: list[bytes]) -> None:
    for line in lines:
        if not _VALUES.match(line.rstrip(b"\r")):
            raise _damaged(path, data, data.index(line, match.end()), "no numbers")


def _short(path: Path, data: bytes, match: re.Match[bytes], last: bool) -> InputError:
    """The error of an epoch with too few lines."""
    when = " ".join(match.group().decode("latin-1")[:28].strip("> ").split())
    if not last:
        return _damaged(path, data, match.start(), f"lines are missing in the epoch {when}")
    return InputError(
        f"the file ends within the epoch {when}",
        file=path,
        line=_line(data, len(data)),
        cure="download or transfer it again",
    )


def _ended(data: bytes) -> bool:
    """True if the last line is complete."""
    return data.endswith((b"\n", b"\r"))


def _cut(match: re.Match[bytes], here: list[bytes]) -> bool:
    """True if the last line stops inside a number, or before the others of its epoch do."""
    first = 0 if match.re is _EPOCH_2 else 3
    if not here:
        return False
    inside = 0 < (len(here[-1].rstrip()) - first) % 16 < 14
    return inside or len(here[-1]) < max(len(line) for line in here)


def _damaged(path: Path, data: bytes, at: int, what: str) -> InputError:
    """The error of a place in the file that cannot be read."""
    return InputError(
        f"the RINEX is damaged: {what}",
        file=path,
        line=_line(data, at),
        cure="download or transfer it again",
    )


def _line(data: bytes, at: int) -> int:
    """Number of the line at an offset."""
    return data.count(b"\n", 0, at) + 1
