"""The templates of all pages.

What is put into them is escaped and every character of it is seen; what is missing is an error.
"""

from __future__ import annotations

import datetime
import re
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from tribrach.report.characters import visible
from tribrach.sentences import PLAIN

if TYPE_CHECKING:
    from jinja2 import Environment

#: rows of a table on paper; the rest is looked up where it can be searched
PRINTED = 30
#: an option of the command line, a standard or a date, which do not break at their hyphens
_WHOLE = re.compile(r"(--[a-z][a-z-]*|\bISO \d+-\d+|\b\d{4}-\d\d-\d\d\b)")

#: from one end of a sight to the other, on one line
_TO = "\N{NO-BREAK SPACE}\N{RIGHTWARDS ARROW} "


@cache
def _environment() -> Environment:
    """The one environment of the package; it is loaded with the first page."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("tribrach.report", "templates"),
        autoescape=True,
        finalize=_seen,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["parts"] = _parts
    return environment


def _seen(value: Any) -> Any:
    """What is put in without characters such as arrows; what is escaped already stays so."""
    if isinstance(value, str) and not hasattr(value, "__html__"):
        return visible(value).replace(" -> ", _TO)
    return value


def _parts(sentence: str) -> list[str]:
    """A sentence in parts; every second of them is to stay on one line."""
    return _WHOLE.split(sentence)


def render_page(template: str, **values: Any) -> str:
    """A page from its template, with version and date, and units beside their numbers."""
    notation = values.pop("notation", PLAIN)
    today = {
        "version": version("tribrach"),
        "date": datetime.date.today().isoformat(),
        "notation": replace(notation, space="\N{NO-BREAK SPACE}"),
        "printed": PRINTED,
    }
    return _environment().get_template(template).render(**today | values)
