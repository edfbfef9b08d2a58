"""The map of GNSS baselines: sessions by colour, float solutions dashed, failing loops red."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.report.figures import new_figure
from tribrach.report.page import picture
from tribrach.report.scan_content import Picture

__all__ = ["MapLine", "baseline_map"]

Array = NDArray[np.float64]
COLOURS = ("#4878a8", "#c2571a", "#5a8f4d", "#7d5ba6", "#a08020", "#3b8f8f", "#8a5a44", "#64707a")
#: names of more points than this would cover the map
MOST_NAMES = 60
MOST_SESSIONS = 8


@dataclass(frozen=True)
class MapLine:
    """A baseline on the map: numbers of its points, its session, what is special about it."""

    start: int
    end: int
    session: str
    floating: bool = False
    suspicious: bool = False


def baseline_map(plan: Array, names: Sequence[str], lines: Sequence[MapLine]) -> Picture:
    """Baselines between points with plan coordinates (n, 2) [m], E and N."""
    figure = new_figure(figsize=(7.2, 6.4), dpi=100, layout="constrained")
    panel = figure.subplots()
    sessions = list(dict.fromkeys(line.session for line in lines))
    told: set[str] = set()
    for line in lines:
        colour = COLOURS[sessions.index(line.session) % len(COLOURS)]
        label = line.session if line.session and line.session not in told else None
        if label is not None and len(told) >= MOST_SESSIONS:
            label = None
        told |= {line.session} if label else set()
        panel.plot(
            *plan[[line.start, line.end]].T,
            color="#c0392b" if line.suspicious else colour,
            linestyle="--" if line.floating else "-",
            linewidth=2.0 if line.suspicious else 1.2,
            label=label,
        )
    used = np.unique([k for line in lines for k in (line.start, line.end)])
    panel.plot(*plan[used].T, "^", color="#1d2327", markersize=5)
    if len(used) <= MOST_NAMES:
        for k in used:
            panel.annotate(
                names[k], plan[k], xytext=(5, 4), textcoords="offset points", fontsize=8,
                parse_math=False,
            )  # fmt: skip
    panel.set_aspect("equal", adjustable="datalim")
    panel.set(xlabel="E [m]", ylabel="N [m]")
    panel.margins(0.1)
    if told:
        panel.legend(fontsize=8, frameon=False, title="session")
    caption = (
        "Baselines in the plan of the work frame. Dashed: float ambiguities. Red: in a loop that "
        "fails its test."
    )
    return picture("gnss-map", "GNSS baselines", figure, caption)
