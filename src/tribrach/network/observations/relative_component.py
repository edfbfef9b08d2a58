"""One component of the orientation of a station relative to another, fixed or weighted.

``a . R_i^T (t_j - t_i)`` and ``a . log(R0^T R_i^T R_j)`` with a unit vector ``a`` of the frame of
station i: the elements of relative orientation of photogrammetry, which the base components and
the mutual rotations are (method sections 2.11 and 2.13).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.geometry.rotation import log, right_jacobian_inverse, skew
from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["RelativeRotations", "RelativeTranslations"]


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
