"""Points counted in the cells of a grid, chunk by chunk: memory grows with surface, not points.

A cell is one number: three signed indices of 21 bits from an origin near the points. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError

__all__ = ["MOST", "PatchGrid", "Patches", "found_in"]

Array = NDArray[np.float64]
Keys = NDArray[np.int64]

#: most cells of one cloud in memory: 24 bytes each
MOST = 60_000_000
_HALF = 1 << 20
_BITS = 21
#: cells waiting to be merged
_WAITING = 2_000_000


@dataclass(frozen=True)
class PatchGrid:
    """Cubic cells of a size [m] around an origin (3,) [m]."""

    origin: Array
    size: float

    @classmethod
    def around(cls, xyz: Array, size: float) -> PatchGrid:
        """The grid for points like these (n, 3), its cells at multiples of the size."""
        return cls(np.floor(np.median(xyz, axis=0) / size) * size, size)

    def keys(self, xyz: Array) -> Keys:
        """Cells (n,) of points (n, 3) [m].

        Raises
        ------
        InputError : a point is too far from the origin for cells of this size.
        """
        index = np.floor((xyz - self.origin) / self.size)
        if len(index) and np.abs(index).max() >= _HALF - 1:
            raise InputError(
                f"points lie more than {_HALF * self.size / 1000:.0f} km apart, too far for cells "
                f"of {self.size:g} m",
                cure="clean the clouds, put all into one frame, or take larger cells",
            )
        whole = index.astype(np.int64) + _HALF
        return (whole[:, 0] << (2 * _BITS)) | (whole[:, 1] << _BITS) | whole[:, 2]

    def indices(self, keys: Keys) -> Keys:
        """Signed indices (n, 3) of cells (n,)."""
        mask = (1 << _BITS) - 1
        parts = (keys >> (2 * _BITS), (keys >> _BITS) & mask, keys & mask)
        return np.stack(parts, axis=1) - _HALF

    def centres(self, keys: Keys) -> Array:
        """Middles (n, 3) [m] of cells (n,)."""
        middle: Array = self.origin + (self.indices(keys) + 0.5) * self.size
        return middle

    @staticmethod
    def shifted(keys: Keys, step: tuple[int, int, int]) -> Keys:
        """The neighbours (n,) of cells (n,) at a step of cells."""
        return keys + (step[0] * (1 << (2 * _BITS)) + step[1] * (1 << _BITS) + step[2])


@dataclass
class Patches:
    """Cells of one cloud, sorted: how many points each has, the sum of their variances [m^2]."""

    keys: Keys = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    sums: Array = field(default_factory=lambda: np.zeros(0))
    _waiting: list[tuple[Keys, NDArray[np.int64], Array]] = field(default_factory=list)
    _size: int = 0

    def add(self, keys: Keys, variance: Array | None = None) -> None:
        """Count points by their cells (n,); variance (n,) [m^2], None where it is not known.

        Raises
        ------
        InputError : more cells than fit.
        """
        found, where, counts = np.unique(keys, return_inverse=True, return_counts=True)
        sums: Array = np.zeros(len(found))
        if variance is not None:
            sums = np.bincount(where, weights=variance, minlength=len(found)).astype(np.float64)
        self._waiting.append((found, counts.astype(np.int64), sums))
        self._size += len(found)
        # merging only what is as large as what is there keeps the work in proportion
        if self._size > max(_WAITING, len(self.keys)):
            self.merge()

    def merge(self) -> None:
        """Bring everything that waits into the sorted cells.

        Raises
        ------
        InputError : more cells than fit.
        """
        if not self._waiting:
            return
        parts = [(self.keys, self.counts, self.sums), *self._waiting]
        keys, counts, sums = (np.concatenate(column) for column in zip(*parts, strict=True))
        self.keys, where = np.unique(keys, return_inverse=True)
        if len(self.keys) > MOST:
            raise InputError(
                f"the clouds fill more than {MOST / 1e6:.0f} million cells", cure="take larger ones"
            )
        total = np.bincount(where, weights=counts, minlength=len(self.keys))
        self.counts = np.round(total).astype(np.int64)
        merged = np.bincount(where, weights=sums, minlength=len(self.keys))
        self.sums = merged.astype(np.float64)
        self._waiting, self._size = [], 0


def found_in(keys: Keys, wanted: Keys) -> Keys:
    """Places (n,) of wanted cells in sorted ones, -1 where they are not."""
    if len(keys) == 0:
        return np.full(len(wanted), -1, dtype=np.int64)
    place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[place] == wanted, place, -1)
