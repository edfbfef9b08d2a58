"""Files of orbits for a baseline: broadcast ones (RINEX) and precise ones (SP3).

Precise orbits take the place of the broadcast ones; these are still needed for the times at which
signals were sent. Satellite clocks cancel in the differences of a baseline, so files of clocks
have nothing to add.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.gnss.galileo_records import galileo_records
from tribrach.io.gnss.navigation_file import NavigationFile, read_navigation
from tribrach.io.gnss.precise_file import PreciseOrbits, is_sp3, joined, read_sp3
from tribrach.io.unpacking import unpacked_bytes


@dataclass(frozen=True, eq=False)
class Orbits:
    """Orbits of a baseline."""

    #: one entry for each navigation file
    broadcast: tuple[NavigationFile, ...]
    #: precise orbits of all SP3 files together, None without any
    precise: PreciseOrbits | None = None
    #: names of the SP3 files
    names: tuple[str, ...] = ()
    #: galileo satellites whose accuracy is beyond the scale of the signal
    coarse: tuple[str, ...] = ()
    #: the largest that they state [m]
    accuracy: float = 0.0

    def for_engine(self) -> Orbits:
        """The same with Galileo records as the engine takes them."""
        records = [galileo_records(file.text) for file in self.broadcast]
        return replace(
            self,
            broadcast=tuple(
                replace(file, text=own.text)
                for file, own in zip(self.broadcast, records, strict=True)
            ),
            coarse=tuple(sorted({name for own in records for name in own.coarse})),
            accuracy=max((own.accuracy for own in records), default=0.0),
        )


def read_orbits(paths: Sequence[Path]) -> Orbits:
    """Read navigation files and SP3 files, told apart by their content."""
    broadcast: list[NavigationFile] = []
    precise: list[PreciseOrbits] = []
    for path in paths:
        data = unpacked_bytes(path)
        if is_sp3(data):
            precise.append(read_sp3(path, data))
        elif b"CLOCK DATA" in data[:60]:
            raise InputError(
                "this is a file of satellite clocks, which cancel in a baseline",
                file=path,
                cure="leave it out",
            )
        else:
            broadcast.append(read_navigation(path))
    if precise and not broadcast:
        raise InputError(
            "precise orbits alone do not suffice: broadcast ones give the times of transmission",
            file=precise[0].path,
            cure="give the navigation file of the day as well",
        )
    if not precise:
        return Orbits(tuple(broadcast))
    names = tuple(file.path.name for file in precise)
    return Orbits(tuple(broadcast), joined(precise), names)
