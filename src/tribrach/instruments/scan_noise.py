"""How does the noise of one scanned point depend on its range, its beam and the surface it hit?

``C_int`` of method sections 5.1 and 5.2: range ``s_0 + s_ppm rho``, divided by the cosine of the
incidence angle where that is known; angles of the encoders; and the place of the echo within the
beam's footprint, ``delta / 4`` in both directions across the beam, with the beam's diameter
``d(rho) = hypot(d0, gamma rho)`` and ``delta = d / rho`` (Lichti and Gordon 2004). Metres and
radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array

__all__ = ["ScanNoise"]


@dataclass(frozen=True)
class ScanNoise:
    """Standard deviations of single points of a scanner.

    range [m] and range_scale [m/m] add linearly.

    Attributes
    ----------
    horizontal, vertical
        Encoder readings [rad]; beam_exit [m] and beam_divergence [rad, full angle] : zero leaves
        the footprint out.
    """

    range: float
    range_scale: float
    horizontal: float
    vertical: float
    beam_exit: float = 0.0
    beam_divergence: float = 0.0

    def beam_diameter(self, length: Array) -> Array:
        """Diameter (n,) [m] of the beam at ranges (n,) [m]."""
        diameter: Array = np.hypot(self.beam_exit, self.beam_divergence * length)
        return diameter

    def beam_angle(self, length: Array) -> Array:
        """Sigma (n,) [rad] of the echo's place within the footprint, ``delta / 4``."""
        angle: Array = self.beam_diameter(length) / length / 4
        return angle

    def range_sigma(self, length: Array, cosine: Array | float = 1.0) -> Array:
        """Sigmas (n,) [m] of ranges (n,) on surfaces hit at an incidence of this cosine."""
        sigma: Array = (self.range + self.range_scale * length) / cosine
        return sigma

    @property
    def parameters(self) -> Array:
        """The six numbers (6,) in the order of the fields, for compiled loops."""
        return np.array(
            [
                self.range,
                self.range_scale,
                self.horizontal,
                self.vertical,
                self.beam_exit,
                self.beam_divergence,
            ]
        )
