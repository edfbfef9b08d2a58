"""Pictures of a calibration: heat maps of correlations, residuals before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.calibration.self_calibration import SelfCalibration
from tribrach.report.figures import Picture, new_figure, picture
from tribrach.units import SEC

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["calibration_charts"]


#: most rows or columns of a heat map that get their name
_MOST_LABELS = 80
#: residuals drawn per panel; more are thinned out evenly
_MOST_DOTS = 20_000
_COMPONENTS = ("E", "N", "U", "tilt E", "tilt N", "heading")


def calibration_charts(found: SelfCalibration) -> list[Picture]:
    """All pictures."""
    c = found.correlations
    axes = [f"{station} {name}" for station in c.stations for name in _COMPONENTS]
    pictures = [
        _heat(
            "within", "Correlations of the parameters with each other", c.within, c.names, c.names
        ),
        _heat(
            "orientations",
            "Correlations of the parameters with orientations",
            c.orientation,
            c.names,
            axes,
        ),
        _heat(
            "points",
            "Correlations of the parameters with points",
            c.strongest_by_point,
            c.names,
            c.point_names,
            "Largest absolute value over the coordinates of each point.",
        ),
    ]
    return [p for p in pictures if p is not None] + [_residuals(found)]


def _heat(
    name: str,
    title: str,
    rho: Array,
    rows: tuple[str, ...],
    columns: tuple[str, ...] | list[str],
    caption: str = "Grey: held by the datum.",
) -> Picture | None:
    """A heat map; None if there is nothing in it."""
    if rho.size == 0:
        return None
    width = float(np.clip(2.5 + 0.22 * len(columns), 4.5, 16))
    height = float(np.clip(1.6 + 0.24 * len(rows), 2.4, 12))
    figure = new_figure(figsize=(width, height), dpi=100, layout="constrained")
    panel = figure.subplots()
    panel.set_facecolor("#d0d0d0")
    shown = np.ma.masked_invalid(rho)
    image = panel.imshow(shown, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    if len(rows) <= _MOST_LABELS:
        panel.set_yticks(range(len(rows)), rows, fontsize=7)
    if len(columns) <= _MOST_LABELS:
        panel.set_xticks(range(len(columns)), columns, fontsize=7, rotation=90)
    if rho.size <= 400:
        for (i, j), value in np.ndenumerate(rho):
            if np.isfinite(value) and abs(value) > 0.7:
                panel.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=6)
    figure.colorbar(image, ax=panel, shrink=0.8)
    return picture(name, title, figure, caption)


def _residuals(found: SelfCalibration) -> Picture:
    """Residuals of range, H and V against range, H and V; without and with parameters."""
    r = found.readings
    step = max(1, len(r.polar) // _MOST_DOTS)
    across = [
        ("range [m]", r.polar[::step, 0]),
        ("horizontal angle [deg]", np.degrees(r.polar[::step, 1]) % 360),
        ("zenith angle [deg]", np.degrees(r.polar[::step, 2])),
    ]
    up = [("range [mm]", 0, 1e3), ("horizontal [″]", 1, 1 / SEC), ("zenith [″]", 2, 1 / SEC)]
    figure = new_figure(figsize=(12, 8.4), dpi=100, layout="constrained")
    panels = figure.subplots(3, 3)
    for i, (what, row, scale) in enumerate(up):
        for j, (against, x) in enumerate(across):
            panel: Axes = panels[i][j]
            if r.before is not None:
                y = r.before[::step, row] * scale
                panel.plot(x, y, ".", color="#c2571a", ms=3, label="without")
            panel.plot(x, r.after[::step, row] * scale, ".", color="#2b5f8a", ms=3, label="with")
            panel.axhline(0, color="#1d2327", lw=0.6)
            panel.set(xlabel=against, ylabel=f"residual of {what}")
    panels[0][0].legend(fontsize=8, frameon=False)
    caption = "Residuals of the network without and with the parameters."
    return picture("residuals", "Residuals against range and angles", figure, caption)
