"""What a total station, a gyroscope or a tape measures from one position to another."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.plumb import PlumbLines
from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import skew
from tribrach.instruments.precision import Precision
from tribrach.observations.base import Block, Observations, norm, per_item, refers, wrap
from tribrach.observations.declaration import (
    SIGHT,
    Category,
    CsvColumns,
    End,
    KindFacts,
    ObservedAxes,
    Planned,
    Repetition,
    Role,
    SightLength,
    SightLine,
    StartTie,
)
from tribrach.observations.ties import Lengths, Rays, TieCollector, Zeniths
from tribrach.observations.unknowns import State


def _in_table(name: str, planned: Planned, **further: Any) -> tuple[CsvColumns, ...]:
    """A kind's column in the table of sights, with heights of instrument and target."""
    heights = ("height_instrument", "height_target")
    return (CsvColumns(("from", "to"), (name,), heights=heights, planned=planned, **further),)


#: what the unknown heights of instruments and targets are
HEIGHT_UNKNOWNS = ("instrument height", "target height")


#: what an unknown error of centring is
ECCENTRICITY_UNKNOWN = "eccentricity"


#: what an error of the deflection of the vertical is called
DEFLECTION_UNKNOWN = "deflection of the vertical"


@dataclass(kw_only=True)
class Sights(Observations):
    """Observations along one line of sight each, from an instrument to a target.

    ``u = L(X_S) (X_T + ht g_T - X_S) - hi e_3`` is the vector from the instrument's axis to the
    target in the local axes ``L`` (rows east, north, up) at the instrument's position; ``g`` is the
    local vertical of the site (method section 2.3). Eccentricities of both ends are added to the
    positions (method section 2.3).
    """

    #: (n,): positions of instrument and target
    start: Index = refers("position", end=End.FROM)
    end: Index = refers("position", end=End.TO)
    #: (n,): heights over the positions [m]
    height_instrument: Array = per_item(0.0)
    height_target: Array = per_item(0.0)
    #: (n,): scalars *added* to those heights, -1 for none: with a height of zero the scalar is the
    #: whole height, which sights of one set-up or of one target may share
    height_instrument_unknown: Index = refers(
        "scalar", optional=True, means=HEIGHT_UNKNOWNS[0], unit="m"
    )
    height_target_unknown: Index = refers(
        "scalar", optional=True, means=HEIGHT_UNKNOWNS[1], unit="m"
    )
    #: (n,): vectors of the work frame [m] from the marks to what stands over them, -1 for none
    eccentricity_instrument: Index = refers("vector", optional=True, means=ECCENTRICITY_UNKNOWN)
    eccentricity_target: Index = refers("vector", optional=True, means=ECCENTRICITY_UNKNOWN)
    #: (n,): scalars to be added to the deflection at the instrument [rad], -1 for none
    xi_error: Index = refers("scalar", optional=True, means=DEFLECTION_UNKNOWN, unit="rad")
    eta_error: Index = refers("scalar", optional=True, means=DEFLECTION_UNKNOWN, unit="rad")
    site: Site = field(default_factory=FlatSite)  #: normals of the place
    #: how plumb lines lean against them, along which instruments and targets stand
    plumb: PlumbLines = field(default_factory=PlumbLines)
    #: is the value read along the plumb line, and not only over it as a slope distance is?
    along_plumb: ClassVar[bool] = True

    def levelled_share(self) -> Array | float:
        """How much of the deflection a value feels: all of it, as it is read along plumb lines."""
        return 1.0

    def _lean(self, state: State) -> Array:
        """Deflections xi, eta (n, 2) [rad] at the instruments, as far as values feel them."""
        x = state.positions[self.start]
        lean = self.plumb.deflection(self.site, self.start, x)
        lean += np.stack([state.scalar(self.xi_error), state.scalar(self.eta_error)], axis=1)
        felt: Array = lean * np.reshape(self.levelled_share(), (-1, 1))
        return felt

    def _has_errors(self) -> bool:
        """Is an error of the deflection unknown?"""
        return bool((self.xi_error >= 0).any() or (self.eta_error >= 0).any())

    def _axes(self, state: State) -> Array:
        """East, north, up (n, 3, 3) of the instruments, up along their plumb lines."""
        x = state.positions[self.start]
        if self.plumb.normal and not self._has_errors():
            return self.site.axes(x)
        return self.site.leaning(x, self._lean(state))

    def _up(self, state: State, index: Index) -> Array:
        """Plumb lines (n, 3) of positions, along which targets stand."""
        x = state.positions[index]
        if self.plumb.normal:
            return self.site.axes(x)[:, 2]
        return self.site.leaning(x, self.plumb.deflection(self.site, index, x))[:, 2]

    def _eccentricities(self, end: Index) -> list[tuple[Index, float]]:
        """Vectors at both ends that are unknown, with their signs in the sight."""
        ends = [(self.eccentricity_instrument, -1.0)]
        if end is self.end:  # another end stands elsewhere
            ends.append((self.eccentricity_target, 1.0))
        return [(index, sign) for index, sign in ends if (index >= 0).any()]

    def _chord(self, state: State, end: Index) -> Array:
        """From what stands over the marks at the start to the targets (n, 3), in the work frame."""
        ht = self.height_target + state.scalar(self.height_target_unknown)
        # coordinates may be millions: what is millimetres is added to their difference
        chord: Array = state.positions[end] + ht[:, None] * self._up(state, end)
        chord = chord - state.positions[self.start]
        for index, sign in self._eccentricities(end):
            chord += sign * np.where(index[:, None] >= 0, state.vectors[index], 0.0)
        return chord

    def sight(self, state: State, end: Index | None = None) -> Array:
        """Vectors ``u`` (n, 3) from instrument to target (or to another ``end``), local axes."""
        end = self.end if end is None else end
        hi = self.height_instrument + state.scalar(self.height_instrument_unknown)
        u: Array = np.einsum("nij,nj->ni", self._axes(state), self._chord(state, end))
        u[:, 2] -= hi
        return u

    def sight_blocks(self, state: State, by_u: Array, end: Index | None = None) -> list[Block]:
        """Chain ``by_u`` (n, rows, 3), the derivative of the values by ``u``, to the unknowns."""
        end = self.end if end is None else end
        layout = state.layout
        x_from, x_to = state.positions[self.start], state.positions[end]
        axes, up = self._axes(state), self._up(state, end)
        ht = self.height_target + state.scalar(self.height_target_unknown)
        chord = self._chord(state, end)
        in_w = by_u @ axes
        # moving the target turns its own vertical, moving the instrument turns the local axes
        by_end = in_w @ (np.eye(3) - ht[:, None, None] * (skew(up) @ self.site.turn(x_to)))
        by_start = in_w @ (skew(chord) @ self.site.turn(x_from) - np.eye(3))
        blocks = [
            Block(layout.position_columns(end), by_end),
            Block(layout.position_columns(self.start), by_start),
        ]
        blocks += self.if_any(state, "scalar", self.height_instrument_unknown, -by_u[:, :, 2:])
        by_height = in_w @ up[:, :, None]
        blocks += self.if_any(state, "scalar", self.height_target_unknown, by_height)
        blocks += [
            Block(layout.columns("vector", index), sign * in_w)
            for index, sign in self._eccentricities(end)
        ]
        return blocks + self._by_deflection(state, by_u, np.einsum("nij,nj->ni", axes, chord))

    def _by_deflection(self, state: State, by_u: Array, c: Array) -> list[Block]:
        """By the errors of xi and eta, from the chord (n, 3) in the instrument's axes."""
        if not self._has_errors():
            return []
        latitude = self.site.latitude_at(state.positions[self.start])
        there = latitude + self._lean(state)[:, 0]
        sine, cosine = np.sin(there) / np.cos(latitude), np.cos(there) / np.cos(latitude)
        zero = np.zeros(len(c))
        # a step of the latitude turns about the east, one of the longitude about the Earth's axis
        by_xi = np.stack([zero, -c[:, 2], c[:, 1]], axis=1)
        by_eta = np.stack(
            [sine * c[:, 1] - cosine * c[:, 2], -sine * c[:, 0], cosine * c[:, 0]], axis=1
        )
        share = np.reshape(self.levelled_share(), (-1, 1))
        return [
            Block(state.layout.columns("scalar", index), by_u @ (share * by_lean)[:, :, None])
            for index, by_lean in ((self.xi_error, by_xi), (self.eta_error, by_eta))
            if (index >= 0).any()
        ]

    def lift(self, rows: Index, start: State) -> Array:
        """Height of target less height of instrument (k,) [m], as far as they are known."""
        lift: Array = self.height_target[rows] - self.height_instrument[rows]
        lift = lift + np.nan_to_num(start.scalar(self.height_target_unknown[rows]))
        return lift - np.nan_to_num(start.scalar(self.height_instrument_unknown[rows]))


def azimuth_by_sight(u: Array) -> Array:
    """Derivative (n, 1, 3) of ``atan2(E', N')`` by the sight vector (n, 3)."""
    flat = u[:, 0] ** 2 + u[:, 1] ** 2
    return np.stack([u[:, 1] / flat, -u[:, 0] / flat, np.zeros(len(u))], axis=1)[:, None, :]


@dataclass(kw_only=True)
class Directions(Sights):
    """Horizontal directions ``r = atan2(E', N') - o`` [rad], clockwise circle readings."""

    #: (n,): scalars ``o``, the azimuth of the circle's zero, one for each set (method sections 1.2
    #: and 2.3)
    orientation: Index = refers("scalar", means="orientation", unit="rad", by_set=True)
    kind: ClassVar[str] = "direction"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="direction",
        computed="`atan2(E', N') - o`, with the orientation unknown `o` of its set",
        axes=ObservedAxes.PLAN,
        start=StartTie.RAY,
        csv=_in_table("direction", Planned.TOTAL_STATION),
        names_target=True,
        full_circle=True,
    )

    def predict(self, state: State) -> Array:
        """Directions (n, 1) in (-pi, pi]."""
        u = self.sight(state)
        return wrap(np.arctan2(u[:, 0], u[:, 1]) - state.scalar(self.orientation))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``[N', -E', 0]/h'^2`` by the sight, -1 by the orientation."""
        blocks = self.sight_blocks(state, azimuth_by_sight(self.sight(state)))
        columns = state.layout.columns("scalar", self.orientation)
        return [*blocks, Block(columns, np.full((len(self), 1, 1), -1.0))]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Rays of the set."""
        ends = self.start[rows], self.end[rows]
        ties.add(Rays(self.orientation[rows], *ends, self.values[rows, 0]))

    @classmethod
    def instrument_sigma(cls, precision: Precision, line: SightLine) -> Array | None:
        """Sigma of a reading, and of centring by the length of the sight."""
        return precision.of_directions(line.sight, line.repetitions, line.ends)

    @classmethod
    def sigma_by_length(cls, precision: Precision) -> bool:
        """By errors of centring."""
        return precision.centring > 0


@dataclass(kw_only=True)
class Angles(Sights):
    """Horizontal angles [rad] in [0, 2 pi) at an instrument, clockwise from a backsight.

    ``A(foresight) - A(backsight)`` with A the azimuth in the instrument's local axes (method
    section 2.3).

    ``start``, ``end`` (n,): positions of instrument and backsight.
    """

    foresight: Index = refers("position", end=End.TO)  #: (n,): positions
    kind: ClassVar[str] = "angle"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="angle",
        computed="azimuth of the foresight less that of the backsight",
        axes=ObservedAxes.PLAN,
        start=StartTie.RAY,
        csv=(
            CsvColumns(
                ("at", "from", "to"),
                ("angle",),
                heights=("height_instrument", "height_target"),
            ),
        ),
        names_target=True,
        full_circle=True,
    )

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

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Rays: angles at one instrument that share targets make a set, each from the last."""
        start, value = self.start[rows], self.values[rows, 0]
        targets = np.concatenate([self.end[rows], self.foresight[rows]])
        node, inverse = np.unique(np.tile(start, 2) * ties.n_nodes + targets, return_inverse=True)
        back, fore = inverse[: len(rows)], inverse[len(rows) :]
        reading = np.full(len(node), np.nan)
        label = np.full(len(node), -1)
        while np.isnan(reading).any():
            first = int(np.argmax(np.isnan(reading)))
            reading[first], label[first] = 0.0, ties.n_sets
            spread = True
            while spread:
                ahead = np.isfinite(reading[back]) & np.isnan(reading[fore])
                reading[fore[ahead]] = reading[back[ahead]] + value[ahead]
                behind = np.isfinite(reading[fore]) & np.isnan(reading[back])
                reading[back[behind]] = reading[fore[behind]] - value[behind]
                label[np.isfinite(reading) & (label < 0)] = ties.n_sets
                spread = bool(ahead.any() or behind.any())
            ties.n_sets += 1
        ties.add(Rays(label, node // ties.n_nodes, node % ties.n_nodes, reading))

    @classmethod
    def instrument_sigma(cls, precision: Precision, line: SightLine) -> Array | None:
        """Sigma of two directions, without centring."""
        return precision.of_angles(line.repetitions)


@dataclass(kw_only=True)
class Azimuths(Sights):
    """Azimuths or grid bearings [rad] from one position to another, clockwise from north.

    ``A = atan2(E', N') - c - o`` with a known meridian convergence ``c`` (a grid bearing t gives
    ``A = t + c``) and an optional unknown offset ``o`` of the instrument, such as a gyroscope's
    (method section 2.5). Where plumb lines lean, azimuths are astronomic, as stars and gyroscopes
    give them, or geodetic, as they are after Laplace's correction.
    """

    convergence: Array = per_item(0.0)  #: (n,): known ``c`` [rad]
    #: (n,): 1 for astronomic azimuths, which is the default, 0 for geodetic ones
    astronomic: Array = per_item(1.0)
    #: (n,): scalars ``o``, -1 for none
    offset: Index = refers("scalar", optional=True, means="azimuth offset", unit="rad")
    kind: ClassVar[str] = "azimuth"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="azimuth",
        computed="`atan2(E', N')` less known convergence and unknown offset",
        axes=ObservedAxes.PLAN,
        start=StartTie.RAY,
        csv=_in_table("azimuth", Planned.BY_NAME),
        names_target=True,
        full_circle=True,
    )

    def levelled_share(self) -> Array:
        """Nothing of the deflection for geodetic azimuths."""
        return self.astronomic

    def predict(self, state: State) -> Array:
        """Azimuths (n, 1) in (-pi, pi]."""
        u = self.sight(state)
        azimuth = np.arctan2(u[:, 0], u[:, 1]) - self.convergence - state.scalar(self.offset)
        return wrap(azimuth)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``[N', -E', 0]/h'^2`` by the sight, -1 by the offset."""
        blocks = self.sight_blocks(state, azimuth_by_sight(self.sight(state)))
        by_offset = np.full((len(self), 1, 1), -1.0)
        return blocks + self.if_any(state, "scalar", self.offset, by_offset)

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Azimuths, with the offset where a value of it is given."""
        offset = np.zeros(len(rows))
        has = self.offset[rows] >= 0
        offset[has] = np.nan_to_num(ties.start.scalars[self.offset[rows][has]])
        value = self.values[rows, 0] + self.convergence[rows] + offset
        ties.add_azimuths(self.start[rows], self.end[rows], value)


#: radius [m] of the refracted ray's correction where the site gives none
MEAN_RADIUS = 6371000.0


def face_two_words(sources: Sequence[str]) -> str:
    """Zenith angles above 200 gon, by where they stand, which readers take from the circle."""
    one = len(sources) == 1
    return (
        f"{sources[0]}: {'a zenith angle' if one else f'{len(sources)} zenith angles'} above "
        f"200 gon {'is a reading' if one else 'are readings'} of face two and "
        f"{'counts' if one else 'count'} as 400 gon less the reading."
    )


@dataclass(kw_only=True)
class ZenithAngles(Sights):
    """Zenith angles [rad] in (0, pi), with refraction and Earth curvature.

    On a site with verticals of its own: ``z = atan2(h', U') - k s / (2 R)``. On a flat site with a
    curvature radius R: ``z = atan2(h', U' - (1 - k) h'^2 / (2 R))``; without a radius both
    corrections are zero. ``k`` is the refraction coefficient (method section 2.3).
    """

    refraction: Array = per_item(0.0)  #: (n,): coefficient k of each sight
    #: (n,): scalars added to it, -1 for none
    refraction_unknown: Index = refers("scalar", optional=True, means="refraction", unit="1")
    kind: ClassVar[str] = "zenith"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="zenith",
        computed="`atan2(h', U')` with refraction and Earth curvature",
        start=StartTie.ZENITH,
        csv=_in_table("zenith", Planned.TOTAL_STATION),
        names_target=True,
    )

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
        by_k = self._by_refraction(u, flat, q)[:, None, None]
        return blocks + self.if_any(state, "scalar", self.refraction_unknown, by_k)

    def _by_refraction(self, u: Array, flat: Array, q: Array) -> Array:
        """Derivative (n,) by k: ``-h^3/(2 R q)`` on a flat site, ``-s/(2 R)`` elsewhere."""
        radius = self.site.curvature_radius
        if isinstance(self.site, FlatSite):
            return np.zeros(len(self)) if radius is None else -(flat**3) / (2 * radius * q)
        return -norm(u) / (2 * (radius or MEAN_RADIUS))

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Slopes of sights that are not vertical."""
        z = self.values[rows, 0]
        good = np.abs(np.sin(z)) > 1e-6
        rows, z = rows[good], z[good]
        slope = np.cos(z) / np.abs(np.sin(z))
        ties.add(Zeniths(self.start[rows], self.end[rows], slope, self.lift(rows, ties.start)))

    @classmethod
    def instrument_sigma(cls, precision: Precision, line: SightLine) -> Array | None:
        """Sigma of a reading, and of heights by the length of the sight."""
        return precision.of_zeniths(line.sight, line.repetitions, line.ends)

    @classmethod
    def sigma_by_length(cls, precision: Precision) -> bool:
        """By errors of heights."""
        return precision.height > 0

    @classmethod
    def instrument_columns(cls, precision: Precision) -> dict[str, Any]:
        """The refraction coefficient of the place."""
        return {"refraction": precision.refraction}


@dataclass(kw_only=True)
class _Lengths(Sights):
    """Distances ``a + (1 + m) l`` [m] of a length ``l`` of the sight."""

    #: (n,): scalars ``a`` [m] and ``m``, -1 for none
    zero: Index = refers("scalar", optional=True, means="distance zero", unit="m")
    scale: Index = refers("scalar", optional=True, means="scale", unit="1")
    units: ClassVar[tuple[str, ...]] = ("m",)

    @abstractmethod
    def _length(self, u: Array) -> tuple[Array, Array]:
        """Lengths (n,) of sights (n, 3), and their derivatives (n, 3) by them."""

    def predict(self, state: State) -> Array:
        """Distances (n, 1)."""
        length, _ = self._length(self.sight(state))
        return (state.scalar(self.zero) + (1 + state.scalar(self.scale)) * length)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``(1 + m) dl/du`` by the sight, 1 by the zero, ``l`` by the scale."""
        length, slope = self._length(self.sight(state))
        by_u = (1 + state.scalar(self.scale))[:, None] * slope
        return [
            *self.sight_blocks(state, by_u[:, None, :]),
            *self.if_any(state, "scalar", self.zero, np.ones((len(self), 1, 1))),
            *self.if_any(state, "scalar", self.scale, length[:, None, None]),
        ]

    @classmethod
    def instrument_sigma(cls, precision: Precision, line: SightLine) -> Array | None:
        """Sigma of the distance and of centring."""
        return precision.of_distances(line.value, line.repetitions, line.ends)


@dataclass(kw_only=True)
class SlopeDistances(_Lengths):
    """Slope distances ``s = a + (1 + m) |u|`` [m] (method section 2.3)."""

    along_plumb: ClassVar[bool] = False
    kind: ClassVar[str] = "slope_distance"
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="slope distance",
        computed="`a + (1 + m) abs(u)`, with zero and scale as unknowns if wanted",
        start=StartTie.LENGTH,
        csv=_in_table(
            "slope_distance",
            Planned.TOTAL_STATION,
            length=SightLength.SLOPE,
            sigmas=("sigma_distance",),
        ),
        names_target=True,
    )

    def _length(self, u: Array) -> tuple[Array, Array]:
        length = norm(u)
        return length, u / length[:, None]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Lengths with the lift from instrument to target."""
        value, unknown = self.values[rows, 0], np.full(len(rows), np.nan)
        ends = self.start[rows], self.end[rows]
        ties.add(Lengths(*ends, value, unknown, self.lift(rows, ties.start)))


@dataclass(kw_only=True)
class HorizontalDistances(_Lengths):
    """Horizontal distances ``d = a + (1 + m) f h'`` [m] in the instrument's local horizon.

    ``f`` reduces them to another surface (a reference height, a projection); ``a`` and ``m`` are
    optional zero and scale unknowns (method section 2.3).
    """

    #: (n,): known factor ``f`` from horizontal to reduced distance, 1 if not given
    reduction: Array = per_item(1.0)
    kind: ClassVar[str] = "horizontal_distance"
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="horizontal distance",
        computed="the same of the horizontal part, reduced by a known factor",
        axes=ObservedAxes.PLAN,
        start=StartTie.LENGTH,
        csv=_in_table(
            "horizontal_distance",
            Planned.BY_NAME,
            length=SightLength.LEVEL,
            sigmas=("sigma_distance",),
        ),
        names_target=True,
    )

    def _length(self, u: Array) -> tuple[Array, Array]:
        flat = np.hypot(u[:, 0], u[:, 1])
        level = np.column_stack([u[:, :2], np.zeros(len(u))])
        return self.reduction * flat, (self.reduction / flat)[:, None] * level

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Horizontal lengths."""
        value = self.values[rows, 0] / self.reduction[rows]
        ties.add(Lengths(self.start[rows], self.end[rows], value, value, np.zeros(len(rows))))


@dataclass(kw_only=True)
class Distances(SlopeDistances):
    """Spatial distances [m]: scale bar, sphere to sphere, base length of stations.

    Slope distances without heights over the ends, under a name of their own because they are
    length standards and not sights (method section 2.12).
    """

    kind: ClassVar[str] = "distance"
    facts: ClassVar[KindFacts] = replace(
        SIGHT,
        title="distance",
        computed="length between two positions without heights: scale bar, base length",
        start=StartTie.LENGTH,
        csv=(
            CsvColumns(
                ("from", "to"), ("distance",), length=SightLength.SLOPE, planned=Planned.BY_NAME
            ),
        ),
        names_target=True,
    )

    @classmethod
    def instrument_sigma(cls, precision: Precision, line: SightLine) -> Array | None:
        """Of a planned distance; the sigma of a measured one is that of its standard."""
        return super().instrument_sigma(precision, line) if line.planned else None


@dataclass(kw_only=True)
class LocalOffsets(Sights):
    """Horizontal offsets [m] of one position from another along an axis of known azimuth.

    ``d = f (E' sin A + N' cos A)`` with the line of sight ``u = (E', N', U')`` from instrument to
    target in the local axes at the start and a known factor f that reduces it to another height.
    With azimuths 90 and 0 degrees these are the offsets in east and north; with the value zero both
    together are a centring, one mark plumb over another (method section 2.3 for ``u``).
    """

    #: (n,): ``A`` [rad], clockwise from the local north at the start
    azimuth: Array = per_item(0.0)
    reduction: Array = per_item(1.0)  #: (n,): known factor ``f``, 1 if not given
    kind: ClassVar[str] = "local_offset"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="local offset",
        computed="horizontal offset along a known azimuth; centrings",
        role=Role.READING,
        category=Category.OTHER,
        axes=ObservedAxes.PLAN,
        repeats=Repetition.SETS,
        start=StartTie.LENGTH,
        names_target=True,
    )

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

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Two offsets of one pair are an azimuth and a length, which may be zero (a centring)."""
        key = self.start[rows] * ties.n_nodes + self.end[rows]
        pairs, group = np.unique(key, return_inverse=True)
        a = np.stack([np.sin(self.azimuth[rows]), np.cos(self.azimuth[rows])], axis=1)
        normal, right = np.zeros((len(pairs), 2, 2)), np.zeros((len(pairs), 2))
        np.add.at(normal, group, a[:, :, None] * a[:, None, :])
        np.add.at(right, group, a * (self.values[rows, :1] / self.reduction[rows, None]))
        good = np.linalg.det(normal) > 0.01
        e, n = np.linalg.solve(normal[good], right[good][..., None])[..., 0].T
        start, end = pairs[good] // ties.n_nodes, pairs[good] % ties.n_nodes
        length = np.hypot(e, n)
        ties.add_azimuths(start, end, np.arctan2(e, n))
        ties.add(Lengths(start, end, length, length, np.zeros(len(length))))
