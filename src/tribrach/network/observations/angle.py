"""Horizontal angle at an instrument, clockwise from a backsight to a foresight.

``A(foresight) - A(backsight)`` with A the azimuth in the instrument's local axes (method 2.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, refers
from tribrach.network.observations.direction import azimuth_by_sight
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import Layout, State

__all__ = ["Angles"]


@dataclass(kw_only=True)
class Angles(Sights):
    """Angles [rad] in [0, 2 pi) at ``start`` from ``end`` (backsight) to ``foresight``.

    foresight : position indices (n,).
    """

    foresight: Index = refers("position")
    kind: ClassVar[str] = "angle"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Instrument, and backsight with foresight."""
        name = layout.position_name
        rows = zip(self.start, self.end, self.foresight, strict=True)
        return [(name(i), f"{name(j)} to {name(k)}") for i, j, k in rows]

    def predict(self, state: State) -> Array:
        """Angles (n, 1) in [0, 2 pi)."""
        back, fore = self.sight(state), self.sight(state, self.foresight)
        angle = np.arctan2(fore[:, 0], fore[:, 1]) - np.arctan2(back[:, 0], back[:, 1])
        values: Array = np.remainder(angle, 2 * np.pi)[:, None]
        return values

    def jacobian(self, state: State) -> list[Block]:
        """The foresight's azimuth minus the backsight's."""
        fore = azimuth_by_sight(self.sight(state, self.foresight))
        back = azimuth_by_sight(self.sight(state))
        return [
            *self.sight_blocks(state, fore, self.foresight),
            *self.sight_blocks(state, -back),
        ]
