"""What pages take from elsewhere when the site is built; a hook of mkdocs.

A line ``{insert: NAME WORDS}`` of a page stands for a table of the program itself (kinds, columns,
keys, options, claims, classes), the contents of the method, a diff, or a CSV file that a program of
``benchmarks`` wrote.
"""

from __future__ import annotations

import ast
import csv
import re
import runpy
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import typer

from tribrach.cli import app
from tribrach.io.survey.csv.columns import LAYOUTS
from tribrach.observations.declaration import End
from tribrach.observations.registry import kind_named

DOCS = Path(__file__).resolve().parent
MARK = re.compile(r"^\{insert: (\w+) ?(.*)\}$", re.MULTILINE)


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


def classes(places: str) -> str:
    """Classes with their files and the first lines of their docstrings."""
    rows = []
    for place in places.split():
        file, name = place.split(":")
        tree = ast.parse((DOCS.parent / "src" / "tribrach" / file).read_text(encoding="utf-8"))
        (found,) = (n for n in tree.body if isinstance(n, ast.ClassDef) and n.name == name)
        words = (ast.get_docstring(found) or "").split("\n\n")[0]
        rows.append((f"`{name}`", f"`{file}`", " ".join(words.split()).replace("``", "`")))
    return markdown(("class", "place", "what it is"), rows)


def contents(pages: str) -> str:
    """Headings of pages with links."""
    lines = []
    for page in pages.split():
        text = (DOCS / "method" / f"{page}.md").read_text(encoding="utf-8")
        for marks, words in re.findall(r"^(##?) (\d.*)$", text, re.MULTILINE):
            anchor = re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", words.lower()))
            if marks == "##":
                lines.append(f"* [{words}]({page}.md#{anchor})")
            else:
                lines.append(f"\n**[{words}]({page}.md)**\n")
    return "\n".join(lines).strip()


def diff(name: str) -> str:
    """A change that is shown."""
    return f"```diff\n{(DOCS / name).read_text(encoding='utf-8')}```"


def options(name: str) -> str:
    """Options of a command, as its help has them."""
    command = typer.main.get_command(app).commands[name].loaded  # type: ignore[attr-defined]
    rows = []
    for option in command.params:
        if option.param_type_name == "option":
            default = option.default
            given = isinstance(default, bool) or default in (None, ())
            words = ", ".join(f"`{word}`" for word in (*option.opts, *option.secondary_opts))
            kind = getattr(getattr(option, "type_descriptor", None), "annotation", None)
            choices = ", ".join(
                f"`{word}`"
                for one in (kind, *get_args(kind))
                if get_origin(one) is Literal
                for word in get_args(one)
            )
            says = f"{option.help} {choices}".strip()
            rows.append((words, "" if given else f"{getattr(default, 'value', default)}", says))
    return markdown(("option", "default", "what it does"), rows)


def script(name: str) -> Callable[[str], str]:
    """What a script of this folder makes."""
    made: Callable[[], str] = runpy.run_path(str(DOCS / f"{name}.py"))["tables"]
    return lambda _: made()


def filled(page: str) -> str:
    """The text of a page with all that it takes from elsewhere."""
    makers = {
        "classes": classes,
        "contents": contents,
        "diff": diff,
        "kinds": kinds,
        "layouts": layouts,
        "measured": measured,
        "options": options,
    }

    return MARK.sub(lambda mark: (makers.get(mark[1]) or script(mark[1]))(mark[2]), page)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Fill a page before it is rendered."""
    return filled(markdown)
