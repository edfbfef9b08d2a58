"""Targets in the frame of a station, value by value, and targets that turn around an axis.

Targets in a frame: ``u = R^T (X + ht g(X) - t)`` is the target in the station's own frame, levelled
or not, with a prism or sphere ``ht`` above the mark along the local vertical ``g``
(:class:`FrameSights`; method sections 2.0 to 2.2).

An axis runs through ``origin`` (a position) along ``n = m + s_1 a_1 + s_2 a_2``: ``m`` is the
coordinate axis of W closest to it, ``a_1`` and ``a_2`` the next ones in cyclic order and ``s``
two unknown slopes (scalars), so that no unknown is superfluous. A target fixed to the turning
body describes a circle of radius ``r`` about ``C = O + l n`` in all positions of the body
(:class:`AxisSights`). Its conditions are observed as zero; their misclosures are lengths, whose
sigma is the stability of the turning body (circle fit of rotation axes, as of telescopes; method
section 2.13).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.circles import common_axis
from tribrach.geometry.rotation import skew
from tribrach.observations.base import Block, Observations, norm, per_item, refers
from tribrach.observations.declaration import (
    Category,
    CsvColumns,
    End,
    KindFacts,
    Repetition,
    Role,
    StartTie,
    shaped,
)
from tribrach.observations.ties import TieCollector
from tribrach.observations.unknowns import State

#: fewest points of an axis; part of an axis of W that its direction must have at least
_FEWEST, _LEAST_MAIN = 4, 0.3
_AXES = ("east", "north", "up")


@dataclass(kw_only=True)
class FrameSights(Observations):
    """Observations of targets in the frame of a station."""

    station: Index = refers("pose", end=End.FROM)  #: (n,): poses
    target: Index = refers("position", end=End.TO)  #: (n,): positions
    height_target: Array = per_item(0.0)  #: (n,): height of the target over its mark [m]
    site: Site = field(default_factory=FlatSite)

    def _chord(self, state: State) -> Array:
        """Target minus station in W, (n, 3)."""
        x = state.positions[self.target]
        top = x + self.height_target[:, None] * self.site.axes(x)[:, 2]
        return top - state.pose_t[self.station]

    def in_frame(self, state: State) -> Array:
        """Targets ``u`` (n, 3) in the station's frame [m]."""
        u: Array = np.einsum("nji,nj->ni", state.pose_r[self.station], self._chord(state))
        return u

    def frame_blocks(self, state: State, by_u: Array) -> list[Block]:
        """Chain ``by_u`` (n, 1, 3), the derivative of the value by ``u``, to the unknowns."""
        layout = state.layout
        in_w = by_u @ state.pose_r[self.station].transpose(0, 2, 1)
        x = state.positions[self.target]
        # moving the target turns the vertical that its height is measured along
        turn = skew(self.site.axes(x)[:, 2]) @ self.site.turn(x)
        by_target = in_w @ (np.eye(3) - self.height_target[:, None, None] * turn)
        by_pose = np.concatenate([-in_w, in_w @ skew(self._chord(state))], axis=2)
        return [
            Block(layout.position_columns(self.target), by_target),
            Block(layout.columns("pose", self.station), by_pose),
        ]

    def add_in_frame(self, rows: Index, component: Index, ties: TieCollector) -> None:
        """Values (k,) for start values, component as in :meth:`TieCollector.add_in_frame`."""
        ends = self.station[rows], self.target[rows]
        ties.add_in_frame(*ends, component, self.values[rows, 0], self.height_target[rows])


#: what sights of one value have in common
_IN_FRAME = KindFacts(
    title="",
    computed="",
    role=Role.READING,
    category=Category.OTHER,
    own_category=Category.BACKSIGHT,
    repeats=Repetition.SETS,
    start=StartTie.SHOT,
    names_target=True,
)


@dataclass(kw_only=True)
class FrameCoordinates(FrameSights):
    """Single coordinates [m], where a whole target centre was not measured."""

    #: (n,): 0 for x, 1 for y, 2 for z of the station's frame (method section 2.0)
    axis: Index = shaped(whole=True)
    kind: ClassVar[str] = "frame_coordinate"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = replace(
        _IN_FRAME,
        title="frame coordinate",
        computed="one coordinate of a target in a station's frame",
        common_to_stations="frame coordinates",
    )

    def predict(self, state: State) -> Array:
        """Coordinates (n, 1)."""
        u = self.in_frame(state)
        return u[np.arange(len(self)), self.axis][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The observed axis by ``u``."""
        return self.frame_blocks(state, np.eye(3)[self.axis][:, None, :])

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """One of three values that make a shot."""
        self.add_in_frame(rows, self.axis[rows], ties)


@dataclass(kw_only=True)
class FrameAngles(FrameSights):
    """Angles [rad]: ``atan2(y, x)`` counter-clockwise, or the elevation ``atan2(z, |(x, y)|)``.

    As of a laser tracker, or of a target in a photograph with the rays of a calibrated camera.
    """

    #: (n,): 0 for the angle about the z axis, 1 for the elevation (method section 2.1)
    circle: Index = shaped(whole=True)
    kind: ClassVar[str] = "frame_angle"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)
    facts: ClassVar[KindFacts] = replace(
        _IN_FRAME,
        title="frame angle",
        computed="angle about the z axis, or elevation, of a target in a station's frame",
        common_to_stations="frame angles",
    )

    def predict(self, state: State) -> Array:
        """Angles (n, 1) in (-pi, pi]."""
        x, y, z = self.in_frame(state).T
        flat = np.hypot(x, y)
        angles: Array = np.where(self.circle == 0, np.arctan2(y, x), np.arctan2(z, flat))
        return angles[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``(-y, x, 0)/q^2`` or ``(-x z/q, -y z/q, q)/|u|^2`` by ``u``, with ``q = |(x, y)|``."""
        u = self.in_frame(state)
        x, y, z = u.T
        flat = np.hypot(x, y)
        around = np.stack([-y, x, np.zeros(len(u))], axis=1) / flat[:, None] ** 2
        upward = np.stack([-x * z / flat, -y * z / flat, flat], axis=1) / norm(u)[:, None] ** 2
        by_u = np.where((self.circle == 0)[:, None], around, upward)
        return self.frame_blocks(state, by_u[:, None, :])

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """One of three values that make a shot."""
        self.add_in_frame(rows, 3 + self.circle[rows], ties)


@dataclass(kw_only=True)
class FrameDistances(FrameSights):
    """Distances ``|u|`` [m] of targets from a station's origin (method section 2.1)."""

    kind: ClassVar[str] = "frame_distance"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = replace(
        _IN_FRAME,
        title="frame distance",
        computed="distance of a target from a station's origin",
        common_to_stations="frame distances",
    )

    def predict(self, state: State) -> Array:
        """Distances (n, 1)."""
        return norm(self.in_frame(state))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The unit vector by ``u``."""
        u = self.in_frame(state)
        return self.frame_blocks(state, (u / norm(u)[:, None])[:, None, :])

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """One of three values that make a shot."""
        self.add_in_frame(rows, np.full(len(rows), 5), ties)


@dataclass(kw_only=True)
class AxisSights(Observations):
    """Conditions between the axis through ``origin`` and the position ``point``."""

    #: (n,): positions
    origin: Index = refers("position", end=End.FROM)
    point: Index = refers("position", end=End.TO)
    #: (n,): scalars: the slopes of the axis
    slope_1: Index = refers("scalar", means="axis slope", unit="1")
    slope_2: Index = refers("scalar", means="axis slope", unit="1")
    main: Index = shaped(whole=True)  #: (n,): 0, 1, 2 for the axis of W that is closest to it

    def direction(self, state: State) -> Array:
        """Vectors ``n`` (n, 3) along the axis, not of unit length."""
        n = np.zeros((len(self), 3))
        row = np.arange(len(self))
        n[row, self.main] = 1.0
        n[row, (self.main + 1) % 3] = state.scalar(self.slope_1)
        n[row, (self.main + 2) % 3] = state.scalar(self.slope_2)
        return n

    def axis_blocks(self, state: State, by_point: Array, by_n: Array) -> list[Block]:
        """Blocks of derivatives (n, 3) by point (the opposite by the origin) and by ``n``."""
        columns = state.layout.columns
        row = np.arange(len(self))
        slopes = [by_n[row, (self.main + k) % 3] for k in (1, 2)]
        return [
            Block(state.layout.position_columns(self.origin), -by_point[:, None, :]),
            Block(state.layout.position_columns(self.point), by_point[:, None, :]),
            Block(columns("scalar", self.slope_1), slopes[0][:, None, None]),
            Block(columns("scalar", self.slope_2), slopes[1][:, None, None]),
        ]

    def _distance(self, state: State, chord: Array) -> tuple[Array, Array, Array]:
        """Length of chords (n, 3) along the axis, its derivatives by the chord and by ``n``."""
        n = self.direction(state)
        size = norm(n)[:, None]
        unit = n / size
        along: Array = np.einsum("ni,ni->n", unit, chord)
        return along, unit, (chord - along[:, None] * unit) / size


@dataclass(kw_only=True)
class _CircleSights(AxisSights):
    """A point on the circle of a target."""

    #: (n,): scalars ``l``: where the circle's centre is on the axis
    along: Index = refers("scalar", means="distance along the axis", unit="m")

    def spoke(self, state: State) -> Array:
        """``P - C``, (n, 3)."""
        x = state.positions
        centre = x[self.origin] + state.scalar(self.along)[:, None] * self.direction(state)
        out: Array = x[self.point] - centre
        return out


@dataclass(kw_only=True)
class AxisRadii(_CircleSights):
    """Distances from the circle's centre less its radius [m]: ``|P - C| - r = 0``."""

    radius: Index = refers("scalar", means="radius", unit="m")  #: (n,): scalars ``r``
    kind: ClassVar[str] = "axis_radius"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="axis radius",
        computed="distance of a target from the centre of its circle less the radius",
        role=Role.CONDITION,
        category=Category.OTHER,
        csv=(CsvColumns(("axis", "target", "point"), ()),),
    )

    def predict(self, state: State) -> Array:
        """``|P - C| - r``, (n, 1)."""
        return (norm(self.spoke(state)) - state.scalar(self.radius))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The spoke's unit vector by point, origin and centre, -1 by the radius."""
        spoke = self.spoke(state)
        unit = spoke / norm(spoke)[:, None]
        along = state.scalar(self.along)[:, None]
        by_along = -np.einsum("ni,ni->n", unit, self.direction(state))
        columns = state.layout.columns
        return [
            *self.axis_blocks(state, unit, -along * unit),
            Block(columns("scalar", self.along), by_along[:, None, None]),
            Block(columns("scalar", self.radius), np.full((len(self), 1, 1), -1.0)),
        ]

    def from_places(self, rows: Index, state: State, given: State) -> State:
        """Axes whose direction is not given, from where the points of their circles are."""
        for slope in np.unique(self.slope_1[rows]):
            members = rows[self.slope_1[rows] == slope]
            located = np.isfinite(state.positions[self.point[members]]).all(axis=1)
            members = members[located]
            if np.isfinite(given.scalars[slope]) or len(members) < _FEWEST:
                continue
            state = self._started(members, state, given)
        return state

    def _started(self, rows: Index, state: State, given: State) -> State:
        """The state with one axis, from its located points (k,)."""
        x, along = state.positions[self.point[rows]], self.along[rows]
        centre, normal = common_axis(x, along)
        main, first = int(self.main[rows[0]]), rows[0]
        if abs(normal[main]) < _LEAST_MAIN:
            raise InputError(
                f"the axis at {state.layout.position_name(int(self.origin[first]))} does not run "
                f"along {_AXES[main]}: its direction is east {normal[0]:.2f}, north "
                f"{normal[1]:.2f}, up {normal[2]:.2f}",
                record=str(self.source[first]) or None,
                cure="name the axis of the work frame that is closest to it",
            )
        n = normal / normal[main]
        foot = (x - centre) @ n / (n @ n)
        origin, points, scalars = int(self.origin[first]), state.points.copy(), state.scalars.copy()
        if origin < len(points) and np.isnan(points[origin]).any():
            # a circle whose place on the axis is given says where the origin is on it
            held = np.isfinite(given.scalars[along])
            k = int(np.argmax(held))
            base = foot[along == along[k]].mean() - np.nan_to_num(given.scalars[along[k]])
            points[origin] = centre + base * n
        else:
            base = (state.positions[origin] - centre) @ n / (n @ n)
        spoke = norm(x - centre - foot[:, None] * n)
        scalars[self.slope_1[first]] = n[(main + 1) % 3]
        scalars[self.slope_2[first]] = n[(main + 2) % 3]
        for one in np.unique(along):
            of = along == one
            scalars[one] = foot[of].mean() - base
            scalars[self.radius[rows[of][0]]] = spoke[of].mean()
        return replace(state, points=points, scalars=scalars)


@dataclass(kw_only=True)
class AxisPlanes(_CircleSights):
    """Distances along the axis from the plane of the circle [m]: ``n . (P - C) / |n| = 0``."""

    kind: ClassVar[str] = "axis_plane"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="axis plane",
        computed="distance of a target from the plane of its circle",
        role=Role.CONDITION,
        category=Category.OTHER,
    )

    def predict(self, state: State) -> Array:
        """``n . (P - C) / |n|``, (n, 1)."""
        return self._distance(state, self.spoke(state))[0][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The axis by the point; by ``n`` both through its turn and through the centre."""
        _, unit, by_n = self._distance(state, self.spoke(state))
        along = state.scalar(self.along)[:, None]
        by_along = -norm(self.direction(state))
        return [
            *self.axis_blocks(state, unit, by_n - along * unit),
            Block(state.layout.columns("scalar", self.along), by_along[:, None, None]),
        ]


@dataclass(kw_only=True)
class AxisFeet(AxisSights):
    """Distances along the axis from its origin to the foot of a point [m].

    ``n . (Q - O) / |n| = 0``: the origin is the foot of ``Q`` on the axis, which fixes it along the
    axis; used as a hard constraint.
    """

    kind: ClassVar[str] = "axis_foot"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="axis foot",
        computed="distance along the axis from its origin to the foot of a point",
        role=Role.CONDITION,
        category=Category.OTHER,
    )

    def _arm(self, state: State) -> Array:
        x = state.positions
        out: Array = x[self.point] - x[self.origin]
        return out

    def predict(self, state: State) -> Array:
        """``n . (Q - O) / |n|``, (n, 1)."""
        return self._distance(state, self._arm(state))[0][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The axis by the point, the arm across it by ``n``."""
        _, unit, by_n = self._distance(state, self._arm(state))
        return self.axis_blocks(state, unit, by_n)
