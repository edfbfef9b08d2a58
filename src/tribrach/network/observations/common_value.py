"""Pairs of positions that share one unknown distance or height difference.

``|X_b - X_a| - q = 0`` and ``H(X_b) - H(X_a) - q = 0`` with the common value ``q`` (a scalar)
of all pairs of a set: rungs of a ladder, points of a sphere about a centre. Observed as zero with
the sigma to which they are equal (equal radii and lengths of method section 2.13, weighted).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, refers
from tribrach.network.observations.height_difference import HeightDifferences
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.unknowns import State

__all__ = ["EqualDistances", "EqualHeightDifferences"]


@dataclass(kw_only=True)
class EqualDistances(SlopeDistances):
    """Slope distances less their common value [m]; ``common`` is a scalar index (n,)."""

    common: Index = refers("scalar")
    kind: ClassVar[str] = "equal_distance"

    def predict(self, state: State) -> Array:
        """``s - q``, (n, 1)."""
        return super().predict(state) - state.scalar(self.common)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """As the distance, and -1 by the common value."""
        columns = state.layout.columns("scalar", self.common)
        return [*super().jacobian(state), Block(columns, np.full((len(self), 1, 1), -1.0))]


@dataclass(kw_only=True)
class EqualHeightDifferences(HeightDifferences):
    """Height differences less their common value [m]; ``common`` is a scalar index (n,)."""

    common: Index = refers("scalar")
    kind: ClassVar[str] = "equal_height_difference"

    def predict(self, state: State) -> Array:
        """``dH - q``, (n, 1)."""
        return super().predict(state) - state.scalar(self.common)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """As the height difference, and -1 by the common value."""
        columns = state.layout.columns("scalar", self.common)
        return [*super().jacobian(state), Block(columns, np.full((len(self), 1, 1), -1.0))]
