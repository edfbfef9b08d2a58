"""The octree of a COPC file: which point goes into which node?

Each point takes the coarsest node in which its cell of a grid of 128 x 128 x 128 is still free; the
first point in the file's order wins a cell. Two departures keep the number of nodes small: a node
that few points reach keeps them all, and a child that would get very few leaves them to its parent.

Clouds larger than memory are divided first: nodes that very many points reach (`Plan.upper`) take
theirs in one pass over the whole cloud, with a bit for each cell; the remaining subtrees (tiles)
are small enough to be made one after the other in memory.

Places are integers: parts of the root's side, 2^31 of them, so that the path of a point down the
tree is in its bits and nothing depends on rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Cube", "Nodes", "Plan", "subtree"]

Integers = NDArray[np.int64]
Places = NDArray[np.int32]

#: bits of a place; the grid within a node takes the last of them
_BITS, _GRID_BITS = 31, 7
#: cells of a node along each axis
GRID = 1 << _GRID_BITS
#: words of 32 bits that hold a bit for each cell of a node
_WORDS = GRID**3 // 32
#: nodes that at most so many points reach keep them
_LEAF = 30_000
#: children with fewer points leave them to their parent
_FEW = 1_000
#: levels over which points are counted before the cloud is divided
_COUNTED = 7


@dataclass(frozen=True)
class Cube:
    """The root node in integer coordinates: its lowest corner (3,) and its side, in steps."""

    corner: Integers
    side: int

    @classmethod
    def around(cls, low: Integers, high: Integers) -> Cube:
        """The smallest cube with the lowest corner of a box, at least a step large.

        No larger: some readers take the cube from the bounds in the header.
        """
        return cls(low, max(int((high - low).max()), 1))

    @property
    def deepest(self) -> int:
        """The level whose cells are no larger than a step: no point of it could be parted."""
        return min(max((self.side - 1).bit_length() - _GRID_BITS, 0), _BITS - _GRID_BITS)

    def places(self, x: NDArray[Any], y: NDArray[Any], z: NDArray[Any]) -> Places:
        """Places (n, 3) of points by their integer coordinates."""
        out = np.empty((len(x), 3), dtype=np.int32)
        for k, column in enumerate((x, y, z)):
            _place(column, self.corner[k], self.side, out[:, k])
        return out


@dataclass(frozen=True)
class Nodes:
    """Nodes in the order of their points.

    keys (m, 4) : level, x, y, z; ends (m,) : number of the point after the last of each.
    """

    keys: NDArray[np.int32]
    ends: Integers


class Plan:
    """How a cloud is divided: upper nodes that are filled in passing, and tiles below them.

    counts (128, 128, 128) : points in each cell of the root's grid, x first; tile : points that a
    tile may have; deepest : level that is not divided any more. Buckets are the ``upper`` nodes,
    level by level, and then the tiles; ``keys`` (m, 4) : level, x, y, z of each bucket's node.
    """

    def __init__(self, counts: Integers, tile: int, deepest: int) -> None:
        tables, upper, tiles = [], [], []
        many = np.ones((1, 1, 1), dtype=bool)
        for level in range(_COUNTED + 1):
            reached = _coarser(counts, _COUNTED - level)
            parents = many
            if level:
                parents = many.repeat(2, axis=0).repeat(2, axis=1).repeat(2, axis=2)
            many = parents & (reached > tile) & (level < min(deepest, _COUNTED))
            upper.append(_keys(level, many))
            tiles.append(_keys(level, parents & ~many & (reached > 0)))
            tables.append(np.full(reached.size, -1, dtype=np.int32))
        self.upper = sum(map(len, upper))
        self.keys = np.concatenate(upper + tiles)
        starts = np.cumsum([0] + [len(table) for table in tables])
        self._starts, self._table = starts, np.concatenate(tables)
        level, x, y, z = self.keys.T.astype(np.int64)
        self._table[starts[level] + ((x << level) + y << level) + z] = np.arange(len(self.keys))
        self._cells = np.zeros((self.upper, _WORDS), dtype=np.uint32)

    @staticmethod
    def count(places: Places, counts: Integers) -> None:
        """Add points to the counts that a plan is made from."""
        _count(places, counts)

    @staticmethod
    def no_counts() -> Integers:
        """Counts to begin with."""
        return np.zeros((1 << _COUNTED,) * 3, dtype=np.int64)

    def buckets(self, places: Places) -> NDArray[np.int32]:
        """Bucket (n,) of the next points of the cloud; cells that they take stay taken."""
        out = np.empty(len(places), dtype=np.int32)
        _descend(places, self._table, self._starts, self._cells, out)
        return out


def subtree(places: Places, level: int, deepest: int) -> tuple[NDArray[np.int64], Nodes]:
    """The nodes of a tile whose own node is of this level, and the order (n,) of its points.

    Nodes come depth first, points of a node in the order given.
    """
    bound = (_BITS + 1) * (len(places) // _FEW + 1)
    order = np.arange(len(places))
    levels, ends = np.empty(bound, dtype=np.int32), np.empty(bound, dtype=np.int64)
    number = _grow(places, level, deepest, order, levels, ends)
    levels, ends = levels[:number], ends[:number]
    first = places[order[np.concatenate([[0], ends[:-1]])]]
    keys = np.column_stack([levels, first >> (_BITS - levels)[:, None]]).astype(np.int32)
    return order, Nodes(keys, ends)


def _coarser(counts: Integers, steps: int) -> Integers:
    """Counts in cells 2^steps as large."""
    size = len(counts) >> steps
    cells = counts.reshape(size, 1 << steps, size, 1 << steps, size, 1 << steps)
    summed: Integers = cells.sum(axis=(1, 3, 5))
    return summed


def _keys(level: int, chosen: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Level, x, y, z of the chosen nodes of a level."""
    places = np.argwhere(chosen)
    return np.insert(places, 0, level, axis=1).astype(np.int32)


@njit(cache=True, nogil=True)
def _place(column, corner, side, out):  # type: ignore[no-untyped-def]
    """Integer coordinates as parts of the side; those on the far face are in the last part."""
    last = np.uint64(2**31 - 1)
    for n in range(len(column)):
        steps = np.int64(column[n]) - corner
        part = (np.uint64(steps) << np.uint64(31)) // np.uint64(side)
        out[n] = np.int32(min(part, last))


@njit(cache=True, nogil=True)
def _count(places, counts):  # type: ignore[no-untyped-def]
    shift = _BITS - _COUNTED
    for n in range(len(places)):
        counts[places[n, 0] >> shift, places[n, 1] >> shift, places[n, 2] >> shift] += 1


@njit(cache=True, nogil=True, inline="always")
def _takes(place, level, cells):  # type: ignore[no-untyped-def]
    """Take the cell of a place in a node of this level; False if it was taken."""
    shift = _BITS - _GRID_BITS - level
    cell = 0
    for k in range(3):
        cell = (cell << _GRID_BITS) | ((place[k] >> shift) & (GRID - 1))
    bit = np.uint32(1) << np.uint32(cell & 31)
    word = cell >> 5
    if cells[word] & bit:
        return False
    cells[word] |= bit
    return True


@njit(cache=True, nogil=True)
def _descend(places, table, starts, cells, out):  # type: ignore[no-untyped-def]
    """The bucket of each point, in order: the first upper node with a free cell, or a tile."""
    for n in range(len(places)):
        level = 0
        while True:
            shift = _BITS - level
            index = 0
            for k in range(3):
                index = (index << level) + (places[n, k] >> shift)
            bucket = table[starts[level] + index]
            if bucket >= len(cells) or _takes(places[n], level, cells[bucket]):
                break
            level += 1
        out[n] = bucket


@njit(cache=True, nogil=True)
def _grow(places, level, deepest, order, levels, ends):  # type: ignore[no-untyped-def]
    """Divide a tile depth first; the number of nodes, written with their ends and the order."""
    cells, scratch = np.empty(_WORDS, dtype=np.uint32), np.empty_like(order)
    part = np.empty(len(order), dtype=np.uint8)
    stack = [(0, len(order), level)]
    nodes = 0
    while len(stack):
        begin, end, level = stack.pop()
        stay = end
        if end - begin > _LEAF and level < deepest:
            cells[:] = 0
            sizes = _shares(places, level, order[begin:end], cells, part)
            _sorted_by_part(order[begin:end], part, sizes, scratch)
            stay = begin + sizes[0]
            for octant in range(8, 0, -1):
                if sizes[octant]:
                    stack.append((end - sizes[octant], end, level + 1))
                    end -= sizes[octant]
        levels[nodes], ends[nodes] = level, stay
        nodes += 1
    return nodes


@njit(cache=True, nogil=True)
def _shares(places, level, order, cells, part):  # type: ignore[no-untyped-def]
    """Part of each point, 0 for the node itself, 1 to 8 for its children, and their sizes (9,)."""
    sizes = np.zeros(9, dtype=np.int64)
    shift = _BITS - 1 - level
    for n in range(len(order)):
        place = places[order[n]]
        part[n] = 0
        if not _takes(place, level, cells):
            for k in range(3):
                part[n] |= ((place[k] >> shift) & 1) << k
            part[n] += 1
        sizes[part[n]] += 1
    few = np.zeros(9, dtype=np.bool_)
    for octant in range(1, 9):
        if sizes[octant] < _FEW:
            few[octant] = True
            sizes[0] += sizes[octant]
            sizes[octant] = 0
    for n in range(len(order)):
        if few[part[n]]:
            part[n] = 0
    return sizes


@njit(cache=True, nogil=True)
def _sorted_by_part(order, part, sizes, scratch):  # type: ignore[no-untyped-def]
    """Sort by part, keeping the order within each."""
    at = np.cumsum(sizes) - sizes
    for n in range(len(order)):
        scratch[at[part[n]]] = order[n]
        at[part[n]] += 1
    order[:] = scratch[: len(order)]
