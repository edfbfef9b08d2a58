"""Slope distance ``s = a + (1 + m) |u|`` with optional zero ``a`` [m] and scale ``m`` unknowns.

Method section 2.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, norm, refers
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import State

__all__ = ["SlopeDistances"]


@dataclass(kw_only=True)
class SlopeDistances(Sights):
    """Slope distances [m]; ``zero`` and ``scale`` are scalar indices (n,), -1 for none."""

    zero: Index = refers("scalar", optional=True)
    scale: Index = refers("scalar", optional=True)
    kind: ClassVar[str] = "slope_distance"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def predict(self, state: State) -> Array:
        """Distances (n, 1)."""
        length = norm(self.sight(state))
        return (state.scalar(self.zero) + (1 + state.scalar(self.scale)) * length)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``(1+m) u/|u|`` by the sight, 1 by the zero, ``|u|`` by the scale."""
        u = self.sight(state)
        length = norm(u)
        unit = (1 + state.scalar(self.scale))[:, None] * u / length[:, None]
        blocks = self.sight_blocks(state, unit[:, None, :])
        columns = state.layout.columns
        if (self.zero >= 0).any():
            blocks.append(Block(columns("scalar", self.zero), np.ones((len(self), 1, 1))))
        if (self.scale >= 0).any():
            blocks.append(Block(columns("scalar", self.scale), length[:, None, None]))
        return blocks
