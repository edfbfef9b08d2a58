"""Vector from one position to another in the local axes of the first.

``u = L(X_a) (X_b + h_b g_b - X_a) - h_a e_3``: east, north and up of a sphere's centre over its
mark, of a prism or antenna beside it, of a scanner's centre over the occupied mark. With the
value zero and held exactly it makes two positions coincide (method sections 2.6 and 2.13).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import State

__all__ = ["Offsets"]


@dataclass(kw_only=True)
class Offsets(Sights):
    """Vectors (n, 3) [m] east, north, up at ``start`` to ``end`` (position indices).

    An offset tilted by the bubble of its pole has the covariance ``(h sigma_bubble)^2`` in plan.
    """

    kind: ClassVar[str] = "offset"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def predict(self, state: State) -> Array:
        """Vectors (n, 3)."""
        return self.sight(state)

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the sight."""
        return self.sight_blocks(state, np.broadcast_to(np.eye(3), (len(self), 3, 3)))
