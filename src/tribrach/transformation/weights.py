"""The metric of common points: covariances of both systems, joined through the transformation.

The differences ``w = b - T(a)`` have ``C = C_b + M C_a M^T``. Covariances come per point (n, d, d)
or as one matrix over all points (n d, n d), such as another adjustment gives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError

#: a joint covariance over more values than this is refused
_MOST = 6000


@dataclass(frozen=True, eq=False)
class Spread:
    """Covariance of n points: one of both forms, or neither if they are free of errors."""

    blocks: Array | None = None  #: (n, d, d), covariance of each point [m^2]
    joint: Array | None = None  #: (n d, n d), one covariance over all points [m^2]

    def part(self, chosen: NDArray[np.bool_], d: int) -> Spread:
        """The covariance of chosen points."""
        if self.joint is not None:
            keep = np.repeat(chosen, d)
            return Spread(joint=self.joint[np.ix_(keep, keep)])
        return Spread(None if self.blocks is None else self.blocks[chosen])

    def of_points(self, n: int, d: int) -> Array:
        """Blocks (n, d, d) of the points, zero where nothing is given."""
        if self.joint is not None:
            whole = self.joint.reshape(n, d, n, d)
            return np.ascontiguousarray(np.einsum("iaib->iab", whole))
        return np.zeros((n, d, d)) if self.blocks is None else self.blocks

    def times(self, x: Array) -> Array:
        """The covariance times vectors (n, d)."""
        if self.joint is not None:
            return (self.joint @ x.ravel()).reshape(x.shape)
        if self.blocks is None:
            return np.zeros_like(x)
        out: Array = np.einsum("nij,nj->ni", self.blocks, x)
        return out

    def carried(self, matrix: Array, n: int) -> Spread:
        """``M C M^T`` with one matrix (d, d) for all n points."""
        if self.joint is not None:
            d = len(matrix)
            whole = self.joint.reshape(n, d, n, d)
            moved = np.einsum("ab,ibjc,dc->iajd", matrix, whole, matrix, optimize=True)
            return Spread(joint=moved.reshape(n * d, n * d))
        return Spread(None if self.blocks is None else matrix @ self.blocks @ matrix.T)


def given_spread(covariance: Array | None, n: int, d: int, which: str) -> Spread:
    """Check a covariance as given: none, (n, d, d) or (n d, n d) [m^2]."""
    if covariance is None:
        return Spread()
    c = np.asarray(covariance, dtype=float)
    if c.shape == (n * d, n * d) and c.ndim == 2:
        if len(c) > _MOST:
            raise InputError(
                f"the joint covariance of system {which} has {len(c)} rows",
                cure=f"give at most {_MOST}, or one block for each point",
            )
        matrices = c[None]
    elif c.shape == (n, d, d):
        matrices = c
    else:
        raise InputError(
            f"the covariance of system {which} has the shape {c.shape}",
            cure=f"give ({n}, {d}, {d}) or ({n * d}, {n * d})",
        )
    turned = matrices.transpose(0, 2, 1)
    smallest = np.linalg.eigvalsh(matrices)[:, 0] if np.isfinite(matrices).all() else np.array([-1])
    largest = np.abs(matrices).max(axis=(1, 2))
    if not np.allclose(matrices, turned, rtol=1e-9, atol=0) or (smallest < -1e-9 * largest).any():
        raise InputError(
            f"a covariance of system {which} is not symmetric and positive",
            cure="check the order and the signs of its elements",
        )
    return Spread(joint=c) if matrices.ndim == 3 and c.ndim == 2 else Spread(c)


class Metric:
    """``C^-1`` of n differences of d coordinates; ``matrix`` (d, d) is the linear part."""

    def __init__(self, a: Spread, b: Spread, matrix: Array, n: int) -> None:
        self.n, self.d = n, len(matrix)
        moved = a.carried(matrix, n)
        try:
            if a.joint is not None or b.joint is not None:
                whole = _dense(moved, n, self.d) + _dense(b, n, self.d)
                self._factor = sla.cho_factor(whole, lower=True)
                self.inverse: Array | None = None
            else:
                nothing = a.blocks is None and b.blocks is None
                eye = np.broadcast_to(np.eye(self.d), (n, self.d, self.d))
                blocks = eye if nothing else moved.of_points(n, self.d) + b.of_points(n, self.d)
                np.linalg.cholesky(blocks)
                self.inverse = np.asarray(np.linalg.inv(blocks), dtype=np.float64)
        except np.linalg.LinAlgError:
            raise InputError(
                "a point has no uncertainty in either system",
                cure="give standard deviations above zero in one of both",
            ) from None

    def solve(self, x: Array) -> Array:
        """``C^-1 x`` of (n, d) or (n, d, k)."""
        if self.inverse is None:
            flat = x.reshape(self.n * self.d, -1)
            return np.asarray(sla.cho_solve(self._factor, flat), dtype=float).reshape(x.shape)
        if x.ndim == 2:
            out: Array = np.einsum("nij,nj->ni", self.inverse, x)
            return out
        return np.asarray(self.inverse @ x, dtype=np.float64)

    def inverse_blocks(self) -> Array:
        """Diagonal blocks (n, d, d) of ``C^-1``."""
        if self.inverse is not None:
            return self.inverse
        size = self.n * self.d
        whole = np.asarray(sla.cho_solve(self._factor, np.eye(size)), dtype=float)
        return Spread(joint=whole).of_points(self.n, self.d)


def _dense(spread: Spread, n: int, d: int) -> Array:
    """As one matrix (n d, n d)."""
    if spread.joint is not None:
        return spread.joint
    return np.asarray(sla.block_diag(*spread.of_points(n, d)), dtype=np.float64)
