"""Figures of millions of distances, gathered chunk by chunk. Metres."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Sample", "Tally"]

Array = NDArray[np.float64]

#: bins of the histogram that quantiles are read from
BINS = 20_000


@dataclass
class Tally:
    """Distances so far: from ``low`` to ``high`` [m], and how many were beyond.

    Sums are taken about the middle of the first chunk, so that they lose no digits.
    """

    low: float
    high: float
    count: int = 0
    beyond: int = 0
    shift: float = 0.0
    total: float = 0.0
    squares: float = 0.0
    bins: NDArray[np.int64] = field(default_factory=lambda: np.zeros(BINS, dtype=np.int64))

    def add(self, distances: Array) -> None:
        """Take in distances (n,); those that are not finite or out of the limits are beyond."""
        near = distances[(distances >= self.low) & (distances <= self.high)]
        self.beyond += len(distances) - len(near)
        if len(near) == 0:
            return
        if self.count == 0:
            self.shift = float(near.mean())
        self.count += len(near)
        self.total += float((near - self.shift).sum())
        self.squares += float(((near - self.shift) ** 2).sum())
        scaled = (near - self.low) * (BINS / (self.high - self.low))
        self.bins += np.bincount(np.minimum(scaled.astype(np.int64), BINS - 1), minlength=BINS)

    @property
    def mean(self) -> float:
        """Mean [m]."""
        return self.shift + self.total / self.count

    @property
    def std(self) -> float:
        """Standard deviation about the mean [m]."""
        return float(np.sqrt(max(self.squares / self.count - (self.total / self.count) ** 2, 0.0)))

    @property
    def rms(self) -> float:
        """Root mean square [m]."""
        return float(np.hypot(self.mean, self.std))

    @property
    def share_beyond(self) -> float:
        """Share of all distances that were beyond."""
        return self.beyond / max(self.beyond + self.count, 1)

    def quantile(self, share: float) -> float:
        """The distance [m] that this share does not exceed, to a twenty-thousandth of the limits.

        Within its bin distances are taken as even.
        """
        wanted = share * self.count
        cumulated = np.cumsum(self.bins)
        k = int(np.searchsorted(cumulated, wanted))
        before = cumulated[k] - self.bins[k]
        within = (wanted - before) / max(self.bins[k], 1)
        return float(self.low + (k + within) * (self.high - self.low) / BINS)

    def histogram(self, bins: int) -> tuple[Array, NDArray[np.int64]]:
        """Edges (bins + 1,) [m] and counts (bins,); the number of bins divides 20,000."""
        return np.linspace(self.low, self.high, bins + 1), self.bins.reshape(bins, -1).sum(axis=1)


@dataclass
class Sample:
    """Every so-many-th row of a long table: at most ``most`` rows, evenly over all of it."""

    most: int
    width: int
    step: int = 1
    seen: int = 0
    rows: NDArray[Any] = field(default_factory=lambda: np.empty((0, 0)))

    def __post_init__(self) -> None:
        self.rows = np.empty((0, self.width))

    def add(self, rows: NDArray[Any]) -> None:
        """Take in rows (n, width)."""
        first = -self.seen % self.step
        self.seen += len(rows)
        self.rows = np.concatenate([self.rows, rows[first :: self.step]])
        while len(self.rows) > self.most:
            self.rows, self.step = self.rows[::2], 2 * self.step
