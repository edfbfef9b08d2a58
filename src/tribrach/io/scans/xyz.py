"""Text with one point in a line: .xyz, .txt, .csv, .asc, plain or compressed.

Columns are named by a first line of words, as a comment or not; otherwise their number tells. What
stands between values and before decimals is told by many lines together
(:mod:`tribrach.io.text_form`). Columns of words are passed over. A count of the points may
stand before them. The format has no place for a scanner.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.scans.columns import arranged, column_unit, known_name
from tribrach.io.scans.origin import assumed_origin, bounds_of, scan_name
from tribrach.io.scans.reading import reading
from tribrach.io.scans.text import LineBlock, Lines, Mark
from tribrach.io.scans.text_scan import TextScan, is_number, malformed, off_by_one, rows, table
from tribrach.io.scans.units import stated_unit
from tribrach.io.text_form import COMMENTS, TextForm, agreement, form_of
from tribrach.io.unpacking import unpacked
from tribrach.scan.length_unit import METRES
from tribrach.scan.scan import Scan

#: lines before the points, at most
_HEAD = 200
#: colours are whole numbers up to this
_COLOUR = 65535
#: share of words that makes a column one of words
_WORDS = 0.1
#: no height is above or below [m]; the distance of places on the ground from the earth's centre
_HIGHEST, _GEOCENTRIC = 20_000.0, (6.3e6, 6.45e6)
#: coordinates of places on a map differ by less than this share of themselves
_ALIKE = 0.1
_NAMED = 'name the columns in the first line, or say --columns "x y z ..."'


@dataclass(frozen=True)
class XyzScan(TextScan):
    """The points of a text file."""

    #: cells of a line, and those of them that are columns of numbers; None for all
    width: int = 0
    kept: tuple[int, ...] | None = None

    def _numbers(self, lines: Lines, block: LineBlock, columns: int) -> list[Array]:
        """The table of a block without its columns of words."""
        if self.kept is None:
            return table(lines, block, columns)
        cells = [line.split(b" ") for line in block.text.split(b"\n")[:-1]]
        if any(len(row) != self.width for row in cells):
            raise malformed(lines, block, self.width)
        text = _without_words(cells, self.kept)
        try:
            return table(lines, LineBlock(text, block.count, block.first, block.mark), columns)
        except InputError as error:
            raise InputError(
                f"{error.what} (words are passed over in other columns)",
                file=error.file,
                line=error.line,
                cure=error.cure,
            ) from error


def _without_words(cells: list[list[bytes]], kept: tuple[int, ...]) -> bytes:
    """Lines of some columns."""
    return b"".join(b" ".join([row[k] for k in kept]) + b"\n" for row in cells)


@dataclass
class _Head:
    """The lines before the points."""

    names: list[str]  #: of the columns, empty if they are not named
    count: int | None  #: of the points, None if it is not stated
    lines: int  #: how many lines


def numeric(line: bytes) -> bool:
    """True for a line of numbers with blanks between them."""
    values = line.split()
    try:
        return bool(values) and [float(v) for v in values] != []
    except ValueError:
        return False


def row_of_numbers(lines: list[str]) -> bool:
    """True if lines are rows of three numbers or more in some form."""
    some = [line for line in lines[:100] if not line.lstrip().startswith(COMMENTS)]
    return agreement(some) > 0


def read(path: Path) -> tuple[Scan, ...]:
    """The one scan of a file; the lines are counted on the way."""
    told = reading()
    form, words, _ = form_of(path, told.decimal)
    with unpacked(path) as file:
        lines = Lines(file, path, form.blanks, Mark(), form.fill)
        head = _head(lines, form, words)
        lines.skip(head.lines)
        mark = lines.mark
        records, sample = lines.survey()
    warnings = []
    if head.count is not None and head.count != records:
        warnings.append(off_by_one(path, head.count, records))
    if records == 0 and not head.names:
        raise InputError("the file has no points", file=path, cure="export it again")
    return (_scan(path, head, sample, records, form, mark, warnings, words),)


def _scan(
    path: Path,
    head: _Head,
    sample: list[bytes],
    records: int,
    form: TextForm,
    mark: Mark,
    warnings: list[str],
    words: list[str],
) -> XyzScan:
    """The scan, once its columns are known."""
    widths = [line.count(b" ") + 1 for line in sample]
    width = max(set(widths), key=widths.count) if widths else len(head.names)
    told = reading().columns
    kept, values = _numbers_of(sample, width)
    names = _names(path, head, values, width, kept, warnings, told, form)
    left_out = [k for k in range(width) if k not in kept or names[k] in ("", "-")]
    kept = tuple(k for k in range(width) if k not in left_out)
    of_words = [names[k] or f"column {k + 1}" for k in left_out if names[k] != "-"]
    if of_words:
        warnings.append(f"what is no number is left out: {', '.join(of_words)}")
    names = _unique([names[k] for k in kept])
    known = {known_name(n) for n in names}
    if not {"x", "y", "z"} <= known:
        what = f"no numbers x, y and z among the columns ({', '.join(names[:12])})"
        raise InputError(what, file=path, cure=_NAMED)
    types = dict.fromkeys(names, "float64")
    columns = dict(zip(names, values[:, list(kept)].T, strict=True))
    layout = arranged(types, columns, path)
    units = {unit for name in names if (unit := column_unit(name)) is not None}
    if any(unit.factors is None for unit in units):  # heights are metres
        units = {unit for unit in units if unit.factors is None}
    if len(units) > 1:
        units = set()
        warnings.append("the columns x, y and z are named in different units")
    stated = next(iter(units), None) or stated_unit(w.lstrip("#/%!' ") for w in words)
    return XyzScan(
        name=scan_name(path),
        path=path,
        records=records,
        fields=layout.fields,
        origin=assumed_origin(bounds_of(layout.coordinates(columns))),
        warnings=tuple(warnings),
        unit=stated or METRES,
        mark=mark,
        first=head.lines,
        blanks=form.blanks,
        fill=form.fill,
        types=types,
        columns=layout,
        width=width,
        kept=None if len(kept) == width else kept,
    )


def _numbers_of(sample: list[bytes], width: int) -> tuple[tuple[int, ...], Array]:
    """Which columns hold numbers, and the sampled rows (k, width) with NaN for words."""
    whole = rows(sample, width)
    lines = [line.split(b" ") for line in sample if line.count(b" ") == width - 1]
    if len(whole) == len(lines):
        return tuple(range(width)), whole
    share = [np.mean([not is_number(row[k]) for row in lines]) for k in range(width)]
    kept = tuple(k for k in range(width) if share[k] < _WORDS)
    if len(kept) < 3:
        return tuple(range(width)), whole
    some = rows([b" ".join(row[k] for k in kept) for row in lines], len(kept))
    out = np.full((len(some), width), np.nan)
    out[:, list(kept)] = some
    return kept, out


def _names(
    path: Path,
    head: _Head,
    values: Array,
    width: int,
    kept: tuple[int, ...],
    warnings: list[str],
    told: tuple[str, ...] | None,
    form: TextForm,
) -> list[str]:
    """A name for each column; "" for one of words without a name, "-" for one to be left out."""
    if told is not None:
        if len(told) > width:
            what = f"--columns names {len(told)} columns and lines have {width} values"
            raise InputError(what, file=path, cure="name as many, - for one to leave out")
        return [*told, *(["-"] * (width - len(told)))]
    names = head.names
    if names and {"x", "y", "z"} <= {known_name(n) for n in names}:
        if len(names) == width:
            warnings += _turned_axes(path, names, values)
            return names
        what = f"{len(names)} columns are named ({', '.join(names[:12])}) and lines have "
        both = form.mark == "," and width == 2 * len(names)
        raise InputError(
            f"{what}{width} values"
            + (": commas seem to stand before decimals too" if both else ""),
            file=path,
            cure="export the file with semicolons between the values"
            if both
            else 'name x, y, z and all other columns, or say --columns "x y z ..."',
        )
    if len(kept) < 3:
        raise InputError("the file has no points x y z", file=path, cure="export it again")
    numbers = values[:, list(kept)]
    first = _running(numbers)
    found = (["number"] if first else []) + _guessed(numbers[:, first:], len(kept) - first)
    listed = first > 0 or len(kept) < width
    if not first and _numbered(numbers):
        raise InputError(
            "the columns have no names, and the first holds whole numbers, each but once, as "
            "numbers of points do",
            file=path,
            cure=_NAMED,
        )
    _refuse_doubtful(path, numbers[:, first : first + 3], listed)
    out = [""] * width
    for k, name in zip(kept, found, strict=True):
        out[k] = name
    if not listed and _northing_first(numbers):
        warnings.append(f"the first coordinate may be the northing: if it is, {_NAMED}")
    if len(kept) > 3:
        warnings.append(f"the columns have no names; they are taken as {' '.join(found)}")
    return out


def _running(numbers: Array) -> int:
    """1 if the first of four columns or more counts the points, else 0."""
    if numbers.shape[1] < 4 or len(numbers) < 3:
        return 0
    first = numbers[:, 0]
    whole = bool((first % 1 == 0).all() and (first >= 0).all())
    steps = np.diff(first)
    # those that count by fives or tens are told by the decimals of what follows
    step = 1.0 if (numbers[:, 1:4] % 1 == 0).all(axis=0).any() else max(float(np.median(steps)), 1)
    counts = whole and bool((steps >= 1).all() and (steps == step).mean() > 0.5)
    # a line of a raster steps as well, and its other coordinate stays
    return int(counts and np.ptp(numbers[:, 1]) > 0 and np.ptp(numbers[:, 2]) > 0)


def _numbered(numbers: Array) -> bool:
    """True if the first of four columns or more may number the points in any order."""
    if numbers.shape[1] < 4 or len(numbers) < 20:
        return False
    first = numbers[:, 0]
    whole = bool((first % 1 == 0).all()) and len(np.unique(first)) == len(first)
    return whole and not (numbers[:, 1:4] % 1 == 0).all(axis=0).any()


def _refuse_doubtful(path: Path, xyz: Array, listed: bool) -> None:
    """Ask for names where the values cannot be x, y and z in this order."""
    if not len(xyz) or not np.isfinite(xyz).all():
        return
    height = float(np.median(np.abs(xyz[:, 2])))
    with np.errstate(over="ignore"):
        radius = float(np.median(np.linalg.norm(xyz, axis=1)))
    if height > _HIGHEST and not _GEOCENTRIC[0] < radius < _GEOCENTRIC[1]:
        plane = np.median(np.abs(xyz[:, :2]), axis=0)
        if height > 5 * plane.min() and np.ptp(xyz[:, 2]) < _ALIKE * height:
            raise InputError(
                f"the third column has {height:.0f}, which is no height", file=path, cure=_NAMED
            )
    if listed and _northing_first(xyz):
        x = np.median(xyz[:, 0])
        raise InputError(
            f"the columns have no names, and the first coordinate ({x:.0f}) may be the northing",
            file=path,
            cure=_NAMED,
        )


def _northing_first(xy: Array) -> bool:
    """True if coordinates (n, 2 or more) are as large as northing and easting of many maps."""
    if not len(xy):
        return False
    x, y = np.median(xy[:, 0]), np.median(xy[:, 1])
    return bool(1e6 < x < 1e7 and 1e5 < y < 1e6)


def _turned_axes(path: Path, names: list[str], values: Array) -> list[str]:
    """A sentence if y stands before x, as where x points north; refused if the sizes say so too."""
    bare = [re.sub(r"\W.*", "", name.strip("\"' ").lower()) for name in names]
    if not {"x", "y"} <= set(bare) or bare.index("y") > bare.index("x"):
        return []
    x, y = bare.index("x"), bare.index("y")
    if _northing_first(values[:, [y, x]]):
        return []
    cure = 'say --columns "x y z ..." with the easting as x, the northing as y'
    if _northing_first(values[:, [x, y]]):
        what = "the column y stands before x, and x is as large as a northing"
        raise InputError(what, file=path, cure=cure)
    return [f"the column y stands before x: if x points north, {cure}"]


def _head(lines: Lines, form: TextForm, words: list[str]) -> _Head:
    """The lines before the first line of several numbers."""
    head = _Head([], None, 0)
    named = reading().columns is not None
    following = lines.peek(_HEAD + 1)
    for k, line in enumerate(following[:_HEAD]):
        raw = words[k] if k < len(words) else ""
        comment = bool(raw) and raw.lstrip().startswith(COMMENTS)
        if raw and not raw.strip().isdigit():
            head.names = _best_names(raw, form, following) or head.names
            if not comment and not head.names and not named:
                bare = raw.strip()[:40]
                what = f"{bare!r} names no columns x, y and z, and is no point"
                number = lines.number(LineBlock(b"", 0, 0, Mark()), k)
                raise InputError(what, file=lines.path, line=number, cure=_NAMED)
        elif line.isdigit() and head.count is None and _several(following[k + 1 : k + 2]):
            head.count = int(line[:30])
        else:
            break
        head.lines = k + 1
    return head


def _best_names(raw: str, form: TextForm, following: list[bytes]) -> list[str]:
    """The names of a line of words, parted as the points are or otherwise; none without x, y, z."""
    bare = raw.strip()
    for comment in COMMENTS:
        while bare.startswith(comment):
            bare = bare[len(comment) :].strip()
    width = following[-1].count(b" ") + 1 if following else 0
    tried = [
        form.cells(bare),
        *(TextForm(mark).cells(bare) for mark in ";\t|, "),
        TextForm("").cells(bare),
    ]
    # lines that all end with a delimiter have no cell behind it
    if form.closed:
        tried += [names[:-1] for names in tried if len(names) == width + 1]
    good = [names for names in tried if {"x", "y", "z"} <= {known_name(n) for n in names}]
    fitting = [names for names in good if len(names) == width]
    return next(iter(fitting or good), [])


def _several(lines: list[bytes]) -> bool:
    """True if the first of these lines has three values or more."""
    return bool(lines) and len(lines[0].split()) >= 3


def _unique(names: list[str]) -> list[str]:
    """Names of which none occurs twice."""
    out: list[str] = []
    for name in names:
        while name in out:
            name += "_2"
        out.append(name)
    return out


def _guessed(values: Array, width: int) -> list[str]:
    """Names by the values of the columns: colours are whole numbers, normals have length one."""
    rest, names = values[:, 3:], ["x", "y", "z"]
    k = 0
    while k < width - 3:
        three = rest[:, k : k + 3]
        if three.shape[1] == 3 and "red" not in names and _colours(three):
            names += ["red", "green", "blue"]
            k += 3
        elif three.shape[1] == 3 and "nx" not in names and _normals(three):
            names += ["nx", "ny", "nz"]
            k += 3
        else:
            names.append("intensity" if "intensity" not in names else f"column_{k + 4}")
            k += 1
    return names


def _colours(three: Array) -> bool:
    """True if three columns hold whole numbers from 0 to 65535."""
    whole = (np.rint(three) == three).all() and (three >= 0).all() and (three <= _COLOUR).all()
    return bool(whole and len(three) > 0)


def _normals(three: Array) -> bool:
    """True if three columns are vectors of length one."""
    square = (np.clip(three, -2, 2) ** 2).sum(axis=1)
    return bool(len(three) > 0 and (np.abs(square - 1) < 0.02).mean() > 0.9)
