"""Do reflectors of one name seen from two stations stand for the same reflector?

RiSCAN PRO links tie points by name, but numbers them anew at every scan position, so that a name
may mean two things. Distances between targets do not depend on the station: a reflector whose
distances to the others differ between two stations is not the same one there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tribrach.io.survey.riscan_records import ScanPosition

__all__ = ["SAME_TARGET", "identities"]

Array = NDArray[np.float64]

#: distances between the same two reflectors from two stations differ by less than this [m]
SAME_TARGET = 0.1


def identities(stations: Sequence[ScanPosition]) -> tuple[list[list[str]], list[str]]:
    """Names of the targets of each station, made different where they are; and warnings."""
    names: list[list[str]] = []
    places: list[dict[str, Array]] = []
    warnings: list[str] = []
    for station in stations:
        mine = {target.name: target.vector for target in station.targets}
        others: dict[str, str] = {}
        for earlier, place in zip(stations, places, strict=False):
            for name in _different(place, mine):
                others.setdefault(name, earlier.name)
        for name, earlier_name in others.items():
            warnings.append(
                f"reflector {name} of {station.name} is not that of {earlier_name}: its distances "
                f"to the others differ by more than {SAME_TARGET:g} m; it is called "
                f"{name}@{station.name}"
            )
        own = [f"{t.name}@{station.name}" if t.name in others else t.name for t in station.targets]
        names.append(own)
        places.append({n: t.vector for n, t in zip(own, station.targets, strict=True)})
    return names, warnings


def _different(a: dict[str, Array], b: dict[str, Array]) -> list[str]:
    """Common names whose distances to most other common names disagree."""
    common = [name for name in b if name in a]
    if len(common) < 2:
        return []
    gap = np.abs(_distances(a, common) - _distances(b, common))
    np.fill_diagonal(gap, np.nan)
    middle = np.nanmedian(gap, axis=1)
    return [name for name, value in zip(common, middle, strict=True) if value > SAME_TARGET]


def _distances(places: dict[str, Array], names: Sequence[str]) -> Array:
    xyz = np.array([places[name] for name in names])
    out: Array = np.linalg.norm(xyz[:, None] - xyz[None], axis=2)
    return out
