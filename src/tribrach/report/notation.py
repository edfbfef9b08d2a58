"""How the numbers of a finished text are written, as a project wants them: decimal comma, groups of
thousands, and angles in one unit.

Sentences are made where something is found, with a decimal point and angles as ``56°``,
``56 degrees``, ``2.9 arcsec`` or ``145 gon``. Every sentence of a report goes through here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tribrach import sentences

if TYPE_CHECKING:
    from tribrach.report.content import Report

__all__ = ["PLAIN", "ReportNotation", "notation_of"]

#: numbers in sentences: with groups of thousands, or with a fraction; versions, dates, lines of
#: files and names with letters are none
_SENTENCE = re.compile(
    r"(?<![\w./:-])(?:\d{1,3}(?:,\d{3})+(?:\.\d+)?(?![\w,])|\d+\.\d+(?!\.?\w))", re.ASCII
)
#: angles in sentences, one or from one to another; degrees of freedom and of warmth are none
_ANGLE = re.compile(
    r"(?<![\w./:])(?:(\d+(?:\.\d+)?)(?:°| degrees)? to )?(\d+(?:\.\d+)?)"
    r"(°(?!\w| ?\d| C\b)| degrees?\b(?! of freedom| C\b)| arcsec\b| arc seconds?\b| m?gon\b)",
    re.ASCII,
)
#: a share without the space that it has elsewhere
_PERCENT = re.compile(r"(?<=\d)%(?!\w)")
#: the other circle: factor and unit
_TURNED: dict[str, dict[str, tuple[float, str]]] = {
    "gon": {
        "°": (1 / 0.9, " gon"),
        "degree": (1 / 0.9, " gon"),
        "arcsec": (1 / 3.24, " mgon"),
        "arc second": (1 / 3.24, " mgon"),
    },
    "deg": {"gon": (0.9, "°"), "mgon": (3.24, " arcsec")},
}
#: digits from which on a number is grouped
_GROUPED = 5


@dataclass(frozen=True)
class ReportNotation(sentences.Notation):
    """How numbers are written, also those of text that is no :class:`Sentence` yet.

    Parameters
    ----------
    decimal : {".", ","}
        Between the whole number and its fraction.
    thousands : str
        Between groups of three digits, nothing if empty.
    angle : {"gon", "deg"}, optional
        Unit of the angles in sentences; without it they stay as they were said.
    """

    #: names of points and stations, which stay as they are although they look like numbers
    names: frozenset[str] = field(default=frozenset(), repr=False)

    @property
    def plain(self) -> bool:
        """True if numbers stay as they are, but for angles."""
        return self.decimal == "." and not self.thousands

    def words(self, text: str) -> str:
        """A sentence with its numbers as they are to be written; a space before every %."""
        if isinstance(text, sentences.Sentence):
            return text.written(self)
        text = _PERCENT.sub(" %", text)
        if self.angle is not None:
            text = _ANGLE.sub(self._turned, text)
        return text if self.plain else _SENTENCE.sub(self._found, text)

    def _turned(self, found: re.Match[str]) -> str:
        """An angle in the other unit, as sharp as it was said."""
        first, last, unit = found.groups()
        units = _TURNED[self.angle or "gon"]
        if (to := units.get(unit.strip().removesuffix("s"))) is None:
            return found.group()
        factor, name = to
        value = float(last) * factor
        sharp = max(2, len(last.replace(".", "").lstrip("0")))
        digits = max(0, sharp - 1 - math.floor(math.log10(value * (1 + 1e-9)))) if value else 0
        begin = "" if first is None else f"{float(first) * factor:.{digits}f} to "
        return f"{begin}{value:.{digits}f}{name}"

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
PLAIN = ReportNotation()


def notation_of(content: Report) -> ReportNotation:
    """The notation that the project of a report asks for."""
    project, angle = content.job.project, content.settings.angle
    if project is None:
        return ReportNotation(angle=angle)
    output = project.output
    if output.decimal == "." and not output.thousands:
        return ReportNotation(angle=angle)
    return ReportNotation(output.decimal, output.thousands, angle, frozenset(_names(content)))


def _names(content: Report) -> Iterable[str]:
    """Names that may look like numbers."""
    yield from (point.name for point in content.points)
    yield from (station.name for station in content.stations)
