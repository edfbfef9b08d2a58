"""Sentences of a report, and which of them ask for something."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["Finding", "words"]


@dataclass(frozen=True)
class Finding:
    """A sentence with its figures.

    Attributes
    ----------
    words
        The sentence.
    warns
        True if something is to be done, or doubted.
    """

    words: str
    warns: bool = False

    def line(self) -> str:
        """The sentence as a terminal shows it: "!" before what warns."""
        return f"! {self.words}" if self.warns else self.words


def words(findings: Iterable[Finding]) -> list[str]:
    """The sentences alone."""
    return [one.words for one in findings]
