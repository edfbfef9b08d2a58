"""The command regress: differences of clouds against range and incidence."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.answers import Form
from tribrach.comparison.regression import ALIKE, Regression, RegressionFit
from tribrach.comparison.regression import regress as fit
from tribrach.errors import InputError
from tribrach.io.comparison_table import read_comparison
from tribrach.io.number_table import NumberTable, read_numbers
from tribrach.report.answer import Answer
from tribrach.report.findings import words
from tribrach.report.numbers import counted
from tribrach.report.page import FrontPage
from tribrach.report.regression import (
    RegressionFigures,
    regression_findings,
    regression_pictures,
    regression_tables,
    units_of,
)
from tribrach.sentences import Sentence, joined
from tribrach.shell.command import command

FORM = Form("regress", RegressionFigures, 1)


def answer_of(title: str, table: NumberTable, found: Regression) -> Answer:
    """The regression of the columns of a table as people read it."""
    said = regression_findings(found)
    bent = sum(one.curved for one in found.relations)
    verdict = f"{bent or 'None'} of {counted(len(found.relations), 'relation')} curved"
    if any(abs(one.value) > ALIKE for one in found.correlations):
        verdict += "; the causes cannot be told apart"
    lines = [f"{found.rows} rows; {units_of(found, table.units)}"]
    lines += [
        Sentence(
            "{one.y} against {one.x}: quadratic R² {one.quadratic.r2:4}, line R² "
            "{one.line.r2:4}, t of the curvature {one.t_curvature:2}, taken: {formula}",
            one=one,
            formula=_formula(one.taken),
        )
        for one in found.relations
    ]
    lines += [
        Sentence("physical: {formula}, R² {fit.r2:4}", formula=_formula(fit), fit=fit)
        for fit in found.physical
    ]
    lines += ["! " + text for text in (*words(said), *table.remarks)]
    return Answer(
        "Regression on range and incidence",
        title,
        FrontPage(
            "none",
            verdict,
            Sentence("{found.rows} rows, tests at {found.confidence:%g}.", found=found),
            signed="The relations stated here, for these rows, with the confidence of their tests.",
        ),
        RegressionFigures(**vars(found)),
        FORM,
        findings=said,
        pictures=regression_pictures(table.values, table.units, found),
        tables=regression_tables(found, table.units),
        footer="Ordinary least squares; all rows have the same weight.",
        terminal=[joined("\n", lines)],
    )


def _formula(fit: RegressionFit) -> str:
    """The fitted equation."""
    first, *others = fit.terms
    parts = [
        Sentence(
            "{sign} {size:g5} {name}",
            sign="-" if one.value < 0 else "+",
            size=abs(one.value),
            name=one.name,
        )
        for one in others
    ]
    return Sentence(
        "{fit.y} = {first.value:g5} {parts}", fit=fit, first=first, parts=joined(" ", parts)
    )


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
