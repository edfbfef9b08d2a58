"""A regression on range and incidence as people read it; its tables and plots are the report's."""

from __future__ import annotations

from tribrach.answers import Form
from tribrach.comparison.regression import ALIKE, Regression, RegressionFit
from tribrach.io.number_table import NumberTable
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
