"""A page of its own beside the report: findings in words, pictures, tables; one HTML file."""

from __future__ import annotations

import base64
import datetime
from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined

from tribrach.report.figures import png
from tribrach.report.scan_content import Picture
from tribrach.report.tables import ReportTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["page", "picture"]


def page(
    kind: str,
    title: str,
    sentences: Sequence[str],
    pictures: Sequence[Picture],
    tables: Sequence[ReportTable],
    footer: str = "",
) -> str:
    """HTML text that needs nothing but a browser; everything put into it is escaped."""
    environment = Environment(
        loader=PackageLoader("tribrach.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html.j2").render(
        kind=kind,
        title=title,
        sentences=sentences,
        pictures=pictures,
        tables=[table for table in tables if table.rows],
        footer=footer,
        version=version("tribrach"),
        date=datetime.date.today().isoformat(),
    )


def picture(name: str, title: str, figure: Figure, caption: str) -> Picture:
    """A figure as PNG in base64."""
    return Picture(name, title, base64.b64encode(png(figure)).decode("ascii"), caption)
