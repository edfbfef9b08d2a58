"""Coordinates of a position as observations: weighted control, with their covariance.

:class:`Coordinates` observes E, N and U with a 3x3 covariance; :class:`Coordinate` observes one
axis only, for control known in plan or in height alone. Method section 2.13 (weighted
parameters).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["Coordinate", "Coordinates"]


@dataclass(kw_only=True)
class Coordinates(Observations):
    """E, N, U [m] of ``position`` (position indices)."""

    position: Index = refers("position")
    kind: ClassVar[str] = "coordinates"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position."""
        return [(layout.position_name(i), "") for i in self.position]

    def predict(self, state: State) -> Array:
        """Coordinates (n, 3)."""
        return state.positions[self.position]

    def jacobian(self, state: State) -> list[Block]:
        """Identity."""
        columns = state.layout.position_columns(self.position)
        return [Block(columns, np.broadcast_to(np.eye(3), (len(self), 3, 3)))]


@dataclass(kw_only=True)
class Coordinate(Observations):
    """One coordinate [m] of ``position``; ``axis`` (n,) is 0 for E, 1 for N, 2 for U."""

    position: Index = refers("position")
    axis: Index = field()
    kind: ClassVar[str] = "coordinate"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.axis = np.asarray(self.axis, dtype=np.int64)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position and the axis."""
        axes = ("E", "N", "U")
        return [
            (layout.position_name(i), axes[a])
            for i, a in zip(self.position, self.axis, strict=True)
        ]

    def predict(self, state: State) -> Array:
        """Coordinates (n, 1)."""
        return state.positions[self.position, self.axis][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """1 by the observed coordinate."""
        columns = state.layout.position_columns(self.position)[np.arange(len(self)), self.axis]
        return [Block(columns[:, None], np.ones((len(self), 1, 1)))]
