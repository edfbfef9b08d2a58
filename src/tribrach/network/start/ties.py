"""All that the observations of a network say about where things are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.observations.ties import (
    Faces,
    Fixes,
    Lengths,
    Links,
    Rays,
    Rises,
    ScannerShots,
    Vectors,
    Zeniths,
)


@dataclass(frozen=True)
class Ties:
    """All ties of a network.

    n_nodes = positions + antennas; n_positions; n_points; n_sets: scalars, then one per pose,
    then sets of angles, last the set of azimuths (``north``). ``set_node`` (n_sets,) is the node
    a set is measured from, -1 where there is none or more than one. ``levelling`` (S, 3, 3)
    turns scanner frames upright, NaN where the scanner is not levelled; ``heading`` (S,) are
    azimuths of their second axes [rad], NaN where no compass tells.
    """

    n_points: int
    n_positions: int
    n_nodes: int
    n_sets: int
    n_scalars: int
    rays: Rays
    lengths: Lengths
    rises: Rises
    zeniths: Zeniths
    vectors: Vectors
    shots: ScannerShots
    links: Links
    faces: Faces
    fixes: Fixes
    levelling: Array
    heading: Array
    set_node: Index

    @property
    def north(self) -> int:
        """The set of azimuths."""
        return self.n_sets - 1

    @cached_property
    def tied(self) -> Mask:
        """Nodes (n_nodes,) that a tie mentions; others are placed by kinds that give no ties."""
        both = (self.rays, self.lengths, self.rises, self.zeniths, self.vectors)
        nodes = [
            *(part.start for part in both),
            *(part.end for part in both),
            self.shots.target,
            self.fixes.node,
            np.arange(self.n_points, self.n_positions),
        ]
        out = np.zeros(self.n_nodes, dtype=bool)
        out[np.concatenate(nodes)] = True
        return out

    @property
    def levelled(self) -> Mask:
        """Poses (S,) that are levelled."""
        return np.isfinite(self.levelling[:, 0, 0])

    def pose_node(self, pose: Index) -> Index:
        """Nodes of poses."""
        return self.n_points + pose

    def pose_set(self, pose: Index) -> Index:
        """Sets of poses."""
        return self.n_scalars + pose
