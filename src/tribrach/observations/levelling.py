"""Pairs of positions that share one unknown distance or height difference.

``|X_b - X_a| - q = 0`` and ``H(X_b) - H(X_a) - q = 0`` with the common value ``q`` (a scalar)
of all pairs of a set: rungs of a ladder, points of a sphere about a centre. Observed as zero with
the sigma to which they are equal (equal radii and lengths of method section 2.13, weighted).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.observations.base import Block, Observations, per_item, refers
from tribrach.observations.sights import SlopeDistances
from tribrach.observations.unknowns import Layout, State

__all__ = ["EqualDistances", "EqualHeightDifferences", "HeightDifferences"]

# Height difference ``H(X_b) - H(X_a)`` of levelling.
#
# The height is that of the site (U on a flat site, ellipsoidal otherwise) minus a known geoid
# height of each end (method section 2.4). Heights of rod or instrument over the marks are added.


@dataclass(kw_only=True)
class HeightDifferences(Observations):
    """Height differences [m] from ``start`` to ``end`` (position indices).

    height_start, height_end : heights of what was levelled over the marks [m], (n,);
    geoid_start, geoid_end : geoid heights [m], (n,); all zero if not given.
    """

    start: Index = refers("position")
    end: Index = refers("position")
    height_start: Array = per_item(0.0)
    height_end: Array = per_item(0.0)
    geoid_start: Array = per_item(0.0)
    geoid_end: Array = per_item(0.0)
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "height_difference"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """From and to."""
        name = layout.position_name
        return [(name(i), name(j)) for i, j in zip(self.start, self.end, strict=True)]

    def predict(self, state: State) -> Array:
        """Height differences (n, 1)."""
        x = state.positions
        upper = self.site.height(x[self.end]) - self.geoid_end + self.height_end
        lower = self.site.height(x[self.start]) - self.geoid_start + self.height_start
        return (upper - lower)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The vertical at either end: + at the end, - at the start."""
        x, columns = state.positions, state.layout.position_columns
        up_end = self.site.axes(x[self.end])[:, 2:]
        up_start = self.site.axes(x[self.start])[:, 2:]
        return [Block(columns(self.end), up_end), Block(columns(self.start), -up_start)]


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
