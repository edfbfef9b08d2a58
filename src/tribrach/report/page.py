"""A page of its own beside the report: findings in words, pictures, tables; one HTML file."""

from __future__ import annotations

from collections.abc import Sequence

from tribrach.report.environment import render_page
from tribrach.report.figures import Picture
from tribrach.report.tables import ReportTable

__all__ = ["page"]


def page(
    kind: str,
    title: str,
    sentences: Sequence[str],
    pictures: Sequence[Picture],
    tables: Sequence[ReportTable],
    footer: str = "",
    first: Sequence[ReportTable] = (),
) -> str:
    """HTML text that needs nothing but a browser; everything put into it is escaped.

    Tables of ``first`` stand before the pictures.
    """
    return render_page(
        "page.html.j2",
        kind=kind,
        title=title,
        sentences=sentences,
        pictures=pictures,
        first=[table for table in first if table.rows],
        tables=[table for table in tables if table.rows],
        footer=footer,
    )
