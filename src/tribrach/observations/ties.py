"""What observations say about where things are, whatever their kind: the basis of start values.

Start values need only a few sorts of ties, in which every kind writes its observations
(:meth:`~tribrach.observations.base.Observations.start_ties`):

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
from typing import Any, Self

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.geodesy.site import Site
from tribrach.observations.unknowns import State


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


class TieCollector:
    """Ties while the observations of a network are read, one kind after another.

    ``start``: given values of the unknowns, NaN where they are not known; ``vectors`` (V, 3): lever
    arms and other vectors [m]; ``n_points``, ``n_poses``, ``n_nodes``, ``n_scalars``, ``n_sets``:
    how many there are so far; whoever needs a node or a set of readings takes the next number;
    ``levelling`` (S, 3, 3): turns scanner frames upright, NaN where a scanner is not levelled;
    ``heading`` (S,): azimuths of their second axes [rad], NaN where no compass tells.
    """

    def __init__(self, start: State, site: Site, vectors: Array) -> None:
        layout = start.layout
        self.start = start
        self.site = site
        self.vectors = vectors
        self.n_points = layout.count("point")
        self.n_poses = layout.count("pose")
        self.n_planes = layout.count("plane")
        self.n_nodes = self.n_points + self.n_poses
        self.n_scalars = layout.count("scalar")
        self.n_sets = self.n_scalars + self.n_poses
        self.levelling = np.full((self.n_poses, 3, 3), np.nan)
        self.heading = np.full(self.n_poses, np.nan)
        self.north: list[tuple[Index, Index, Array]] = []
        self.in_frames: list[tuple[Index, Index, Index, Array, Array]] = []
        index, number, triple = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 3))
        self.parts: dict[type[TieTable], list[Any]] = {
            Rays: [Rays(index, index, index, number)],
            Lengths: [Lengths(index, index, number, number, number)],
            Rises: [Rises(index, index, number)],
            Zeniths: [Zeniths(index, index, number, number)],
            Vectors: [Vectors(index, index, triple)],
            ScannerShots: [ScannerShots(index, index, triple)],
            Links: [Links(index, index, triple, np.zeros((0, 3, 3)))],
            Faces: [Faces(index, index, triple, number)],
            Fixes: [Fixes(index, triple)],
        }

    def add(self, part: TieTable) -> None:
        """Append rows of one kind of tie."""
        self.parts[type(part)].append(part)

    def add_azimuths(self, start: Index, end: Index, azimuth: Array) -> None:
        """Azimuths (n,) [rad] between nodes; all of them are one set, which looks north."""
        self.north.append((start, end, azimuth))

    def add_in_frame(
        self, station: Index, target: Index, component: Index, value: Array, lift: Array
    ) -> None:
        """Single values (n,) of targets in the frames of stations; three of them make a shot.

        component : 0, 1, 2 for x, y, z, 3 for the angle from x towards y, 4 for the elevation, 5
        for the distance; lift : height of the target over its mark [m].
        """
        self.in_frames.append((station, target, component, value, lift))

    def table(self, kind: type[Any]) -> Any:
        """All parts of a table."""
        return kind.joined(self.parts[kind])


def xyz_of_polar(r: Array, around: Array, elevation: Array) -> Array:
    """Points (n, 3) at distances r, angles from x towards y, and elevations (n,)."""
    flat = r * np.cos(elevation)
    return np.stack([flat * np.cos(around), flat * np.sin(around), r * np.sin(elevation)], axis=1)
