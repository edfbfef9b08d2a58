"""What is known of a station, or of a group of stations as if they were one: planes and views.

Metres and radians, in the frame of the station or of the group.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tribrach.geometry.pose import Pose
from tribrach.registration.plane_set import PlaneSet
from tribrach.registration.station_view import Agreement, StationView, agreement

__all__ = ["Surroundings", "merged", "seen"]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Planes and views of a station or of a group.

    name : of the station, of the first one of a group; planes : in its frame; views : what each
    scanner sees, and its pose in that frame; levelled : is the third axis plumb?
    """

    name: str
    planes: PlaneSet
    views: Sequence[tuple[Pose, StationView]]
    levelled: bool

    @classmethod
    def of(cls, name: str, planes: PlaneSet, view: StationView, levelled: bool) -> Surroundings:
        """Those of one station."""
        return cls(name, planes, ((Pose.identity(), view),), levelled)


def merged(stations: Mapping[str, Surroundings], poses: Mapping[str, Pose]) -> Surroundings:
    """Stations at poses, as one: in the frame of the poses, which is plumb if all stations are.

    poses : of some of the stations, the first of which gives the name.
    """
    mine = [(pose, stations[name]) for name, pose in poses.items()]
    return Surroundings(
        next(iter(poses)),
        PlaneSet.joined([s.planes.placed(pose) for pose, s in mine]),
        [(pose @ at, view) for pose, s in mine for at, view in s.views],
        all(s.levelled for _, s in mine),
    )


def seen(
    first: Surroundings, second: Surroundings, first_from_second: Pose
) -> tuple[Agreement, float, float]:
    """How the points of either stand in the views of the other; overlaps.

    The overlap is the share of points that the other sees, of the two views that share most: of
    the second's points, and of the first's.
    """
    total, there, back = Agreement(0, 0, 0, 0, 0), 0.0, 0.0
    for at, mine in first.views:
        for where, theirs in second.views:
            between = at.inverse @ first_from_second @ where
            forward = agreement(theirs, mine, between)
            backward = agreement(mine, theirs, between.inverse)
            total = total + forward + backward
            there, back = max(there, forward.overlap), max(back, backward.overlap)
    return total, there, back
