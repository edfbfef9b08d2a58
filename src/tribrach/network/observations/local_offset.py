"""Horizontal offset of one position from another along an axis of known azimuth.

``d = f (E' sin A + N' cos A)`` with the line of sight ``u = (E', N', U')`` from instrument to
target in the local axes at the start and a known factor f that reduces it to another height. With
azimuths 90 and 0 degrees these are the offsets in east and north; with the value zero both
together are a centring, one mark plumb over another (method section 2.3 for ``u``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, per_item
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import State

__all__ = ["LocalOffsets"]


@dataclass(kw_only=True)
class LocalOffsets(Sights):
    """Offsets [m] along ``azimuth`` (n,) [rad], clockwise from the local north at the start.

    reduction : known factor f (n,), 1 if not given.
    """

    azimuth: Array = per_item(0.0)
    reduction: Array = per_item(1.0)
    kind: ClassVar[str] = "local_offset"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def _axis(self) -> Array:
        zero = np.zeros(len(self))
        axis = np.stack([np.sin(self.azimuth), np.cos(self.azimuth), zero], axis=1)
        out: Array = self.reduction[:, None] * axis
        return out

    def predict(self, state: State) -> Array:
        """Offsets (n, 1)."""
        offsets: Array = np.einsum("ni,ni->n", self._axis(), self.sight(state))
        return offsets[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The axis by the sight."""
        return self.sight_blocks(state, self._axis()[:, None, :])
