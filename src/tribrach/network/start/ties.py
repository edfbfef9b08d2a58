"""What the observations say about where things are, whatever their kind.

Start values need only a few sorts of ties, in which all kinds of observations are written:

=========  ===========================================================================
rays       a reading of a *set* towards a node: directions, angles, azimuths, and the
           target centres of levelled scanners. A set turns by one orientation
lengths    horizontal or slope distance between two nodes
rises      height of one node over another: levelling, zenith angle with a distance
zeniths    zenith angles without a distance: rises once the plan is known
vectors    difference of coordinates in the work frame: GNSS baselines
shots      a node's coordinates in a scanner frame
links      one scanner's pose in another's frame
faces      a plane in a scanner frame
fixes      coordinates, NaN where not observed
=========  ===========================================================================

A *node* is a position (points, then poses) or an antenna whose place is known. Metres, radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from tribrach._types import Array, Index, Mask

__all__ = [
    "Faces",
    "Fixes",
    "Lengths",
    "Links",
    "Rays",
    "Rises",
    "ScannerShots",
    "TieTable",
    "Ties",
    "Vectors",
    "Zeniths",
]


@dataclass(frozen=True)
class TieTable:
    """Columns of equal length."""

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    def __getitem__(self, rows: Mask | Index) -> Self:
        return replace(self, **{f.name: getattr(self, f.name)[rows] for f in fields(self)})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All rows of several tables; at least one part."""
        return cls(
            **{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)}
        )


@dataclass(frozen=True)
class Rays(TieTable):
    """``azimuth(start, end) = orientation[set] + reading`` clockwise from north."""

    set: Index
    start: Index
    end: Index
    reading: Array


@dataclass(frozen=True)
class Lengths(TieTable):
    """Distances with ``value^2 = plan^2 + (up_end - up_start + lift)^2``.

    flat : the horizontal distance where it is known by itself, NaN elsewhere; lift: height of
    target minus height of instrument.
    """

    start: Index
    end: Index
    value: Array
    flat: Array
    lift: Array


@dataclass(frozen=True)
class Rises(TieTable):
    """``up_end - up_start = value``."""

    start: Index
    end: Index
    value: Array


@dataclass(frozen=True)
class Zeniths(TieTable):
    """``up_end - up_start = plan distance * slope - lift``, slope the cotangent of the zenith."""

    start: Index
    end: Index
    slope: Array
    lift: Array


@dataclass(frozen=True)
class Vectors(TieTable):
    """``x_end - x_start = value`` (n, 3) in the work frame."""

    start: Index
    end: Index
    value: Array


@dataclass(frozen=True)
class ScannerShots(TieTable):
    """``x_target = R_pose u + t_pose`` with u (n, 3) in the scanner frame."""

    pose: Index
    target: Index
    u: Array


@dataclass(frozen=True)
class Links(TieTable):
    """``R_second = R_first turn``, ``t_second = t_first + R_first shift``."""

    first: Index
    second: Index
    shift: Array
    turn: Array


@dataclass(frozen=True)
class Faces(TieTable):
    """Plane ``normal . u = offset`` in a scanner frame."""

    pose: Index
    plane: Index
    normal: Array
    offset: Array


@dataclass(frozen=True)
class Fixes(TieTable):
    """Coordinates (n, 3) of nodes in the work frame, NaN where not observed."""

    node: Index
    xyz: Array


@dataclass(frozen=True)
class Ties:
    """All ties of a network.

    n_nodes = positions + antennas; n_positions; n_points; n_sets: scalars, then one per pose,
    then sets of angles, last the set of azimuths (``north``). ``set_node`` (n_sets,) is the node
    a set is measured from, -1 where there is none or more than one. ``levelling`` (S, 3, 3)
    turns scanner frames upright, NaN where the scanner is not levelled.
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
    set_node: Index

    @property
    def north(self) -> int:
        """The set of azimuths."""
        return self.n_sets - 1

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
