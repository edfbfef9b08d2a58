"""The command regress: differences of clouds against range and incidence."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.comparison.regression import regress as fit
from tribrach.errors import InputError
from tribrach.io.comparison_table import read_comparison
from tribrach.io.number_table import read_numbers
from tribrach.questions.regress.chapters import answer_of
from tribrach.report.answer import Answer
from tribrach.shell.command import command


@command(html="Write a page with plots.")
def regress(
    table: Annotated[Path, typer.Argument(help="Test sites: CSV, or the JSON of a comparison.")],
    x: Annotated[
        str, typer.Option("--x", help="Columns of the causes, with commas between.")
    ] = "range,incidence",
    y: Annotated[str, typer.Option("--y", help="Columns of what depends on them.")] = "mean,std",
    confidence: Annotated[float, typer.Option(min=0.5, max=0.9999, help="Of the tests.")] = 0.95,
) -> Answer:
    """Fit differences of clouds against range and incidence, and say what that tells."""
    causes, effects = _names(x, "--x"), _names(y, "--y")
    read = read_comparison if table.suffix.lower() == ".json" else read_numbers
    rows = read(table, [*causes, *effects])
    return answer_of(table.name, rows, fit(rows.values, causes, effects, rows.units, confidence))


def _names(words: str, option: str) -> list[str]:
    """Names between commas, each once."""
    names = list(dict.fromkeys(name.strip() for name in words.split(",") if name.strip()))
    if not names:
        raise InputError(f"{option} names no column", cure="name one or more, with commas between")
    return names
