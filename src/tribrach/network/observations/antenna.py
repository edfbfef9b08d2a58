"""Antenna (or prism) on the scanner, ``y = t + R l + c`` with the lever arm ``l`` as an unknown.

The lever arm is a vector in the scanner frame with a prior from its calibration; ``c`` is the
optional common shift of a GNSS session (method section 2.8).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.geometry.rotation import skew
from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["Antennas"]


@dataclass(kw_only=True)
class Antennas(Observations):
    """Positions (n, 3) [m] in W of the antenna on ``station`` (pose indices).

    lever_arm : vector indices (n,); common : vector indices (n,) of a session's shift, -1 none.
    """

    station: Index = refers("pose")
    lever_arm: Index = refers("vector")
    common: Index = refers("vector", optional=True)
    kind: ClassVar[str] = "antenna"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The station and its lever arm."""
        poses, vectors = layout.names["pose"], layout.names["vector"]
        return [(poses[i], vectors[j]) for i, j in zip(self.station, self.lever_arm, strict=True)]

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
        blocks = [
            Block(layout.columns("pose", self.station), np.concatenate([eye, -skew(arm)], axis=2)),
            Block(layout.columns("vector", self.lever_arm), r),
        ]
        if (self.common >= 0).any():
            blocks.append(Block(layout.columns("vector", self.common), eye))
        return blocks
