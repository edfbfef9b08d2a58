"""Do two placed clouds differ as much as their uncertainty says?

On flat places that both stations see, the mean of one cloud lies off the plane of the other by
noise, and by what is uncertain of the relative pose: ``s^2 = s_1^2/n_1 + s_2^2/n_2 + s_plane^2 +
a C a^T`` with ``a = [n ; (X - X_0) x n]`` (method section 9.5). Its RMS over the overlap is
predicted and observed. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.comparison.station_pair import along_normals
from tribrach.geometry.pose import Pose
from tribrach.registration.clouds.fine import matched
from tribrach.registration.clouds.prepared import PreparedScan
from tribrach.registration.clouds.surfels import Surfels

__all__ = ["Differences", "differences"]

Array = NDArray[np.float64]

#: surfels with as many points, and no rougher than this many times the median, are flat places
_POINTS, _SMOOTH = 12, 2.5
#: fewer places tell nothing
_PLACES = 30


@dataclass(frozen=True)
class Differences:
    """Root mean squares over flat places of the overlap [m].

    places : how many; observed; noise, registration : parts of what is predicted.
    """

    places: int
    observed: float
    noise: float
    registration: float

    @property
    def predicted(self) -> float:
        """Both parts together [m]."""
        return float(np.hypot(self.noise, self.registration))

    @property
    def ratio(self) -> float:
        """Observed over predicted."""
        return self.observed / self.predicted


def differences(
    a: PreparedScan, b: PreparedScan, pose: Pose, covariance: Array, gate: float = 0.1
) -> Differences | None:
    """Differences of two scans; None if they have hardly a flat place in common.

    pose : of b in a; covariance (6, 6) : of it, left increments in a: of the translation [m] and
    of the turn about the scanner of b [rad]; gate : larger differences are other surfaces [m].
    """
    found = matched(a.fine, b.fine, pose, gate)
    s, t = a.fine.surfels, b.fine.surfels
    flat = _flat(s)[found.first] & _flat(t)[found.second]
    flat &= s.size[found.first] == t.size[found.second]
    found = found.subset(flat & found.forward)
    # the few that are beyond all noise are edges
    limit = 6 * 1.4826 * float(np.median(np.abs(found.residual))) if len(found) else 0.0
    found = found.subset(np.abs(found.residual) <= limit)
    if len(found) < _PLACES:
        return None
    i, j = found.first, found.second
    q = found.point - s.center[i]
    along = np.maximum((q**2).sum(axis=1) - found.residual**2, 0.0)
    plane = s.sigma_offset[i] ** 2 * (1 + 0.5 * along * (1 / s.width[i] ** 2).sum(axis=1))
    noise = plane + t.sigma_offset[j] ** 2
    rows = along_normals(found.point, found.normal, pose.translation)
    registered = np.einsum("ni,ij,nj->n", rows, covariance, rows)
    return Differences(
        len(found),
        float(np.sqrt((found.residual**2).mean())),
        float(np.sqrt(noise.mean())),
        float(np.sqrt(max(registered.mean(), 0.0))),
    )


def _flat(s: Surfels) -> NDArray[np.bool_]:
    """Which surfels (n,) are flat places with enough points."""
    enough = s.count >= _POINTS
    usual = float(np.median(s.thickness[enough])) if enough.any() else 0.0
    return np.asarray(enough & (s.thickness <= _SMOOTH * usual))
