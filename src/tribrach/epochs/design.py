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
    """Displacement [m] that is found in the hardest direction of 1, 2 or 3 axes tested together.

    ``sigma`` is the largest of the point in any direction, of one epoch [m].
    """
    return float(np.sqrt(2 * Limits(1 - CONFIDENCE).noncentrality(axes, POWER)) * sigma)


def sigma_for_displacement(displacement: float, axes: int) -> float:
    """Largest standard deviation [m] with which a displacement [m] is found."""
    return displacement / detectable_displacement(1.0, axes)
