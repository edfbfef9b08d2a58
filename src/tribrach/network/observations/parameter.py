"""Known values of scalars and vectors, with their sigma: weighted parameters.

A prior for an EDM zero, a refraction coefficient, a calibration parameter, a height of
instrument (:class:`ScalarPriors`), or for a lever arm or a session's common shift
(:class:`VectorPriors`). Method section 2.13.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["ScalarPriors", "VectorPriors"]


@dataclass(kw_only=True)
class ScalarPriors(Observations):
    """Values (n, 1) of ``scalar`` (scalar indices), each in its scalar's own unit."""

    scalar: Index = refers("scalar")
    kind: ClassVar[str] = "scalar_prior"
    units: ClassVar[tuple[str, ...]] = ("1",)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The scalar."""
        return [(layout.names["scalar"][i], "") for i in self.scalar]

    def predict(self, state: State) -> Array:
        """Values (n, 1)."""
        return state.scalars[self.scalar][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """1 by the scalar."""
        columns = state.layout.columns("scalar", self.scalar)
        return [Block(columns, np.ones((len(self), 1, 1)))]


@dataclass(kw_only=True)
class VectorPriors(Observations):
    """Values (n, 3) [m] of ``vector`` (vector indices), in the vector's own frame."""

    vector: Index = refers("vector")
    kind: ClassVar[str] = "vector_prior"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("x", "y", "z")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The vector."""
        return [(layout.names["vector"][i], "") for i in self.vector]

    def predict(self, state: State) -> Array:
        """Values (n, 3)."""
        return state.vectors[self.vector]

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the vector."""
        columns = state.layout.columns("vector", self.vector)
        return [Block(columns, np.broadcast_to(np.eye(3), (len(self), 3, 3)))]
