"""What two epochs of a planned network will tell: from sigmas to detectable displacements and back.

Two epochs that are measured alike and share nothing have ``Q_dd = 2 Q``, and the displacement that
is found with a power in the hardest direction is ``sqrt(2 lambda_0)`` times the largest sigma of
the point (method section 12.3).
"""

from __future__ import annotations

import numpy as np

from tribrach.epochs.congruence import Limits

#: of the test of a displacement, and the probability with which it is found
CONFIDENCE, POWER = 0.95, 0.8


def detectable_displacement(sigma: float, axes: int) -> float:
    """Displacement [m] found in the hardest of 1 to 3 axes at one epoch's largest ``sigma`` [m]."""
    return float(np.sqrt(2 * Limits(1 - CONFIDENCE).noncentrality(axes, POWER)) * sigma)


def sigma_for_displacement(displacement: float, axes: int) -> float:
    """Largest standard deviation [m] with which a displacement [m] is found."""
    return displacement / detectable_displacement(1.0, axes)
