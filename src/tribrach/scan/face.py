"""Which face of a panoramic scanner measured a point, by the direction of its head.

The head turns with the columns of the grid; the mirror looks ahead on one face and behind on the
other (method section 4.4). :func:`tribrach.scan.prepared.head_turn` tells how the head turned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Mask


@dataclass(frozen=True)
class HeadTurn:
    """How the head turned: its direction at column k is ``first + step k``."""

    first: float  #: direction of the first column [rad], counter-clockwise about the standing axis
    step: float  #: turn from one column to the next [rad]
    columns: int  #: number of columns

    def faces(self, xyz: Array, column: NDArray[np.integer]) -> Array:
        """Faces (n,) of +1 or -1 of points (n, 3) [m] with their columns (n,)."""
        h = np.arctan2(xyz[:, 1], xyz[:, 0])
        ahead = np.cos(h - self.first - self.step * column) >= 0
        return np.where(ahead, 1.0, -1.0)


@dataclass(frozen=True)
class ScanFace:
    """One of the two faces of a scan: +1 in front, -1 at the back."""

    turn: HeadTurn
    sign: float

    def measured(self, xyz: Array, column: NDArray[np.integer]) -> Mask:
        """Tell (n,) which of points (n, 3) [m] with their columns (n,) this face measured."""
        measured: Mask = self.turn.faces(xyz, column) == self.sign
        return measured
