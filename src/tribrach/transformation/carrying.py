"""Points and their covariances carried through a transformation, there and back.

``C_b = M C_a M^T + J Q J^T`` with the covariance Q of the parameters: its part is common to all
points. A transformation in the plane leaves heights and their variances as they are. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.transformation.models import Transformation


@dataclass(frozen=True, eq=False)
class Carrier:
    """Carries points (n, 3), or (n, 2) by one in the plane; backwards from B to A."""

    transformation: Transformation  #: from A to B
    covariance: Array | None = None  #: (k, k), covariance of its parameters; None leaves it out
    backwards: bool = False  #: true from B to A
    #: degrees of freedom of the variance that the covariance rests on; None where sigmas were given
    freedom: int | None = None

    def matrix(self, d: int) -> Array:
        """Linear part (d, d) for points of dimension d."""
        own = self.transformation.matrix
        out = np.eye(d)
        out[: len(own), : len(own)] = np.linalg.inv(own) if self.backwards else own
        return out

    def points(self, x: Array) -> Array:
        """Points (n, d) in the other system."""
        t, d = self.transformation, self.transformation.model.dimension
        out = x.copy()
        out[:, :d] = t.back(x[:, :d]) if self.backwards else t(x[:, :d])
        return out

    def covariances(self, x: Array, own: Array | None = None) -> Array:
        """Covariances of the carried points.

        ``x`` (n, d): points before [m]; ``own`` (n, d, d): their covariances before [m^2], none if
        None. Returns (n, d, d): covariances afterwards [m^2].
        """
        n, size = x.shape
        out = np.zeros((n, size, size))
        matrix = self.matrix(size)
        if own is not None:
            out += matrix @ own @ matrix.T
        if self.covariance is not None:
            d = self.transformation.model.dimension
            lever = self.levers(x)
            out[:, :d, :d] += lever @ self.covariance @ lever.transpose(0, 2, 1)
        return out

    def levers(self, x: Array) -> Array:
        """Derivatives (n, d, k) of the carried points by the parameters."""
        d = self.transformation.model.dimension
        if not self.backwards:
            return self.transformation.jacobian(x[:, :d])
        there = self.transformation.jacobian(self.transformation.back(x[:, :d]))
        out: Array = -self.matrix(d) @ there
        return out

    def rotation(self) -> Array:
        """The turn (3, 3) without scales, for normals."""
        u, _, vt = np.linalg.svd(self.matrix(3))
        turned: Array = u @ vt
        return turned
