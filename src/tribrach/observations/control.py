"""Known values of scalars and vectors, with their sigma: weighted parameters.

A prior for an EDM zero, a refraction coefficient, a calibration parameter, a height of
instrument (:class:`ScalarPriors`), or for a lever arm or a session's common shift
(:class:`VectorPriors`), or for one component of it where others are held
(:class:`VectorComponentPriors`). Method section 2.13.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.observations.base import Block, Observations, per_item, refers
from tribrach.observations.sights import Sights
from tribrach.observations.unknowns import Layout, State

__all__ = [
    "Coordinate",
    "Coordinates",
    "DirectedComponents",
    "Heights",
    "Offsets",
    "ScalarPriors",
    "VectorComponentPriors",
    "VectorPriors",
]

# Coordinates of a position as observations: weighted control, with their covariance.
#
# :class:`Coordinates` observes E, N and U with a 3x3 covariance; :class:`Coordinate` observes one
# axis only, for control known in plan or in height alone. Method section 2.13 (weighted
# parameters).


@dataclass(kw_only=True)
class Coordinates(Observations):
    """E, N, U [m] of ``position`` (position indices)."""

    position: Index = refers("position")
    kind: ClassVar[str] = "coordinates"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position."""
        return [(layout.position_name(i), "") for i in self.position]

    def predict(self, state: State) -> Array:
        """Coordinates (n, 3)."""
        return state.positions[self.position]

    def jacobian(self, state: State) -> list[Block]:
        """Identity."""
        columns = state.layout.position_columns(self.position)
        return [Block(columns, np.broadcast_to(np.eye(3), (len(self), 3, 3)))]


@dataclass(kw_only=True)
class Coordinate(Observations):
    """One coordinate [m] of ``position``; ``axis`` (n,) is 0 for E, 1 for N, 2 for U."""

    position: Index = refers("position")
    axis: Index = field()
    kind: ClassVar[str] = "coordinate"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.axis = np.asarray(self.axis, dtype=np.int64)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position and the axis."""
        axes = ("E", "N", "U")
        return [
            (layout.position_name(i), axes[a])
            for i, a in zip(self.position, self.axis, strict=True)
        ]

    def predict(self, state: State) -> Array:
        """Coordinates (n, 1)."""
        return state.positions[self.position, self.axis][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """1 by the observed coordinate."""
        columns = state.layout.position_columns(self.position)[np.arange(len(self)), self.axis]
        return [Block(columns[:, None], np.ones((len(self), 1, 1)))]


# Component ``a . X`` of a position along a given direction ``a`` of the work frame.
#
# For control that is known in one direction only which is not an axis of W: the ellipsoidal height
# or the latitude of a station away from the origin (method section 2.13).


@dataclass(kw_only=True)
class DirectedComponents(Observations):
    """Components [m] of ``position`` along unit vectors ``direction`` (n, 3) in W."""

    position: Index = refers("position")
    direction: Array = field()
    kind: ClassVar[str] = "component"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.direction = np.asarray(self.direction, dtype=float).reshape(-1, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position."""
        return [(layout.position_name(i), "") for i in self.position]

    def predict(self, state: State) -> Array:
        """Components (n, 1)."""
        x = state.positions[self.position]
        out: Array = np.einsum("ni,ni->n", self.direction, x)
        return out[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The direction."""
        columns = state.layout.position_columns(self.position)
        return [Block(columns, self.direction[:, None, :])]


# Height of a position: weighted or hard control in height alone.
#
# ``H(X)`` is the height of the site: U on a flat site, the height over the ellipsoid or sphere
# otherwise, so that a benchmark far from the origin of W keeps its height while its plan position
# is still unknown (method section 2.13).


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


# Vector from one position to another in the local axes of the first.
#
# ``u = L(X_a) (X_b + h_b g_b - X_a) - h_a e_3``: east, north and up of a sphere's centre over its
# mark, of a prism or antenna beside it, of a scanner's centre over the occupied mark. With the
# value zero and held exactly it makes two positions coincide (method sections 2.6 and 2.13).


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
