"""The report as one HTML file that needs nothing but a browser."""

from __future__ import annotations

from tribrach.report.content import Report
from tribrach.report.environment import render_page
from tribrach.report.histogram import histogram
from tribrach.report.map import network_map
from tribrach.report.tables import ROW_LIMIT

__all__ = ["render"]


def render(content: Report, *, row_limit: int = ROW_LIMIT) -> str:
    """The whole report; tables have ``row_limit`` rows at most, the worst, and say so."""
    return render_page(
        "report.html.j2",
        content=content,
        summary=content.summary,
        map=network_map(content),
        histogram=histogram(content),
        chapters=[c for c in content.chapters if c.sentences or c.pictures],
        tables=content.tables(row_limit),
        percent=content.percent,
        posterior=content.scaled,
    )
