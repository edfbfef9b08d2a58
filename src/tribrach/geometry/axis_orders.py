"""Orders and signs of the axes of coordinates: columns exchanged, an axis that runs the other way.

Mirror images differ by a rotation only: the likely one leaves heights upright, and two exchanged
columns are more common than a reversed one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from tribrach._types import Array


@dataclass(frozen=True)
class AxisOrder:
    """Which column stands for which axis, and which way it runs."""

    moved: tuple[int, ...]  #: column of each axis
    signs: tuple[int, ...]  #: 1, or -1 where the axis runs the other way

    def __call__(self, points: Array) -> Array:
        """Points (n, d) with their axes so."""
        out: Array = points[:, self.moved] * self.signs
        return out

    @property
    def plain(self) -> bool:
        """True if nothing is changed."""
        return not self.changes

    @property
    def changes(self) -> int:
        """How many columns differ."""
        pairs = enumerate(zip(self.moved, self.signs, strict=True))
        return sum(k != i or s < 0 for i, (k, s) in pairs)

    @property
    def mirrors(self) -> bool:
        """True if a left-handed system comes of a right-handed one."""
        matrix = np.eye(len(self.moved))[list(self.moved)] * np.array(self.signs)
        return bool(np.linalg.det(matrix) < 0)

    def words(self, titles: Sequence[str]) -> str:
        """The exchange in words, with the titles of the columns."""
        odd = [titles[i] for i, k in enumerate(self.moved) if k != i]
        negative = [titles[k] for k, s in zip(self.moved, self.signs, strict=True) if s < 0]
        words = []
        if odd:
            words.append(f"the columns {' and '.join(odd)} look exchanged")
            if len(odd) == 2 and not negative:
                words.append(f"or one of {odd[0]} and {odd[1]} reversed")
        if negative:
            verb = "looks" if len(negative) == 1 else "look"
            words.append(f"{' and '.join(negative)} {verb} reversed")
        return ", ".join(words)


def axis_orders(dimension: int) -> Iterator[AxisOrder]:
    """All orders and signs of so many axes."""
    for moved in permutations(range(dimension)):
        for signs in product((1, -1), repeat=dimension):
            yield AxisOrder(moved, signs)
