"""The line of sight from instrument to target that every total-station kind shares.

``u = L(X_S) (X_T + ht g_T - X_S) - hi e_3`` is the vector from the instrument's axis to the
target in the local axes ``L`` (rows east, north, up) at the instrument's position; ``g`` is the
local vertical of the site (method section 2.3).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import skew
from tribrach.network.observations.base import (
    Array,
    Block,
    Index,
    Observations,
    per_item,
    refers,
)
from tribrach.network.unknowns import Layout, State

__all__ = ["Sights"]


@dataclass(kw_only=True)
class Sights(Observations):
    """Observations along one line of sight each.

    Parameters
    ----------
    start, end : position indices (n,) of instrument and target.
    height_instrument, height_target : heights over the positions [m], (n,); 0 if not given.
    height_instrument_unknown, height_target_unknown : indices (n,) of scalars *added* to those
        heights (their errors as unknowns), -1 for none.
    site : verticals of the place.
    """

    start: Index = refers("position")
    end: Index = refers("position")
    height_instrument: Array = per_item(0.0)
    height_target: Array = per_item(0.0)
    height_instrument_unknown: Index = refers("scalar", optional=True)
    height_target_unknown: Index = refers("scalar", optional=True)
    site: Site = field(default_factory=FlatSite)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Instrument and target of each sight."""
        name = layout.position_name
        return [(name(i), name(j)) for i, j in zip(self.start, self.end, strict=True)]

    def sight(self, state: State, end: Index | None = None) -> Array:
        """Vectors ``u`` (n, 3) from instrument to target (or to another ``end``), local axes."""
        end = self.end if end is None else end
        x_from, x_to = state.positions[self.start], state.positions[end]
        hi = self.height_instrument + state.scalar(self.height_instrument_unknown)
        ht = self.height_target + state.scalar(self.height_target_unknown)
        chord = x_to + ht[:, None] * self.site.axes(x_to)[:, 2] - x_from
        u: Array = np.einsum("nij,nj->ni", self.site.axes(x_from), chord)
        u[:, 2] -= hi
        return u

    def sight_blocks(
        self, state: State, by_u: Array, end: Index | None = None, *, from_instrument: bool = True
    ) -> list[Block]:
        """Chain ``by_u`` (n, rows, 3), the derivative of the values by ``u``, to the unknowns."""
        end = self.end if end is None else end
        layout = state.layout
        x_from, x_to = state.positions[self.start], state.positions[end]
        axes, up = self.site.axes(x_from), self.site.axes(x_to)[:, 2]
        ht = self.height_target + state.scalar(self.height_target_unknown)
        chord = x_to + ht[:, None] * up - x_from
        in_w = by_u @ axes
        # moving the target turns its own vertical, moving the instrument turns the local axes
        by_end = in_w @ (np.eye(3) - ht[:, None, None] * (skew(up) @ self.site.turn(x_to)))
        by_start = in_w @ (skew(chord) @ self.site.turn(x_from) - np.eye(3))
        blocks = [Block(layout.position_columns(end), by_end)]
        if from_instrument:
            blocks.append(Block(layout.position_columns(self.start), by_start))
            if (self.height_instrument_unknown >= 0).any():
                columns = layout.columns("scalar", self.height_instrument_unknown)
                blocks.append(Block(columns, -by_u[:, :, 2:]))
        if (self.height_target_unknown >= 0).any():
            columns = layout.columns("scalar", self.height_target_unknown)
            blocks.append(Block(columns, in_w @ up[:, :, None]))
        return blocks
