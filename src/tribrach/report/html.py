"""The report as one HTML file that needs nothing but a browser."""

from __future__ import annotations

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from tribrach.report.content import Content
from tribrach.report.histogram import histogram
from tribrach.report.plan import plan
from tribrach.report.sections import Chapters

__all__ = ["ROW_LIMIT", "render"]

#: rows per table; the JSON result always has all of them
ROW_LIMIT = 2000


@cache
def _environment() -> Environment:
    """Templates of the package; everything put into them is escaped."""
    return Environment(
        loader=PackageLoader("tribrach.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render(content: Content, *, row_limit: int = ROW_LIMIT) -> str:
    """The whole report; tables end after ``row_limit`` rows and say so."""
    tables = Chapters(content, most=row_limit).all()
    template = _environment().get_template("report.html.j2")
    return template.render(
        content=content,
        summary=content.summary,
        plan=plan(content),
        histogram=histogram(content),
        tables=tables,
        percent=f"{100 * content.settings.confidence:g} %",
        posterior=content.settings.posterior and content.summary.dof > 0,
    )
