"""A pose by kiss-matcher (Lim et al. 2025), where it is installed: ``pip install tribrach[kiss]``.

Local shapes are matched and the largest consistent set of matches gives the pose, whatever the
attitude of the scans. It is a proposal like others: judged by the clouds before it is believed.
"""

from __future__ import annotations

import numpy as np

from tribrach.geometry.pose import Pose
from tribrach.registration.clouds.surfels import Surfels

try:
    import kiss_matcher
except ImportError:
    kiss_matcher = None

__all__ = ["kiss_pose"]

#: size of its cubes [sizes of the surfels]
_VOXEL = 1.5
#: fewer surfels are not matched
_FEWEST = 50
_SKEWED = 1e-3


def kiss_pose(a: Surfels, b: Surfels) -> Pose | None:
    """The pose of b in a; None if kiss-matcher is not installed or finds none."""
    if kiss_matcher is None or min(len(a), len(b)) < _FEWEST:
        return None
    size = float(max(np.median(x.size) for x in (a, b)))
    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(_VOXEL * size))
    found = matcher.estimate(*(list(x.center.astype(np.float32)) for x in (b, a)))
    rotation = np.asarray(found.rotation, dtype=np.float64)
    if not found.valid or np.abs(rotation @ rotation.T - np.eye(3)).max() > _SKEWED:
        return None
    u, _, vt = np.linalg.svd(rotation)
    if np.linalg.det(u @ vt) < 0:
        return None
    return Pose(u @ vt, np.asarray(found.translation, dtype=np.float64).reshape(3))
