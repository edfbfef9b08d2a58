"""GNSS position of a mark or antenna in the work frame, with a common part of its session.

``y = X + a g(X) + c``: antenna height ``a`` along the local vertical, and an optional common shift
``c`` (a vector unknown with its own prior) shared by all positions of a session, so that their
relative precision is better than their absolute one (method section 2.6).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import skew
from tribrach.network.observations.base import Array, Block, Index, Observations, per_item, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["GnssPositions"]


@dataclass(kw_only=True)
class GnssPositions(Observations):
    """Positions (n, 3) [m] in W of ``position`` (position indices).

    antenna_height : [m] (n,) over the position; common : index (n,) of the session's shift
    vector, -1 for none.
    """

    position: Index = refers("position")
    antenna_height: Array = per_item(0.0)
    common: Index = refers("vector", optional=True)
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "gnss_position"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position."""
        return [(layout.position_name(i), "") for i in self.position]

    def predict(self, state: State) -> Array:
        """Antenna positions (n, 3)."""
        x = state.positions[self.position]
        antenna = x + self.antenna_height[:, None] * self.site.axes(x)[:, 2]
        if (self.common >= 0).any():
            shift = state.vectors[np.maximum(self.common, 0)]
            antenna = antenna + np.where(self.common[:, None] >= 0, shift, 0.0)
        return antenna

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the position (and the turn of the vertical), identity by the shift."""
        x = state.positions[self.position]
        up = self.site.axes(x)[:, 2]
        tilt = self.antenna_height[:, None, None] * (skew(up) @ self.site.turn(x))
        blocks = [Block(state.layout.position_columns(self.position), np.eye(3) - tilt)]
        if (self.common >= 0).any():
            columns = state.layout.columns("vector", self.common)
            blocks.append(Block(columns, np.broadcast_to(np.eye(3), (len(self), 3, 3))))
        return blocks
