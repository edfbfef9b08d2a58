"""GNSS baseline ``X_b - X_a`` as a vector of the work frame, with its full covariance.

Vectors and covariances measured in ECEF are rotated into W by the reader (method sections 1.1 and
2.7); antenna heights run along the local verticals. Several baselines of one session are joined
by a joint covariance of the network.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import skew
from tribrach.network.observations.base import Array, Block, Index, Observations, per_item, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["GnssBaselines"]


@dataclass(kw_only=True)
class GnssBaselines(Observations):
    """Vectors (n, 3) [m] in W from ``start`` to ``end`` (position indices).

    height_start, height_end : antenna heights [m] (n,); scale : index (n,) of a scalar that
    scales the vectors by ``1 + m``, -1 for none.
    """

    start: Index = refers("position")
    end: Index = refers("position")
    height_start: Array = per_item(0.0)
    height_end: Array = per_item(0.0)
    scale: Index = refers("scalar", optional=True)
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "gnss_baseline"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """From and to."""
        name = layout.position_name
        return [(name(i), name(j)) for i, j in zip(self.start, self.end, strict=True)]

    def _chord(self, state: State) -> Array:
        a, b = state.positions[self.start], state.positions[self.end]
        top_b = b + self.height_end[:, None] * self.site.axes(b)[:, 2]
        return top_b - a - self.height_start[:, None] * self.site.axes(a)[:, 2]

    def predict(self, state: State) -> Array:
        """Vectors (n, 3)."""
        return (1 + state.scalar(self.scale))[:, None] * self._chord(state)

    def jacobian(self, state: State) -> list[Block]:
        """Plus identity at the end, minus at the start, the vector itself by the scale."""
        columns = state.layout.position_columns
        factor = (1 + state.scalar(self.scale))[:, None, None]
        blocks = [
            Block(columns(self.end), factor * self._by_mark(state, self.end, self.height_end)),
            Block(
                columns(self.start), -factor * self._by_mark(state, self.start, self.height_start)
            ),
        ]
        if (self.scale >= 0).any():
            by_scale = self._chord(state)[:, :, None]
            blocks.append(Block(state.layout.columns("scalar", self.scale), by_scale))
        return blocks

    def _by_mark(self, state: State, index: Index, height: Array) -> Array:
        """Derivative (n, 3, 3) of an antenna by its mark: identity and the vertical's turn."""
        x = state.positions[index]
        up = self.site.axes(x)[:, 2]
        return np.eye(3) - height[:, None, None] * (skew(up) @ self.site.turn(x))
