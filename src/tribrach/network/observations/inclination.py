"""Levelled station: what a compensator or inclinometer says about the plumb line.

``q = R^T g`` with the plumb line ``g = (eta, xi, 1)`` in the local axes of the station (deflection
of the vertical, zero if unknown); observed are ``(q_x/q_z, q_y/q_z)``, zero for a compensated
instrument, plus an optional constant offset of the inclinometer (method section 2.9). Where the
deflection itself is known with a sigma only, its error is an unknown that the stations share (7.5).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import skew
from tribrach.network.observations.base import Array, Block, Index, Observations, per_item, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["Inclinations"]


@dataclass(kw_only=True)
class Inclinations(Observations):
    """Inclinations (n, 2) [rad] of the scanner's z axis at ``station`` (pose indices).

    xi, eta : deflection of the vertical towards north and east [rad], (n,); offset_x, offset_y :
    indices (n,) of the inclinometer's constant offsets, -1 for none; xi_error, eta_error : indices
    (n,) of what has to be added to xi and eta [rad], -1 for none.
    """

    station: Index = refers("pose")
    xi: Array = per_item(0.0)
    eta: Array = per_item(0.0)
    offset_x: Index = refers("scalar", optional=True)
    offset_y: Index = refers("scalar", optional=True)
    xi_error: Index = refers("scalar", optional=True)
    eta_error: Index = refers("scalar", optional=True)
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "inclination"
    units: ClassVar[tuple[str, ...]] = ("rad", "rad")
    components: ClassVar[tuple[str, ...]] = ("x", "y")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The station."""
        return [(layout.names["pose"][i], "") for i in self.station]

    def _plumb(self, state: State) -> tuple[Array, Array]:
        """Plumb line in W and in the scanner frame, (n, 3) each."""
        eta = self.eta + state.scalar(self.eta_error)
        xi = self.xi + state.scalar(self.xi_error)
        local = np.stack([eta, xi, np.ones(len(self))], axis=1)
        axes = self.site.axes(state.pose_t[self.station])
        g = np.einsum("nij,ni->nj", axes, local)
        return g, np.einsum("nji,nj->ni", state.pose_r[self.station], g)

    def predict(self, state: State) -> Array:
        """Inclinations (n, 2)."""
        _, q = self._plumb(state)
        offset = np.stack([state.scalar(self.offset_x), state.scalar(self.offset_y)], axis=1)
        return q[:, :2] / q[:, 2:] + offset

    def jacobian(self, state: State) -> list[Block]:
        """By the rotation ``P R^T [g]x``; by the position through the turn of the vertical."""
        layout = state.layout
        g, q = self._plumb(state)
        project = np.zeros((len(self), 2, 3))
        project[:, 0, 0] = project[:, 1, 1] = 1 / q[:, 2]
        project[:, :, 2] = -q[:, :2] / q[:, 2:] ** 2
        by_g = project @ state.pose_r[self.station].transpose(0, 2, 1)
        by_turn = by_g @ skew(g)
        # a turned vertical is the opposite of a turned instrument
        by_t = -by_turn @ self.site.turn(state.pose_t[self.station])
        values = np.concatenate([by_t, by_turn], axis=2)
        blocks = [Block(layout.columns("pose", self.station), values)]
        for row, index in enumerate((self.offset_x, self.offset_y)):
            if (index >= 0).any():
                unit = np.zeros((len(self), 2, 1))
                unit[:, row] = 1.0
                blocks.append(Block(layout.columns("scalar", index), unit))
        by_local = by_g @ self.site.axes(state.pose_t[self.station]).transpose(0, 2, 1)
        for axis, index in enumerate((self.eta_error, self.xi_error)):
            if (index >= 0).any():
                part = by_local[:, :, axis, None]
                blocks.append(Block(layout.columns("scalar", index), part))
        return blocks
