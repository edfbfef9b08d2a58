"""Easting, northing or height offset of one position from another, in local axes.

``d = a . u`` with the line of sight ``u`` from instrument to target in the local axes (east,
north, up) at the start. With value zero in east and north it is a centring: one mark plumb over
another (method section 2.3 for ``u``).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index
from tribrach.network.observations.sight import Sights
from tribrach.network.unknowns import State

__all__ = ["LocalOffsets"]


@dataclass(kw_only=True)
class LocalOffsets(Sights):
    """Offsets [m]; ``axis`` (n,) is 0 for east, 1 for north, 2 for up at the start."""

    axis: Index = field()
    kind: ClassVar[str] = "local_offset"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.axis = np.asarray(self.axis, dtype=np.int64)

    def predict(self, state: State) -> Array:
        """Offsets (n, 1)."""
        return self.sight(state)[np.arange(len(self)), self.axis][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The observed axis by the sight."""
        return self.sight_blocks(state, np.eye(3)[self.axis][:, None, :])
