"""Groups of observations that come or go together, with the unknowns that come or go with them.

A new target seen from some stations brings rows ``[A B]``: A by unknowns of the network, B by its
own. What the rows say about the network, whatever the own unknowns are, is ``M A`` with the
projector ``M = I - B (B^T B)^-1 B^T``; the information added is ``A^T M A``. The same rows of a
target that is there already are what the network loses with it. Groups are kept as padded dense
blocks, so that thousands of them are judged at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index

#: smallest eigenvalue of the unit-diagonal B^T B with which own unknowns count as determined
_DETERMINED = 1e-9
#: bytes of one set of blocks
_MEMORY = 32_000_000


@dataclass(frozen=True)
class Blocks:
    """Groups (c,) of up to k whitened rows by up to w unknowns of the network."""

    number: Index  #: (c,), number of each group
    rows: Array  #: (c, k, w), ``M A``, zero where padded
    columns: Index  #: (c, w), columns of the prospect, -1 where padded
    leverage: Array  #: (c, k), diagonal of ``I - M``
    line: Index  #: (c, k), rows of the design they came from, -1 where padded
    determined: NDArray[np.bool_]  #: (c,), false where the rows do not determine their own unknowns

    def __len__(self) -> int:
        return len(self.number)

    def take(self, chosen: Index) -> Blocks:
        """Some of the groups."""
        return Blocks(*(getattr(self, name)[chosen] for name in Blocks.__dataclass_fields__))


def group_rows(design: sp.csr_array, group: Index, place: Index) -> list[Blocks]:
    """Form blocks of all groups, those with the same number of rows together.

    A row belongs to the group of its own columns; rows without any are left out.

    ``group`` is the group that owns a column, -1 for columns of the network; ``place`` the column
    of the prospect for these, -1 where it is held fixed.
    """
    triple = design.tocoo()
    owner = np.full(design.shape[0], -1, dtype=np.int64)
    np.maximum.at(owner, triple.row, group[triple.col])
    used = np.flatnonzero(owner >= 0)
    if len(used) == 0:
        return []
    numbers, which, count = np.unique(owner[used], return_inverse=True, return_counts=True)
    order = np.argsort(which, kind="stable")
    rank = np.empty(len(used), dtype=np.int64)
    first = np.cumsum(count) - count
    rank[order] = np.arange(len(used)) - np.repeat(first, count)
    member = np.full(design.shape[0], -1, dtype=np.int64)
    member[used] = which
    position = np.zeros(design.shape[0], dtype=np.int64)
    position[used] = rank
    parts = _Triples(design, member, position, group, place)
    out = []
    for size in np.unique(count):
        same = np.flatnonzero(count == size)
        room = max(1, _MEMORY // (8 * int(size) * max(int(size), parts.widest(same))))
        for chosen in np.array_split(same, -(-len(same) // room)):
            out.append(parts.blocks(chosen, int(size), numbers[chosen]))
    return out


class _Triples:
    """Entries of the design sorted by group, on their way into dense blocks."""

    def __init__(
        self, design: sp.csr_array, member: Index, position: Index, group: Index, place: Index
    ) -> None:
        triple = design.tocoo()
        row, column, value = triple.row.astype(np.int64), triple.col.astype(np.int64), triple.data
        used = member[row] >= 0
        row, column, value = row[used], column[used], value[used]
        self.own = group[column] >= 0
        keep = self.own | (place[column] >= 0)
        row, column, value, self.own = row[keep], column[keep], value[keep], self.own[keep]
        self.member, self.position, self.value = member[row], position[row], value
        self.row, self.place = row, place
        width = design.shape[1]
        # columns are numbered within their group, own ones and those of the network apart
        self.local, self.columns, self.count = {}, {}, {}
        groups = int(member.max(initial=-1)) + 1
        for own in (False, True):
            of = np.flatnonzero(self.own == own)
            key, back = np.unique(self.member[of] * width + column[of], return_inverse=True)
            holder = key // width
            count = np.bincount(holder, minlength=groups)
            first = np.cumsum(count) - count
            local = np.zeros(len(self.own), dtype=np.int64)
            local[of] = (np.arange(len(key)) - first[holder])[back]
            self.local[own], self.columns[own], self.count[own] = local, key % width, count

    def widest(self, chosen: Index) -> int:
        """Most unknowns of the network that one of the groups touches."""
        return int(self.count[False][chosen].max(initial=1))

    def blocks(self, chosen: Index, k: int, number: Index) -> Blocks:
        """Dense blocks of chosen groups with k rows each."""
        of = np.full(int(self.member.max()) + 1, -1, dtype=np.int64)
        of[chosen] = np.arange(len(chosen))
        slot = of[self.member]
        w = self.widest(chosen)
        m = int(self.count[True][chosen].max(initial=0))
        by_network, by_own = np.zeros((len(chosen), k, w)), np.zeros((len(chosen), k, m))
        line = np.full((len(chosen), k), -1, dtype=np.int64)
        for own, target in ((False, by_network), (True, by_own)):
            members = (slot >= 0) & (self.own == own)
            target[slot[members], self.position[members], self.local[own][members]] = self.value[
                members
            ]
        members = slot >= 0
        line[slot[members], self.position[members]] = self.row[members]
        columns = np.full((len(chosen), w), -1, dtype=np.int64)
        first = np.cumsum(self.count[False]) - self.count[False]
        inside = np.arange(w) < self.count[False][chosen][:, None]
        index = first[chosen][:, None] + np.arange(w)
        columns[inside] = self.place[self.columns[False][index[inside]]]
        basis, determined = _own_basis(by_own)
        rows = by_network - basis @ (basis.transpose(0, 2, 1) @ by_network)
        return Blocks(
            number=number,
            rows=rows,
            columns=columns,
            leverage=(basis**2).sum(axis=2),
            line=line,
            determined=determined,
        )


def _own_basis(by_own: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Orthonormal columns (c, k, m) that span B, zero if padded; where B has full rank (c,)."""
    if by_own.shape[2] == 0:
        return by_own, np.ones(len(by_own), dtype=bool)
    length = np.sqrt((by_own**2).sum(axis=1))
    padded = length == 0
    unit = by_own / np.where(padded, 1.0, length)[:, None, :]
    gram = unit.transpose(0, 2, 1) @ unit
    m = gram.shape[1]
    gram[:, np.arange(m), np.arange(m)] += padded
    value, vector = np.linalg.eigh(gram)
    determined = value[:, 0] > _DETERMINED
    root = np.where(value > _DETERMINED, value, np.inf)
    basis = unit @ (vector / np.sqrt(root)[:, None, :])
    return basis, determined


def join(parts: Sequence[Blocks]) -> Blocks:
    """Join several sets of groups, padded to one size."""
    k = max(part.rows.shape[1] for part in parts)
    w = max(part.rows.shape[2] for part in parts)

    def padded(array: NDArray[Any], shape: tuple[int, ...], fill: float) -> NDArray[Any]:
        return np.pad(
            array,
            [(0, 0), *((0, n - m) for n, m in zip(shape, array.shape[1:], strict=True))],
            constant_values=fill,
        )

    return Blocks(
        number=np.concatenate([part.number for part in parts]),
        rows=np.concatenate([padded(part.rows, (k, w), 0.0) for part in parts]),
        columns=np.concatenate([padded(part.columns, (w,), -1) for part in parts]),
        leverage=np.concatenate([padded(part.leverage, (k,), 0.0) for part in parts]),
        line=np.concatenate([padded(part.line, (k,), -1) for part in parts]),
        determined=np.concatenate([part.determined for part in parts]),
    )
