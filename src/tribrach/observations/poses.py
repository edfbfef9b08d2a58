"""Poses of scanner stations: relative ones from registration, and single known components."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geometry.rotation import log, right_jacobian_inverse, skew
from tribrach.observations.base import Block, Observations, refers
from tribrach.observations.declaration import (
    SCANNED,
    Category,
    End,
    KindFacts,
    Role,
    StartTie,
    shaped,
)
from tribrach.observations.ties import Links, TieCollector
from tribrach.observations.unknowns import State


@dataclass(kw_only=True)
class RelativePoses(Observations):
    """Relative poses of two stations, from cloud-to-cloud registration, with 6x6 covariances.

    Residual ``[R_i^T (t_j - t_i) - t_ij ; log(R_ij^T R_i^T R_j)]``; the covariance is in that
    order: translation [m] in frame i, then a rotation vector [rad] applied on the right in frame j
    (method section 2.11). Values (n, 6) are the translation t_ij [m] and three zeros.
    """

    #: (n,): poses i and j
    start: Index = refers("pose", end=End.FROM)
    end: Index = refers("pose", end=End.TO)
    #: (n, 3, 3): measured R_ij, which the rotational values are relative to
    rotation: Array = shaped(3, 3)
    kind: ClassVar[str] = "relative_pose"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m", "rad", "rad", "rad")
    components: ClassVar[tuple[str, ...]] = ("x", "y", "z", "about x", "about y", "about z")
    facts: ClassVar[KindFacts] = replace(
        SCANNED,
        title="relative pose",
        computed="pose of a station in the frame of another, with its 6 by 6 covariance",
        start=StartTie.LINK,
        common_to_stations="clouds",
    )

    def _turn(self, state: State) -> Array:
        """Rotation vectors (n, 3) from measured to computed."""
        computed = state.pose_r[self.start].transpose(0, 2, 1) @ state.pose_r[self.end]
        return log(self.rotation.transpose(0, 2, 1) @ computed)

    def predict(self, state: State) -> Array:
        """Translation in frame i, and the turn relative to the measured rotation, (n, 6)."""
        chord = state.pose_t[self.end] - state.pose_t[self.start]
        t = np.einsum("nji,nj->ni", state.pose_r[self.start], chord)
        return np.concatenate([t, self._turn(state)], axis=1)

    def jacobian(self, state: State) -> list[Block]:
        """By both poses."""
        layout = state.layout
        back_i = state.pose_r[self.start].transpose(0, 2, 1)
        back_j = state.pose_r[self.end].transpose(0, 2, 1)
        chord = state.pose_t[self.end] - state.pose_t[self.start]
        turn = right_jacobian_inverse(self._turn(state)) @ back_j
        by_i, by_j = np.zeros((len(self), 6, 6)), np.zeros((len(self), 6, 6))
        by_i[:, :3, :3], by_j[:, :3, :3] = -back_i, back_i
        by_i[:, :3, 3:] = back_i @ skew(chord)
        by_i[:, 3:, 3:], by_j[:, 3:, 3:] = -turn, turn
        return [
            Block(layout.columns("pose", self.start), by_i),
            Block(layout.columns("pose", self.end), by_j),
        ]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Links."""
        ends = self.start[rows], self.end[rows]
        ties.add(Links(*ends, self.values[rows, :3], self.rotation[rows]))


@dataclass(kw_only=True)
class RelativeTranslations(Observations):
    """Single components ``a . R_i^T (t_j - t_i)`` [m] of the base between two stations.

    With :class:`RelativeRotations` the elements of relative orientation of photogrammetry, fixed or
    weighted (method sections 2.11 and 2.13).
    """

    #: (n,): poses i and j
    start: Index = refers("pose", end=End.FROM)
    end: Index = refers("pose", end=End.TO)
    axis: Array = shaped(3)  #: (n, 3): unit vectors ``a`` of the frame of station i
    kind: ClassVar[str] = "relative_translation"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="relative translation",
        computed="one component of the base between two stations",
        role=Role.GIVEN,
        category=Category.OTHER,
    )

    def predict(self, state: State) -> Array:
        """Components (n, 1)."""
        along = np.einsum("nij,nj->ni", state.pose_r[self.start], self.axis)
        chord = state.pose_t[self.end] - state.pose_t[self.start]
        values: Array = np.einsum("ni,ni->n", along, chord)
        return values[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """By both translations and by the rotation of the first station."""
        along = np.einsum("nij,nj->ni", state.pose_r[self.start], self.axis)[:, None, :]
        chord = state.pose_t[self.end] - state.pose_t[self.start]
        layout = state.layout
        by_start = np.concatenate([-along, along @ skew(chord)], axis=2)
        return [
            Block(layout.columns("pose", self.start), by_start),
            Block(layout.columns("pose", self.end)[:, :3], along),
        ]


@dataclass(kw_only=True)
class RelativeRotations(Observations):
    """Single components ``a . log(R_i^T R_j R_0^T)`` [rad] of the turn between two stations.

    The turn of station j against station i is taken from a reference ``R_0``; the component is
    along ``a`` in the frame of station i (method section 2.13).
    """

    #: (n,): poses i and j
    start: Index = refers("pose", end=End.FROM)
    end: Index = refers("pose", end=End.TO)
    axis: Array = shaped(3)  #: (n, 3): unit vectors ``a`` of the frame of station i
    #: (n, 3, 3): rotations ``R_0`` of j against i that the components are measured from
    reference: Array = shaped(3, 3)
    kind: ClassVar[str] = "relative_rotation"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="relative rotation",
        computed="one component of the turn between two stations, from a reference",
        role=Role.GIVEN,
        category=Category.OTHER,
    )

    def _turn(self, state: State) -> Array:
        between = state.pose_r[self.start].transpose(0, 2, 1) @ state.pose_r[self.end]
        return log(between @ self.reference.transpose(0, 2, 1))

    def predict(self, state: State) -> Array:
        """Components (n, 1)."""
        values: Array = np.einsum("ni,ni->n", self.axis, self._turn(state))
        return values[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``a^T Jl^-1 R_i^T`` by the second rotation, the opposite by the first."""
        left = right_jacobian_inverse(self._turn(state)).transpose(0, 2, 1)
        back = state.pose_r[self.start].transpose(0, 2, 1)
        by_end = self.axis[:, None, :] @ left @ back
        layout = state.layout
        return [
            Block(layout.columns("pose", self.start)[:, 3:], -by_end),
            Block(layout.columns("pose", self.end)[:, 3:], by_end),
        ]


@dataclass(kw_only=True)
class RotationComponents(Observations):
    """Single components ``a . log(R R_0^T)`` [rad] of a station's rotation, fixed or weighted.

    A known heading, a tilt taken as zero, a component fixed as a datum (method section 2.13).
    """

    station: Index = refers("pose", end=End.AT)  #: (n,): poses
    axis: Array = shaped(3)  #: (n, 3): unit vectors ``a`` of the work frame
    #: (n, 3, 3): rotations ``R_0`` that the components are measured from
    reference: Array = shaped(3, 3)
    kind: ClassVar[str] = "rotation_component"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="rotation component",
        computed="one component of a station's rotation, known or weighted",
        role=Role.GIVEN,
        category=Category.OTHER,
    )

    def _turn(self, state: State) -> Array:
        turn: Array = log(state.pose_r[self.station] @ self.reference.transpose(0, 2, 1))
        return turn

    def predict(self, state: State) -> Array:
        """Components (n, 1)."""
        values: Array = np.einsum("ni,ni->n", self.axis, self._turn(state))
        return values[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``a^T Jl^-1`` by the rotation."""
        left = right_jacobian_inverse(self._turn(state)).transpose(0, 2, 1)
        columns = state.layout.columns("pose", self.station)[:, 3:]
        return [Block(columns, self.axis[:, None, :] @ left)]
