"""How a text of scans, lists or observations is written: what parts cells, what decimals.

Told by many lines together: of all ways to read them, the one that makes rows of one length with
most numbers. What two ways read alike is not guessed but asked for.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.decimals import lone_commas
from tribrach.io.opened_files import lines_of, text_of_bytes
from tribrach.io.unpacking import unpacked

#: what comments begin with
COMMENTS = ("#", "//", "%", "!", "'")
#: bytes and lines that are looked at
_LOOKED, _LINES = 1 << 18, 2000
#: how a line of numbers begins; some programs write nan and inf
_BEGINS = re.compile(r'"?(?:[-+.,]?\d|[-+]?(?:nan|inf(?:inity)?)\b)', re.IGNORECASE)
#: share of the lines that must have one number of cells, and share of numbers in a column of them
_WHOLE, _NUMBERS = 0.9, 0.9
_EXPONENT = r"(?:[eEdD][-+]?\d+)?"
_ODD = r"|[-+]?(?:nan|inf|infinity|1\.#\w+|nan\(\w*\)|n/a|null)"
_PLAIN = {
    (".", ""): re.compile(rf"(?i)[-+]?(?:\d+\.?\d*|\.\d+){_EXPONENT}{_ODD}"),
    (",", ""): re.compile(rf"(?i)[-+]?(?:\d+(?:,\d+)?|,\d+){_EXPONENT}{_ODD}"),
    (".", ","): re.compile(r"[-+]?\d{1,3}(?:,\d{3})*(?:\.\d*)?"),
    (",", "."): re.compile(r"[-+]?\d{1,3}(?:\.\d{3})*(?:,\d+)?"),
    (".", "'"): re.compile(r"[-+]?\d{1,3}(?:['\u2019]\d{3})*(?:\.\d*)?"),
    (",", "'"): re.compile(r"[-+]?\d{1,3}(?:['\u2019]\d{3})*(?:,\d+)?"),
    (".", " "): re.compile(r"[-+]?\d{1,3}(?:[ \xa0\u202f\u2009]\d{3})*(?:\.\d*)?"),
    (",", " "): re.compile(r"[-+]?\d{1,3}(?:[ \xa0\u202f\u2009]\d{3})*(?:,\d+)?"),
}
#: bytes of those apostrophes and blanks in UTF-8 and Windows-1252
_APART = b"'\xe2\x80\x99\x92\xc2\xa0\xaf\x89"
#: exponents of Fortran
_FORTRAN = re.compile(r"(?<=[\d.,])[dD](?=[-+]?\d)")
#: what stands between the cells of lists; blanks are tried last
MARKS = ";\t|,"
#: a number in quotes with a comma in it
_IN_QUOTES = re.compile(r'"[-+.\d]*\d,\d')
_DROPPED = 34


@dataclass(frozen=True)
class TextForm:
    """What stands between the values of lines, and within them."""

    #: between values: a blank for any white space, "" for white space, commas and semicolons alike
    mark: str = " "
    #: before decimals, and between thousands
    decimal: str = "."
    thousands: str = ""
    ends: bool = False  #: the last cell of some lines is empty
    closed: bool = False  #: a mark stands at the end of every line
    fortran: bool = False  #: exponents begin with D

    @property
    def blanks(self) -> bytes:
        """Translation of bytes that makes a space of the mark and a point of a decimal comma.

        256 bytes for what stands outside of quotes, and as many for what stands in them.
        """
        table = bytearray(range(256))
        for white in b"\v\f":
            table[white] = 32
        if self.mark in (" ", ""):
            table[9] = 32
        else:
            table[32] = table[9] = _DROPPED
        if self.thousands in ("'", " "):
            for byte in _APART:
                table[byte] = _DROPPED
        elif self.thousands:
            table[ord(self.thousands)] = _DROPPED
        if self.decimal == ",":
            table[ord(",")] = ord(".")
        if self.fortran:
            table[ord("D")] = table[ord("d")] = ord("E")
        quoted = bytes(table)
        for mark in self.mark or ",;":
            table[ord(mark)] = 32
        return bytes(table) + quoted

    @property
    def fill(self) -> bytes:
        """What matches cells with nothing in them, which are missing numbers; none with blanks."""
        if self.mark in (" ", ""):
            return b""
        mark, white = re.escape(self.mark.encode()), b" *" if self.mark == "\t" else rb"[ \t]*"
        within = b"(?:^|(?<=" + mark + b"))" + white + b"(?=" + mark + b")"
        last = b"|(?<=" + mark + b")" + white + rb"(?=\r?$)" if self.ends else b""
        return b"(?m)" + within + last

    def cells(self, line: str) -> list[str]:
        """The cells of a line, without blanks and quotes about them; names may hold blanks."""
        if self.mark == "":
            return re.split(r"(?a)[\s,;]+", line.replace('"', "").strip())
        if self.mark == " ":  # but not those between thousands
            return _quoted(re.sub(r"(?a)\s+", " ", line), " ")
        return [one.strip() for one in _quoted(line, self.mark)]

    def number(self, cell: str) -> bool:
        """True if a cell is a number."""
        return _PLAIN[self.decimal, self.thousands].fullmatch(cell) is not None


#: the ways that are tried, the likelier first
_FORMS = (
    *(TextForm(mark, decimal) for mark in ";\t|" for decimal in ".,"),
    *(TextForm(mark) for mark in ", "),
    TextForm(",", ","),
    TextForm(" ", ","),
    *(TextForm(mark, *pair) for mark in ";\t| ," for pair in (".,", ",.", ".'", ",'")),
    *(TextForm(mark, *pair) for mark in ";\t| ," for pair in (". ", ", ")),
    TextForm(""),
)


def _quoted(line: str, mark: str) -> list[str]:
    """Cells between marks; what stands in quotes is one cell."""
    try:
        return next(
            csv.reader(
                [line.strip(" \t\r\n" if mark == " " else " \r\n")],
                delimiter=mark,
                skipinitialspace=True,
            ),
            [],
        )
    except csv.Error:
        return line.split(mark)


def heads(text: str) -> tuple[list[str], list[str]]:
    """Lines before the first one that begins like a number or holds three, and the others."""
    lines = [line for line in lines_of(text) if line.strip()]
    for k, line in enumerate(lines):
        bare = line.strip()
        if bare.startswith(COMMENTS) or bare.isdigit():
            continue
        if _BEGINS.match(bare) or any(_numbers(form, bare) >= 3 for form in _FORMS):
            return lines[:k], lines[k:]
    return lines, []


def _numbers(form: TextForm, line: str) -> int:
    """How many cells of a line are numbers."""
    return sum(map(form.number, form.cells(line)))


def text_start(path: Path) -> str:
    """The beginning of a file as text, whole lines."""
    with unpacked(path) as file:
        raw = file.read(_LOOKED)
    if len(raw) == _LOOKED:
        raw = raw[: raw.rfind(b"\n") + 1] or raw
    return text_of_bytes(raw)


def form_of(path: Path, decimal: str | None = None) -> tuple[TextForm, list[str], list[str]]:
    """How a file is written, its lines of words, and some lines of its points.

    ``decimal``: what stands before decimals where the user says it.
    """
    before, lines = heads(text_start(path))
    lines = [line for line in lines[:_LINES] if not line.lstrip().startswith(COMMENTS)]
    form = _best(lines, decimal)
    if decimal is None:
        _refuse_doubt(form, lines, path)
    if any(form.number(c) and _FORTRAN.search(c) for line in lines for c in form.cells(line)):
        form = replace(form, fortran=True)
    if form.fill:
        empty = [line.rstrip(" \r").endswith(form.mark) for line in lines]
        form = replace(form, ends=any(empty) and not all(empty), closed=all(empty))
    return form, before, lines


def mark_of(head: str, lines: Sequence[str]) -> str:
    """What stands between the cells of a list, of a head and lines: one of MARKS or a blank."""
    forms = [f for f in _FORMS if f.mark and len(head.split(f.mark.strip(" ") or None)) > 1]
    scores = [_agreement(form, [head, *lines], least=0, head=1) for form in forms]
    if any(score > (0.0, 0.0) for score in scores):
        return forms[scores.index(max(scores))].mark
    found = max(MARKS, key=head.count)
    return found if found in head else " " if head.split()[1:] else ","


def _best(lines: Sequence[str], decimal: str | None) -> TextForm:
    """The form that makes rows of numbers of most lines."""
    best, form = (0.0, 0.0), TextForm("")
    for one in _FORMS:
        if decimal is not None and one.decimal != decimal:
            continue
        if not one.mark and best > (0.0, 0.0):  # blanks, commas and semicolons alike: the last way
            continue
        good = _agreement(one, lines)
        if good > best:
            best, form = good, one
    return form


def blanks_of(path: Path, decimal: str | None = None, head: int = 0) -> bytes:
    """Translation of bytes for the points of a format with blanks, whatever stands there instead.

    ``head``: lines of numbers before the points.
    """
    text = text_start(path)
    if not any(mark in text for mark in ",;|"):
        return TextForm().blanks
    _, lines = heads(text)
    form = _best(lines[head:_LINES], decimal)
    if decimal is None:
        _refuse_doubt(form, lines[head:_LINES], path)
    table = bytearray((form if form.mark else TextForm()).blanks)
    table[32] = table[9] = table[288] = table[265] = 32  # they part the numbers of headers
    return bytes(table)


def agreement(lines: Sequence[str]) -> float:
    """Share of the lines that the best of all forms makes rows of numbers of; 0 for none."""
    return max((_agreement(form, lines)[0] for form in _FORMS), default=0.0)


def _agreement(
    form: TextForm, lines: Sequence[str], least: int = 3, head: int = 0
) -> tuple[float, float]:
    """Share of the lines with the usual number of cells, and share of numbers; 0 for too few.

    ``least``: columns of numbers; ``head``: lines of words before them.
    """
    rows = [form.cells(line) for line in lines]
    widths = [len(row) for row in rows]
    if not widths:
        return 0.0, 0.0
    usual = max(set(widths), key=widths.count)
    whole = [row for row in rows if len(row) == usual]
    if usual < max(least, 2) or len(whole) < _WHOLE * len(rows):
        return 0.0, 0.0
    columns = [[cell for cell in column if cell] for column in zip(*whole[head:], strict=True)]
    # what is empty throughout is no column: lines that end with a mark
    shares = [sum(map(form.number, column)) / len(column) for column in columns if column]
    numbers = [share for share in shares if share >= _NUMBERS]
    if len(numbers) < least:
        return 0.0, 0.0
    return round(len(whole) / len(rows), 2), len(numbers) / max(len(shares), 1)


def refuse_two_commas(rows: Sequence[Sequence[str]], path: Path, both: bool = False) -> None:
    """Refuse rows of cells between commas where as many digits follow as commas before decimals.

    ``both``: commas are known to stand between values and before decimals.
    """
    columns = zip(*rows, strict=False)
    parts = [set(map(len, column)) for column in columns if all(map(str.isdigit, column))]
    sizes = [size for part in parts if len(part) == 1 for size in part if size > 1]
    zeros = any(re.fullmatch(r"0\d+", cell) for row in rows for cell in row)
    if both or (zeros and max(map(sizes.count, sizes), default=0) >= 3):
        raise InputError(
            "commas seem to stand both between the values and before decimals",
            file=path,
            cure="export the file with semicolons or blanks between the values",
        )


def _refuse_doubt(form: TextForm, lines: Sequence[str], path: Path) -> None:
    """Ask where commas may mean two things."""
    cells = [cell for line in lines for cell in form.cells(line)]
    if form.mark == "," != form.decimal and "." not in "".join(lines):
        both = all(re.search(r",\S", line) and re.search(r",\s+\S", line) for line in lines)
        refuse_two_commas([form.cells(line) for line in lines], path, both)
    if not form.mark and any(map(_IN_QUOTES.search, lines)):
        raise InputError(
            "quotes stand about decimals with a comma, and commas between them",
            file=path,
            cure="export the file with semicolons or blanks between the values",
        )
    unclear = lone_commas(cells, form.mark) if form.decimal == "," and not form.thousands else None
    if unclear is not None:
        raise InputError(
            f"the comma of {unclear!r} may stand before decimals or thousands",
            file=path,
            cure="say --decimal comma or --decimal point",
        )
