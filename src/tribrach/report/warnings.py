"""Warnings on top of the report, the gravest first.

Whoever makes a warning says how much it weighs; the report sorts by weight, and keeps the order
in which warnings of one weight were made.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from tribrach.sentences import capital, stopped


class Severity(IntEnum):
    """How much a warning weighs; small numbers come first.

    ``INPUT``: something was not read or not used as it was meant. ``BLUNDER``: observations,
    control or scans contradict each other. ``DOUBT``: stated sigmas are assumed, or shown to be too
    small. ``WEAK``: what the design leaves uncontrolled or hardly determined. ``NOTE``: to be known
    when the results are used. Down to ``DOUBT`` no verdict is green.
    """

    INPUT = 1
    BLUNDER = 2
    DOUBT = 3
    WEAK = 4
    NOTE = 5


@dataclass(frozen=True)
class ReportWarning:
    """A sentence with its weight."""

    text: str
    severity: Severity
    key: str = ""  #: what was found, for programs and tests


def warned(severity: Severity, texts: Iterable[str], key: str = "") -> tuple[ReportWarning, ...]:
    """Warnings of one weight; each text gets a capital and a full stop where it has none."""
    return tuple(ReportWarning(_sentence(text), severity, key) for text in texts)


def in_order(warnings: Iterable[ReportWarning]) -> tuple[str, ...]:
    """Sentences by weight, each once, those of one weight in the order they were given."""
    ordered = sorted(warnings, key=lambda warning: warning.severity)
    return tuple(dict.fromkeys(warning.text for warning in ordered))


def _sentence(text: str) -> str:
    """A sentence with a full stop, and a capital unless it begins with the name of a file."""
    first = text.split(":")[0].split(" ")[0]
    text = text if "." in first.rstrip(".") else capital(text)
    return stopped(text)
