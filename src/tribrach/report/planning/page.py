"""A planned network as text and as a page with a map, for the crew that will measure it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.report.charts import Chart, beside, colour_bar
from tribrach.report.content import Report
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding
from tribrach.report.notation import notation_of
from tribrach.report.page import FrontPage, page
from tribrach.report.tables import ReportTable
from tribrach.report.text import WIDTH, table_text, wrapped

__all__ = ["PlanPage", "gain_map", "plan_page", "plan_text"]


@dataclass(frozen=True)
class PlanPage:
    """What is said about a plan: findings, tables, network for the map, verdict, pictures."""

    title: str
    sentences: tuple[str, ...]
    warnings: tuple[str, ...]
    tables: tuple[ReportTable, ...]
    network: Report
    front: FrontPage
    pictures: tuple[Picture, ...] = ()


def plan_page(plan: PlanPage) -> str:
    """The plan as one HTML file that needs nothing but a browser."""
    findings = [
        *(Finding(words, True) for words in plan.warnings),
        *(Finding(words) for words in plan.sentences),
    ]
    return page(
        "Plan of a network",
        plan.title,
        plan.front,
        findings,
        plan.pictures,
        plan.tables,
        "All standard deviations are predicted from those of the observations; nothing was "
        "measured.",
        network=plan.network,
        notation=notation_of(plan.network),
    )


def plan_text(plan: PlanPage, *, brief: bool = False) -> str:
    """The plan to print."""
    rule = "=" * WIDTH
    notation = notation_of(plan.network)
    say = notation.words
    parts = [f"{plan.title}\n{rule}"]
    parts.append("\n".join(wrapped(say(f"- {sentence}")) for sentence in plan.sentences))
    if plan.warnings:
        parts.append("\n".join(wrapped(say(f"! {sentence}")) for sentence in plan.warnings))
    for table in plan.tables:
        if table.rows and not (brief and table.name == "sights"):
            parts.append(table_text(table, notation))
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
    every = np.concatenate([places, chosen_xyz, stations])
    low, high = every.min(axis=0), every.max(axis=0)
    margin = 0.06 * float((high - low).max()) + 0.5
    bottom, top = float(gains.min()), float(gains.max())
    panels = []
    for a, b in ((0, 1), (0, 2)):
        ends = [(float(low[k]) - margin, float(high[k]) + margin) for k in (a, b)]
        labels = ("E [m]", "N [m]" if b == 1 else "U [m]")
        panel = Chart(ends[0], ends[1], labels, (600.0, 480.0), equal=True)
        panel.cloud(places[:, a], places[:, b], (gains - bottom) / max(top - bottom, 1e-12))
        for xyz in stations:
            panel.place(float(xyz[a]), float(xyz[b]), "", "station")
        for name, xyz in zip(chosen, chosen_xyz, strict=True):
            panel.place(float(xyz[a]), float(xyz[b]), name, "ring")
        panels.append(panel)
    caption = (
        "Places that were looked at, each alone, in plan and from the side; diamonds are stations, "
        "rings what is proposed."
    )
    title = "What each place is worth"
    scale = colour_bar(bottom, top, f"gain [{unit}]", 1200.0)
    return Picture("gain", title, beside([panels], title, scale), caption, wide=True)
