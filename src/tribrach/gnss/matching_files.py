"""Do the files of a baseline belong together: the same time, common satellites, their orbits?"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta

import numpy as np

from tribrach.errors import InputError
from tribrach.gnss.navigation_file import NavigationFile
from tribrach.gnss.observation_file import ObservationFile

__all__ = ["calendar", "check_together", "usable_systems"]

#: broadcast orbits are used up to this far from their time [s]
ORBIT_AGE = 14400.0
#: phases of fewer satellites give no position
FEWEST = 4


def calendar(seconds: float) -> str:
    """Date and time of seconds since 1980-01-06, in the same time system."""
    return f"{datetime(1980, 1, 6) + timedelta(seconds=round(seconds)):%Y-%m-%d %H:%M:%S}"


def check_together(
    base: ObservationFile, rover: ObservationFile, orbits: Sequence[NavigationFile]
) -> None:
    """Refuse files that cannot give a baseline.

    Raises
    ------
    InputError : no common time, fewer than four common satellites, no orbits for them.
    """
    if not orbits:
        raise InputError("there is no navigation file", cure="give the broadcast orbits of the day")
    start, end = max(base.times[0], rover.times[0]), min(base.times[-1], rover.times[-1])
    if end < start:
        raise InputError(
            f"{base.path.name} ({_span(base)}) and {rover.path.name} ({_span(rover)}) have no time "
            "in common",
            file=rover.path,
            cure="give files of the same session",
        )
    common = base.satellites & rover.satellites
    if len(common) < FEWEST:
        raise InputError(
            f"{base.path.name} and {rover.path.name} have {_count(len(common))} in common, and "
            f"{FEWEST} are needed",
            file=rover.path,
            cure="give files of the same session with the same satellite systems",
        )
    known: set[str] = set()
    for orbit in orbits:
        near = (orbit.times > start - ORBIT_AGE) & (orbit.times < end + ORBIT_AGE)
        known |= set(orbit.satellites[near])
    if len(known & common) < FEWEST:
        times = np.concatenate([orbit.times for orbit in orbits])
        raise InputError(
            f"the orbits ({calendar(times.min())} to {calendar(times.max())}) cover "
            f"{_count(len(known & common))} of the session that starts {calendar(start)}",
            file=orbits[0].path,
            cure="give the navigation file of the same day and systems",
        )


def usable_systems(
    base: ObservationFile,
    rover: ObservationFile,
    orbits: Sequence[NavigationFile],
    wanted: str,
) -> str:
    """Letters of the wanted satellite systems that all files have.

    Raises
    ------
    InputError : none of them.
    """
    of_orbits = {str(name)[0] for orbit in orbits for name in orbit.satellites}
    found = "".join(
        letter
        for letter in dict.fromkeys(wanted.upper())
        if letter in base.systems and letter in rover.systems and letter in of_orbits
    )
    if not found:
        raise InputError(
            f"the files have none of the satellite systems {wanted} in common",
            file=rover.path,
            cure="name others, such as GREC",
        )
    return found


def _span(file: ObservationFile) -> str:
    return f"{calendar(file.times[0])} to {calendar(file.times[-1])}"


def _count(n: int) -> str:
    return {0: "no satellite", 1: "one satellite"}.get(n, f"{n} satellites")
