"""Diameter of a beam as a function of the range (method section 5.2).

A beam with its waist at the exit widens as ``hypot(d0, gamma rho)``, slowly at first; one that
leaves the instrument as a cone as ``d0 + gamma rho``. With 4 mm and 0.3 mrad these are 7.2 and 10
mm at 20 m. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array


@dataclass(frozen=True)
class Beam:
    """A beam of light."""

    exit: float = 0.0  #: diameter where it leaves the instrument [m]
    divergence: float = 0.0  #: full angle [rad]
    cone: bool = False  #: true if it is a cone from there on, else it has its waist there

    def diameter(self, length: Array) -> Array:
        """Diameters at ranges.

        ``length`` (n,): ranges [m]. Returns (n,): diameters [m].
        """
        wide = self.divergence * np.asarray(length, dtype=float)
        return np.asarray(self.exit + wide if self.cone else np.hypot(self.exit, wide))
