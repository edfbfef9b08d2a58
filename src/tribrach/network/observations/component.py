"""Component ``a . X`` of a position along a given direction ``a`` of the work frame.

For control that is known in one direction only which is not an axis of W: the ellipsoidal height
or the latitude of a station away from the origin (method section 2.13).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["Components"]


@dataclass(kw_only=True)
class Components(Observations):
    """Components [m] of ``position`` along unit vectors ``direction`` (n, 3) in W."""

    position: Index = refers("position")
    direction: Array = field()
    kind: ClassVar[str] = "component"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.direction = np.asarray(self.direction, dtype=float).reshape(-1, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position."""
        return [(layout.position_name(i), "") for i in self.position]

    def predict(self, state: State) -> Array:
        """Components (n, 1)."""
        x = state.positions[self.position]
        out: Array = np.einsum("ni,ni->n", self.direction, x)
        return out[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The direction."""
        columns = state.layout.position_columns(self.position)
        return [Block(columns, self.direction[:, None, :])]
