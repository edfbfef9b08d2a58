"""The command regress: differences of clouds against range and incidence."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.comparison.regression import regress as fit
from tribrach.errors import InputError
from tribrach.io.comparison_table import read_comparison
from tribrach.io.number_table import read_numbers
from tribrach.io.outputs import write_texts
from tribrach.report.regression import regression_page, regression_text
from tribrach.report.schema.base import document_text
from tribrach.report.schema.comparison import regression_document
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, say

__all__ = ["regress"]


def regress(
    table: Annotated[Path, typer.Argument(help="Test sites: CSV, or the JSON of a comparison.")],
    x: Annotated[
        str, typer.Option("--x", help="Columns of the causes, with commas between.")
    ] = "range,incidence",
    y: Annotated[str, typer.Option("--y", help="Columns of what depends on them.")] = "mean,std",
    confidence: Annotated[float, typer.Option(min=0.5, max=0.9999, help="Of the tests.")] = 0.95,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    html_file: Annotated[
        Path | None, typer.Option("--html", help="Write a page with plots.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Fit differences of clouds against range and incidence, and say what that tells."""

    def work() -> None:
        claim([table], (json_file, html_file), overwrite=overwrite)
        causes, effects = _names(x, "--x"), _names(y, "--y")
        read = read_comparison if table.suffix.lower() == ".json" else read_numbers
        rows = read(table, [*causes, *effects])
        regression = fit(rows.values, causes, effects, rows.units, confidence)
        texts = {}
        if json_file is not None:
            texts[json_file] = document_text(regression_document(regression))
        if html_file is not None:
            texts[html_file] = regression_page(table.name, rows.values, rows.units, regression)
        write_texts(texts)
        if not quiet:
            text = regression_text(regression, rows.units)
            say("\n".join([text, *(f"! {r}" for r in rows.remarks)]))

    guarded(work)


def _names(words: str, option: str) -> list[str]:
    """Names between commas, each once."""
    names = list(dict.fromkeys(name.strip() for name in words.split(",") if name.strip()))
    if not names:
        raise InputError(f"{option} names no column", cure="name one or more, with commas between")
    return names
