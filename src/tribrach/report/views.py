"""Plan and elevation of places, for pictures of clouds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tribrach._types import Array
from tribrach.report.charts import Chart, ends_of
from tribrach.sentences import capital

#: a plan narrower than this share of its length is a line
_LINE = 0.03
#: width and largest height of a panel in pixels
SIZE = (900.0, 420.0)


class View:
    """Plan or elevation of places (n, 3), shortened by a round corner; axes have their names."""

    def __init__(self, xyz: Array, axes: tuple[int, int], names: str) -> None:
        self.axes, self._names = axes, names
        self._corner = np.floor(xyz.min(axis=0) / 10) * 10
        self._ends = [ends_of(values) for values in self.of(xyz)]

    def of(self, xyz: Array) -> tuple[Array, Array]:
        """Places (n, 3) in the axes of the panel."""
        x, y = (xyz[:, k] - self._corner[k] for k in self.axes)
        return x, y

    def panel(self) -> Chart:
        """An empty panel."""
        labels = [f"{self._names[k]}{_less(float(self._corner[k]))} [m]" for k in self.axes]
        return Chart(self._ends[0], self._ends[1], (labels[0], labels[1]), SIZE, equal=True)


def views_of(xyz: Array, names: str = "ENU", *, level: bool = False) -> list[View]:
    """Plan, unless it is a line, and elevation along its longer side, also if ``level``."""
    extent = np.ptp(xyz, axis=0)
    along = 0 if extent[0] >= extent[1] else 1
    flat = min(extent[:2]) < _LINE * max(extent[:2])
    views = [] if flat else [View(xyz, (0, 1), names)]
    if level or flat or extent[2] >= _LINE * max(extent[:2]):
        views.append(View(xyz, (along, 2), names))
    return views


def views_in_words(views: Sequence[View]) -> str:
    """What they are."""
    words = ["plan" if view.axes == (0, 1) else "elevation" for view in views]
    return capital(" and ".join(words))


def _less(start: float) -> str:
    """What an axis is shortened by."""
    return f" - {start:.0f}" if start > 0 else f" + {-start:.0f}" if start < 0 else ""
