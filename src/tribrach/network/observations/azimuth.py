"""Azimuth or grid bearing from one position to another, clockwise from north.

``A = atan2(E', N') - c - o`` with a known meridian convergence ``c`` (a grid bearing t gives
``A = t + c``) and an optional unknown offset ``o`` of the instrument, such as a gyroscope's
(method section 2.5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, per_item, refers, wrap
from tribrach.network.observations.direction import azimuth_by_sight
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import State

__all__ = ["Azimuths"]


@dataclass(kw_only=True)
class Azimuths(Sights):
    """Azimuths [rad]; convergence [rad] (n,) and the index of an offset scalar (n,)."""

    convergence: Array = per_item(0.0)
    offset: Index = refers("scalar", optional=True)
    kind: ClassVar[str] = "azimuth"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)

    def predict(self, state: State) -> Array:
        """Azimuths (n, 1) in (-pi, pi]."""
        u = self.sight(state)
        azimuth = np.arctan2(u[:, 0], u[:, 1]) - self.convergence - state.scalar(self.offset)
        return wrap(azimuth)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``[N', -E', 0]/h'^2`` by the sight, -1 by the offset."""
        blocks = self.sight_blocks(state, azimuth_by_sight(self.sight(state)))
        if (self.offset >= 0).any():
            columns = state.layout.columns("scalar", self.offset)
            blocks.append(Block(columns, np.full((len(self), 1, 1), -1.0)))
        return blocks
