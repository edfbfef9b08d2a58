"""A fast stand-in for a smooth change of coordinates over the extent of a cloud.

Projections cost microseconds a point. Over a few hundred metres a cubic polynomial in the three
coordinates is the same function to nanometres. It is fitted at Chebyshev nodes of the box that
holds the points and compared with the exact function elsewhere; it is used only where the two agree
to :data:`TOLERANCE`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.answers import Matrix, Result, Vector
from tribrach.kernels import in_threads, njit

#: largest difference from the exact function [m]
TOLERANCE = 1e-6
_POWERS = np.array([(i, j, k) for i in range(4) for j in range(4 - i) for k in range(4 - i - j)])


class LocalMap:
    """A fast ``exact`` change of coordinates, called with points (n, 3) [m]."""

    def __init__(self, exact: Callable[[Array], Array]) -> None:
        self.exact = exact
        self._low = self._high = np.zeros(3)
        self._coefficients: Array | None = None
        self._origin = np.zeros(3)

    def __call__(self, x: Array) -> Array:
        """Mapped points (n, 3) [m], within a micrometre of the exact function."""
        if len(x) == 0:
            return x
        low, high = x.min(axis=0), x.max(axis=0)
        if self._coefficients is None or (low < self._low).any() or (high > self._high).any():
            self._fit(low, high)
        if self._coefficients is None:
            return self.exact(x)
        centre, half = (self._low + self._high) / 2, (self._high - self._low) / 2
        out = np.empty_like(x)
        given = np.ascontiguousarray(x), centre, half, self._coefficients, self._origin
        in_threads(_evaluate, len(x), *given, out)
        return out

    def _fit(self, low: Array, high: Array) -> None:
        """Fit the cubic over the box of all points so far, with a margin; drop it if not exact."""
        if self._coefficients is not None:
            low, high = np.minimum(low, self._low), np.maximum(high, self._high)
        margin = 1.0 + 0.2 * (high - low)
        self._low, self._high = low - margin, high + margin
        self._origin, cubic, error = _fitted(self.exact, self._low, self._high)
        self._coefficients = cubic if error <= TOLERANCE else None


@dataclass(frozen=True)
class StoredMap(Result):
    """A change of coordinates over a box, as cubic polynomials that need nothing else.

    A mapped point is ``origin`` and the sum of ``cubic`` times the products of powers of the
    coordinates, which go from -1 to 1 over the box; exponents (i, j, k) with i + j + k of 3 at
    most, k fastest, then j.
    """

    #: (3,), corners of the box in which it holds [m]
    low: Vector
    high: Vector
    origin: Vector  #: (3,), mapped middle [m]
    cubic: Matrix  #: (20, 3), coefficients

    def __post_init__(self) -> None:
        """Refuse values that do not form a map."""
        shapes = [a.shape for a in (self.low, self.high, self.origin)]
        known = shapes == [(3,)] * 3 and self.cubic.shape == (len(_POWERS), 3)
        if not known or not (self.low < self.high).all():
            raise ValueError("this is no map")

    @classmethod
    def over(
        cls, exact: Callable[[Array], Array], low: Array, high: Array, tolerance: float
    ) -> StoredMap | None:
        """Fit a map over the box from ``low`` to ``high`` (3,); None if no cubic is exact."""
        origin, cubic, error = _fitted(exact, low, high)
        return cls(low, high, origin, cubic) if error <= tolerance else None

    def __call__(self, x: Array) -> Array:
        """Mapped points (n, 3) [m], NaN outside of the box."""
        centre, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        out = self.origin + _monomials((x - centre) / half) @ self.cubic
        inside = np.all((x >= self.low) & (x <= self.high), axis=1)
        mapped: Array = np.where(inside[:, None], out, np.nan)
        return mapped

    def rotation(self, x: Array) -> Array:
        """Rotations (n, 3, 3) nearest to the derivatives at points (n, 3)."""
        step = 1e-3 * (self.high - self.low)
        centre = np.clip(x, self.low + step, self.high - step)
        columns = [
            (self(centre + e * step) - self(centre - e * step)) / (2 * step @ e) for e in np.eye(3)
        ]
        u, _, vt = np.linalg.svd(np.stack(columns, axis=2))
        turned: Array = u @ vt
        return turned


def _fitted(exact: Callable[[Array], Array], low: Array, high: Array) -> tuple[Array, Array, float]:
    """Mapped middle, coefficients, and the largest error [m] of a cubic over a box."""
    centre, half = (low + high) / 2, (high - low) / 2
    line = np.cos(np.pi * (np.arange(6) + 0.5) / 6)
    nodes = np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3)
    there = exact(centre + half * nodes)
    origin: Array = there.mean(axis=0)
    cubic: Array = np.linalg.lstsq(_monomials(nodes), there - origin)[0].astype(np.float64)
    trial = np.random.default_rng(0).uniform(-1, 1, (64, 3))
    error = _monomials(trial) @ cubic + origin - exact(centre + half * trial)
    return origin, cubic, float(np.abs(error).max())


def _monomials(x: Array) -> Array:
    """Products of powers (n, 20) of coordinates (n, 3) up to the third degree."""
    products: Array = np.prod(x[:, None, :] ** _POWERS[None], axis=2)
    return products


@njit(cache=True, nogil=True)
def _evaluate(first, last, x, centre, half, c, origin, out):  # type: ignore[no-untyped-def]
    """The cubic at every point, terms in the order of ``_POWERS``."""
    for n in range(first, last):
        a = (x[n, 0] - centre[0]) / half[0]
        b = (x[n, 1] - centre[1]) / half[1]
        d = (x[n, 2] - centre[2]) / half[2]
        for axis in range(3):
            total, row, pa = 0.0, 0, 1.0
            for i in range(4):
                pb = pa
                for j in range(4 - i):
                    pc = pb
                    for _ in range(4 - i - j):
                        total += c[row, axis] * pc
                        row += 1
                        pc *= d
                    pb *= b
                pa *= a
            out[n, axis] = origin[axis] + total
