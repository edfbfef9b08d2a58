"""From which distance on is a change no longer explained by uncertainty? Levels of detection, 95 %.

With ``s_noise^2 = s_1^2 / n_1 + s_2^2 / n_2`` of the mean positions and ``reg`` of the registration

- additive : ``1.96 (s_noise + reg)``, as published (Lague, Brodu and Leroux 2013, eq. 1). Standard
  deviations are added, so it is wider than 95 %;
- quadratic : ``1.96 sqrt(s_noise^2 + reg^2)``: variances of independent errors add, five false
  alarms in a hundred.

All in metres; any shapes that go together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["NORMAL_95", "additive_level", "mean_sigma", "quadratic_level"]

Array = NDArray[np.float64]

#: two-sided 95 % of the normal distribution, as the paper rounds it
NORMAL_95 = 1.96


def mean_sigma(spread_1: Array, n_1: Array, spread_2: Array, n_2: Array) -> Array:
    """Sigma of the difference of two mean positions from spreads [m] and numbers of points."""
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma: Array = np.sqrt(spread_1**2 / n_1 + spread_2**2 / n_2)
    return sigma


def additive_level(noise: Array, registration: Array | float) -> Array:
    """``1.96 (s_noise + reg)``."""
    level: Array = NORMAL_95 * (noise + registration)
    return level


def quadratic_level(noise: Array, registration: Array | float) -> Array:
    """``1.96 sqrt(s_noise^2 + reg^2)``."""
    level: Array = NORMAL_95 * np.hypot(noise, registration)
    return level
