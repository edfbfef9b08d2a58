"""What other programs take in of our uncertainty: py4dgeo's M3C2-EP, CloudCompare's precision maps.

py4dgeo moves the second cloud by ``x' = A (x - x_0) + t + x_0`` and wants the covariance (12, 12)
of the elements of A row by row, then of t, and the reference x_0. The errors of a rigid motion are
``dA = [q_r]x A`` and ``dt = q_t + q_r x t``, with q the relative pose about x_0: rank six in twelve
unknowns. It takes the noise of a scanner as one sigma of ranges and two of angles.

CloudCompare's precision maps take three scalar fields of each cloud, the sigmas along x, y, z in
any unit: `SIGMA_FIELDS` of the clouds that Tribrach delivers, scale 1 for metres. They hold the
station's part too; correlations are not asked for, and both clouds count as independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.comparison.station_pair import StationPair
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import skew

#: fields of delivered clouds that precision maps are made of, along x, y, z [m]
SIGMA_FIELDS = ("sigma_x", "sigma_y", "sigma_z")


@dataclass(frozen=True)
class PeerTransformation:
    """A transformation of the second cloud with its uncertainty, for py4dgeo's M3C2-EP."""

    matrix: Array  #: (3, 4), A and t
    covariance: Array  #: (12, 12), of the elements a11, a12, a13, a21 .. a33, then tx, ty, tz [m].
    reference: Array  #: (3,), x_0 [m]

    @property
    def arguments(self) -> dict[str, Array]:
        """Keyword arguments of ``py4dgeo.M3C2EP``."""
        return {"tfM": self.matrix, "Cxx": self.covariance, "refPointMov": self.reference}


def alignment(
    stations: StationPair, reference: Array, motion: Pose | None = None
) -> PeerTransformation:
    """Write the sigma of the second station for py4dgeo, ``motion`` still to come if given."""
    rotation = np.eye(3) if motion is None else motion.rotation
    # x' = R x + s, written about the reference
    shift = np.zeros(3) if motion is None else motion @ reference - reference
    to_elements = np.zeros((12, 6))
    for k in range(3):
        turn = skew(np.eye(3)[k])
        to_elements[:9, 3 + k] = (turn @ rotation).ravel()
        to_elements[9:, 3 + k] = turn @ shift
    to_elements[9:, :3] = np.eye(3)
    covariance = to_elements @ stations.relative(reference) @ to_elements.T
    return PeerTransformation(
        np.column_stack([rotation, shift]), covariance, np.asarray(reference, float)
    )
