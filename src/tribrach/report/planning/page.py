"""A planned network as text and as a page with a map, for the crew that will measure it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.report.content import Report
from tribrach.report.environment import render_page
from tribrach.report.figures import Picture, new_figure, picture
from tribrach.report.map import network_map
from tribrach.report.tables import ReportTable
from tribrach.report.text import WIDTH, table_text, wrapped

__all__ = ["PlanPage", "gain_map", "plan_page", "plan_text"]


@dataclass(frozen=True)
class PlanPage:
    """What is said about a plan: findings, tables, the network for its map, further pictures."""

    title: str
    sentences: tuple[str, ...]
    warnings: tuple[str, ...]
    tables: tuple[ReportTable, ...]
    network: Report
    pictures: tuple[Picture, ...] = ()


def plan_page(page: PlanPage) -> str:
    """The plan as one HTML file that needs nothing but a browser."""
    return render_page(
        "planning.html.j2",
        page=page,
        map=network_map(page.network),
        percent=page.network.percent,
        posterior=False,
        tables=[table for table in page.tables if table.rows],
    )


def plan_text(page: PlanPage, *, brief: bool = False) -> str:
    """The plan to print.

    Parameters
    ----------
    brief
        True to leave out the single sights.
    """
    rule = "=" * WIDTH
    parts = [f"{page.title}\n{rule}"]
    parts.append("\n".join(wrapped(f"- {sentence}") for sentence in page.sentences))
    if page.warnings:
        parts.append("\n".join(wrapped(f"! {sentence}") for sentence in page.warnings))
    for table in page.tables:
        if table.rows and not (brief and table.name == "sights"):
            parts.append(table_text(table))
    return "\n\n".join(parts) + "\n"


def gain_map(
    places: Array,
    gains: Array,
    chosen: Sequence[str],
    chosen_xyz: Array,
    stations: Array,
    unit: str,
) -> Picture:
    """Where one target or station more serves how much, in plan and from the side.

    Parameters
    ----------
    places, gains
        Places (n, 3) [m] that were looked at, and what each is worth (n,) in ``unit``.
    chosen, chosen_xyz
        Names and places (k, 3) [m] of what is proposed.
    stations
        Places (s, 3) [m] of the stations.
    unit
        Of the gains.
    """
    figure = new_figure(figsize=(11, 5), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2)
    order = np.argsort(gains)
    for panel, (a, b) in ((left, (0, 1)), (right, (0, 2))):
        shown = panel.scatter(
            places[order, a], places[order, b], c=gains[order], s=14, cmap="viridis", linewidths=0
        )
        panel.plot(stations[:, a], stations[:, b], "D", color="#a3231c", markersize=6)
        panel.plot(
            chosen_xyz[:, a], chosen_xyz[:, b], "o", mfc="none", mec="#a3231c", markersize=12
        )
        for name, xyz in zip(chosen, chosen_xyz, strict=True):
            panel.annotate(name, (xyz[a], xyz[b]), xytext=(7, 7), textcoords="offset points")
        panel.set(aspect="equal", xlabel="E [m]", ylabel="N [m]" if b == 1 else "U [m]")
    figure.colorbar(shown, ax=[left, right], label=f"gain [{unit}]", shrink=0.8)
    caption = (
        "Places that were looked at, each alone; diamonds are stations, rings what is proposed."
    )
    return picture("gain", "What each place is worth", figure, caption)
