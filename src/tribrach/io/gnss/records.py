"""The content of files of GNSS results: geocentric metres and names, before any work frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tribrach._types import Array
from tribrach.geodesy.epochs import Realisation


@dataclass
class GnssRecords:
    """Positions, vectors and approximate coordinates of one file; ECEF [m]."""

    #: names of the n points that were measured as positions
    positions: list[str] = field(default_factory=list)
    xyz: Array = field(default_factory=lambda: np.zeros((0, 3)))  #: (n, 3), their coordinates
    #: (3n, 3n), of the coordinates [m^2]
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    velocity: Array | None = None  #: (n, 3), in m/year
    velocity_covariance: Array | None = None  #: (6n, 6n), of coordinates and velocities
    #: names of the ends of m vectors
    start: list[str] = field(default_factory=list)
    end: list[str] = field(default_factory=list)
    vectors: Array = field(default_factory=lambda: np.zeros((0, 3)))  #: (m, 3), end minus start
    #: (m, 3, 3), their covariances [m^2]
    blocks: Array = field(default_factory=lambda: np.zeros((0, 3, 3)))
    #: coordinates (3,) of further points by name
    approximate: dict[str, Array] = field(default_factory=dict)
    #: as the file states them, "" and None if it does not
    frame: str = ""
    epoch: float | None = None
    #: ``file:line`` of each
    position_sources: list[str] = field(default_factory=list)
    vector_sources: list[str] = field(default_factory=list)
    #: why a vector is switched off, "" if it is not; empty if none is
    vector_off: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)  #: sentences

    def realisation(self, default: Realisation | None) -> Realisation | None:
        """Frame and epoch of the coordinates; ``default`` supplies what the file leaves out."""
        name = self.frame or (default.frame if default else "")
        if not name:
            return None
        epoch = self.epoch if self.epoch is not None else (default.epoch if default else None)
        return Realisation(name, epoch)
