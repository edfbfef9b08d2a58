"""Tables of pages, made when the site is built; a hook of mkdocs.

A line ``{table: NAME WORDS}`` of a page stands for a table: of the program itself (kinds, columns,
keys, claims), or of a CSV file beside the page that a program of ``benchmarks`` writes.
"""

from __future__ import annotations

import csv
import re
import runpy
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from tribrach.io.survey.csv.columns import LAYOUTS
from tribrach.observations.declaration import End
from tribrach.observations.registry import kind_named

DOCS = Path(__file__).resolve().parent
MARK = re.compile(r"^\{table: (\w+) ?(.*)\}$", re.MULTILINE)


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def kinds(names: str) -> str:
    """Observation kinds, as each describes itself."""
    rows = []
    for name in names.split():
        kind = kind_named(name)
        facts = kind.facts
        units = "of the unknown" if facts.of_unknown else ", ".join(dict.fromkeys(kind.units))
        ends = "; ".join(
            f"{'' if r.end is End.AT else f'{r.end.value} '}{r.name}: {r.family}"
            for r in kind.references()
            if r.end is not None
        )
        rows.append((f"`{name}`", facts.computed, units, ends, facts.role.value, facts.category))
    return markdown(("kind", "computed value", "unit", "ends", "role", "budget"), rows)


def layouts(_: str) -> str:
    """Tables of observations, with their columns."""
    return markdown(("table", "has", "may have"), [layout.documented() for layout in LAYOUTS])


def measured(name: str) -> str:
    """A table that a program has written."""
    with (DOCS / name).open(encoding="utf-8", newline="") as file:
        heads, *rows = csv.reader(file)
    return markdown(heads, rows)


def script(name: str) -> Callable[[str], str]:
    """What a script of this folder makes."""
    made: Callable[[], str] = runpy.run_path(str(DOCS / f"{name}.py"))["tables"]
    return lambda _: made()


def filled(page: str) -> str:
    """The text of a page with its tables."""
    makers = {"kinds": kinds, "layouts": layouts, "measured": measured}

    def table(mark: re.Match[str]) -> str:
        return (makers.get(mark[1]) or script(mark[1]))(mark[2])

    return MARK.sub(table, page)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Fill the tables of a page before it is rendered."""
    return filled(markdown)
