"""The error budget as a table and as stacked bars, for the chapter on scans."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.report.charts import PALETTE, Chart, beside, legend
from tribrach.report.columns import ColumnSet
from tribrach.report.figures import Picture
from tribrach.report.tables import (
    ColumnHead,
    ReportTable,
    Spec,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.sentences import Notation, Sentence, joined

if TYPE_CHECKING:
    from tribrach.job.budget import BudgetRow

#: width of a bar in steps from one to the next
_WIDTH = 0.8
#: where words over a bar that is cut stand, as shares of the highest
_LOW, _HIGH = 1.02, 1.09
_NORMAL, _SURFACE, _ALL = "along the normal", "in the surface", "all directions"
_ANGLES = ("horizontal angle", "vertical angle")
_NOTE = (
    "Sigmas of points by cause; their squares add up to that of the 3D σ. Classes are by range and "
    "incidence angle, and by intensity in quarters of the points. Own: new with every point, "
    "smaller in a mean of points. Neighbours: common to points side by side, systematic angles "
    "among it (empty where unknown). Shared: common to all points of the station (control, "
    "targets, levelling and so on); no mean falls below it. Control that is held fixed adds "
    "nothing. Along the normal is what a comparison of surfaces sees. Sigmas in the files of "
    "clouds contain incidence only where the project asks for it."
)


def budget_table(rows: Sequence[BudgetRow], columns: ColumnSet) -> ReportTable:
    """One row per region, one column per part."""
    names = list(dict.fromkeys(part.name for row in rows for part in row.parts))
    groups: dict[str, tuple[str, ...]] = {name: (name,) for name in names if name not in _ANGLES}
    if any(name in names for name in _ANGLES):
        groups["angles"] = _ANGLES
    specs: list[Spec] = [
        columns.word("Station", "station"),
        (ColumnHead("Class", numeric=False), lambda r: text_cell(_class(r.region, columns))),
        (ColumnHead("points", "%"), lambda r: number_cell(r.share, f"{100 * r.share:.0f}")),
        *(columns.mm(name, _part(members)) for name, members in groups.items()),
        columns.mm("own σ", lambda r: _root(r.own)),
        columns.mm("neighbours σ", lambda r: _root(r.neighbours)),
        columns.mm("shared σ", lambda r: _root(r.shared)),
        columns.mm("3D σ", lambda r: _root(r.variance)),
        columns.mm("σ along the normal", lambda r: _root(r.normal)),
        columns.mm("σ in the surface", lambda r: _root(r.tangential)),
    ]
    return build_table("error-budget", "Error budget", _NOTE, rows, specs)


def _part(names: tuple[str, ...]) -> Callable[[BudgetRow], float | None]:
    return lambda row: _root(row.part(*names))


def _root(variance: float | None) -> float | None:
    return None if variance is None else float(np.sqrt(max(variance, 0.0)))


def budget_charts(rows: Sequence[BudgetRow], columns: ColumnSet) -> list[Picture]:
    """One chart for each station."""
    stations = dict.fromkeys(row.station for row in rows)
    return [
        _chart(name, [row for row in rows if row.station == name], columns) for name in stations
    ]


def _chart(station: str, rows: Sequence[BudgetRow], columns: ColumnSet) -> Picture:
    """Stacked variances of a station's regions, along the normal and in the surface."""
    rows = [row for row in rows if row.by == "region"] or rows
    rows = [row for row in rows if row.normal is not None] or rows
    names = [part.name for part in rows[0].parts]
    known = rows[0].normal is not None
    classes = [_class(row.region, columns) for row in rows]
    panels = []
    if known:
        panels.append(_stack(rows, classes, names, lambda r, k: r.parts[k].normal, _NORMAL))
        panels.append(_stack(rows, classes, names, lambda r, k: r.parts[k].tangential, _SURFACE))
    else:
        panels.append(_stack(rows, classes, names, lambda r, k: r.parts[k].variance, _ALL))
    entries = [(f"s{k % PALETTE}", name) for k, name in enumerate(names)]
    width = sum(panel.width for panel in panels)
    drawing = beside([panels], f"Error budget of {station}", legend(entries, width))
    caption = Sentence(
        "The bars add up because variances do. {largest}", largest=_largest(rows, classes, known)
    )
    return Picture(f"budget-{station}", f"Error budget of {station}", drawing, caption, wide=True)


def _class(region: str, columns: ColumnSet) -> str:
    """A class of range and incidence with angles in the unit of the report."""
    return Notation(angle=columns.style.angle).words(region)


def _stack(
    rows: Sequence[BudgetRow],
    classes: Sequence[str],
    names: Sequence[str],
    value: Callable[[BudgetRow, int], float | None],
    title: str,
) -> Chart:
    """One bar for each region, the parts one above the other.

    Beams that graze a surface are smeared along it for many times of what they are elsewhere: bars
    far above the others are cut, with their height in words, so that the others can be read.
    """
    heights = 1e6 * np.array([[value(row, k) or 0.0 for row in rows] for k in range(len(names))])
    tops = np.cumsum(heights, axis=0)
    highest = _readable(tops[-1])
    panel = Chart(
        (-0.5, len(rows) - 0.5),
        (0.0, highest * (_HIGH + 0.05)),
        ("", "variance [mm²]"),
        (450.0, 330.0),
        title,
        names=classes,
    )
    for k, name in enumerate(names):
        for j, region in enumerate(classes):
            top, own = float(tops[k, j]), float(heights[k, j])
            words = Sentence(
                "{region}: {name} {own:g3} mm², sigma {own2:g2} mm",
                region=region,
                name=name,
                own=own,
                own2=np.sqrt(max(own, 0.0)),
            )
            panel.bar(
                j - _WIDTH / 2, j + _WIDTH / 2, min(top - own, highest), min(top, highest),
                f"s{k % PALETTE}", words,
            )  # fmt: skip
    low = False
    for j, total in enumerate(tops[-1]):
        # words of neighbours would stand in each other, so that every second one is higher
        low = bool(total > highest) and not low
        if total > highest:
            panel.note(j, highest * (_LOW if low else _HIGH), Sentence("↑ {total:0}", total=total))
    return panel


def _readable(totals: Array) -> float:
    """How high the chart is: a quarter above the highest bar that is not far above the median."""
    usual = 4.0 * float(np.median(totals)) if len(totals) else 0.0
    highest = float(totals.max(initial=0.0))
    if highest <= usual or usual <= 0:
        return highest if highest > 0 else 1.0
    return 1.1 * float(totals[totals <= usual].max(initial=usual / 4))


def _largest(rows: Sequence[BudgetRow], classes: Sequence[str], known: bool) -> str:
    """Which parts matter most where most points are."""
    at, row = max(enumerate(rows), key=lambda one: one[1].points)
    values = [(part.normal if known else part.variance) or 0.0 for part in row.parts]
    total = sum(values)
    if total <= 0:
        return ""
    order = np.argsort(values)[::-1][:3]
    words = [
        Sentence("{part} {share:%}", part=row.parts[k].name, share=values[k] / total)
        for k in order
        if values[k] >= 0.005 * total
    ]
    where = "along the normal" if known else "in all directions"
    return Sentence(
        "Largest parts {where} at {classes}: {words}.",
        where=where,
        classes=classes[at],
        words=joined(", ", words),
    )
