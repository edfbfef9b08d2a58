"""Height of a position: weighted or hard control in height alone.

``H(X)`` is the height of the site: U on a flat site, the height over the ellipsoid or sphere
otherwise, so that a benchmark far from the origin of W keeps its height while its plan position
is still unknown (method section 2.13).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from tribrach.geodesy.site import FlatSite, Site
from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["Heights"]


@dataclass(kw_only=True)
class Heights(Observations):
    """Heights [m] of ``position`` (position indices)."""

    position: Index = refers("position")
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "height"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position."""
        return [(layout.position_name(i), "") for i in self.position]

    def predict(self, state: State) -> Array:
        """Heights (n, 1)."""
        return self.site.height(state.positions[self.position])[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The up axis."""
        x = state.positions[self.position]
        columns = state.layout.position_columns(self.position)
        return [Block(columns, self.site.axes(x)[:, 2:])]
