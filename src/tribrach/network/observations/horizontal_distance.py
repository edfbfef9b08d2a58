"""Horizontal distance ``d = a + (1 + m) f h'`` in the instrument's local horizon.

``f`` reduces it to another surface (a reference height, a projection), known for each distance;
``a`` and ``m`` are optional zero and scale unknowns (method section 2.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, per_item, refers
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import State

__all__ = ["HorizontalDistances"]


@dataclass(kw_only=True)
class HorizontalDistances(Sights):
    """Horizontal distances [m]; zero [m] and scale are scalar indices (n,), -1 for none.

    reduction : known factor f (n,) from horizontal to reduced distance, 1 if not given.
    """

    zero: Index = refers("scalar", optional=True)
    scale: Index = refers("scalar", optional=True)
    reduction: Array = per_item(1.0)
    kind: ClassVar[str] = "horizontal_distance"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def predict(self, state: State) -> Array:
        """Distances (n, 1)."""
        u = self.sight(state)
        length = self.reduction * np.hypot(u[:, 0], u[:, 1])
        return (state.scalar(self.zero) + (1 + state.scalar(self.scale)) * length)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``(1+m) f (E', N', 0)/h'`` by the sight, 1 by the zero, ``f h'`` by the scale."""
        u = self.sight(state)
        flat = np.hypot(u[:, 0], u[:, 1])
        factor = (1 + state.scalar(self.scale)) * self.reduction / flat
        by_u = np.stack([factor * u[:, 0], factor * u[:, 1], np.zeros(len(u))], axis=1)
        blocks = self.sight_blocks(state, by_u[:, None, :])
        columns = state.layout.columns
        if (self.zero >= 0).any():
            blocks.append(Block(columns("scalar", self.zero), np.ones((len(self), 1, 1))))
        if (self.scale >= 0).any():
            by_scale = (self.reduction * flat)[:, None, None]
            blocks.append(Block(columns("scalar", self.scale), by_scale))
        return blocks
