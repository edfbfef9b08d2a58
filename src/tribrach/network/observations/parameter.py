"""Known values of scalars and vectors, with their sigma: weighted parameters.

A prior for an EDM zero, a refraction coefficient, a calibration parameter, a height of
instrument (:class:`ScalarPriors`), or for a lever arm or a session's common shift
(:class:`VectorPriors`), or for one component of it where others are held
(:class:`VectorComponentPriors`). Method section 2.13.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.network.observations.base import (
    Array,
    Block,
    Index,
    Observations,
    per_item,
    refers,
)
from tribrach.network.unknowns import Layout, State

__all__ = ["ScalarPriors", "VectorComponentPriors", "VectorPriors"]


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


@dataclass(kw_only=True)
class VectorComponentPriors(Observations):
    """Values (n, 1) [m] of the component ``axis`` (0, 1, 2) of ``vector`` (vector indices)."""

    vector: Index = refers("vector")
    axis: Array = per_item(0.0)
    kind: ClassVar[str] = "vector_component_prior"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The vector and its component."""
        names = layout.names["vector"]
        pairs = zip(self.vector, self._axis, strict=True)
        return [(names[i], "xyz"[k]) for i, k in pairs]

    @property
    def _axis(self) -> Index:
        return self.axis.astype(np.int64)

    def predict(self, state: State) -> Array:
        """Values (n, 1)."""
        return state.vectors[self.vector, self._axis][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """1 by the component."""
        columns = state.layout.columns("vector", self.vector)
        values = np.zeros((len(self), 1, 3))
        values[np.arange(len(self)), 0, self._axis] = 1.0
        return [Block(columns, values)]
