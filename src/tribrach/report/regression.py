"""A regression on range and incidence as text and as a page with plots."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.comparison.regression import ALIKE
from tribrach.report.charts import Chart, beside, legend
from tribrach.report.figures import Picture
from tribrach.report.numbers import chance, counted, fixed_cell
from tribrach.report.page import FrontPage, page
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)

if TYPE_CHECKING:
    from tribrach.comparison.regression import Regression, RegressionFit, Term

__all__ = ["regression_page", "regression_pictures", "regression_tables", "regression_text"]

Values = Mapping[str, Array]

_NOTE = (
    "R² is the share of the variation that the fit explains; the adjusted one is charged for every "
    "coefficient. Scatter is the standard deviation of the residuals. The fit marked as taken is "
    "the quadratic only where its last term is significant."
)


def regression_text(regression: Regression, units: Mapping[str, str]) -> str:
    """What a terminal shows: units, one line per relation, then the findings."""
    lines = [f"{regression.n} rows; {_units(regression, units)}"]
    for r in regression.relations:
        lines.append(
            f"{r.y} against {r.x}: quadratic R² {r.quadratic.r2:.4f}, line R² {r.line.r2:.4f}, "
            f"t of the curvature {r.curvature:.2f}, taken: {_formula(r.chosen)}"
        )
    for fit in regression.physical:
        lines.append(f"physical: {_formula(fit)}, R² {fit.r2:.4f}")
    return "\n".join([*lines, *(f"! {sentence}" for sentence in regression.sentences())])


def regression_page(
    title: str, values: Values, units: Mapping[str, str], regression: Regression
) -> str:
    """The whole regression as one HTML file."""
    return page(
        "Regression on range and incidence",
        title,
        _front(regression),
        regression.sentences(),
        regression_pictures(values, units, regression),
        regression_tables(regression, units),
        "Ordinary least squares; all rows have the same weight.",
    )


def _front(regression: Regression) -> FrontPage:
    """How many relations are curved, and whether the causes can be told apart."""
    bent = sum(r.curved for r in regression.relations)
    alike = any(abs(c.value) > ALIKE for c in regression.correlations)
    verdict = f"{bent or 'None'} of {counted(len(regression.relations), 'relation')} curved"
    if alike:
        verdict += "; the causes cannot be told apart"
    rests = f"{regression.n} rows, tests at {100 * regression.confidence:g} %."
    signed = "The relations stated here, for these rows, with the confidence of their tests."
    return FrontPage("none", verdict, rests, signed=signed)


def regression_pictures(
    values: Values, units: Mapping[str, str], regression: Regression
) -> list[Picture]:
    """Fits of every pair, and the physical model where there is one."""
    return [_curves(values, units, regression), *_physical(values, units, regression)]


def regression_tables(regression: Regression, units: Mapping[str, str]) -> list[ReportTable]:
    """Fits, coefficients, causes that go together."""
    return [
        _fits(regression),
        _terms(regression, _units(regression, units)),
        _correlations(regression),
    ]


def _units(regression: Regression, units: Mapping[str, str]) -> str:
    """What coefficients are in, in words."""
    names = dict.fromkeys(n for r in regression.relations for n in (r.x, r.y))
    known = [f"{name} in {_sign(units[name])}" for name in names if units.get(name)]
    bare = [name for name in names if not units.get(name)]
    if bare:
        known.append(f"{', '.join(bare)} as in the table")
    return ", ".join(known)


def _formula(fit: RegressionFit) -> str:
    """The fitted equation."""
    first, *others = fit.terms
    parts = [f"{term.value:+.5g} {term.name}".replace("+", "+ ").replace("-", "- ", 1)
             for term in others]  # fmt: skip
    return f"{fit.y} = {first.value:.5g} {' '.join(parts)}"


def _curves(values: Values, units: Mapping[str, str], regression: Regression) -> Picture:
    """Points, line and quadratic of every pair."""
    ys = list(dict.fromkeys(r.y for r in regression.relations))
    xs = list(dict.fromkeys(r.x for r in regression.relations))
    rows = [[_panel(values, units, regression, y, x) for x in xs] for y in ys]
    entries = [("s0", "straight line"), ("s1", "quadratic")]
    title = "Quadratic and straight fits"
    width = 430.0 * len(xs)
    drawing = beside(rows, title, legend(entries, width))
    caption = "The fit that is taken is solid, the other dashed; a fit that is pointed at says R²."
    return Picture("curves", title, drawing, caption, wide=len(xs) > 1)


def _panel(
    values: Values, units: Mapping[str, str], regression: Regression, y: str, x: str
) -> Chart:
    """Points of a pair with their line and quadratic; empty where it was not fitted."""
    a, b = values[x], values[y]
    labels = _titled(x, units), _titled(y, units)
    chart = Chart(_ends(a), _ends(b), labels, (430.0, 290.0))
    found = [r for r in regression.relations if (r.y, r.x) == (y, x)]
    for relation in found:
        grid = np.linspace(a.min(), a.max(), 61)
        for fit, colour in ((relation.line, "s0"), (relation.quadratic, "s1")):
            curve = np.polynomial.polynomial.polyval(grid, fit.values)
            words = f"{fit.model}, R² {fit.r2:.3f}"
            chart.line(grid, curve.tolist(), colour, dashed=fit is not relation.chosen, words=words)
        chart.points(a, b, [f"{x} {u:.4g}, {y} {v:.4g}" for u, v in zip(a, b, strict=True)])
    return chart


def _ends(values: Array) -> tuple[float, float]:
    """Ends of an axis with a little space beside the values."""
    low, high = float(values.min()), float(values.max())
    return low - 0.05 * (high - low), high + 0.05 * (high - low)


def _physical(values: Values, units: Mapping[str, str], regression: Regression) -> list[Picture]:
    """Fitted against given values of the physical model."""
    if not regression.physical:
        return []
    panels = []
    for fit in regression.physical:
        given = values[fit.y]
        ends = float(min(given.min(), fit.fitted.min())), float(max(given.max(), fit.fitted.max()))
        axis = _ends(np.array(ends))
        named = _titled(fit.y, units)
        labels = named, f"model of {named}"
        chart = Chart(axis, axis, labels, (430.0, 330.0), f"R² {fit.r2:.3f}")
        chart.line(ends, ends)
        words = [f"given {u:.4g}, model {v:.4g}" for u, v in zip(given, fit.fitted, strict=True)]
        chart.points(given, fit.fitted, words)
        panels.append(chart)
    caption = "What a + b D + c / cos I makes of each row against what the row says."
    drawing = beside([panels], "Physical model")
    return [Picture("physical", "Physical model", drawing, caption, wide=len(panels) > 1)]


def _titled(name: str, units: Mapping[str, str]) -> str:
    unit = _sign(units.get(name, ""))
    return f"{name} [{unit}]" if unit else name


def _sign(unit: str) -> str:
    """A unit as pages write it."""
    return "°" if unit == "deg" else unit


def _fits(regression: Regression) -> ReportTable:
    """All fits, the physical ones last."""
    rows = [(fit, fit is r.chosen) for r in regression.relations for fit in (r.quadratic, r.line)]
    rows += [(fit, False) for fit in regression.physical]
    columns = [
        (ColumnHead("Quantity", numeric=False), lambda row: text_cell(row[0].y)),
        (ColumnHead("Against", numeric=False), lambda row: text_cell(", ".join(row[0].x))),
        (ColumnHead("Model", numeric=False), lambda row: text_cell(row[0].model)),
        (ColumnHead("R²"), lambda row: fixed_cell(row[0].r2, 4)),
        (ColumnHead("adjusted R²"), lambda row: fixed_cell(row[0].adjusted_r2, 4)),
        (ColumnHead("scatter"), lambda row: fixed_cell(row[0].scatter, 3)),
        (ColumnHead("redundancy"), lambda row: fixed_cell(row[0].dof, 0)),
        (ColumnHead("Taken", numeric=False), lambda row: text_cell("taken" if row[1] else "")),
    ]
    return build_table("fits", "Fits", _NOTE, rows, columns)


def _digits(term: Term) -> int:
    """Digits after the point of a coefficient: three of its sigma count."""
    if not 0 < term.sigma < np.inf:
        return 4
    return max(0, 2 - math.floor(math.log10(term.sigma)))


def _terms(regression: Regression, units: str) -> ReportTable:
    """Every coefficient."""
    fits: list[RegressionFit] = [f for r in regression.relations for f in (r.quadratic, r.line)]
    rows = [(fit, term) for fit in (*fits, *regression.physical) for term in fit.terms]
    level = 1 - regression.confidence

    def t_cell(row: tuple[RegressionFit, Term]) -> Cell:
        return fixed_cell(row[1].t, 2, "good" if row[1].p < level else "")

    columns = [
        (ColumnHead("Quantity", numeric=False), lambda row: text_cell(row[0].y)),
        (ColumnHead("Model", numeric=False), lambda row: text_cell(row[0].model)),
        (ColumnHead("Term", numeric=False), lambda row: text_cell(row[1].name)),
        (ColumnHead("coefficient"), lambda row: fixed_cell(row[1].value, _digits(row[1]))),
        (ColumnHead("σ"), lambda row: fixed_cell(row[1].sigma, _digits(row[1]))),
        (ColumnHead("t"), t_cell),
        (ColumnHead("p"), lambda row: number_cell(row[1].p, chance(row[1].p))),
    ]
    note = (
        f"Units: {units}. Coefficients significant at {100 * regression.confidence:g} % are green."
    )
    return build_table("terms", "Coefficients", note, rows, columns)


def _correlations(regression: Regression) -> ReportTable:
    columns = [
        (ColumnHead("Cause", numeric=False), lambda c: text_cell(c.a)),
        (ColumnHead("and", numeric=False), lambda c: text_cell(c.b)),
        (ColumnHead("correlation"), lambda c: fixed_cell(c.value, 3)),
        (ColumnHead("variance inflation"), lambda c: fixed_cell(c.inflation, 1)),
    ]
    note = "Causes that go together cannot be told apart by any fit to these rows."
    return build_table("causes", "Causes that go together", note, regression.correlations, columns)
