"""What older networks measured on the ellipsoid: chords, arcs, latitudes and longitudes.

Distances that were reduced before they were written down, on the ellipsoid or at sea level, and
geodetic or astronomic positions of single stations (method section 2.15).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite, FlatSite, Site, curvature_radii
from tribrach.geometry.rotation import skew
from tribrach.observations.base import Block, Observations, norm, per_item, refers, wrap
from tribrach.observations.declaration import (
    SIGHT,
    Category,
    End,
    KindFacts,
    ObservedAxes,
    Role,
    StartTie,
)
from tribrach.observations.ties import Lengths, TieCollector
from tribrach.observations.unknowns import State


@dataclass(kw_only=True)
class EllipsoidChords(Observations):
    """Straight distances ``|P_b - P_a|`` [m] between the feet of two positions on the ellipsoid.

    ``P = X - h g``, with the height ``h`` over the ellipsoid and its normal ``g``; on a flat site
    the foot is at U = 0 (method section 2.15).
    """

    #: (n,): positions
    start: Index = refers("position", end=End.FROM)
    end: Index = refers("position", end=End.TO)
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "ellipsoid_chord"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="ellipsoid chord",
        computed="straight distance between the feet of two positions on the ellipsoid",
        axes=ObservedAxes.PLAN,
        start=StartTie.LENGTH,
    )

    def _chord(self, state: State) -> Array:
        """From foot to foot, (n, 3)."""
        chord: Array = self._foot(state, self.end) - self._foot(state, self.start)
        return chord

    def _foot(self, state: State, index: Index) -> Array:
        """Feet (n, 3) in W."""
        x = state.positions[index]
        foot: Array = x - self.site.height(x)[:, None] * self.site.axes(x)[:, 2]
        return foot

    def _by_place(self, state: State, index: Index) -> Array:
        """Derivative (n, 3, 3) of a foot by its position, ``I - g g^T + h [g]x K``."""
        x = state.positions[index]
        up, height = self.site.axes(x)[:, 2], self.site.height(x)
        across = np.eye(3) - up[:, :, None] * up[:, None, :]
        return across + height[:, None, None] * (skew(up) @ self.site.turn(x))

    def predict(self, state: State) -> Array:
        """Chords (n, 1)."""
        return norm(self._chord(state))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The chord's unit vector, through the feet."""
        chord = self._chord(state)
        unit = (chord / norm(chord)[:, None])[:, None, :] * self._by_chord(state)[:, None, None]
        columns = state.layout.position_columns
        return [
            Block(columns(self.end), unit @ self._by_place(state, self.end)),
            Block(columns(self.start), -unit @ self._by_place(state, self.start)),
        ]

    def _by_chord(self, state: State) -> Array:
        """Derivative (n,) of the value by the chord."""
        return np.ones(len(self))

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Horizontal lengths, near enough."""
        value = self.values[rows, 0]
        ties.add(Lengths(self.start[rows], self.end[rows], value, value, np.zeros(len(rows))))


@dataclass(kw_only=True)
class EllipsoidArcs(EllipsoidChords):
    """Distances [m] along the ellipsoid, or along a surface at known heights above it: sea level.

    ``s = 2 r asin(k/(2 r))`` with ``k^2 = c^2 (1 + N_a/R)(1 + N_b/R) + (N_b - N_a)^2``, the chord
    ``c`` on the ellipsoid, its radius ``R`` along the line and ``r = R + (N_a + N_b)/2`` (method
    section 2.15). On a flat site the plane is the surface.
    """

    #: (n,): heights ``N`` of the surface over the ellipsoid [m]
    geoid_start: Array = per_item(0.0)
    geoid_end: Array = per_item(0.0)
    kind: ClassVar[str] = "ellipsoid_arc"
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="ellipsoid arc",
        computed="distance along the ellipsoid, or along a surface at known heights above it",
        axes=ObservedAxes.PLAN,
        start=StartTie.LENGTH,
    )

    def _lifted(self, state: State) -> tuple[Array, Array, Array, Array]:
        """Chord on the ellipsoid and on the surface, lifting factor, radius of the surface."""
        chord, curvature = norm(self._chord(state)), self._curvature(state)
        low, high = self.geoid_start, self.geoid_end
        factor = (1 + low * curvature) * (1 + high * curvature)
        lifted = np.sqrt(chord**2 * factor + (high - low) ** 2)
        return chord, lifted, factor, curvature / (1 + (low + high) / 2 * curvature)

    def _curvature(self, state: State) -> Array:
        """One over the radius of the ellipsoid along each line (n,), zero on a flat site."""
        if not isinstance(self.site, EllipsoidSite):
            return np.zeros(len(self))
        start, end = state.positions[self.start], state.positions[self.end]
        latitude = (self.site.geodetic(start)[:, 0] + self.site.geodetic(end)[:, 0]) / 2
        east, north, _ = np.einsum("nij,nj->in", self.site.axes((start + end) / 2), end - start)
        nu, m = curvature_radii(latitude, self.site.ellipsoid)
        flat = east**2 + north**2
        out: Array = (east**2 / nu + north**2 / m) / flat
        return out

    def predict(self, state: State) -> Array:
        """Arcs (n, 1)."""
        _, lifted, _, curvature = self._lifted(state)
        half = lifted * curvature / 2
        # asin(x)/x, one on a plane
        safe = np.where(half > 0, half, 1.0)
        return (lifted * np.where(half > 0, np.arcsin(safe) / safe, 1.0))[:, None]

    def _by_chord(self, state: State) -> Array:
        """``(dk/dc) / sqrt(1 - (k/2r)^2)``; that the radius turns with the line is left out."""
        chord, lifted, factor, curvature = self._lifted(state)
        out: Array = factor * chord / lifted / np.sqrt(1 - (lifted * curvature / 2) ** 2)
        return out


@dataclass(kw_only=True)
class _SinglePositions(Observations):
    """Latitudes or longitudes of positions."""

    position: Index = refers("position", end=End.AT)  #: (n,): positions
    #: (n,): known difference of the astronomic from the geodetic value [rad]: 0 for geodetic ones
    lean: Array = per_item(0.0)
    site: Site = field(default_factory=FlatSite)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.site, EllipsoidSite):
            raise InputError(
                f"a {self.facts.title} needs a place on the ellipsoid, and the site is flat",
                record=next((str(s) for s in self.source if s), None),
                cure="give the site latitude and longitude, or a crs",
            )

    def _geodetic(self, state: State) -> Array:
        assert isinstance(self.site, EllipsoidSite)
        return self.site.geodetic(state.positions[self.position])

    def _block(self, state: State, axis: int, factor: Array) -> list[Block]:
        """A component of the turn of the local axes, times a factor (n,)."""
        x = state.positions[self.position]
        turn = np.einsum("nj,njk->nk", self.site.axes(x)[:, axis], self.site.turn(x))
        columns = state.layout.position_columns(self.position)
        return [Block(columns, (factor[:, None] * turn)[:, None, :])]


@dataclass(kw_only=True)
class Latitudes(_SinglePositions):
    """Latitudes ``B + xi`` [rad], astronomic; geodetic if xi is 0 (method section 2.15)."""

    kind: ClassVar[str] = "latitude"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="latitude",
        computed="geodetic latitude, with the northern deflection of an astronomic one",
        role=Role.GIVEN,
        category=Category.CONTROL,
        axes=ObservedAxes.PLAN,
        absolute=True,
    )

    def predict(self, state: State) -> Array:
        """Latitudes (n, 1)."""
        return (self._geodetic(state)[:, 0] + self.lean)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """Moving north by ``M + h`` turns the axes by one against the east axis."""
        return self._block(state, 0, np.full(len(self), -1.0))


@dataclass(kw_only=True)
class Longitudes(_SinglePositions):
    """Longitudes ``L + eta / cos B`` [rad], astronomic; geodetic if eta is 0 (section 2.15)."""

    kind: ClassVar[str] = "longitude"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)
    facts: ClassVar[KindFacts] = KindFacts(
        title="longitude",
        computed="geodetic longitude, with the eastern deflection of an astronomic one",
        role=Role.GIVEN,
        category=Category.CONTROL,
        axes=ObservedAxes.PLAN,
        absolute=True,
    )

    def predict(self, state: State) -> Array:
        """Longitudes (n, 1) in (-pi, pi]."""
        geodetic = self._geodetic(state)
        return wrap(geodetic[:, 1] + self.lean / np.cos(geodetic[:, 0]))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """A turn about the polar axis has ``cos B`` of it along north; the lean goes with it."""
        latitude = self._geodetic(state)[:, 0]
        by_latitude = self.lean * np.tan(latitude) / np.cos(latitude)
        return [
            *self._block(state, 1, 1 / np.cos(latitude)),
            *self._block(state, 0, -by_latitude),
        ]
