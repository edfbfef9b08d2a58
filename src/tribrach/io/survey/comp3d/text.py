"""Lines of Comp3D's text files: comments, included files, fields.

Everything from ``*`` on is a comment. ``@name`` alone on a line includes another file of the same
kind, relative to the file that names it, backslashes allowed. Files are UTF-8 or Windows-1252.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.named_files import named_file
from tribrach.io.opened_files import lines_of, text_of_bytes
from tribrach.io.xml_file import read_bytes
from tribrach.units import too_large

#: how deep files may include each other
MAX_DEPTH = 5


@dataclass
class Problems:
    """How lines that cannot be used are handled: as errors, or left out with a warning."""

    root: Path  #: the folder that all files must lie in
    tolerant: bool = False  #: leave them out
    warnings: list[str] = field(default_factory=list)  #: sentences about those that were left out
    #: gathers those that are refused
    refused: RefusalCollector = field(default_factory=RefusalCollector)

    def refuse(self, error: InputError) -> None:
        """Note the error, or keep its sentence as a warning if tolerant."""
        if not self.tolerant:
            self.refused.add(error)
            return
        self.warnings.append(f"{str(error).rstrip('.')}; the line is left out.")


@dataclass(frozen=True)
class TextLine:
    """One line with data."""

    file: str  #: path as named by the project
    number: int  #: of the line, from 1
    fields: tuple[str, ...]  #: words of the line, without the comment
    folder: Path  #: where files named on the line are looked for
    root: Path  #: the folder that they must lie in

    @property
    def source(self) -> str:
        """``file:line``."""
        return f"{self.file}:{self.number}"

    def error(self, what: str, cure: str | None = None) -> InputError:
        """The error of this line."""
        return InputError(what, file=self.file, line=self.number, cure=cure)

    def integer(self, index: int, what: str) -> int:
        """A field as an integer."""
        try:
            return int(self.fields[index])
        except ValueError:
            raise self.error(f"{what} is {self.fields[index]!r}, not an integer") from None

    def numbers(self, first: int, what: str) -> list[float]:
        """All fields from the first on as numbers."""
        out = []
        for text in self.fields[first:]:
            try:
                value = float(text)
            except ValueError:
                raise self.error(f"{text!r} in {what} is not a number") from None
            if not isfinite(value):
                raise self.error(f"{text!r} in {what} is not a finite number")
            if too_large(value):
                raise self.error(f"{text} in {what} is beyond any measurement")
            out.append(value)
        return out

    def subfile(self, index: int) -> tuple[Path, str]:
        """Path and shown name of the file that a field names with ``@``."""
        name = self.fields[index] if len(self.fields) > index else ""
        if len(name) < 2 or not name.startswith("@"):
            raise self.error("the file of the observations is missing", "name it as @file")
        return _resolve(self, name)


def read_lines(path: Path, shown: str, problems: Problems, depth: int = 1) -> Iterator[TextLine]:
    """Lines with data of a file and of all files it includes, in order."""
    for number, text in enumerate(lines_of(_text(path, shown)), start=1):
        fields = tuple(text.split("*", 1)[0].split())
        if len("".join(fields)) < 2:
            continue
        line = TextLine(shown, number, fields, path.parent, problems.root)
        if not fields[0].startswith("@"):
            yield line
            continue
        try:
            if depth >= MAX_DEPTH:
                raise line.error(f"{fields[0][1:]} is the {MAX_DEPTH}th file inside a file")
            other, name = _resolve(line, fields[0])
        except InputError as error:
            problems.refuse(error)
            continue
        yield from read_lines(other, name, problems, depth + 1)


#: the largest code of an observation or of a point
_LARGEST_CODE = 30


def comp3d_lines(path: Path) -> bool:
    """True if a file has a line as Comp3D writes it, with a code and a name, or no line at all."""
    lines = [text.split("*", 1)[0].split() for text in lines_of(_text(path, path.name))]
    data = [fields for fields in lines if fields]
    return not data or any(
        fields[0].startswith("@")
        or (
            len(fields) > 1
            and re.fullmatch(r"-?\d{1,2}", fields[0]) is not None
            and abs(int(fields[0])) <= _LARGEST_CODE
        )
        for fields in data
    )


def _resolve(line: TextLine, name: str) -> tuple[Path, str]:
    """Path and shown name of a file that a line names."""
    shown = (Path(line.file).parent / name[1:].replace("\\", "/")).as_posix()
    try:
        return named_file(name[1:], line.folder, line.root), shown
    except InputError as error:
        raise line.error(error.what, error.cure) from error


def _text(path: Path, shown: str) -> str:
    """The text of a file."""
    try:
        data = read_bytes(path)
    except InputError as error:
        raise InputError(error.what, file=shown, cure=error.cure) from error
    if b"\0" in data:
        raise InputError("not a text file ", file=shown)
    return text_of_bytes(data)
