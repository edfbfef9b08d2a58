"""What one pass over the points of a scan tells, in bounded memory."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.scan.scan import Chunk, Scan

__all__ = ["FieldRange", "Statistics", "statistics"]

Array = NDArray[np.float64]

#: first points, for what needs neighbours; points from all over the scan
_FIRST, _SPREAD = 1_500_000, 300_000
#: points that are compared with each other to find doubles
_COMPARED = 300_000
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)


@dataclass
class FieldRange:
    """Smallest and largest value of a field, and how many are not finite."""

    low: float = np.inf
    high: float = -np.inf
    bad: int = 0

    def add(self, column: NDArray[Any]) -> None:
        """Take in a column (n,) or (n, k)."""
        if column.dtype.kind == "f":
            finite = np.isfinite(column)
            if not finite.all():
                self.bad += int(column.size - np.count_nonzero(finite))
                column = column[finite]
        if column.size:
            self.low = min(self.low, float(column.min()))
            self.high = max(self.high, float(column.max()))


@dataclass
class Statistics:
    """Of the valid points of a scan.

    bounds (2, 3) [m]; zeros : points at exactly 0, 0, 0; single : all coordinates are numbers of 32
    bits; doubled : share of points that are there before; first (k, 3) : the first points; spread
    (k, 3) : points from all over.
    """

    points: int = 0
    dropped: int = 0
    bounds: Array | None = None
    zeros: int = 0
    single: bool = True
    doubled: float = 0.0
    fields: dict[str, FieldRange] = field(default_factory=dict)
    first: Array = field(default_factory=lambda: np.zeros((0, 3)))
    spread: Array = field(default_factory=lambda: np.zeros((0, 3)))


def statistics(scan: Scan) -> Statistics:
    """Read a scan once.

    Raises
    ------
    InputError : a damaged file.
    """
    out, doubles = Statistics(), _Doubles()
    first: list[Array] = []
    spread: list[Array] = []
    stride = max((scan.records or 0) // _SPREAD, 1)
    for chunk in scan.chunks():
        out.dropped += chunk.dropped
        if len(chunk) == 0:
            continue
        if out.points < _FIRST:
            first.append(chunk.xyz[: _FIRST - out.points])
        spread.append(chunk.xyz[(-out.points) % stride :: stride].copy())
        out.points += len(chunk)
        doubles.add(chunk.xyz)
        _add(out, chunk)
    out.doubled = doubles.share
    if first:
        out.first, out.spread = np.concatenate(first), np.concatenate(spread)
    return out


def _add(out: Statistics, chunk: Chunk) -> None:
    """Bounds, zeros, float resolution and the fields of one chunk."""
    bounds = np.stack([chunk.xyz.min(axis=0), chunk.xyz.max(axis=0)])
    if out.bounds is not None:
        bounds[0] = np.minimum(bounds[0], out.bounds[0])
        bounds[1] = np.maximum(bounds[1], out.bounds[1])
    out.bounds = bounds
    out.zeros += int(len(chunk) - np.count_nonzero(chunk.xyz.any(axis=1)))
    with np.errstate(over="ignore"):
        out.single = out.single and bool((chunk.xyz.astype(np.float32) == chunk.xyz).all())
    for name, column in chunk.values.items():
        out.fields.setdefault(name, FieldRange()).add(column)


class _Doubles:
    """Counts doubles among those points whose hash ends in enough zeros, wherever they stand."""

    def __init__(self) -> None:
        self._kept: NDArray[np.uint64] = np.zeros(0, dtype=np.uint64)
        self._bits = 0

    def add(self, xyz: Array) -> None:
        """Take in points (n, 3)."""
        bits = np.ascontiguousarray(xyz + 0.0).view(np.uint64)
        mixed = np.zeros(len(xyz), dtype=np.uint64)
        for k in range(3):
            mixed = (mixed ^ bits[:, k]) * _MIX[k]
            mixed ^= mixed >> np.uint64(29)
        self._kept = np.concatenate([self._kept, self._chosen(mixed)])
        while len(self._kept) > _COMPARED and self._bits < 40:
            self._bits += 1
            self._kept = self._chosen(self._kept)

    def _chosen(self, mixed: NDArray[np.uint64]) -> NDArray[np.uint64]:
        """Those whose lowest bits are zero."""
        mask = np.uint64((1 << self._bits) - 1)
        return np.asarray(mixed[(mixed & mask) == 0])

    @property
    def share(self) -> float:
        """Share of points that are there before."""
        if len(self._kept) == 0:
            return 0.0
        return 1 - len(np.unique(self._kept)) / len(self._kept)
