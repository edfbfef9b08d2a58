"""The error budget as a table and as stacked bars, for the chapter on scans."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.report.columns import ColumnSet
from tribrach.report.figures import (
    Picture,
    colours,
    legend_patches,
    new_figure,
    picture,
    poly_collection,
)
from tribrach.report.tables import ColumnHead, ReportTable, Spec, build_table, number_cell

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from tribrach.job.budget import BudgetRow

__all__ = ["budget_charts", "budget_table"]

#: width of a bar in steps from one to the next, and free space beside and above all of them
_WIDTH, _MARGIN = 0.8, 0.05
_ANGLES = ("horizontal angle", "vertical angle")
_NOTE = (
    "Sigmas of points by what they come from; their squares add up to the square of "
    "the 3D σ. Classes are by range and incidence angle, and by intensity in quarters of the "
    "points. Own is what is new with every point, so that a mean of points makes it smaller; "
    "neighbours what points side by side have in common (empty where nobody says); shared what all "
    "points of the station have, below which no mean of them falls (control, targets, levelling "
    "and so on). Systematic angles are those of the neighbours. Control that is held fixed "
    "adds nothing. Along the normal is what a comparison of surfaces sees. Sigmas in the files of "
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
        columns.word("Class", "region"),
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


def budget_charts(rows: Sequence[BudgetRow]) -> list[Picture]:
    """One chart for each station."""
    stations = dict.fromkeys(row.station for row in rows)
    return [_chart(name, [row for row in rows if row.station == name]) for name in stations]


def _chart(station: str, rows: Sequence[BudgetRow]) -> Picture:
    """Stacked variances of the regions of a station, along the normal and in the surface.

    Regions without normals are in the chart only if there are no others.
    """
    rows = [row for row in rows if row.by == "region"] or rows
    rows = [row for row in rows if row.normal is not None] or rows
    names = [part.name for part in rows[0].parts]
    known = rows[0].normal is not None
    wide = max(7.0, 2.5 + 0.9 * len(rows) * (2 if known else 1))
    figure = new_figure(figsize=(min(wide, 13.0), 4.4), dpi=100, layout="constrained")
    if known:
        panels = figure.subplots(1, 2)
        _stack(panels[0], rows, names, lambda r, k: r.parts[k].normal, "along the normal")
        _stack(panels[1], rows, names, lambda r, k: r.parts[k].tangential, "in the surface")
    else:
        panels = [figure.subplots()]
        _stack(panels[0], rows, names, lambda r, k: r.parts[k].variance, "all directions")
    handles = legend_patches(names, _part_colours(len(names)))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    caption = f"Variances add up, so the bars do. {_largest(rows, known)}"
    return picture(f"budget-{station}", f"Error budget of {station}", figure, caption)


def _part_colours(count: int) -> Array:
    """Colours (count, 4) of the parts of a budget, pairs of like ones last."""
    palette = np.asarray(colours("tab20")(np.linspace(0, 1, 20)))
    return palette[[(2 * k) % 20 + k // 10 % 2 for k in range(count)]]


def _stack(
    panel: Axes,
    rows: Sequence[BudgetRow],
    names: Sequence[str],
    value: Callable[[BudgetRow, int], float | None],
    title: str,
) -> None:
    """One bar per region; all pieces of a panel are one thing to draw, which saves time."""
    heights = 1e6 * np.array([[value(row, k) or 0.0 for row in rows] for k in range(len(names))])
    tops = np.cumsum(heights, axis=0)
    left = np.broadcast_to(np.arange(len(rows)) - _WIDTH / 2, tops.shape)
    right, low = left + _WIDTH, tops - heights
    corners = [(left, low), (right, low), (right, tops), (left, tops)]
    pieces = np.stack([np.stack(corner, axis=-1) for corner in corners], axis=2)
    colour = np.repeat(_part_colours(len(names)), len(rows), axis=0)
    panel.add_collection(poly_collection(pieces.reshape(-1, 4, 2), facecolors=colour))
    margin = _MARGIN * (len(rows) - 1 + _WIDTH)
    panel.set_xlim(-_WIDTH / 2 - margin, len(rows) - 1 + _WIDTH / 2 + margin)
    highest = float(tops[-1].max(initial=0.0))
    panel.set_ylim(0.0, (1 + _MARGIN) * highest if highest > 0 else 1.0)
    panel.set_xticks(np.arange(len(rows)), [row.region for row in rows], rotation=40, ha="right")
    panel.tick_params(labelsize=8)
    panel.set(title=title, ylabel="variance [mm²]")


def _largest(rows: Sequence[BudgetRow], known: bool) -> str:
    """Which parts matter most where most points are."""
    row = max(rows, key=lambda r: r.points)
    values = [(part.normal if known else part.variance) or 0.0 for part in row.parts]
    total = sum(values)
    if total <= 0:
        return ""
    order = np.argsort(values)[::-1][:3]
    words = [f"{row.parts[k].name} {values[k] / total:.0%}" for k in order if values[k] > 0]
    where = "along the normal" if known else "in all directions"
    return f"Largest parts {where} at {row.region}: {', '.join(words)}."
