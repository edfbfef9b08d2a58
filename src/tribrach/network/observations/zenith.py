"""Zenith angle with refraction and Earth curvature.

On a site with verticals of its own: ``z = atan2(h', U') - k s / (2 R)``. On a flat site with a
curvature radius R: ``z = atan2(h', U' - (1 - k) h'^2 / (2 R))``; without a radius both corrections
are zero. ``k`` is the refraction coefficient (method section 2.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.geodesy.site import FlatSite
from tribrach.network.observations.base import Array, Block, Index, norm, per_item, refers
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import State

__all__ = ["ZenithAngles"]

#: radius [m] of the refracted ray's correction where the site gives none
MEAN_RADIUS = 6371000.0


@dataclass(kw_only=True)
class ZenithAngles(Sights):
    """Zenith angles [rad] in (0, pi).

    refraction : coefficient k of each sight (n,); refraction_unknown : index (n,) of a scalar
    added to it, -1 for none.
    """

    refraction: Array = per_item(0.0)
    refraction_unknown: Index = refers("scalar", optional=True)
    kind: ClassVar[str] = "zenith"
    units: ClassVar[tuple[str, ...]] = ("rad",)

    def _bend(self, state: State) -> tuple[Array, Array]:
        """Factors (n,): of h'^2 lowering U' (flat site), of s lowering z (other sites)."""
        k = self.refraction + state.scalar(self.refraction_unknown)
        radius = self.site.curvature_radius
        if isinstance(self.site, FlatSite):
            zero = np.zeros(len(self))
            return (zero if radius is None else (1 - k) / (2 * radius)), zero
        return np.zeros(len(self)), k / (2 * (radius or MEAN_RADIUS))

    def predict(self, state: State) -> Array:
        """Zenith angles (n, 1)."""
        u = self.sight(state)
        curve, bend = self._bend(state)
        flat = np.hypot(u[:, 0], u[:, 1])
        z = np.arctan2(flat, u[:, 2] - curve * flat**2) - bend * norm(u)
        values: Array = z[:, None]
        return values

    def jacobian(self, state: State) -> list[Block]:
        """By the sight, and by the refraction coefficient where it is unknown."""
        u = self.sight(state)
        curve, bend = self._bend(state)
        flat = np.hypot(u[:, 0], u[:, 1])
        up = u[:, 2] - curve * flat**2
        q = flat**2 + up**2
        # dz = (up dh - h dup)/q with dup = dU' - 2 C h dh
        along = (up + 2 * curve * flat**2) / (q * flat)
        by_u = np.stack([along * u[:, 0], along * u[:, 1], -flat / q], axis=1)
        by_u -= (bend / norm(u))[:, None] * u
        blocks = self.sight_blocks(state, by_u[:, None, :])
        if (self.refraction_unknown >= 0).any():
            blocks.append(self._by_refraction(state, u, flat, q))
        return blocks

    def _by_refraction(self, state: State, u: Array, flat: Array, q: Array) -> Block:
        """Derivative by k: ``-h^3/(2 R q)`` on a flat site, ``-s/(2 R)`` elsewhere."""
        radius = self.site.curvature_radius
        if isinstance(self.site, FlatSite):
            by_k = np.zeros(len(self)) if radius is None else -(flat**3) / (2 * radius * q)
        else:
            by_k = -norm(u) / (2 * (radius or MEAN_RADIUS))
        columns = state.layout.columns("scalar", self.refraction_unknown)
        return Block(columns, by_k[:, None, None])
