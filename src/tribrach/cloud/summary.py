"""Sums up the uncertainty of a whole cloud, chunk by chunk.

Histogram of the three-dimensional sigma ``sqrt(sx^2 + sy^2 + sz^2)``, shares of points within
tolerances at twice that (95 %), and a thin sample of points for the map. Metres. Classes: USIBD LOA
2019 (measured accuracy at 95 %) and GSA BIM Guide 03 (method sections 11.4 and 11.5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.kernels import njit

#: upper limits [m] of twice the sigma, by class
CLASSES: dict[str, float] = {
    "LOA10": 0.150,
    "LOA20": 0.050,
    "LOA30": 0.015,
    "LOA40": 0.005,
    "LOA50": 0.001,
    "GSA level 1": 0.051,
    "GSA level 2": 0.013,
    "GSA level 3": 0.006,
    "GSA level 4": 0.003,
}
#: edges of the histogram [m]: 20 bins a decade from 0.01 mm to 1 m
EDGES = np.logspace(-5, 0, 101)
#: squares of edges and of half the limits [m^2], in order, and where those of each are
_STEPS = np.unique(np.concatenate([EDGES, np.array(list(CLASSES.values())) / 2]) ** 2)
_EDGES_AT = np.searchsorted(_STEPS, EDGES**2)
_LIMITS_AT = np.searchsorted(_STEPS, (np.array(list(CLASSES.values())) / 2) ** 2)
#: the lowest power of two among the steps, and cells from one power to the next
_LOWEST, _CELLS = -34, 64
#: the first step that is not below a cell
_FIRST = np.searchsorted(
    _STEPS,
    (2.0 ** np.arange(_LOWEST - 1, 2)[:, None] * (1 + np.arange(_CELLS) / _CELLS)).ravel(),
)
#: one point of this many goes into the sample, more as the cloud grows
_THIN = 64
#: points in the sample
_SAMPLE = 4000


@dataclass
class CloudSummary:
    """Uncertainty of the points that were taken in so far."""

    points: int = 0  #: number of points
    #: (3,): sums of squared sigmas along the axes [m^2]
    squares: Array = field(default_factory=lambda: np.zeros(3))
    #: extremes of the three-dimensional sigma [m]
    smallest: float = np.inf
    largest: float = 0.0
    #: (102,): points between the edges of the histogram
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(102, dtype=np.int64))
    #: (classes,): points within the limit of each class
    within: NDArray[np.int64] = field(
        default_factory=lambda: np.zeros(len(CLASSES), dtype=np.int64)
    )
    #: (3,): bounds of the coordinates [m]
    low: Array = field(default_factory=lambda: np.full(3, np.inf))
    high: Array = field(default_factory=lambda: np.full(3, -np.inf))
    #: (k, 4): x, y, z in the frame of the cloud and the three-dimensional sigma [m]
    sample: Array = field(default_factory=lambda: np.zeros((0, 4)))
    _step: int = _THIN

    def add(self, xyz: Array, sigma: NDArray[np.float32] | None) -> None:
        """Take in points (n, 3) and their sigmas (n, 3), None where there are none."""
        if len(xyz) == 0:
            return
        _bounds(np.ascontiguousarray(xyz), self.low, self.high)
        first = -self.points % self._step
        self.points += len(xyz)
        if sigma is None:
            return
        squares, between = self.squares.copy(), np.zeros(len(_STEPS) + 1, dtype=np.int64)
        smallest, largest = _tally(np.ascontiguousarray(sigma), squares, between, _STEPS, _FIRST)
        upto = np.cumsum(between)
        self.squares = squares
        self.counts = self.counts + np.diff(upto[_EDGES_AT], prepend=0, append=len(sigma))
        self.within = self.within + upto[_LIMITS_AT]
        self.smallest, self.largest = min(self.smallest, smallest), max(self.largest, largest)
        chosen = slice(first, None, self._step)
        total = np.linalg.norm(sigma[chosen], axis=1)
        new = np.concatenate([xyz[chosen], total[:, None]], axis=1)
        self.sample = np.concatenate([self.sample, new])
        while len(self.sample) > _SAMPLE:
            self.sample, self._step = self.sample[::2], 2 * self._step

    @property
    def rms(self) -> Array:
        """Root mean square of the sigmas (3,) along the axes [m]."""
        out: Array = np.sqrt(self.squares / max(1, self.points))
        return out

    def quantile(self, share: float) -> float:
        """The three-dimensional sigma [m] that this share of the points does not exceed.

        Between the edges of a bin, which is 12 % wide, its points are taken as evenly spread.
        """
        cumulated = np.cumsum(self.counts)
        wanted = share * cumulated[-1]
        bin_ = int(np.searchsorted(cumulated, wanted))
        if bin_ == 0 or bin_ >= len(EDGES):
            return float(min(EDGES[min(bin_, len(EDGES) - 1)], self.largest))
        within = 1 - (cumulated[bin_] - wanted) / self.counts[bin_]
        sigma = EDGES[bin_ - 1] * (EDGES[bin_] / EDGES[bin_ - 1]) ** within
        return float(min(sigma, self.largest))

    @property
    def shares(self) -> dict[str, float]:
        """Share of the points whose 95 % uncertainty is within each class."""
        return {
            name: float(count / max(1, self.points))
            for name, count in zip(CLASSES, self.within, strict=True)
        }


@njit(cache=True, nogil=True)
def _bounds(xyz, low, high):  # type: ignore[no-untyped-def]
    """Widen bounds (3,) to points (n, 3)."""
    for n in range(len(xyz)):
        for k in range(3):
            low[k] = min(low[k], xyz[n, k])
            high[k] = max(high[k], xyz[n, k])


@njit(cache=True, nogil=True)
def _tally(sigma, squares, counts, steps, first):  # type: ignore[no-untyped-def]
    """Add sigmas (n, 3) to sums and to counts between the steps; the extremes (in space) of them.

    Exponent and first digits of the squared sigma say where in the steps to begin.
    """
    smallest, largest = np.inf, 0.0
    x2 = y2 = z2 = 0.0
    for n in range(len(sigma)):
        x, y, z = float(sigma[n, 0]), float(sigma[n, 1]), float(sigma[n, 2])
        smallest = min(smallest, min(x, min(y, z)))
        x2 += x * x
        y2 += y * y
        z2 += z * z
        square = x * x + y * y + z * z
        largest = max(largest, square)
        mantissa, exponent = math.frexp(max(square, 1e-30))
        cell = (exponent - _LOWEST) * _CELLS + int((mantissa - 0.5) * (2 * _CELLS))
        k = first[min(max(cell, 0), len(first) - 1)]
        while k < len(steps) and steps[k] < square:
            k += 1
        counts[k] += 1
    squares[0] += x2
    squares[1] += y2
    squares[2] += z2
    return smallest, np.sqrt(largest)
