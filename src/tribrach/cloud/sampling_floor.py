"""What nearest-neighbour distances are between two perfect clouds of one surface: their floor.

For a square lattice of pitch s and a point anywhere on the same plane the distance to the nearest
lattice point has mean ``s (sqrt 2 + ln(1 + sqrt 2)) / 6``, standard deviation 0.1424 s and RMS
``s / sqrt 6`` (method section 5.5). Metres.
"""

from __future__ import annotations

import numpy as np

__all__ = ["MEAN", "RMS", "STD", "rms_of_rectangle"]

#: distances over the pitch
MEAN = float((np.sqrt(2) + np.log1p(np.sqrt(2))) / 6)
RMS = float(1 / np.sqrt(6))
STD = float(np.sqrt(RMS**2 - MEAN**2))


def rms_of_rectangle(pitch_x: float, pitch_y: float) -> float:
    """RMS [m] on a lattice of two pitches: ``sqrt((s_x^2 + s_y^2) / 12)``."""
    return float(np.sqrt((pitch_x**2 + pitch_y**2) / 12))
