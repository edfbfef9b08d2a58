"""One component of a station's rotation, fixed or weighted: ``a . log(R R0^T)``.

``a`` is a unit vector of the work frame and ``R0`` the rotation the component is measured from: a
known heading, a tilt taken as zero, a component fixed as a datum (method section 2.13).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geometry.rotation import log, right_jacobian_inverse, skew
from tribrach.observations.base import Block, Observations, refers
from tribrach.observations.unknowns import Layout, State

__all__ = ["RelativePoses", "RelativeRotations", "RelativeTranslations", "RotationComponents"]

# Relative pose of two stations, from cloud-to-cloud registration, with its 6x6 covariance.
#
# Residual ``[R_i^T (t_j - t_i) - t_ij ; log(R_ij^T R_i^T R_j)]``; the covariance is in that order:
# translation [m] in frame i, then a rotation vector [rad] applied on the right in frame j (method
# section 2.11).


@dataclass(kw_only=True)
class RelativePoses(Observations):
    """Poses of station ``end`` in the frame of ``start`` (pose indices).

    values (n, 6): translation t_ij [m] and zeros; rotation (n, 3, 3): measured R_ij, which the
    rotational values are relative to.
    """

    start: Index = refers("pose")
    end: Index = refers("pose")
    rotation: Array = field()
    kind: ClassVar[str] = "relative_pose"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m", "rad", "rad", "rad")
    components: ClassVar[tuple[str, ...]] = ("x", "y", "z", "about x", "about y", "about z")

    def __post_init__(self) -> None:
        super().__post_init__()
        self.rotation = np.asarray(self.rotation, dtype=float).reshape(-1, 3, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """From and to."""
        poses = layout.names["pose"]
        return [(poses[i], poses[j]) for i, j in zip(self.start, self.end, strict=True)]

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


# One component of the orientation of a station relative to another, fixed or weighted.
#
# ``a . R_i^T (t_j - t_i)`` and ``a . log(R0^T R_i^T R_j)`` with a unit vector ``a`` of the frame of
# station i: the elements of relative orientation of photogrammetry, which the base components and
# the mutual rotations are (method sections 2.11 and 2.13).


@dataclass(kw_only=True)
class RelativeTranslations(Observations):
    """Components [m] of the base from ``start`` to ``end`` (pose indices) in the frame of start.

    axis (n, 3) : unit vectors of that frame.
    """

    start: Index = refers("pose")
    end: Index = refers("pose")
    axis: Array = field()
    kind: ClassVar[str] = "relative_translation"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.axis = np.asarray(self.axis, dtype=float).reshape(-1, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """From and to."""
        poses = layout.names["pose"]
        return [(poses[i], poses[j]) for i, j in zip(self.start, self.end, strict=True)]

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
    """Components [rad] of the turn of ``end`` against ``start`` (pose indices), from a reference.

    axis (n, 3) : unit vectors of the frame of start; reference (n, 3, 3) : rotations that the
    components are measured from.
    """

    start: Index = refers("pose")
    end: Index = refers("pose")
    axis: Array = field()
    reference: Array = field()
    kind: ClassVar[str] = "relative_rotation"
    units: ClassVar[tuple[str, ...]] = ("rad",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.axis = np.asarray(self.axis, dtype=float).reshape(-1, 3)
        self.reference = np.asarray(self.reference, dtype=float).reshape(-1, 3, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """From and to."""
        poses = layout.names["pose"]
        return [(poses[i], poses[j]) for i, j in zip(self.start, self.end, strict=True)]

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
    """Components [rad] of the turn of ``station`` from a reference, along an axis.

    axis (n, 3) unit vectors of W, reference (n, 3, 3) rotations.
    """

    station: Index = refers("pose")
    axis: Array = field()
    reference: Array = field()
    kind: ClassVar[str] = "rotation_component"
    units: ClassVar[tuple[str, ...]] = ("rad",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.axis = np.asarray(self.axis, dtype=float).reshape(-1, 3)
        self.reference = np.asarray(self.reference, dtype=float).reshape(-1, 3, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The station."""
        return [(layout.names["pose"][i], "") for i in self.station]

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
