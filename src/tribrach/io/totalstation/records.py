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

    station: NDArray[Any]  #: (n,), names, "" where the file gives none
    height: Array  #: (n,), of the instrument [m]
    backsight: NDArray[Any]  #: (n,), names
    azimuth: Array  #: (n,), of the backsight as it was set [rad]
    circle: Array  #: (n,), reading at the backsight [rad]
    line: Index  #: (n,), of the file, from 1

    def __len__(self) -> int:
        return len(self.station)


@dataclass(frozen=True)
class RawSights:
    """Readings of a total station as its file has them, with their lines."""

    setup: Index  #: (n,), index of the set-up
    #: (n,), names
    target: NDArray[Any]
    code: NDArray[Any]
    #: (n,), as read in their face [rad]
    direction: Array
    zenith: Array
    distance: Array  #: (n,), along the slope, as in the file [m]
    face: NDArray[np.int8]  #: (n,), 1 or 2
    height: Array  #: (n,), of the target [m]
    prism: Array  #: (n,), prism constant [m]
    ppm: Array  #: (n,), atmospheric correction [1e-6]
    applied: NDArray[np.bool_]  #: (n,), true if the distance contains both corrections
    #: (n,), of the air
    temperature_c: Array
    pressure_hpa: Array
    humidity_percent: Array
    series: Index  #: (n,), number of the set if the file gives it, else 0
    off: NDArray[Any]  #: (n,), why a sight is not used, "" if it is
    line: Index  #: (n,), of the file, from 1

    def __len__(self) -> int:
        return len(self.target)


@dataclass(frozen=True)
class StoredPoints:
    """n coordinates of the file."""

    name: NDArray[Any]  #: (n,), of the points
    xyz: Array  #: (n, 3), E, N, U [m], NaN where not given
    #: (n,), true if they were keyed in or uploaded, False if the instrument computed them
    given: NDArray[np.bool_]
    code: NDArray[Any]  #: (n,), codes or descriptions, "" without
    line: Index  #: (n,), of the file, from 1

    def __len__(self) -> int:
        return len(self.name)


@dataclass(frozen=True)
class Problem:
    """A record that was left out."""

    line: int  #: of the file, from 1
    what: str  #: what is wrong with it


@dataclass(frozen=True)
class RawFile:
    """A raw file as it was understood."""

    path: Path  #: of the file
    format: str  #: its name in words
    instrument: str  #: as the file names it
    #: the content
    setups: Setups
    shots: RawSights
    points: StoredPoints
    #: how many records or words there were, by kind
    understood: Mapping[str, int]
    unknown: Mapping[str, int]
    problems: tuple[Problem, ...]  #: records of known kinds that cannot be right
    notes: tuple[str, ...]  #: assumptions, in sentences
    label: str = ""  #: what tells the file from others of the same name; empty takes its name

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
