"""Horizontal direction ``r = atan2(E', N') - o`` with the orientation unknown ``o`` of its set.

Clockwise circle reading; ``o`` is the azimuth of the circle's zero (method sections 1.2, 2.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, refers, wrap
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import State

__all__ = ["Directions", "azimuth_by_sight"]


def azimuth_by_sight(u: Array) -> Array:
    """Derivative (n, 1, 3) of ``atan2(E', N')`` by the sight vector (n, 3)."""
    flat = u[:, 0] ** 2 + u[:, 1] ** 2
    return np.stack([u[:, 1] / flat, -u[:, 0] / flat, np.zeros(len(u))], axis=1)[:, None, :]


@dataclass(kw_only=True)
class Directions(Sights):
    """Directions [rad]; ``orientation`` is the scalar index (n,) of each set's unknown."""

    orientation: Index = refers("scalar")
    kind: ClassVar[str] = "direction"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)

    def predict(self, state: State) -> Array:
        """Directions (n, 1) in (-pi, pi]."""
        u = self.sight(state)
        return wrap(np.arctan2(u[:, 0], u[:, 1]) - state.scalar(self.orientation))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``[N', -E', 0]/h'^2`` by the sight, -1 by the orientation."""
        blocks = self.sight_blocks(state, azimuth_by_sight(self.sight(state)))
        columns = state.layout.columns("scalar", self.orientation)
        return [*blocks, Block(columns, np.full((len(self), 1, 1), -1.0))]
