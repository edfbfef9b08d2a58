"""Checks that the files of a baseline belong together: time, satellites and orbits.

Precise orbits take the place of the broadcast ones; these are still needed for the times at which
signals were sent. Times are seconds since 1980-01-06.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Annotated

import numpy as np

from tribrach.answers import Written
from tribrach.errors import InputError
from tribrach.io.gnss.navigation_file import NavigationFile
from tribrach.io.gnss.observation_file import RinexObservations
from tribrach.io.gnss.precise_file import PreciseOrbits

#: broadcast orbits are used up to this far from their time [s]
ORBIT_AGE = 14400.0
#: names of the satellite systems
_NAMES = {
    "G": "GPS",
    "R": "GLONASS",
    "E": "Galileo",
    "C": "BeiDou",
    "J": "QZSS",
    "I": "NavIC",
    "S": "SBAS",
}
#: phases of fewer satellites give no position
FEWEST = 4
#: epochs that the engine's polynomials go through, and their largest step [s]
EPOCHS, STEP = 11, 901.0


def calendar(seconds: float) -> str:
    """Date and time, as text, of seconds since 1980-01-06 in the same time system."""
    return f"{datetime(1980, 1, 6) + timedelta(seconds=round(seconds)):%Y-%m-%d %H:%M:%S}"


#: seconds since 1980-01-06, written as date and time
Calendar = Annotated[float, Written(calendar)]


def check_together(
    base: RinexObservations, rover: RinexObservations, orbits: Sequence[NavigationFile]
) -> None:
    """Refuse files that cannot give a baseline."""
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
    base: RinexObservations,
    rover: RinexObservations,
    orbits: Sequence[NavigationFile],
    wanted: str,
) -> str:
    """Letters of the ``wanted`` satellite systems, in order of preference, that all files have."""
    of_orbits = {str(name)[0] for orbit in orbits for name in orbit.satellites}
    systems = "".join(
        letter
        for letter in dict.fromkeys(wanted.upper())
        if letter in base.systems and letter in rover.systems and letter in of_orbits
    )
    if not systems:
        raise InputError(
            f"the files have none of the satellite systems {wanted} in common",
            file=rover.path,
            cure="name others, such as GREC",
        )
    return systems


def idle_systems(
    base: RinexObservations,
    rover: RinexObservations,
    orbits: Sequence[NavigationFile],
    wanted: str,
    used: Sequence[str],
) -> list[str]:
    """Why ``wanted`` satellite systems that observations hold took no part: name and reason."""
    start, end = max(base.times[0], rover.times[0]), min(base.times[-1], rover.times[-1])
    present = sorted(base.systems | rover.systems, key=lambda s: (list(_NAMES).index(s), s))
    out = []
    for letter in present:
        if any(name[0] == letter for name in used):
            continue
        common = {name for name in base.satellites & rover.satellites if name[0] == letter}
        known: set[str] = set()
        for orbit in orbits:
            near = (orbit.times > start - ORBIT_AGE) & (orbit.times < end + ORBIT_AGE)
            known |= set(orbit.satellites[near].tolist()) & common
        if letter not in wanted.upper():
            why = f"not among the systems asked for ({wanted.upper()})"
        elif letter not in rover.systems or letter not in base.systems:
            only = base if letter in base.systems else rover
            why = f"only in {only.path.name}"
        elif not common:
            why = "the receivers have no satellite of it in common"
        elif not known:
            names = ", ".join(sorted(common))
            why = f"no navigation message for {names} at the time of the session"
        elif len(known) < 2:
            why = f"{_count(len(known))} with orbits, and differences need two"
        else:
            why = (
                f"the engine used none of {len(known)} satellites: below the elevation mask, "
                "unhealthy, without accuracy of their orbits, or without the phases it takes"
            )
        out.append(f"{_NAMES[letter]} ({letter}): {why}")
    return out


def _span(file: RinexObservations) -> str:
    """First and last epoch of a file as text."""
    return f"{calendar(file.times[0])} to {calendar(file.times[-1])}"


def _count(n: int) -> str:
    """A number of satellites in words."""
    return {0: "no satellite", 1: "one satellite"}.get(n, f"{n} satellites")


def check_precise(orbits: PreciseOrbits, base: RinexObservations, rover: RinexObservations) -> None:
    """Refuse precise orbits that do not cover the common time of two receivers."""
    start, end = max(base.times[0], rover.times[0]), min(base.times[-1], rover.times[-1])
    first, last = float(orbits.times[0]), float(orbits.times[-1])
    if len(orbits.times) < EPOCHS:
        raise InputError(
            f"{len(orbits.times)} epochs of precise orbits are too few to interpolate: "
            f"{EPOCHS} are needed",
            file=orbits.path,
            cure="give a whole file",
        )
    if start < first or end > last:
        raise InputError(
            f"the precise orbits ({calendar(first)} to {calendar(last)}) do not cover the session "
            f"({calendar(start)} to {calendar(end)})",
            file=orbits.path,
            cure="give the file of the day, and those of the days before and after where it is "
            "near midnight",
        )
    low, high = np.searchsorted(orbits.times, [start, end])
    around = orbits.times[max(int(low) - EPOCHS // 2, 0) : int(high) + EPOCHS // 2 + 1]
    widest = float(np.diff(around).max())
    if widest > STEP:
        raise InputError(
            f"the precise orbits have epochs {widest / 60:.0f} minutes apart, too far to "
            "interpolate",
            file=orbits.path,
            cure="give orbits every 15 minutes or less",
        )
    there = np.isfinite(orbits.xyz[max(int(low) - 1, 0) : int(high) + 1, :, 0])
    known = {orbits.satellites[k] for k in np.flatnonzero(there.all(axis=0))}
    common = base.satellites & rover.satellites & known
    if len(common) < FEWEST:
        count = {0: "none", 1: "one"}.get(len(common), str(len(common)))
        raise InputError(
            f"the precise orbits have {count} of the satellites that both receivers observed, and "
            f"{FEWEST} are needed",
            file=orbits.path,
            cure="give orbits of the same satellite systems",
        )
