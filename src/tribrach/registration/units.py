"""What is matched as one: targets of a station, or of several with known relative poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tribrach._types import Array
from tribrach.geometry.pose import Pose

__all__ = ["Mounted", "Sighting", "Unit", "units_of"]


#: targets of one kind that stations of a unit see nearer to each other than this are one [m]
_SAME = 0.05


@dataclass(frozen=True, eq=False)
class Mounted:
    """An antenna or prism on a scanner whose place is known without the scan.

    arm (3,) : its lever arm in the scanner frame; xyz (3,) : where it is in the world; sigma_arm,
    sigma : of one coordinate of either. All in metres.
    """

    arm: Array
    xyz: Array
    sigma_arm: float
    sigma: float


@dataclass(frozen=True)
class Sighting:
    """What one scan saw.

    centers (n, 3) scanner frame; sigmas (n,) [m]; kinds (n,) such as ``sphere``; levelled : z is
    the plumb line; known : names that the user gave, by detection number; mounted : antennas on
    the scanner, which count as targets where those do not suffice.
    """

    station: str
    centers: Array
    sigmas: Array
    kinds: Sequence[str]
    levelled: bool = False
    known: Mapping[int, str] = field(default_factory=dict)
    mounted: tuple[Mounted, ...] = ()


@dataclass(frozen=True, eq=False)
class Unit:
    """Stations that are matched as one.

    sighting : all their targets in the frame of the unit; members : station to pose in that frame;
    own : what each station saw itself, in its scanner frame.
    """

    sighting: Sighting
    members: Mapping[str, Pose]
    own: tuple[Sighting, ...]

    @property
    def name(self) -> str:
        """The stations in words."""
        names = list(self.members)
        return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"

    def apart(self) -> list[Unit]:
        """Its stations one by one, those without targets left out."""
        return [_alone(s) for s in self.own]


def units_of(sightings: Sequence[Sighting], groups: Sequence[Mapping[str, Pose]]) -> list[Unit]:
    """Units of all sightings, those with most targets first."""
    grouped = {name for group in groups for name in group}
    units = [_alone(s) for s in sightings if s.station not in grouped]
    by_name = {s.station: s for s in sightings}
    for group in groups:
        own = tuple(by_name[name] for name in group if name in by_name)
        if own:
            units.append(_joined(group, own))
    return sorted(units, key=lambda unit: -len(unit.sighting.centers))


def _alone(sighting: Sighting) -> Unit:
    return Unit(sighting, {sighting.station: Pose.identity()}, (sighting,))


def _joined(group: Mapping[str, Pose], own: tuple[Sighting, ...]) -> Unit:
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
                if kinds[i] == s.kinds[k] and np.linalg.norm(other - center) < _SAME
            ]
            at = same[0] if same else len(centers)
            if not same:
                centers.append(center)
                sigmas.append(float(s.sigmas[k]))
                kinds.append(s.kinds[k])
            if k in s.known:
                known[at] = s.known[k]
    sighting = Sighting(
        own[0].station,
        np.array(centers).reshape(-1, 3),
        np.array(sigmas, dtype=float),
        kinds,
        all(s.levelled for s in own),
        known,
        tuple(replace(m, arm=group[s.station] @ m.arm) for s in own for m in s.mounted),
    )
    return Unit(sighting, dict(group), own)
