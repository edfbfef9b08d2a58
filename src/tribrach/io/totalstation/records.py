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

__all__ = ["Problem", "RawFile", "RawSights", "Setups", "StoredPoints"]


@dataclass(frozen=True)
class Setups:
    """n set-ups of the instrument in the order of the file.

    Attributes
    ----------
    station : (n,)
        Names, "" where the file gives none.
    height : (n,)
        Of the instrument [m].
    backsight : (n,)
        Names.
    azimuth : (n,)
        Of the backsight as it was set [rad].
    circle : (n,)
        Reading at the backsight [rad].
    line : (n,)
        Of the file, from 1.
    """

    station: NDArray[Any]
    height: Array
    backsight: NDArray[Any]
    azimuth: Array
    circle: Array
    line: Index

    def __len__(self) -> int:
        return len(self.station)


@dataclass(frozen=True)
class RawSights:
    """n sights in the order of the file.

    Attributes
    ----------
    setup : (n,)
        Index of the set-up.
    target, code : (n,)
        Names.
    direction, zenith : (n,)
        As read in their face [rad].
    distance : (n,)
        Along the slope, as in the file [m].
    face : (n,)
        1 or 2.
    height : (n,)
        Of the target [m].
    prism : (n,)
        Prism constant [m].
    ppm : (n,)
        Atmospheric correction [1e-6].
    applied : (n,)
        True if the distance contains both corrections.
    temperature_c, pressure_hpa, humidity_percent : (n,)
        Of the air.
    series : (n,)
        Number of the set if the file gives it, else 0.
    off : (n,)
        Why a sight is not used, "" if it is.
    line : (n,)
        Of the file, from 1.
    """

    setup: Index
    target: NDArray[Any]
    code: NDArray[Any]
    direction: Array
    zenith: Array
    distance: Array
    face: NDArray[np.int8]
    height: Array
    prism: Array
    ppm: Array
    applied: NDArray[np.bool_]
    temperature_c: Array
    pressure_hpa: Array
    humidity_percent: Array
    series: Index
    off: NDArray[Any]
    line: Index

    def __len__(self) -> int:
        return len(self.target)


@dataclass(frozen=True)
class StoredPoints:
    """n coordinates of the file.

    Attributes
    ----------
    name : (n,)
        Of the points.
    xyz : (n, 3)
        E, N, U [m], NaN where not given.
    given : (n,)
        True if they were keyed in or uploaded, False if the instrument computed them.
    line : (n,)
        Of the file, from 1.
    """

    name: NDArray[Any]
    xyz: Array
    given: NDArray[np.bool_]
    line: Index

    def __len__(self) -> int:
        return len(self.name)


@dataclass(frozen=True)
class Problem:
    """A record that was left out.

    Attributes
    ----------
    line
        Of the file, from 1.
    what
        What is wrong with it.
    """

    line: int
    what: str


@dataclass(frozen=True)
class RawFile:
    """A raw file as it was understood.

    Attributes
    ----------
    path
        Of the file.
    format
        Its name in words.
    instrument
        As the file names it.
    setups, shots, points
        The content.
    understood, unknown
        How many records or words there were, by kind.
    problems
        Records of known kinds that cannot be right.
    notes
        Assumptions, in sentences.
    label
        What tells the file from others of the same name; empty takes its name.
    """

    path: Path
    format: str
    instrument: str
    setups: Setups
    shots: RawSights
    points: StoredPoints
    understood: Mapping[str, int]
    unknown: Mapping[str, int]
    problems: tuple[Problem, ...]
    notes: tuple[str, ...]
    label: str = ""

    @property
    def name(self) -> str:
        """Name of the file in sources, in names of unknowns and in reports."""
        return self.label or self.path.name

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
