"""Relative pose of two stations, from cloud-to-cloud registration, with its 6x6 covariance.

Residual ``[R_i^T (t_j - t_i) - t_ij ; log(R_ij^T R_i^T R_j)]``; the covariance is in that order:
translation [m] in frame i, then a rotation vector [rad] applied on the right in frame j (method
section 2.11).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.geometry.rotation import log, right_jacobian_inverse, skew
from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["RelativePoses"]


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
