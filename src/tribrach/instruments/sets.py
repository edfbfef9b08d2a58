"""Which readings of a set-up belong to one set?

Files tell the order of readings, seldom the sets. A set holds each target once in each face; it
ends where a target comes again in a face in which it was read before. Readings one after the
other of the same target in the same face are one pointing, and a half-set that ends on its first
target closes the horizon rather than beginning a new set.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Sets", "find_sets"]

Index = NDArray[np.int64]


@dataclass(frozen=True)
class Sets:
    """Set (n,) of each reading from 0 on, and whether it closes the horizon (n,)."""

    number: Index
    closing: NDArray[np.bool_]


def find_sets(target: Index, face: NDArray[np.int8], series: Index | None = None) -> Sets:
    """Sets of n readings in the order they were taken.

    Parameters
    ----------
    target (n,) index; face (n,) 1 or 2; series (n,) numbers of sets that the file says, 0 where
    it does not; a change of it begins a set.
    """
    n = len(target)
    number, closing = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool)
    said = np.zeros(n, dtype=np.int64) if series is None else series
    keys = list(zip(target.tolist(), face.tolist(), strict=True))
    seen: set[tuple[int, int]] = set()
    current, half = 0, 0
    for i, key in enumerate(keys):
        fresh = i > 0 and said[i] != said[i - 1]
        if i > 0 and keys[i - 1][1] != key[1]:
            half = i
        repeated = i > 0 and keys[i - 1] == key
        if fresh or (key in seen and not repeated):
            if not fresh and i > half + 1 and key == keys[half] and _ends(keys, i):
                closing[i] = True
            else:
                current, half = current + 1, i
                seen = set()
        seen.add(key)
        number[i] = current
    return Sets(number, closing)


def _ends(keys: list[tuple[int, int]], i: int) -> bool:
    """True if the half-set ends here: the other face, the same target again, or nothing follows."""
    return i + 1 == len(keys) or keys[i + 1][1] != keys[i][1] or keys[i + 1] == keys[i]
