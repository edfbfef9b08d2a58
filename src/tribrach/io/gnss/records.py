"""The content of files of GNSS results: geocentric metres and names, before any work frame."""

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
        Names of the n points that were measured as positions.
    xyz : (n, 3)
        Their coordinates.
    covariance : (3n, 3n)
        Of the coordinates [m^2].
    velocity : (n, 3) or None
        In m/year.
    velocity_covariance : (6n, 6n) or None
        Of coordinates and velocities.
    start, end
        Names of the ends of m vectors.
    vectors : (m, 3)
        End minus start.
    blocks : (m, 3, 3)
        Their covariances [m^2].
    approximate
        Coordinates (3,) of further points by name.
    frame, epoch
        As the file states them, "" and None if it does not.
    position_sources, vector_sources
        ``file:line`` of each.
    vector_off
        Why a vector is switched off, "" if it is not; empty if none is.
    warnings
        Sentences.
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
    vector_off: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def realisation(self, default: Realisation | None) -> Realisation | None:
        """Frame and epoch of the coordinates; ``default`` supplies what the file leaves out."""
        name = self.frame or (default.frame if default else "")
        if not name:
            return None
        epoch = self.epoch if self.epoch is not None else (default.epoch if default else None)
        return Realisation(name, epoch)
