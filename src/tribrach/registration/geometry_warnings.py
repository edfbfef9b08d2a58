"""Warnings on targets that stand badly around a scanner station, and on scans beyond them.

Angles at the station should be between 20 and 160 degrees, targets on more than one side, not all
on one line where no compensator levels the axis, and one more than needed (method section 5.3).
Where points reach beyond the hull of the targets, errors of the station are extrapolated (method
section 11.3). Metres and radians of the work frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Use
from tribrach.observations.declaration import End, Role
from tribrach.sentences import Sentence
from tribrach.units import DEG

#: targets within a smaller sector are as good as one, within the second on one side only
_NARROW, _ONE_SIDED = np.radians(20.0), np.radians(90.0)
_FLAT = np.radians(160.0)
#: spread across a line over that along it
_COLLINEAR = 0.1
#: a target counts as wide as this in the hull of all [m]
_BREADTH = 0.5


@dataclass(frozen=True)
class TargetsAround:
    """A scanner station and the targets it was tied to."""

    station: str  #: name of the station
    place: Array  #: (3,), its place in the work frame [m]
    names: tuple[str, ...]  #: names of the targets
    targets: Array  #: (k, 3), their places in the work frame [m]
    levelled: bool  #: true if an observed inclination holds the axis of the station

    @property
    def sector(self) -> float:
        """Smallest horizontal sector at the station that holds all targets [rad]."""
        if len(self.targets) < 2:
            return 0.0
        plan = (self.targets - self.place)[:, :2]
        azimuth = np.sort(np.arctan2(plan[:, 0], plan[:, 1]))
        gaps = np.diff(np.append(azimuth, azimuth[0] + 2 * np.pi))
        return float(2 * np.pi - gaps.max())

    @property
    def slenderness(self) -> float:
        """Spread of the targets across their best line over that along it; 0 on a line."""
        if len(self.targets) < 3:
            return 0.0
        values = np.linalg.svd(self.targets - self.targets.mean(axis=0), compute_uv=False)
        return float(values[1] / max(values[0], 1e-12))

    def sentences(self) -> list[str]:
        """Weaknesses of the geometry, each with its consequence."""
        count, needed = len(self.targets), 2 if self.levelled else 3
        if count == 0:
            return []
        sentences = []
        if count <= needed:
            sentences.append(
                f"station {self.station} is tied to {count} "
                f"target{'s' if count > 1 else ''} ({', '.join(self.names)}), no more than it "
                "takes: an error in one of them stays unseen"
            )
        degrees = np.degrees(self.sector)
        if count > 1 and self.sector < _NARROW:
            sentences.append(
                Sentence(
                    "the targets of station {own.station} lie within {degrees:°0} as seen from it: "
                    "its heading and its place across that direction are weak; {low:°0~} to "
                    "{high:°0} are better",
                    own=self,
                    degrees=degrees * DEG,
                    low=20 * DEG,
                    high=160 * DEG,
                )
            )
        elif count == 2 and self.sector > _FLAT:
            sentences.append(
                Sentence(
                    "station {own.station} stands almost on the line between its two targets "
                    "({degrees:°0}): its place rests on distances along that line; {low:°0~} to "
                    "{high:°0} are better",
                    own=self,
                    degrees=degrees * DEG,
                    low=20 * DEG,
                    high=160 * DEG,
                )
            )
        elif count > 2 and self.sector < _ONE_SIDED:
            sentences.append(
                Sentence(
                    "the targets of station {own.station} are on one side of it, within "
                    "{degrees:°0}: what was scanned on the other sides is extrapolated",
                    own=self,
                    degrees=degrees * DEG,
                )
            )
        if not self.levelled and count > 2 and self.slenderness < _COLLINEAR:
            sentences.append(
                f"the targets of station {self.station} lie almost on one line and its axis is "
                "not levelled: its turn about that line is weak"
            )
        return sentences


def geometry_sentences(adjustment: Adjustment) -> list[str]:
    """Warnings for all scanner stations that are tied to targets only."""
    return [text for one in targets_around(adjustment) for text in one.sentences()]


def targets_around(adjustment: Adjustment) -> list[TargetsAround]:
    """Every scanner station that is tied to targets only, with its targets.

    Stations that planes, other stations or antennas hold as well are left out. What a station is
    tied to follows from the declared ends of the observation kinds.
    """
    layout, positions = adjustment.layout, adjustment.state.positions
    points = layout.count("point")
    seen: list[set[int]] = [set() for _ in layout.names["pose"]]
    levelled: set[int] = set()
    otherwise: set[int] = set()
    for o in adjustment.network.observations:
        active = np.flatnonzero(o.use == Use.ACTIVE)
        first, second = o.end_field(End.FROM) or o.end_field(End.AT), o.end_field(End.TO)
        if first is None or first.family not in ("pose", "position"):
            continue
        start = np.asarray(getattr(o, first.name))[active]
        end = None if second is None else np.asarray(getattr(o, second.name))[active]
        if second is not None and end is not None and second.family == "position":
            stands = start if first.family == "pose" else start - points
            if o.facts.places_station:
                otherwise |= set(stands.tolist())
            elif o.facts.role is not Role.CONDITION:
                for station, target in zip(stands.tolist(), end.tolist(), strict=True):
                    if station >= 0:
                        seen[station].add(target)
        elif first.family == "pose" and o.facts.levels_station:
            levelled |= set(start.tolist())
        elif first.family == "pose":
            otherwise |= set(start.tolist())
            if second is not None and end is not None and second.family == "pose":
                otherwise |= set(end.tolist())
    names = [*layout.names["point"], *layout.names["pose"]]
    return [
        TargetsAround(
            station,
            positions[points + k],
            tuple(names[p] for p in sorted(seen[k])),
            positions[sorted(seen[k])].reshape(-1, 3),
            k in levelled,
        )
        for k, station in enumerate(layout.names["pose"])
        if k not in otherwise
    ]


def extrapolation_factor(
    targets: Array, station: Array, points: Array, share: float = 0.95
) -> float:
    """Factor by which the hull of targets and station must grow to hold a share of the points."""
    # networks without scanners ask for no hull, and would wait for scipy.spatial
    from scipy.spatial import ConvexHull, QhullError

    corners = np.concatenate([targets[:, :2], station[None, :2]])
    # targets have a breadth, so that those on one line have a hull too
    around = _BREADTH * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    corners = (corners[:, None, :] + around).reshape(-1, 2)
    try:
        hull = ConvexHull(corners)
    except QhullError:
        return float("inf")
    centre = corners[hull.vertices].mean(axis=0)
    normal, offset = hull.equations[:, :2], hull.equations[:, 2]
    inside = -(normal @ centre + offset)
    reach = ((points[:, :2] - centre) @ normal.T / inside).max(axis=1)
    return float(np.quantile(reach, share))
