"""Makes the units that are matched to known points as one rigid body.

A unit is one station, or several that planes or clouds join; their targets are then put together in
the frame of the unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tribrach._types import Array
from tribrach.geometry.pose import Pose

#: targets of one kind that stations of a unit see nearer to each other than this are one [m]; more
#: than registrations err by, less than targets are apart; chosen by hand, no source
_SAME_TARGET_M = 0.05


@dataclass(frozen=True, eq=False)
class Mounted:
    """An antenna or prism on a scanner whose place is known without the scan."""

    arm: Array  #: (3,), its lever arm in the scanner frame [m]
    xyz: Array  #: (3,), its place in the world [m]
    sigma_arm: float  #: sigma of one coordinate of the lever arm [m]
    sigma: float  #: sigma of one coordinate of the place [m]


@dataclass(frozen=True)
class Sighting:
    """The targets that one scan saw."""

    station: str  #: name of the station
    centers: Array  #: (n, 3), centres in the scanner frame [m]
    sigmas: Array  #: (n,), their sigmas [m]
    kinds: Sequence[str]  #: their kinds, such as ``sphere``
    levelled: bool = False  #: true if z is the plumb line
    #: names that the user gave, by number of the detection
    known: Mapping[int, str] = field(default_factory=dict)
    #: antennas on the scanner, which count as targets where those do not suffice
    mounted: tuple[Mounted, ...] = ()


@dataclass(frozen=True, eq=False)
class RigidUnit:
    """Stations that are matched as one."""

    sighting: Sighting  #: all their targets in the frame of the unit
    members: Mapping[str, Pose]  #: poses of the stations in that frame
    own: tuple[Sighting, ...]  #: what each station saw itself, in its scanner frame

    @property
    def name(self) -> str:
        """The names of the stations in words."""
        names = list(self.members)
        return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"

    def apart(self) -> list[RigidUnit]:
        """The stations as units of their own, those without targets left out."""
        return [_alone(s) for s in self.own]


def rigid_units(
    sightings: Sequence[Sighting], groups: Sequence[Mapping[str, Pose]]
) -> list[RigidUnit]:
    """Make the units of all sightings."""
    grouped = {name for group in groups for name in group}
    units = [_alone(s) for s in sightings if s.station not in grouped]
    by_name = {s.station: s for s in sightings}
    for group in groups:
        own = tuple(by_name[name] for name in group if name in by_name)
        if own:
            units.append(_joined(group, own))
    return sorted(units, key=lambda unit: -len(unit.sighting.centers))


def _alone(sighting: Sighting) -> RigidUnit:
    return RigidUnit(sighting, {sighting.station: Pose.identity()}, (sighting,))


def _joined(group: Mapping[str, Pose], own: tuple[Sighting, ...]) -> RigidUnit:
    """One sighting of several stations: a target that more than one sees counts once."""
    centers: list[Array] = []
    sigmas: list[float] = []
    kinds: list[str] = []
    known: dict[int, str] = {}
    for s in own:
        for k, center in enumerate(group[s.station] @ s.centers):
            same = [
                i
                for i, other in enumerate(centers)
                if kinds[i] == s.kinds[k] and np.linalg.norm(other - center) < _SAME_TARGET_M
            ]
            at = same[0] if same else len(centers)
            if not same:
                centers.append(center)
                sigmas.append(float(s.sigmas[k]))
                kinds.append(s.kinds[k])
            if k in s.known:
                known[at] = s.known[k]
    sighting = Sighting(
        station=own[0].station,
        centers=np.array(centers).reshape(-1, 3),
        sigmas=np.array(sigmas, dtype=float),
        kinds=kinds,
        levelled=all(s.levelled for s in own),
        known=known,
        mounted=tuple(replace(m, arm=group[s.station] @ m.arm) for s in own for m in s.mounted),
    )
    return RigidUnit(sighting, dict(group), own)
