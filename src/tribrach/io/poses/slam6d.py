"""Poses of 3DTK, the 3D toolkit of slam6d (``scan000.pose``): a place and three angles.

Six numbers: x, y, z in centimetres and the turns about these axes in degrees, in a left-handed
frame with x to the right, y up and z ahead; the turn about z comes first,
``R = R_x(a) R_y(b) R_z(c)``. Scans beside it are taken to be in the toolkit's ``xyz`` frame, which
is right-handed, with x ahead, y to the left and z up, in metres: ``p_left = 100 (-y, z, x)``.
Conventions: 3DTK, ``EulerToMatrix4`` and its reader of xyz scans.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.io.poses.rows import NumberRow, PoseList

SUFFIX = ".pose"
#: left-handed axes of the toolkit from right-handed ones
_LEFT_FROM_RIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
_CM = 0.01


def fits(rows: Sequence[NumberRow]) -> bool:
    """True for six numbers, in one line or two."""
    return [len(row.values) for row in rows] in ([6], [3, 3])


def read(path: Path, rows: Sequence[NumberRow]) -> PoseList:
    """The pose of a file, in the right-handed frame in metres."""
    values = np.array([v for row in rows for v in row.values])
    turns = [
        exp(np.radians(angle) * axis) for angle, axis in zip(values[3:], np.eye(3), strict=True)
    ]
    left = turns[0] @ turns[1] @ turns[2]
    rotation = _LEFT_FROM_RIGHT.T @ left @ _LEFT_FROM_RIGHT
    pose = Pose(rotation, _CM * _LEFT_FROM_RIGHT.T @ values[:3])
    return PoseList(path, (pose,), None, "3DTK, left-handed, centimetres and degrees")
