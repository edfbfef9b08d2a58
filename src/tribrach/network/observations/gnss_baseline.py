"""GNSS baseline ``X_b - X_a`` as a vector of the work frame, with its full covariance.

``y = (1 + m) exp(w) (X_b - X_a)``. Vectors and covariances measured in ECEF are rotated into W by
the reader (method sections 1.1 and 2.7); antenna heights run along the local verticals. The scale
``m`` and the turn ``w`` of the GNSS frame against W are optional unknowns. Several baselines of one
session are joined by a joint covariance of the network.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import exp, right_jacobian_inverse, skew
from tribrach.network.observations.base import Array, Block, Index, Observations, per_item, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["GnssBaselines"]


@dataclass(kw_only=True)
class GnssBaselines(Observations):
    """Vectors (n, 3) [m] in W from ``start`` to ``end`` (position indices).

    height_start, height_end : antenna heights [m] (n,); scale : index (n,) of a scalar that
    scales the vectors by ``1 + m``; turn_e, turn_n, turn_u : indices (n,) of the components of
    the rotation vector ``w`` [rad] about the axes of W; -1 for none.
    """

    start: Index = refers("position")
    end: Index = refers("position")
    height_start: Array = per_item(0.0)
    height_end: Array = per_item(0.0)
    scale: Index = refers("scalar", optional=True)
    turn_e: Index = refers("scalar", optional=True)
    turn_n: Index = refers("scalar", optional=True)
    turn_u: Index = refers("scalar", optional=True)
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

    def _turn(self, state: State) -> Array:
        """Rotation vectors ``w`` (n, 3)."""
        return np.stack([state.scalar(i) for i in (self.turn_e, self.turn_n, self.turn_u)], axis=1)

    def _frame(self, state: State) -> Array:
        """``(1 + m) exp(w)``, (n, 3, 3)."""
        return (1 + state.scalar(self.scale))[:, None, None] * exp(self._turn(state))

    def predict(self, state: State) -> Array:
        """Vectors (n, 3)."""
        vectors: Array = np.einsum("nij,nj->ni", self._frame(state), self._chord(state))
        return vectors

    def jacobian(self, state: State) -> list[Block]:
        """Plus the frame at the end, minus it at the start; the vector itself by the scale."""
        columns = state.layout.position_columns
        frame = self._frame(state)
        blocks = [
            Block(columns(self.end), frame @ self._by_mark(state, self.end, self.height_end)),
            Block(
                columns(self.start), -frame @ self._by_mark(state, self.start, self.height_start)
            ),
        ]
        if (self.scale >= 0).any():
            turned = exp(self._turn(state)) @ self._chord(state)[:, :, None]
            blocks.append(Block(state.layout.columns("scalar", self.scale), turned))
        return blocks + self._by_turn(state)

    def _by_turn(self, state: State) -> list[Block]:
        """``-[y]x Jl(w)``, one column for each component that is unknown."""
        parts = (self.turn_e, self.turn_n, self.turn_u)
        if not any((index >= 0).any() for index in parts):
            return []
        left = np.linalg.inv(right_jacobian_inverse(self._turn(state)).transpose(0, 2, 1))
        by_w = -skew(self.predict(state)) @ left
        return [
            Block(state.layout.columns("scalar", index), by_w[:, :, [k]])
            for k, index in enumerate(parts)
        ]

    def _by_mark(self, state: State, index: Index, height: Array) -> Array:
        """Derivative (n, 3, 3) of an antenna by its mark: identity and the vertical's turn."""
        x = state.positions[index]
        up = self.site.axes(x)[:, 2]
        return np.eye(3) - height[:, None, None] * (skew(up) @ self.site.turn(x))
