"""How finely are coordinates kept, on disk and in memory?"""

from __future__ import annotations

import numpy as np

__all__ = ["COARSEST", "FINEST", "single_resolution", "step_for"]

#: limits of the coordinate step [m]
FINEST, COARSEST = 1e-6, 1e-3


def step_for(sigma: float) -> float:
    """The largest step of 1, 2 or 5 times a power of ten that is at most a tenth of a sigma [m].

    Rounding to it adds less than 0.05 % to that sigma. Within 1 micrometre and 1 millimetre.
    """
    wanted = min(max(sigma / 10, FINEST), COARSEST)
    decade = 10.0 ** np.floor(np.log10(wanted * (1 + 1e-9)))
    step = max(m * decade for m in (1, 2, 5) if m * decade <= wanted * (1 + 1e-9))
    return float(np.round(step, 9))


def single_resolution(coordinate: float) -> float:
    """Distance [m] between neighbouring 32-bit floats at a coordinate [m]."""
    return float(np.spacing(np.float32(abs(coordinate))))
