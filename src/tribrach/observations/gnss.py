"""What satellite positioning gives: positions, vectors, and antennas mounted on a scanner."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import exp, right_jacobian_inverse, skew
from tribrach.observations.base import Block, Observations, per_item, refers
from tribrach.observations.declaration import (
    Category,
    CsvColumns,
    End,
    KindFacts,
    Planned,
    Repetition,
    Role,
    StartTie,
)
from tribrach.observations.ties import Fixes, ScannerShots, TieCollector, Vectors
from tribrach.observations.unknowns import State


@dataclass(kw_only=True)
class GnssPositions(Observations):
    """GNSS positions [m] of marks or antennas in the work frame, ``y = X + a g(X) + c``.

    The antenna stands ``a`` above the mark along the local vertical; an optional common shift ``c``
    (a vector unknown with its own prior) is shared by all positions of a session, so that their
    relative precision is better than their absolute one (method section 2.6).
    """

    position: Index = refers("position", end=End.AT)  #: (n,): positions
    antenna_height: Array = per_item(0.0)  #: (n,): ``a`` [m]
    #: (n,): vectors ``c``, -1 for none
    common: Index = refers("vector", optional=True, means="common shift")
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "gnss_position"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")
    facts: ClassVar[KindFacts] = KindFacts(
        title="GNSS position",
        computed="position of the antenna over a mark, with a shift common to its session",
        role=Role.READING,
        category=Category.GNSS,
        repeats=Repetition.FINER,
        start=StartTie.FIX,
        csv=(CsvColumns(("gnss",), ("e", "n", "u"), planned=Planned.BY_NAME),),
        absolute=True,
    )

    def predict(self, state: State) -> Array:
        """Antenna positions (n, 3)."""
        x = state.positions[self.position]
        antenna = x + self.antenna_height[:, None] * self.site.axes(x)[:, 2]
        if (self.common >= 0).any():
            shift = state.vectors[np.maximum(self.common, 0)]
            antenna = antenna + np.where(self.common[:, None] >= 0, shift, 0.0)
        return antenna

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the position (and the turn of the vertical), identity by the shift."""
        x = state.positions[self.position]
        up = self.site.axes(x)[:, 2]
        tilt = self.antenna_height[:, None, None] * (skew(up) @ self.site.turn(x))
        blocks = [Block(state.layout.position_columns(self.position), np.eye(3) - tilt)]
        eye = np.broadcast_to(np.eye(3), (len(self), 3, 3))
        return blocks + self.if_any(state, "vector", self.common, eye)

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Coordinates under the antenna."""
        antenna = self.values[rows]
        up = ties.site.axes(antenna)[:, 2]
        xyz = antenna - self.antenna_height[rows, None] * up
        ties.add(Fixes(self.position[rows], xyz))


@dataclass(kw_only=True)
class GnssBaselines(Observations):
    """GNSS baselines as vectors [m] of the work frame, ``y = (1 + m) exp(w) (X_b - X_a)``.

    Vectors and covariances measured in ECEF are rotated into the work frame by the reader;
    antenna heights run along the local verticals. The scale ``m`` and the turn ``w`` of the GNSS
    frame against the work frame are optional unknowns. Several baselines of one session are joined
    by a joint covariance of the network (method sections 1.1 and 2.7).
    """

    #: (n,): positions
    start: Index = refers("position", end=End.FROM)
    end: Index = refers("position", end=End.TO)
    #: (n,): antenna heights [m]
    height_start: Array = per_item(0.0)
    height_end: Array = per_item(0.0)
    #: (n,): scalars ``m``, -1 for none
    scale: Index = refers("scalar", optional=True, means="scale", unit="1")
    #: (n,): scalars: components of the rotation vector ``w`` [rad] about the axes of W, -1 for none
    turn_e: Index = refers("scalar", optional=True, means="turn of the GNSS frame", unit="rad")
    turn_n: Index = refers("scalar", optional=True, means="turn of the GNSS frame", unit="rad")
    turn_u: Index = refers("scalar", optional=True, means="turn of the GNSS frame", unit="rad")
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "gnss_baseline"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")
    facts: ClassVar[KindFacts] = KindFacts(
        title="GNSS baseline",
        computed="`X_b - X_a`, turned and scaled by unknowns if wanted; any number of them in one "
        "covariance matrix",
        role=Role.READING,
        category=Category.GNSS,
        repeats=Repetition.FINER,
        start=StartTie.VECTOR,
        csv=(
            CsvColumns(("from", "to"), ("de", "dn", "du"), planned=Planned.BY_NAME),
            CsvColumns(("from", "to"), ("dx", "dy", "dz")),
        ),
    )

    def _chord(self, state: State) -> Array:
        a, b = state.positions[self.start], state.positions[self.end]
        top_b = b + self.height_end[:, None] * self.site.axes(b)[:, 2]
        return top_b - a - self.height_start[:, None] * self.site.axes(a)[:, 2]

    def _turn(self, state: State) -> Array:
        """Rotation vectors ``w`` (n, 3)."""
        return np.stack([state.scalar(i) for i in (self.turn_e, self.turn_n, self.turn_u)], axis=1)

    def _frame(self, state: State) -> Array:
        """``(1 + m) exp(w)``, (n, 3, 3)."""
        return (1 + state.scalar(self.scale))[:, None, None] * exp(self._turn(state))

    def predict(self, state: State) -> Array:
        """Vectors (n, 3)."""
        vectors: Array = np.einsum("nij,nj->ni", self._frame(state), self._chord(state))
        return vectors

    def jacobian(self, state: State) -> list[Block]:
        """Plus the frame at the end, minus it at the start; the vector itself by the scale."""
        columns = state.layout.position_columns
        frame = self._frame(state)
        blocks = [
            Block(columns(self.end), frame @ self._by_mark(state, self.end, self.height_end)),
            Block(
                columns(self.start), -frame @ self._by_mark(state, self.start, self.height_start)
            ),
        ]
        turned = exp(self._turn(state)) @ self._chord(state)[:, :, None]
        blocks += self.if_any(state, "scalar", self.scale, turned)
        return blocks + self._by_turn(state)

    def _by_turn(self, state: State) -> list[Block]:
        """``-[y]x Jl(w)``, one column for each component that is unknown."""
        parts = (self.turn_e, self.turn_n, self.turn_u)
        if not any((index >= 0).any() for index in parts):
            return []
        left = np.linalg.inv(right_jacobian_inverse(self._turn(state)).transpose(0, 2, 1))
        by_w = -skew(self.predict(state)) @ left
        return [
            Block(state.layout.columns("scalar", index), by_w[:, :, [k]])
            for k, index in enumerate(parts)
        ]

    def _by_mark(self, state: State, index: Index, height: Array) -> Array:
        """Derivative (n, 3, 3) of an antenna by its mark: identity and the vertical's turn."""
        x = state.positions[index]
        up = self.site.axes(x)[:, 2]
        return np.eye(3) - height[:, None, None] * (skew(up) @ self.site.turn(x))

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Vectors from mark to mark."""
        value = self.values[rows].copy()
        # antenna heights along the mean vertical are near enough for a start
        value[:, 2] += self.height_start[rows] - self.height_end[rows]
        ties.add(Vectors(self.start[rows], self.end[rows], value))


@dataclass(kw_only=True)
class Antennas(Observations):
    """Positions [m] in the work frame of an antenna or prism on a scanner, ``y = t + R l + c``.

    The lever arm ``l`` is an unknown vector in the scanner frame with a prior from its calibration;
    ``c`` is the optional common shift of a GNSS session (method section 2.8).
    """

    station: Index = refers("pose", end=End.FROM)  #: (n,): poses
    lever_arm: Index = refers("vector", end=End.TO, means="lever arm")  #: (n,): vectors ``l``
    #: (n,): vectors ``c``, -1 for none
    common: Index = refers("vector", optional=True, means="common shift")
    kind: ClassVar[str] = "antenna"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")
    facts: ClassVar[KindFacts] = KindFacts(
        title="antenna",
        computed="`t + R l`, with the lever arm `l` of an antenna or prism on the scanner",
        role=Role.READING,
        category=Category.GNSS,
        repeats=Repetition.SETS,
        start=StartTie.FIX,
        csv=(CsvColumns(("gnss",), ("e", "n", "u")),),
        absolute=True,
        places_station=True,
    )

    def predict(self, state: State) -> Array:
        """Antenna positions (n, 3)."""
        arm = np.einsum("nij,nj->ni", state.pose_r[self.station], state.vectors[self.lever_arm])
        shift = np.where(self.common[:, None] >= 0, state.vectors[np.maximum(self.common, 0)], 0.0)
        antenna: Array = state.pose_t[self.station] + arm + shift
        return antenna

    def jacobian(self, state: State) -> list[Block]:
        """Identity and ``-[R l]x`` by the pose, R by the lever arm, identity by the shift."""
        layout = state.layout
        r = state.pose_r[self.station]
        arm = np.einsum("nij,nj->ni", r, state.vectors[self.lever_arm])
        eye = np.broadcast_to(np.eye(3), r.shape)
        return [
            Block(layout.columns("pose", self.station), np.concatenate([eye, -skew(arm)], axis=2)),
            Block(layout.columns("vector", self.lever_arm), r),
            *self.if_any(state, "vector", self.common, eye),
        ]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """An antenna is a target of its scanner with known coordinates."""
        nodes = ties.n_nodes + np.arange(len(rows))
        ties.n_nodes += len(rows)
        ties.add(Fixes(nodes, self.values[rows]))
        ties.add(ScannerShots(self.station[rows], nodes, ties.vectors[self.lever_arm[rows]]))


@dataclass(kw_only=True)
class MountedPoints(Observations):
    """Points mounted on a scanner, ``0 = X - t - R l`` [m]: an antenna or a prism of its own.

    What is measured to the point (vectors of a GNSS session, sights of a total station) then places
    the scanner through the lever arm ``l``, an unknown vector in the scanner frame (method section
    2.8). :class:`Antennas` is the same for positions. Values are zero; the covariance says how well
    the mounting repeats, along E, N, U of W.
    """

    station: Index = refers("pose", end=End.FROM)  #: (n,): poses
    point: Index = refers("position", end=End.TO)  #: (n,): positions ``X``
    lever_arm: Index = refers("vector", means="lever arm")  #: (n,): vectors ``l``
    kind: ClassVar[str] = "mounted_point"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")
    facts: ClassVar[KindFacts] = KindFacts(
        title="mounted point",
        computed="`X - t - R l`, observed as zero: a point on the scanner, for what is measured to "
        "the antenna itself",
        role=Role.CONDITION,
        category=Category.OTHER,
        start=StartTie.SHOT,
        places_station=True,
    )

    def _arm(self, state: State) -> Array:
        r, arm = state.pose_r[self.station], state.vectors[self.lever_arm]
        turned: Array = np.einsum("nij,nj->ni", r, arm)
        return turned

    def predict(self, state: State) -> Array:
        """Points relative to where their lever arms end, (n, 3)."""
        gap: Array = state.positions[self.point] - state.pose_t[self.station] - self._arm(state)
        return gap

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the point, its opposite and ``[R l]x`` by the pose, -R by the lever arm."""
        layout = state.layout
        r = state.pose_r[self.station]
        eye = np.broadcast_to(np.eye(3), r.shape)
        by_pose = np.concatenate([-eye, skew(self._arm(state))], axis=2)
        return [
            Block(layout.position_columns(self.point), eye),
            Block(layout.columns("pose", self.station), by_pose),
            Block(layout.columns("vector", self.lever_arm), -r),
        ]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """What is mounted on a scanner is a target of it."""
        arms = ties.vectors[self.lever_arm[rows]]
        ties.add(ScannerShots(self.station[rows], self.point[rows], arms))
