"""An answer as people read it: made once, and rendered as page, text, terminal and JSON.

A question makes one :class:`Answer` of its result: what stands first, findings, pictures, tables.
Renderings know no question.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tribrach.answers import Form
from tribrach.errors import TribrachError
from tribrach.io.outputs import Content
from tribrach.report.content import Report
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding
from tribrach.report.page import FrontPage, page
from tribrach.report.tables import ReportTable
from tribrach.report.text import WIDTH, table_text, wrapped
from tribrach.sentences import PLAIN, Notation


@dataclass(frozen=True)
class Answer:
    """A question's result as page, text, terminal output and JSON."""

    #: what was asked, and of what
    kind: str
    title: str
    front: FrontPage | None  #: the verdict, and what is to be signed; None of what has no page
    #: the figures, and the form in which they are written as JSON; further keys of words
    result: Any
    form: Form | None = None
    words: Mapping[str, Any] = field(default_factory=dict)
    findings: Sequence[Finding] = ()
    #: tables before the pictures and behind them; those without rows are left out
    first: Sequence[ReportTable] = ()
    pictures: Sequence[Picture] = ()
    tables: Sequence[ReportTable] = ()
    footer: str = ""  #: what holds for the whole page
    #: a network whose map stands on the page
    network: Report | None = None
    notation: Notation = PLAIN
    #: what a terminal shows: text as it is, findings, tables
    terminal: Sequence[str | Finding | ReportTable] = ()
    #: why it may not be used as it is: raised once it was shown
    failure: TribrachError | None = None
    refuses: bool = False  #: true if then no file is written
    #: files that were written before; with these all files are named at the end
    written: Sequence[Path] | None = None
    #: further files that were asked for
    files: Mapping[Path, Content] = field(default_factory=dict)

    def page(self) -> str:
        """The whole of it as one HTML file."""
        assert self.front is not None
        return page(
            self.kind,
            self.title,
            self.front,
            self.findings,
            self.pictures,
            self.tables,
            self.footer,
            first=self.first,
            network=self.network,
            notation=self.notation,
        )

    def text(self) -> Content:
        """The whole of it as plain text."""
        return self.printed()

    def printed(self, without: Sequence[str] = ()) -> str:
        """The same, but for some tables."""
        say, rule = self.notation.words, "=" * WIDTH
        blocks = [f"{self.title}\n{rule}"]
        for sign, warns in (("-", False), ("!", True)):
            told = [f"{sign} {say(one.words)}" for one in self.findings if one.warns == warns]
            blocks += ["\n".join(map(wrapped, told))] if told else []
        tables = (table for table in (*self.first, *self.tables) if table.name not in without)
        blocks += [table_text(table, self.notation) for table in tables if table.rows]
        return "\n\n".join(blocks) + "\n"

    def json(self) -> Content:
        """The figures as JSON text."""
        assert self.form is not None
        return self.form.text(self.result, **self.words)
