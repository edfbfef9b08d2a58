"""Findings: a key, a sentence that keeps its figures, and whether it asks for something."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from tribrach.sentences import Sentence


@dataclass(frozen=True)
class Finding:
    """A key, a sentence, and whether it asks for something."""

    words: str  #: the sentence
    warns: bool = False  #: true if something is to be done, or doubted
    key: str = ""  #: what it is about, for programs and tests

    @classmethod
    def of(cls, key: str, template: str, warns: bool = False, **values: Any) -> Finding:
        """A finding of a template and its figures (:class:`tribrach.sentences.Sentence`)."""
        return cls(Sentence(template, **values), warns, key)

    @property
    def values(self) -> Mapping[str, Any]:
        """The figures of its sentence, by their names in the template."""
        return self.words.values if isinstance(self.words, Sentence) else {}

    def line(self) -> str:
        """The sentence as a terminal shows it: "!" before what warns."""
        return "! " + self.words if self.warns else self.words


def words(findings: Iterable[Finding]) -> list[str]:
    """The sentences alone."""
    return [one.words for one in findings]
