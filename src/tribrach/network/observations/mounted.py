"""A point that is mounted on a scanner, ``0 = X - t - R l``: an antenna or a prism of its own.

What is measured to the point (vectors of a GNSS session, sights of a total station) then places the
scanner through the lever arm ``l``, an unknown vector in the scanner frame (method section 2.8).
:class:`~tribrach.network.observations.antenna.Antennas` is the same for positions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.geometry.rotation import skew
from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["MountedPoints"]


@dataclass(kw_only=True)
class MountedPoints(Observations):
    """Zeros (n, 3) [m]; the covariance says how well the mounting repeats, along E, N, U of W.

    station : pose indices (n,); point : position indices (n,); lever_arm : vector indices (n,).
    """

    station: Index = refers("pose")
    point: Index = refers("position")
    lever_arm: Index = refers("vector")
    kind: ClassVar[str] = "mounted_point"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The station and the point on it."""
        poses = layout.names["pose"]
        return [
            (poses[i], layout.position_name(j))
            for i, j in zip(self.station, self.point, strict=True)
        ]

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
