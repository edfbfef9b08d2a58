"""Horizontal offset of one position from another along an axis of known azimuth.

``d = f (E' sin A + N' cos A)`` with the line of sight ``u = (E', N', U')`` from instrument to
target in the local axes at the start and a known factor f that reduces it to another height. With
azimuths 90 and 0 degrees these are the offsets in east and north; with the value zero both
together are a centring, one mark plumb over another (method section 2.3 for ``u``).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import skew
from tribrach.observations.base import Block, Observations, norm, per_item, refers, wrap
from tribrach.observations.unknowns import Layout, State

__all__ = [
    "Angles",
    "Azimuths",
    "Directions",
    "Distances",
    "HorizontalDistances",
    "LocalOffsets",
    "Sights",
    "SlopeDistances",
    "ZenithAngles",
]

# The line of sight from instrument to target that every total-station kind shares.
#
# ``u = L(X_S) (X_T + ht g_T - X_S) - hi e_3`` is the vector from the instrument's axis to the
# target in the local axes ``L`` (rows east, north, up) at the instrument's position; ``g`` is the
# local vertical of the site (method section 2.3).


@dataclass(kw_only=True)
class Sights(Observations):
    """Observations along one line of sight each.

    Parameters
    ----------
    start, end : position indices (n,) of instrument and target.
    height_instrument, height_target : heights over the positions [m], (n,); 0 if not given.
    height_instrument_unknown, height_target_unknown : indices (n,) of scalars *added* to those
        heights (their errors as unknowns), -1 for none.
    site : verticals of the place.
    """

    start: Index = refers("position")
    end: Index = refers("position")
    height_instrument: Array = per_item(0.0)
    height_target: Array = per_item(0.0)
    height_instrument_unknown: Index = refers("scalar", optional=True)
    height_target_unknown: Index = refers("scalar", optional=True)
    site: Site = field(default_factory=FlatSite)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Instrument and target of each sight."""
        name = layout.position_name
        return [(name(i), name(j)) for i, j in zip(self.start, self.end, strict=True)]

    def sight(self, state: State, end: Index | None = None) -> Array:
        """Vectors ``u`` (n, 3) from instrument to target (or to another ``end``), local axes."""
        end = self.end if end is None else end
        x_from, x_to = state.positions[self.start], state.positions[end]
        hi = self.height_instrument + state.scalar(self.height_instrument_unknown)
        ht = self.height_target + state.scalar(self.height_target_unknown)
        chord = x_to + ht[:, None] * self.site.axes(x_to)[:, 2] - x_from
        u: Array = np.einsum("nij,nj->ni", self.site.axes(x_from), chord)
        u[:, 2] -= hi
        return u

    def sight_blocks(
        self, state: State, by_u: Array, end: Index | None = None, *, from_instrument: bool = True
    ) -> list[Block]:
        """Chain ``by_u`` (n, rows, 3), the derivative of the values by ``u``, to the unknowns."""
        end = self.end if end is None else end
        layout = state.layout
        x_from, x_to = state.positions[self.start], state.positions[end]
        axes, up = self.site.axes(x_from), self.site.axes(x_to)[:, 2]
        ht = self.height_target + state.scalar(self.height_target_unknown)
        chord = x_to + ht[:, None] * up - x_from
        in_w = by_u @ axes
        # moving the target turns its own vertical, moving the instrument turns the local axes
        by_end = in_w @ (np.eye(3) - ht[:, None, None] * (skew(up) @ self.site.turn(x_to)))
        by_start = in_w @ (skew(chord) @ self.site.turn(x_from) - np.eye(3))
        blocks = [Block(layout.position_columns(end), by_end)]
        if from_instrument:
            blocks.append(Block(layout.position_columns(self.start), by_start))
            if (self.height_instrument_unknown >= 0).any():
                columns = layout.columns("scalar", self.height_instrument_unknown)
                blocks.append(Block(columns, -by_u[:, :, 2:]))
        if (self.height_target_unknown >= 0).any():
            columns = layout.columns("scalar", self.height_target_unknown)
            blocks.append(Block(columns, in_w @ up[:, :, None]))
        return blocks


# Horizontal direction ``r = atan2(E', N') - o`` with the orientation unknown ``o`` of its set.
#
# Clockwise circle reading; ``o`` is the azimuth of the circle's zero (method sections 1.2, 2.3).


def azimuth_by_sight(u: Array) -> Array:
    """Derivative (n, 1, 3) of ``atan2(E', N')`` by the sight vector (n, 3)."""
    flat = u[:, 0] ** 2 + u[:, 1] ** 2
    return np.stack([u[:, 1] / flat, -u[:, 0] / flat, np.zeros(len(u))], axis=1)[:, None, :]


@dataclass(kw_only=True)
class Directions(Sights):
    """Directions [rad]; ``orientation`` is the scalar index (n,) of each set's unknown."""

    orientation: Index = refers("scalar")
    kind: ClassVar[str] = "direction"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)

    def predict(self, state: State) -> Array:
        """Directions (n, 1) in (-pi, pi]."""
        u = self.sight(state)
        return wrap(np.arctan2(u[:, 0], u[:, 1]) - state.scalar(self.orientation))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``[N', -E', 0]/h'^2`` by the sight, -1 by the orientation."""
        blocks = self.sight_blocks(state, azimuth_by_sight(self.sight(state)))
        columns = state.layout.columns("scalar", self.orientation)
        return [*blocks, Block(columns, np.full((len(self), 1, 1), -1.0))]


# Horizontal angle at an instrument, clockwise from a backsight to a foresight.
#
# ``A(foresight) - A(backsight)`` with A the azimuth in the instrument's local axes (method 2.3).


@dataclass(kw_only=True)
class Angles(Sights):
    """Angles [rad] in [0, 2 pi) at ``start`` from ``end`` (backsight) to ``foresight``.

    foresight : position indices (n,).
    """

    foresight: Index = refers("position")
    kind: ClassVar[str] = "angle"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Instrument, and backsight with foresight."""
        name = layout.position_name
        rows = zip(self.start, self.end, self.foresight, strict=True)
        return [(name(i), f"{name(j)} to {name(k)}") for i, j, k in rows]

    def predict(self, state: State) -> Array:
        """Angles (n, 1) in [0, 2 pi)."""
        back, fore = self.sight(state), self.sight(state, self.foresight)
        angle = np.arctan2(fore[:, 0], fore[:, 1]) - np.arctan2(back[:, 0], back[:, 1])
        values: Array = np.remainder(angle, 2 * np.pi)[:, None]
        return values

    def jacobian(self, state: State) -> list[Block]:
        """The foresight's azimuth minus the backsight's."""
        fore = azimuth_by_sight(self.sight(state, self.foresight))
        back = azimuth_by_sight(self.sight(state))
        return [
            *self.sight_blocks(state, fore, self.foresight),
            *self.sight_blocks(state, -back),
        ]


# Azimuth or grid bearing from one position to another, clockwise from north.
#
# ``A = atan2(E', N') - c - o`` with a known meridian convergence ``c`` (a grid bearing t gives
# ``A = t + c``) and an optional unknown offset ``o`` of the instrument, such as a gyroscope's
# (method section 2.5).


@dataclass(kw_only=True)
class Azimuths(Sights):
    """Azimuths [rad]; convergence [rad] (n,) and the index of an offset scalar (n,)."""

    convergence: Array = per_item(0.0)
    offset: Index = refers("scalar", optional=True)
    kind: ClassVar[str] = "azimuth"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)

    def predict(self, state: State) -> Array:
        """Azimuths (n, 1) in (-pi, pi]."""
        u = self.sight(state)
        azimuth = np.arctan2(u[:, 0], u[:, 1]) - self.convergence - state.scalar(self.offset)
        return wrap(azimuth)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``[N', -E', 0]/h'^2`` by the sight, -1 by the offset."""
        blocks = self.sight_blocks(state, azimuth_by_sight(self.sight(state)))
        if (self.offset >= 0).any():
            columns = state.layout.columns("scalar", self.offset)
            blocks.append(Block(columns, np.full((len(self), 1, 1), -1.0)))
        return blocks


# Zenith angle with refraction and Earth curvature.
#
# On a site with verticals of its own: ``z = atan2(h', U') - k s / (2 R)``. On a flat site with a
# curvature radius R: ``z = atan2(h', U' - (1 - k) h'^2 / (2 R))``; without a radius both
# corrections are zero. ``k`` is the refraction coefficient (method section 2.3).


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


# Slope distance ``s = a + (1 + m) |u|`` with optional zero ``a`` [m] and scale ``m`` unknowns.
#
# Method section 2.3.


@dataclass(kw_only=True)
class SlopeDistances(Sights):
    """Slope distances [m]; ``zero`` and ``scale`` are scalar indices (n,), -1 for none."""

    zero: Index = refers("scalar", optional=True)
    scale: Index = refers("scalar", optional=True)
    kind: ClassVar[str] = "slope_distance"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def predict(self, state: State) -> Array:
        """Distances (n, 1)."""
        length = norm(self.sight(state))
        return (state.scalar(self.zero) + (1 + state.scalar(self.scale)) * length)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``(1+m) u/|u|`` by the sight, 1 by the zero, ``|u|`` by the scale."""
        u = self.sight(state)
        length = norm(u)
        unit = (1 + state.scalar(self.scale))[:, None] * u / length[:, None]
        blocks = self.sight_blocks(state, unit[:, None, :])
        columns = state.layout.columns
        if (self.zero >= 0).any():
            blocks.append(Block(columns("scalar", self.zero), np.ones((len(self), 1, 1))))
        if (self.scale >= 0).any():
            blocks.append(Block(columns("scalar", self.scale), length[:, None, None]))
        return blocks


# Horizontal distance ``d = a + (1 + m) f h'`` in the instrument's local horizon.
#
# ``f`` reduces it to another surface (a reference height, a projection), known for each distance;
# ``a`` and ``m`` are optional zero and scale unknowns (method section 2.3).


@dataclass(kw_only=True)
class HorizontalDistances(Sights):
    """Horizontal distances [m]; zero [m] and scale are scalar indices (n,), -1 for none.

    reduction : known factor f (n,) from horizontal to reduced distance, 1 if not given.
    """

    zero: Index = refers("scalar", optional=True)
    scale: Index = refers("scalar", optional=True)
    reduction: Array = per_item(1.0)
    kind: ClassVar[str] = "horizontal_distance"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def predict(self, state: State) -> Array:
        """Distances (n, 1)."""
        u = self.sight(state)
        length = self.reduction * np.hypot(u[:, 0], u[:, 1])
        return (state.scalar(self.zero) + (1 + state.scalar(self.scale)) * length)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``(1+m) f (E', N', 0)/h'`` by the sight, 1 by the zero, ``f h'`` by the scale."""
        u = self.sight(state)
        flat = np.hypot(u[:, 0], u[:, 1])
        factor = (1 + state.scalar(self.scale)) * self.reduction / flat
        by_u = np.stack([factor * u[:, 0], factor * u[:, 1], np.zeros(len(u))], axis=1)
        blocks = self.sight_blocks(state, by_u[:, None, :])
        columns = state.layout.columns
        if (self.zero >= 0).any():
            blocks.append(Block(columns("scalar", self.zero), np.ones((len(self), 1, 1))))
        if (self.scale >= 0).any():
            by_scale = (self.reduction * flat)[:, None, None]
            blocks.append(Block(columns("scalar", self.scale), by_scale))
        return blocks


# Spatial distance between two positions: scale bar, sphere to sphere, base length of stations.
#
# A slope distance without instrument or target heights, under a name of its own because it is a
# length standard and not a sight (method section 2.12).


@dataclass(kw_only=True)
class Distances(SlopeDistances):
    """Distances [m] from ``start`` to ``end`` (position indices)."""

    kind: ClassVar[str] = "distance"


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
