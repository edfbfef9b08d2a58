"""Decimal comma and groups of thousands, as a project wants them: how the numbers of a finished
text are written. What is worked with inside has a decimal point.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tribrach.report.content import Report

__all__ = ["PLAIN", "Notation", "notation_of"]

#: a number that fills a cell
_CELL = re.compile(r"([-+]?)(\d+)(?:\.(\d+))?( %)?")
#: numbers in sentences: with groups of thousands, or with a fraction; versions, dates, lines of
#: files and names with letters are none
_SENTENCE = re.compile(
    r"(?<![\w./:-])(?:\d{1,3}(?:,\d{3})+(?:\.\d+)?(?![\w,])|\d+\.\d+(?!\.?\w))", re.ASCII
)
#: digits from which on a number is grouped
_GROUPED = 5


@dataclass(frozen=True)
class Notation:
    """How numbers are written.

    Parameters
    ----------
    decimal : {".", ","}
        Between the whole number and its fraction.
    thousands : str
        Between groups of three digits, nothing if empty.
    names : frozenset of str
        Names of points and stations, which stay as they are although they look like numbers.
    """

    decimal: str = "."
    thousands: str = ""
    names: frozenset[str] = field(default=frozenset(), repr=False)

    @property
    def plain(self) -> bool:
        """True if texts stay as they are."""
        return self.decimal == "." and not self.thousands

    def cell(self, text: str) -> str:
        """The number of a cell; what is none stays."""
        found = None if self.plain else _CELL.fullmatch(text)
        if found is None:
            return text
        sign, whole, fraction, percent = found.groups()
        return f"{sign}{self._number(whole, fraction)}{percent or ''}"

    def words(self, text: str) -> str:
        """A sentence with its numbers as they are to be written."""
        return text if self.plain else _SENTENCE.sub(self._found, text)

    def _found(self, found: re.Match[str]) -> str:
        text = found.group()
        if text in self.names:
            return text
        whole, _, fraction = text.partition(".")
        return self._number(whole.replace(",", ""), fraction or None)

    def _number(self, whole: str, fraction: str | None) -> str:
        """A number of its digits."""
        if self.thousands and len(whole) >= _GROUPED:
            whole = f"{int(whole):,}".replace(",", self.thousands)
        return whole if fraction is None else f"{whole}{self.decimal}{fraction}"


#: numbers as they are made
PLAIN = Notation()


def notation_of(content: Report) -> Notation:
    """The notation that the project of a report asks for."""
    project = content.job.project
    if project is None:
        return PLAIN
    output = project.output
    if output.decimal == "." and not output.thousands:
        return PLAIN
    return Notation(output.decimal, output.thousands, frozenset(_names(content)))


def _names(content: Report) -> Iterable[str]:
    """Names that may look like numbers."""
    yield from (point.name for point in content.points)
    yield from (station.name for station in content.stations)
