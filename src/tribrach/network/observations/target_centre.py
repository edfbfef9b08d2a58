"""Target centre in the scanner frame, ``u = (1 + m) R^T (X - t)``, with its full 3x3 covariance.

``m`` is an optional scale unknown of the scan: its EDM's scale, or that of another system in a
similarity transformation weighted on both sides. Method sections 2.0 and 2.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.geometry.rotation import skew
from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["TargetCentres"]


@dataclass(kw_only=True)
class TargetCentres(Observations):
    """Centres (n, 3) [m] of ``target`` (position indices) seen from ``station`` (pose indices).

    scale : scalar indices (n,), -1 for none.
    """

    station: Index = refers("pose")
    target: Index = refers("position")
    scale: Index = refers("scalar", optional=True)
    kind: ClassVar[str] = "target_centre"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("x", "y", "z")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Station and target."""
        poses = layout.names["pose"]
        return [
            (poses[i], layout.position_name(j))
            for i, j in zip(self.station, self.target, strict=True)
        ]

    def predict(self, state: State) -> Array:
        """Centres (n, 3) in the scanner frame."""
        chord = state.positions[self.target] - state.pose_t[self.station]
        u: Array = np.einsum("nji,nj->ni", state.pose_r[self.station], chord)
        return (1 + state.scalar(self.scale))[:, None] * u

    def jacobian(self, state: State) -> list[Block]:
        """``R^T`` by the point, ``-R^T`` and ``R^T [X - t]x`` by the pose, u by the scale."""
        layout = state.layout
        chord = state.positions[self.target] - state.pose_t[self.station]
        factor = (1 + state.scalar(self.scale))[:, None, None]
        scanner_from_world = factor * state.pose_r[self.station].transpose(0, 2, 1)
        by_pose = np.concatenate([-scanner_from_world, scanner_from_world @ skew(chord)], axis=2)
        blocks = [
            Block(layout.position_columns(self.target), scanner_from_world),
            Block(layout.columns("pose", self.station), by_pose),
        ]
        if (self.scale >= 0).any():
            by_scale = np.einsum("nji,nj->ni", state.pose_r[self.station], chord)
            blocks.append(Block(layout.columns("scalar", self.scale), by_scale[:, :, None]))
        return blocks
