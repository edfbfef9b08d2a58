"""Staff readings of a level as a file has them, and the set-ups that they make.

A set-up is what was read to a backsight and a foresight in any order, once or twice: BF, BFFB,
aBFFB, FBBF. Intermediate sights belong to the set-up in which they were taken.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tribrach.errors import InputError

#: no staff is longer, and none is read from farther [m]
_STAFF, _FAR = 100.0, 1000.0


@dataclass(frozen=True)
class StaffReading:
    """One staff reading."""

    #: ``back``, ``fore`` or ``side`` (intermediate)
    kind: str
    point: str
    #: on the staff, and how far away it is [m]; NaN where the file does not say it
    value: float
    distance: float
    line: int  #: of the file, from 1
    #: height of the point that the instrument computed [m], NaN where the record has none
    height: float = math.nan


@dataclass
class LevelSetup:
    """Readings of one position of the level."""

    back: list[StaffReading] = field(default_factory=list)
    fore: list[StaffReading] = field(default_factory=list)
    side: list[StaffReading] = field(default_factory=list)

    @property
    def whole(self) -> bool:
        """True if it has a backsight and a foresight."""
        return bool(self.back and self.fore)

    def pairs(self) -> list[tuple[StaffReading, StaffReading]]:
        """Backsight and foresight in the order of reading; each pair is a height difference."""
        return list(zip(self.back, self.fore, strict=False))

    @property
    def length(self) -> float:
        """From backsight to foresight [m], NaN if a distance is not known."""
        back = np.mean([r.distance for r in self.back])
        return float(back + np.mean([r.distance for r in self.fore]))

    @property
    def difference(self) -> float:
        """Height of the foresight less that of the backsight [m], the mean of all readings."""
        fore = np.mean([r.value for r in self.fore])
        return float(np.mean([r.value for r in self.back]) - fore)


@dataclass(frozen=True)
class LevelLine:
    """Set-ups between a start and an end of a line."""

    setups: tuple[LevelSetup, ...]

    @property
    def start(self) -> str:
        """Name of the first point."""
        return next((r.point for setup in self.setups for r in setup.back), "")

    @property
    def end(self) -> str:
        """Name of the last point."""
        return next((r.point for setup in self.setups[::-1] for r in setup.fore), "")


@dataclass(frozen=True)
class LevelFile:
    """A file of a level as it was understood."""

    path: Path
    #: name of the format in words
    format: str
    lines: tuple[LevelLine, ...]
    given: dict[str, tuple[float, int]]  #: heights that were keyed in [m], with their lines
    problems: tuple[tuple[int, str], ...]  #: (line, sentence) of what cannot be used


def _problem(reading: StaffReading) -> str:
    """Reason why the reading is impossible for a level; "" if it is possible."""
    if not reading.point:
        return "the reading has no point"
    if not abs(reading.value) < _STAFF:
        return f"the staff reading is {reading.value:g} m"
    if not math.isnan(reading.distance) and not 0 <= reading.distance < _FAR:
        return f"the distance is {reading.distance:g} m"
    return ""


@dataclass
class LevelBook:
    """What the lines of a file hold, as they are read."""

    _done: list[LevelLine] = field(default_factory=list)
    _pending: list[StaffReading] = field(default_factory=list)
    computed: set[str] = field(default_factory=set)  #: points whose height the instrument computed
    #: as in :class:`LevelFile`
    given: dict[str, tuple[float, int]] = field(default_factory=dict)
    problems: list[tuple[int, str]] = field(default_factory=list)

    def add(self, reading: StaffReading) -> None:
        """Take a reading of the current line, or say why it is left out."""
        if problem := _problem(reading):
            self.problems.append((reading.line, problem))
            return
        self._pending.append(reading)
        if reading.kind != "back":
            self.computed.add(reading.point)

    def close(self) -> None:
        """End the line."""
        setups, lost = setups_of(self._pending)
        for one in lost:
            what = f"the {one.kind}sight to {one.point} has no other end"
            self.problems.append((one.line, what))
        if setups:
            self._done.append(LevelLine(tuple(setups)))
        self._pending.clear()

    def file(self, path: Path, name: str) -> LevelFile:
        """The whole file, of the format ``name``."""
        self.close()
        if not self._done:
            raise InputError(
                "the file of a level has no set-up with a backsight and a foresight",
                file=path,
                cure="give the whole file",
            )
        return LevelFile(path, name, tuple(self._done), self.given, tuple(self.problems))


def setups_of(readings: Sequence[StaffReading]) -> tuple[list[LevelSetup], list[StaffReading]]:
    """Set-ups of the readings of one line, and readings that belong to none.

    A reading opens a new set-up if it is a backsight to another point, or a foresight to another
    point whose backsight follows.
    """
    out: list[LevelSetup] = []
    current = LevelSetup()
    for k, reading in enumerate(readings):
        if reading.kind == "side":
            current.side.append(reading)
            continue
        own = current.back if reading.kind == "back" else current.fore
        if own and own[0].point != reading.point:
            following = readings[k + 1] if k + 1 < len(readings) else None
            branch = (
                reading.kind == "fore"
                and bool(current.back)
                and not (following is not None and following.kind == "back"
                         and following.point == own[0].point)
            )  # fmt: skip
            out.append(current)
            current = LevelSetup(back=list(current.back) if branch else [])
            own = current.back if reading.kind == "back" else current.fore
        own.append(reading)
    out.append(current)
    whole = [s for s in out if _usable(s)]
    lost = [r for s in out if s not in whole for r in (*s.back, *s.fore, *s.side)]
    return whole, lost


def _usable(setup: LevelSetup) -> bool:
    """True if a set-up has two ends, or a backsight and intermediate sights."""
    if setup.whole:
        return setup.back[0].point != setup.fore[0].point
    return bool(setup.back and setup.side)
