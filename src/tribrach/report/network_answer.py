"""An adjusted network as an answer: its report as page, text and JSON, and its terminal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import TribrachError
from tribrach.io.outputs import Content
from tribrach.report.answer import Answer
from tribrach.report.content import Report
from tribrach.report.text import brief, render


@dataclass(frozen=True)
class NetworkAnswer(Answer):
    """An answer whose result is a report; each form is made, and loaded, when it is asked for."""

    result: Report

    @classmethod
    def of(
        cls,
        content: Report,
        files: Mapping[Path, Content] | None = None,
        folder: Path | None = None,
    ) -> NetworkAnswer:
        """The report, with further files to write and the folder where a run left it."""
        lines = [brief(content)]
        if folder is not None:
            lines.append(f"report: {folder / 'report.html'}")
            if any(table.name == "clouds" for table in content.tables(1)):
                lines.append(f"clouds: {folder / 'clouds'}")
        unchecked = TribrachError(
            "no redundancy: nothing is checked; observe more before these figures are used"
        )
        failure = None if content.summary.dof > 0 else unchecked
        return cls(
            "Report on an adjusted network",
            content.title,
            None,
            content,
            terminal=lines,
            failure=failure,
            files=files or {},
        )

    def page(self) -> str:
        """The whole report as one HTML file."""
        from tribrach.report.html import render as page

        return page(self.result)

    def text(self) -> str:
        """The whole report as plain text."""
        return render(self.result)

    def json(self) -> Content:
        """The figures as JSON text, piece by piece."""
        from tribrach.report.json_result import pieces

        return pieces(self.result)
