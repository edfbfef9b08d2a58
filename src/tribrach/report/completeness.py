"""Completeness of a survey as text and as a page with a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.report.charts import (
    TESTED,
    Chart,
    Drawing,
    beside,
    colour_bar,
    legend,
    shade,
)
from tribrach.report.figures import Picture
from tribrach.report.numbers import count_cell
from tribrach.report.page import FrontPage, page
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.units import percent

if TYPE_CHECKING:
    from tribrach.comparison.completeness import Completeness, Gap

__all__ = ["completeness_page", "completeness_text"]


#: cells shown in a map, drawn at random from more
_SHOWN = 60_000
#: shares of the colours from well within to well beyond, by the number of stations
_SHARES = np.array([1.0, 0.66, 0.33, 0.0])
_SIGNED = "What these clouds cover, in cells of the size and with the sigma stated here."
_LABELS = ("no station", "one station", "two stations", "three and more")


def completeness_text(completeness: Completeness) -> str:
    """What a terminal shows: the findings, the stations, the largest gaps."""
    lines = completeness.sentences()
    lines += [f"{name} sees {percent(share)}" for name, share in completeness.shares.items()]
    for title, gaps in _sorts(completeness):
        lines += [f"{title}: {_words(gap)}" for gap in gaps[:3]]
    return "\n".join(lines)


def completeness_page(title: str, completeness: Completeness) -> str:
    """The whole of it as one HTML file."""
    pictures = [_map(completeness)]
    if completeness.required is not None:
        pictures.append(_sigma_map(completeness))
    return page(
        "Completeness",
        title,
        _front(completeness),
        completeness.sentences(),
        pictures,
        _gap_tables(completeness),
        f"Cells of {completeness.size:g} m; a station sees a cell if it has points in it or in one "
        "that shares a face with it.",
        first=[_classes(completeness), _stations(completeness)],
    )


def _front(completeness: Completeness) -> FrontPage:
    """How much was seen, or is as exact as required; the sentence is one of the findings."""
    n = max(1, len(completeness.seen))
    missed = completeness.classes["no station"] / n
    single = completeness.classes["one station"] / n
    said = completeness.sentences()
    if completeness.required is None:
        verdict = (
            f"{percent(1 - missed)} of the model seen"
            if completeness.modelled
            else f"{percent(1 - single)} seen by two stations or more"
        )
        return FrontPage("none", verdict, said[0], signed=_SIGNED)
    sigmas = completeness.sigmas
    everywhere = sigmas["reached"] == sum(sigmas.values()) and not missed
    share = sigmas["reached"] / max(1, sum(sigmas.values()))
    verdict = (
        f"The required sigma is reached {'everywhere' if everywhere else f'on {percent(share)}'}"
    )
    return FrontPage("good" if everywhere else "none", verdict, said[-1], signed=_SIGNED)


def _sorts(completeness: Completeness) -> list[tuple[str, Sequence[Gap]]]:
    return [
        ("Seen by no station", completeness.unseen_gaps),
        ("Seen by one station only", completeness.single_gaps),
        ("Sigma not reached", completeness.weak_gaps),
    ]


def _words(gap: Gap) -> str:
    x, y, z = gap.middle
    size = " x ".join(f"{e:.1f}" for e in gap.extent)
    return f"{gap.cells} cells around {x:.1f}, {y:.1f}, {z:.1f} ({size} m)"


def _chosen(count: int) -> NDArray[np.int64]:
    """Cells of a map: all, or some at random, the same ones each time."""
    if count <= _SHOWN:
        return np.arange(count)
    return np.sort(np.random.default_rng(0).choice(count, _SHOWN, replace=False))


def _axes_of(completeness: Completeness, which: NDArray[np.int64]) -> tuple[Array, Array, str]:
    """Plan (n, 2) and the view from the side (n, 2) along the longer way; words for its axis."""
    xyz = completeness.centres[which]
    plan = xyz[:, :2] - xyz[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(plan[:: max(1, len(plan) // 5000)], full_matrices=False)
    along = plan @ axes[0]
    azimuth = np.degrees(np.arctan2(axes[0, 0], axes[0, 1])) % 180
    return xyz[:, :2], np.stack([along, xyz[:, 2]], axis=1), f"along {azimuth:.0f}° [m]"


def _panels(completeness: Completeness, which: NDArray[np.int64], shares: Array) -> list[Chart]:
    """Plan and view from the side of cells, coloured by shares; the largest lies on top."""
    plan, side, words = _axes_of(completeness, which)
    origin = np.round(plan.mean(axis=0), -1)
    labels = f"x - {origin[0]:.0f} [m]", f"y - {origin[1]:.0f} [m]"
    panels = []
    for (u, v), names in (((plan - origin).T, labels), (side.T, (words, "height [m]"))):
        panel = Chart(_wide(u), _wide(v), names, (600.0, 460.0), equal=True)
        panel.cloud(u, v, shares, TESTED)
        panels.append(panel)
    return panels


def _wide(values: Array) -> tuple[float, float]:
    """Ends of an axis with a little space beside the values."""
    low, high = float(values.min()), float(values.max())
    margin = 0.03 * (high - low) + 1e-6
    return low - margin, high + margin


def _map(completeness: Completeness) -> Picture:
    """Cells by the number of stations, those that lack most on top."""
    which = _chosen(len(completeness.seen))
    panels = _panels(completeness, which, _SHARES[np.minimum(completeness.seen[which], 3)])
    entries = [(shade(float(s), TESTED), text) for s, text in zip(_SHARES, _LABELS, strict=True)]
    title = "Seen by how many stations"
    caption = (
        f"{len(which):,} of {len(completeness.seen):,} cells in plan and from the side; what fewer "
        "stations see lies on top."
    )
    drawing = beside([panels], title, legend(entries, 1200.0))
    return Picture("seen", title, drawing, caption, wide=True)


def _sigma_map(completeness: Completeness) -> Picture:
    """Sigma of the best station, the worst on top."""
    which = _chosen(len(completeness.seen))
    which = which[np.isfinite(completeness.sigma[which])]
    top = 2e3 * (completeness.required or 0.0)
    title = "Required sigma"
    if not len(which):
        return Picture("sigma", title, Drawing(600.0, 0.0, (), title), "No cell has a sigma.")
    panels = _panels(completeness, which, 1e3 * completeness.sigma[which] / top)
    scale = colour_bar(0.0, top, "3D sigma [mm]", 1200.0, TESTED)
    caption = (
        f"Sigma of the best station in every cell; yellow is the {top / 2:g} mm that are required, "
        "red twice as much or more."
    )
    return Picture("sigma", title, beside([panels], title, scale), caption, wide=True)


def _classes(completeness: Completeness) -> ReportTable:
    n = max(1, len(completeness.seen))
    rows = [
        *completeness.classes.items(),
        *((f"sigma {k}", v) for k, v in completeness.sigmas.items()),
    ]
    columns = [
        (ColumnHead("Seen by", numeric=False), lambda row: text_cell(row[0])),
        (ColumnHead("cells"), lambda row: count_cell(row[1])),
        (ColumnHead("share", "%"), lambda row: number_cell(row[1] / n, f"{100 * row[1] / n:.1f}")),
    ]
    note = "Shares of all cells of the surface. The sigma is that of the best station in a cell."
    return build_table("classes", "Cells", note, rows, columns)


def _stations(completeness: Completeness) -> ReportTable:
    columns = [
        (ColumnHead("Station", numeric=False), lambda row: text_cell(row[0])),
        (ColumnHead("sees", "%"), lambda row: number_cell(row[1], f"{100 * row[1]:.1f}")),
    ]
    return build_table("stations", "Stations", "", list(completeness.shares.items()), columns)


def _gap_tables(completeness: Completeness) -> list[ReportTable]:
    """The largest gaps of every sort."""
    columns = [
        *((ColumnHead(axis, "m"), _middle(k)) for k, axis in enumerate("xyz")),
        *((ColumnHead(f"along {axis}", "m"), _extent(k)) for k, axis in enumerate("xyz")),
        (ColumnHead("cells"), lambda gap: count_cell(gap.cells)),
    ]
    names = ("unseen", "single", "weak")
    return [
        build_table(name, f"Largest places: {title.lower()}", "", gaps, columns)
        for name, (title, gaps) in zip(names, _sorts(completeness), strict=True)
    ]


def _middle(k: int) -> Callable[[Gap], Cell]:
    return lambda gap: number_cell(gap.middle[k], f"{gap.middle[k]:.2f}")


def _extent(k: int) -> Callable[[Gap], Cell]:
    return lambda gap: number_cell(gap.extent[k], f"{gap.extent[k]:.2f}")
