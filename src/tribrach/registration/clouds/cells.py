"""Points of a scan summed up in cubes, chunk by chunk: counts, first and second moments.

Cubes of one size lie on a lattice about the scanner; moments are kept about the middle of each
cube, so that nothing is lost far away. Cubes merge into cubes of twice the size exactly. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["MOMENTS", "CellSum", "Cells", "coarser"]

Array = NDArray[np.float64]
Keys = NDArray[np.int64]

#: n, x, y, z, xx, xy, xz, yy, yz, zz
MOMENTS = 10
#: bits of each of the three numbers of a cube
_BITS = 20
_HALF = 1 << (_BITS - 1)
_MASK = (1 << _BITS) - 1
#: more cubes than this are merged into larger ones while they are filled: 300 MB
_MOST = 2_000_000
_ROOM = 1 << 14


@dataclass(frozen=True, eq=False)
class Cells:
    """Cubes of ``size`` [m]: keys (m,) that hold their three numbers, moments (m, 10)."""

    size: float
    keys: Keys
    moments: Array

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def middles(self) -> Array:
        """Middles (m, 3) of the cubes [m]."""
        numbers = np.stack([self.keys >> (2 * _BITS), self.keys >> _BITS, self.keys], axis=1)
        return np.asarray(((numbers & _MASK) - _HALF + 0.5) * self.size, dtype=np.float64)

    def subset(self, chosen: NDArray[np.bool_] | Keys) -> Cells:
        """Some of the cubes, by a mask (m,) or indices."""
        return Cells(self.size, self.keys[chosen], self.moments[chosen])


class CellSum:
    """Cubes while points come in.

    size : edge of the cubes [m]; it doubles whenever more than ``most`` cubes would be needed.
    """

    def __init__(self, size: float, most: int = _MOST) -> None:
        self.size, self._most, self._count = size, most, 0
        self._keys: Keys = np.empty(0, dtype=np.int64)
        self._moments: Array = np.zeros((0, MOMENTS))
        self._table: Keys = np.empty(0, dtype=np.int64)
        self._restart(Cells(size, np.empty(0, dtype=np.int64), np.zeros((0, MOMENTS))))

    def add(self, xyz: Array) -> None:
        """Add points (n, 3) [m]; not finite or beyond 500,000 cubes they are left out."""
        xyz = np.ascontiguousarray(xyz)
        first = 0
        while first < len(xyz):
            first, self._count = _add(
                xyz, first, self.size, self._table, self._keys, self._moments, self._count
            )
            if first < len(xyz):
                self._restart(self.cells)
            while self._count > self._most:
                self._restart(coarser(self.cells))

    @property
    def cells(self) -> Cells:
        """The cubes so far."""
        n = self._count
        return Cells(self.size, self._keys[:n].copy(), self._moments[:n].copy())

    def _restart(self, cells: Cells) -> None:
        """Go on from cubes with room for as many again."""
        self.size, self._count = cells.size, len(cells)
        room = max(_ROOM, 2 * len(cells))
        self._keys, self._moments = np.empty(room, dtype=np.int64), np.zeros((room, MOMENTS))
        self._keys[: self._count], self._moments[: self._count] = cells.keys, cells.moments
        self._table = np.full(1 << (2 * room - 1).bit_length(), -1, dtype=np.int64)
        _enter(self._keys, self._count, self._table)


def coarser(cells: Cells) -> Cells:
    """Cubes of twice the size with the same points."""
    return Cells(2 * cells.size, *_merged(cells.keys, cells.moments, cells.size))


@njit(cache=True, nogil=True)
def _slot(key, table, keys):  # type: ignore[no-untyped-def]
    """Place of a key in the table, or the empty place where it belongs."""
    mask = len(table) - 1
    hashed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    at = np.int64((hashed >> np.uint64(20)) & np.uint64(mask))
    while table[at] >= 0 and keys[table[at]] != key:
        at = (at + 1) & mask
    return at


@njit(cache=True, nogil=True)
def _enter(keys, count, table):  # type: ignore[no-untyped-def]
    for number in range(count):
        table[_slot(keys[number], table, keys)] = number


@njit(cache=True, nogil=True)
def _add(xyz, first, size, table, keys, moments, count):  # type: ignore[no-untyped-def]
    """Sum up points from ``first`` on until there is no room; next point, number of cubes."""
    cell = np.empty(3, dtype=np.int64)
    d = np.empty(3)
    for n in range(first, len(xyz)):
        inside = True
        for axis in range(3):
            number = np.floor(xyz[n, axis] / size)
            # NaN is not inside either
            inside = inside and abs(number) < _HALF - 1
            if inside:
                cell[axis] = np.int64(number)
                d[axis] = xyz[n, axis] - (number + 0.5) * size
        if not inside:
            continue
        key = ((cell[0] + _HALF) << (2 * _BITS)) | ((cell[1] + _HALF) << _BITS)
        key |= cell[2] + _HALF
        at = _slot(key, table, keys)
        if table[at] < 0:
            if count == len(keys):
                return n, count
            table[at] = count
            keys[count] = key
            count += 1
        m = moments[table[at]]
        m[0] += 1.0
        for axis in range(3):
            m[1 + axis] += d[axis]
        m[4] += d[0] * d[0]
        m[5] += d[0] * d[1]
        m[6] += d[0] * d[2]
        m[7] += d[1] * d[1]
        m[8] += d[1] * d[2]
        m[9] += d[2] * d[2]
    return len(xyz), count


@njit(cache=True, nogil=True)
def _merged(keys, moments, size):  # type: ignore[no-untyped-def]
    """Keys and moments of cubes of twice the size."""
    table = np.full(1, -1, dtype=np.int64)
    room = 1
    while room < 2 * len(keys) + 2:
        room *= 2
    table = np.full(room, -1, dtype=np.int64)
    out_keys = np.empty(len(keys), dtype=np.int64)
    out = np.zeros((len(keys), MOMENTS))
    count = 0
    s = np.empty(3)
    for n in range(len(keys)):
        key = np.int64(0)
        for axis in range(3):
            number = ((keys[n] >> ((2 - axis) * _BITS)) & _MASK) - _HALF
            half = number >> 1
            s[axis] = (0.5 if number & 1 else -0.5) * size
            key = (key << _BITS) | (half + _HALF)
        at = _slot(key, table, out_keys)
        if table[at] < 0:
            table[at] = count
            out_keys[count] = key
            count += 1
        m, o = moments[n], out[table[at]]
        o[0] += m[0]
        k = 4
        for i in range(3):
            o[1 + i] += m[1 + i] + m[0] * s[i]
            for j in range(i, 3):
                o[k] += m[k] + s[i] * m[1 + j] + s[j] * m[1 + i] + m[0] * s[i] * s[j]
                k += 1
    return out_keys[:count].copy(), out[:count].copy()
