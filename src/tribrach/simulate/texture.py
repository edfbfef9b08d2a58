"""Errors of ranges that neighbouring beams of a simulated scanner share.

White texture lies on the sphere of directions, finer than the beams; each beam has the mean over
its disc. Beams have the texture in common that their discs have, so that their errors are
correlated as method section 5.7 says. Each column of the grid draws its own texture from the seed
of the scan, so that blocks fit together and the draws of the rest of the scan stay what they are
without.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.instruments.neighbours import SharedNoise

#: cells of texture over the diameter of a disc, about, and for a step of the grid at most
_ACROSS, _FINEST = 24, 6
#: range that the fineness is chosen for [m]
_USUAL = 10.0
#: columns that a disc reaches to either side at most; near the poles it would be all of them
_REACH = 64
#: what parts these draws from all others of a scan, and the first column of a halo
_KEY, _FIRST = 57, 1_000_000


@dataclass(frozen=True)
class SharedTexture:
    """Texture over the directions of one scan."""

    #: what neighbours share
    shared: SharedNoise
    #: V of the first row, and the step of the grid [rad]
    first_v: float
    step: float
    #: of the grid
    rows: int
    #: seed of the scan
    entropy: tuple[int, ...]

    def mixed(self, own: Array, row: Index, column: Index, length: Array) -> Array:
        """Errors of variance one, made of beams' own standard normal ones and of what they share.

        Columns lie side by side; ranges tell the width of the discs [m].
        """
        if not len(own):
            return own
        share = self.shared.share
        mixed: Array = np.sqrt(1 - share) * own + np.sqrt(share) * self._seen(row, column, length)
        return mixed

    def _seen(self, row: Index, column: Index, length: Array) -> Array:
        """Means (n,) of the texture over discs, times the root of their cells."""
        usual = float(self.shared.diameter(np.array([_USUAL]))[0]) / _USUAL
        fine = int(np.clip(round(_ACROSS * self.step / max(usual, 1e-12)), 1, _FINEST))
        cell = self.step / fine
        radius = self.shared.diameter(length) / length / 2 / cell
        sine = np.maximum(np.abs(np.sin(self.first_v + row * self.step)), 1e-3)
        reach = int(np.ceil(min(float((radius / sine).max()) / fine + 1, _REACH)))
        first = int(column.min()) - reach
        above = int(np.ceil(float(radius.max()))) + 1
        sums = self._sums(first, int(column.max()) + reach, fine, above)
        place, middle = row * fine + above, (column - first) * fine
        widest = reach * fine - 1
        total, cells = np.zeros(len(row)), np.zeros(len(row))
        for k in range(-above, above + 1):
            left = radius**2 - k**2
            at = np.flatnonzero(left >= 0)
            half = np.minimum(np.sqrt(left[at]) / sine[at], widest).astype(np.int64)
            line = place[at] + k
            total[at] += sums[line, middle[at] + half + 1] - sums[line, middle[at] - half]
            cells[at] += 2 * half + 1
        seen: Array = total / np.sqrt(np.maximum(cells, 1))
        return seen

    def _sums(self, first: int, last: int, fine: int, above: int) -> Array:
        """Sums along H of the texture over some columns, with ``above`` cells beyond all rows."""
        high = self.rows * fine + 2 * above + fine
        parts = []
        for column in range(first, last + 1):
            key = (_KEY, column + _FIRST)
            rng = np.random.default_rng(np.random.SeedSequence(self.entropy, spawn_key=key))
            parts.append(rng.standard_normal((fine, high)).T)
        texture = np.concatenate([np.zeros((high, 1)), *parts], axis=1)
        return np.asarray(np.cumsum(texture, axis=1))
