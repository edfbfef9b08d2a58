"""Covers triangles with points no farther apart than a given spacing. Metres."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tribrach._types import Array

__all__ = ["covering_points"]


#: parts along an edge; larger triangles are split in four first
_PARTS = 128
#: points at a time
_CHUNK = 1_000_000


def covering_points(triangles: Array, spacing: float) -> Iterator[Array]:
    """Points on triangles, corners included.

    Parameters
    ----------
    triangles : (n, 3, 3)
        Corners [m].
    spacing
        Largest distance between neighbours [m].
    """
    waiting = [np.asarray(triangles, dtype=float)]
    while waiting:
        batch = waiting.pop()
        longest = np.linalg.norm(batch - np.roll(batch, 1, axis=1), axis=2).max(axis=1)
        parts = np.ceil(longest / spacing)
        large = parts > _PARTS
        if large.any():
            # a bounded number at a time, so that one huge triangle does not fill the memory
            for part in np.array_split(batch[large], np.count_nonzero(large) // 10_000 + 1):
                waiting.append(_split(part))
        small, number = batch[~large], np.maximum(parts[~large], 1).astype(np.int64)
        for n in np.unique(number):
            yield from _covered(small[number == n], int(n))


def _split(triangles: Array) -> Array:
    """Four triangles (4 n, 3, 3) in place of each triangle of (n, 3, 3)."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([np.stack(part, axis=1) for part in parts])


def _covered(triangles: Array, n: int) -> Iterator[Array]:
    """Points (k, 3) at all multiples of 1/n along two edges of each triangle."""
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    inside = i + j <= n
    u, v = i[inside] / n, j[inside] / n
    weights = np.stack([1 - u - v, u, v], axis=1)
    step = max(1, _CHUNK // len(weights))
    for start in range(0, len(triangles), step):
        yield (weights @ triangles[start : start + step]).reshape(-1, 3)
