"""Directions of the axes x and y of a GNU Gama file, and the sense of its angles.

The two letters of ``axes-xy`` say where x and y point; ``ne``, ``sw``, ``es`` and ``wn`` are
left-handed, ``en``, ``nw``, ``se`` and ``ws`` right-handed. Angles are clockwise (``left-handed``)
or counter-clockwise (``right-handed``) whatever the axes. Inside the program coordinates are E, N,
U and angles clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

AXES = ("ne", "sw", "es", "wn", "en", "nw", "se", "ws")
HANDS = {"left-handed": 1.0, "right-handed": -1.0}
_DIRECTION = {"n": (0, 1), "s": (0, -1), "e": (1, 0), "w": (-1, 0)}


@cache
def _matrix(letters: str) -> NDArray[np.float64]:
    """The matrix (3, 3) of axes with these letters, not to be changed."""
    out = np.eye(3)
    out[:2, :2] = np.array([_DIRECTION[letter] for letter in letters]).T
    out.flags.writeable = False
    return out


@cache
def _order(letters: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Which of x, y, z are E, N, U (3,), and with which sign."""
    matrix = _matrix(letters)
    source = np.argmax(np.abs(matrix), axis=1)
    return source, matrix[np.arange(3), source]


@dataclass(frozen=True)
class Axes:
    """Horizontal axes of a file."""

    letters: str = "ne"  #: where its ``x`` and ``y`` point

    def matrix(self) -> NDArray[np.float64]:
        """The matrix (3, 3) with E, N, U = matrix @ (x, y, z) of the file; it is orthogonal."""
        return _matrix(self.letters)

    def world_from_file(self, xyz: NDArray[np.float64]) -> NDArray[np.float64]:
        """E, N, U (..., 3) of the file's x, y, z (..., 3); NaN stays NaN in its coordinate."""
        source, sign = _order(self.letters)
        world: NDArray[np.float64] = np.asarray(xyz, dtype=float)[..., source] * sign
        return world
