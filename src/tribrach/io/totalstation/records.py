"""The content of a raw file of a total station, in columns and independent of its maker.

Readings stay as they were taken: both faces, circle readings without orientation, distances as the
file holds them with the corrections that are still to be applied. Metres and radians; NaN where
nothing was given.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index


@dataclass(frozen=True)
class Setups:
    """n set-ups of the instrument in the order of the file."""

    #: (n,), names, "" where the file gives none
    station: NDArray[Any]
    #: (n,), of the instrument [m]
    height: Array
    #: (n,), names
    backsight: NDArray[Any]
    #: (n,), of the backsight as it was set [rad]
    azimuth: Array
    #: (n,), reading at the backsight [rad]
    circle: Array
    #: (n,), of the file, from 1
    line: Index

    def __len__(self) -> int:
        return len(self.station)


@dataclass(frozen=True)
class RawSights:
    """n sights in the order of the file."""

    #: (n,), index of the set-up
    setup: Index
    #: (n,), names
    target: NDArray[Any]
    code: NDArray[Any]
    #: (n,), as read in their face [rad]
    direction: Array
    zenith: Array
    #: (n,), along the slope, as in the file [m]
    distance: Array
    #: (n,), 1 or 2
    face: NDArray[np.int8]
    #: (n,), of the target [m]
    height: Array
    #: (n,), prism constant [m]
    prism: Array
    #: (n,), atmospheric correction [1e-6]
    ppm: Array
    #: (n,), true if the distance contains both corrections
    applied: NDArray[np.bool_]
    #: (n,), of the air
    temperature_c: Array
    pressure_hpa: Array
    humidity_percent: Array
    #: (n,), number of the set if the file gives it, else 0
    series: Index
    #: (n,), why a sight is not used, "" if it is
    off: NDArray[Any]
    #: (n,), of the file, from 1
    line: Index

    def __len__(self) -> int:
        return len(self.target)


@dataclass(frozen=True)
class StoredPoints:
    """n coordinates of the file."""

    #: (n,), of the points
    name: NDArray[Any]
    #: (n, 3), E, N, U [m], NaN where not given
    xyz: Array
    #: (n,), true if they were keyed in or uploaded, False if the instrument computed them
    given: NDArray[np.bool_]
    #: (n,), codes or descriptions, "" without
    code: NDArray[Any]
    #: (n,), of the file, from 1
    line: Index

    def __len__(self) -> int:
        return len(self.name)


@dataclass(frozen=True)
class Problem:
    """A record that was left out."""

    #: of the file, from 1
    line: int
    #: what is wrong with it
    what: str


@dataclass(frozen=True)
class RawFile:
    """A raw file as it was understood."""

    #: of the file
    path: Path
    #: its name in words
    format: str
    #: as the file names it
    instrument: str
    #: the content
    setups: Setups
    shots: RawSights
    points: StoredPoints
    #: how many records or words there were, by kind
    understood: Mapping[str, int]
    unknown: Mapping[str, int]
    #: records of known kinds that cannot be right
    problems: tuple[Problem, ...]
    #: assumptions, in sentences
    notes: tuple[str, ...]
    #: what tells the file from others of the same name; empty takes its name
    label: str = ""

    @property
    def name(self) -> str:
        """Name of the file in sources, in names of unknowns and in reports."""
        return self.label or self.path.name

    @property
    def codes(self) -> tuple[tuple[str, str], ...]:
        """Names of points with their codes, in the order of coordinates and then of sights."""
        names = (*self.points.name.tolist(), *self.shots.target.tolist())
        codes = (*self.points.code.tolist(), *self.shots.code.tolist())
        return tuple((name, code) for name, code in zip(names, codes, strict=True) if code)

    def source(self, line: int) -> str:
        """``file:line`` of a record."""
        return f"{self.name}:{line}"

    def summary(self) -> str:
        """The content in one line."""
        parts = [f"{len(self.setups)} set-ups", f"{len(self.shots)} sights"]
        parts.append(f"{len(self.points)} coordinates")
        if self.unknown:
            words = ", ".join(f"{n} x {word}" for word, n in sorted(self.unknown.items()))
            parts.append(f"not understood: {words}")
        if self.problems:
            parts.append(f"{len(self.problems)} records left out")
        return f"{self.name} ({self.format}): {'; '.join(parts)}"
