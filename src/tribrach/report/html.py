"""The report as one HTML file that needs nothing but a browser."""

from __future__ import annotations

from dataclasses import dataclass

from tribrach.report.chapter import Chapter
from tribrach.report.content import Report
from tribrach.report.environment import render_page
from tribrach.report.front_page import front_page, letterhead
from tribrach.report.histogram import histogram
from tribrach.report.map import network_map
from tribrach.report.notation import notation_of
from tribrach.report.page import running
from tribrach.report.still_picture import still_picture
from tribrach.report.tables import ROW_LIMIT, ReportTable


@dataclass(frozen=True)
class _Shown:
    """A chapter with the rows of its tables that are shown."""

    chapter: Chapter
    tables: tuple[ReportTable, ...]


def render(content: Report, *, row_limit: int = ROW_LIMIT) -> str:
    """The whole report; tables have ``row_limit`` rows at most, the worst, and say so."""
    shown = [_shown(chapter, row_limit) for chapter in content.chapters]
    shown = [s for s in shown if s.tables or s.chapter.sentences or s.chapter.pictures]
    head, _ = letterhead(dict(content.facts), content.job.logo)
    return render_page(
        "report.html.j2",
        content=content,
        front=front_page(content),
        head=head,
        running=running(
            " · ".join(text for text in (head.job, content.title, head.client) if text),
            content.version,
            content.date,
        ),
        summary=content.summary,
        still=still_picture(content),
        map=network_map(content),
        histogram=histogram(content),
        signed=[s for s in shown if s.chapter.signed],
        behind=[s for s in shown if not s.chapter.signed],
        percent=content.percent,
        posterior=content.scaled,
        notation=notation_of(content),
    )


def _shown(chapter: Chapter, row_limit: int) -> _Shown:
    """The chapter with the first rows of its tables, those with rows."""
    tables = tuple(table.first(row_limit) for table in chapter.tables)
    return _Shown(chapter, tuple(table for table in tables if table.rows))
