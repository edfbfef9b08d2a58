"""A regression on range and incidence: what it says, its plots and tables, for runs and pages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.comparison.regression import ALIKE, Regression, RegressionFit, Relation, Term
from tribrach.report.charts import Chart, beside, ends_of, legend
from tribrach.report.columns import column
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import chance
from tribrach.report.tables import ReportTable, build_table
from tribrach.sentences import Sentence, capital, joined

Values = Mapping[str, Array]

_NOTE = (
    "R² is the share of the variation that the fit explains; the adjusted one is charged for every "
    "coefficient. Scatter is the standard deviation of the residuals. The fit marked as taken is "
    "the quadratic only where its last term is significant."
)


@dataclass(frozen=True)
class RegressionFigures(Regression, also=("sentences",)):
    """Regressions of quantities on causes."""

    @property
    def sentences(self) -> list[str]:
        """What a reader should take from it."""
        return words(regression_findings(self))


def regression_findings(found: Regression) -> list[Finding]:
    """What a reader should take from it."""
    out: list[Finding] = []
    bent = [one for one in found.relations if one.curved]
    straight = [one for one in found.relations if not one.curved]
    if bent:
        only = "Only {names}" if straight else "{names}"
        out.append(
            Finding.of(
                "curved",
                f"{only} {'is' if len(bent) == 1 else 'are'} significantly curved.",
                names=_listed(bent) if straight else capital(_listed(bent)),
            )
        )
    if straight:
        what = "term of {names} is" if len(straight) == 1 else "terms of {names} are"
        out.append(
            Finding.of(
                "straight",
                f"The quadratic {what} not significant (limit {{limit:2}} at {{confidence:%g6}}); "
                "a straight line describes as much.",
                names=_listed(straight),
                limit=straight[0].t_limit,
                confidence=found.confidence,
            )
        )
    out += [
        Finding.of(
            "causes_alike",
            "{a} and {c.b} are correlated {c.value:2}: these rows cannot tell their effects apart. "
            "A fit against one of them carries the effect of the other, and variances of a fit "
            "against both are {c.inflation:1} times as large. Measure near surfaces at an angle "
            "and far ones straight on to part them.",
            a=capital(one.a),
            c=one,
        )
        for one in found.correlations
        if abs(one.value) > ALIKE
    ]
    for fit in found.physical:
        weak = [term.name for term in fit.terms[1:] if term.p > 1 - found.confidence]
        if weak:
            out.append(
                Finding.of(
                    "weak_term",
                    "In the physical model of {y} the term of {weak} is not significant beside "
                    "the other.",
                    y=fit.y,
                    weak=_and(weak),
                )
            )
    return [*out, *(Finding(text, key="remark") for text in found.remarks)]


def _listed(relations: Sequence[Relation]) -> str:
    """Relations with the t of their curvature."""
    return _and(Sentence("{r.y} against {r.x} (t = {r.t_curvature:2})", r=one) for one in relations)


def _and(names: Iterable[str]) -> str:
    """Names with commas and an ``and``."""
    *others, last = names
    return joined(" and ", [joined(", ", others), last]) if others else last


def regression_pictures(
    values: Values, units: Mapping[str, str], regression: Regression
) -> list[Picture]:
    """Fits of every pair, and the physical model where there is one."""
    return [_curves(values, units, regression), *_physical(values, units, regression)]


def regression_tables(regression: Regression, units: Mapping[str, str]) -> list[ReportTable]:
    """Fits, coefficients, causes that go together."""
    fits = [(fit, fit is r.taken) for r in regression.relations for fit in (r.quadratic, r.line)]
    fits += [(fit, False) for fit in regression.physical]
    of_fits = [
        column("Quantity", lambda row: row[0].y),
        column("Against", lambda row: ", ".join(row[0].x)),
        column("Model", lambda row: row[0].model),
        column("R²", lambda row: row[0].r2, "4"),
        column("adjusted R²", lambda row: row[0].adjusted_r2, "4"),
        column("scatter", lambda row: row[0].scatter, "3"),
        column("redundancy", lambda row: row[0].dof, "0"),
        column("Taken", lambda row: "taken" if row[1] else ""),
    ]
    terms = [(fit, term) for fit, _ in fits for term in fit.terms]
    level = Sentence("{regression.confidence:%g}", regression=regression)
    of_terms = [
        column("Quantity", lambda row: row[0].y),
        column("Model", lambda row: row[0].model),
        column("Term", lambda row: row[1].name),
        column("coefficient", lambda row: row[1].value, _sharp),
        column("σ", lambda row: row[1].sigma, _sharp),
        column(
            "t",
            lambda row: row[1].t,
            "2",
            mark=lambda row: "good" if row[1].p < 1 - regression.confidence else "",
        ),
        column("p", lambda row: row[1].p, lambda p, _: chance(p)),
    ]
    note = Sentence(
        "Units: {units_of}. Coefficients significant at {level} are green.",
        units_of=units_of(regression, units),
        level=level,
    )
    alike = "Causes that go together"
    of_causes = [
        column("Cause", "a"),
        column("and", "b"),
        column("correlation", "value", "3"),
        column("variance inflation", "inflation", "1"),
    ]
    told = "Causes that go together cannot be told apart by any fit to these rows."
    return [
        build_table("fits", "Fits", _NOTE, fits, of_fits),
        build_table("terms", "Coefficients", note, terms, of_terms),
        build_table("causes", alike, told, regression.correlations, of_causes),
    ]


def _sharp(value: float, row: tuple[RegressionFit, Term]) -> str:
    """A coefficient or its sigma: three digits of the sigma count."""
    sigma = row[1].sigma
    known = 0 < sigma < np.inf
    return f"{value:.{max(0, 2 - math.floor(math.log10(sigma))) if known else 4}f}"


def units_of(regression: Regression, units: Mapping[str, str]) -> str:
    """What coefficients are in, in words."""
    names = dict.fromkeys(n for r in regression.relations for n in (r.x, r.y))
    known = [f"{name} in {_sign(units[name])}" for name in names if units.get(name)]
    bare = [name for name in names if not units.get(name)]
    if bare:
        known.append(f"{', '.join(bare)} as in the table")
    return ", ".join(known)


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
    chart = Chart(ends_of(a, 0.05, 0.0), ends_of(b, 0.05, 0.0), labels, (430.0, 290.0))
    found = [r for r in regression.relations if (r.y, r.x) == (y, x)]
    for relation in found:
        grid = np.linspace(a.min(), a.max(), 61)
        for fit, colour in ((relation.line, "s0"), (relation.quadratic, "s1")):
            curve = np.polynomial.polynomial.polyval(grid, fit.values)
            words = Sentence("{fit.model}, R² {fit.r2:3}", fit=fit)
            chart.line(grid, curve.tolist(), colour, dashed=fit is not relation.taken, words=words)
        chart.points(
            a,
            b,
            [
                Sentence("{x} {u:g4}, {y} {v:g4}", x=x, u=u, y=y, v=v)
                for u, v in zip(a, b, strict=True)
            ],
        )
    return chart


def _physical(values: Values, units: Mapping[str, str], regression: Regression) -> list[Picture]:
    """Fitted against given values of the physical model."""
    if not regression.physical:
        return []
    panels = []
    for fit in regression.physical:
        given = values[fit.y]
        ends = float(min(given.min(), fit.fitted.min())), float(max(given.max(), fit.fitted.max()))
        axis = ends_of(np.array(ends), 0.05, 0.0)
        named = _titled(fit.y, units)
        labels = named, f"model of {named}"
        chart = Chart(axis, axis, labels, (430.0, 330.0), f"R² {fit.r2:.3f}")
        chart.line(ends, ends)
        words = [
            Sentence("given {u:g4}, model {v:g4}", u=u, v=v)
            for u, v in zip(given, fit.fitted, strict=True)
        ]
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
