"""What files of GNSS results hold, before it is anyone's work frame: geocentric metres, names."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tribrach._types import Array
from tribrach.geodesy.epochs import Realisation

__all__ = ["GnssRecords"]


@dataclass
class GnssRecords:
    """Positions, vectors and approximate coordinates of one file; ECEF [m].

    Attributes
    ----------
    positions
        Names of the n points measured as such; xyz (n, 3), covariance (3n, 3n) [m^2], velocity (n,
        3) [m/year] or None.
    start, end
        Names of m vectors; vectors (m, 3), blocks (m, 3, 3); group : of their variance component.
    approximate
        Further points by name.
    frame, epoch
        As the file states them, "" and None if it does not. sources of positions and vectors
        ``file:line``.
    """

    positions: list[str] = field(default_factory=list)
    xyz: Array = field(default_factory=lambda: np.zeros((0, 3)))
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    velocity: Array | None = None
    velocity_covariance: Array | None = None
    start: list[str] = field(default_factory=list)
    end: list[str] = field(default_factory=list)
    vectors: Array = field(default_factory=lambda: np.zeros((0, 3)))
    blocks: Array = field(default_factory=lambda: np.zeros((0, 3, 3)))
    approximate: dict[str, Array] = field(default_factory=dict)
    frame: str = ""
    epoch: float | None = None
    position_sources: list[str] = field(default_factory=list)
    vector_sources: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def realisation(self, default: Realisation | None) -> Realisation | None:
        """Frame and epoch of the coordinates; what the file leaves out is that of the job."""
        name = self.frame or (default.frame if default else "")
        if not name:
            return None
        epoch = self.epoch if self.epoch is not None else (default.epoch if default else None)
        return Realisation(name, epoch)
