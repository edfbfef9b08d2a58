"""Cuts triangles into small ones, whose centres and areas stand for the surface. Metres."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tribrach._types import Array

#: parts along an edge; larger triangles are split in four first
_PARTS = 128
#: points at a time
_CHUNK = 1_000_000


def covering_pieces(triangles: Array, size: float) -> Iterator[tuple[Array, Array]]:
    """Cut triangles into ones with shorter sides than a size: their centres (k, 3) and areas."""
    waiting = [np.asarray(triangles, dtype=float)]
    while waiting:
        batch = waiting.pop()
        longest = np.linalg.norm(batch - np.roll(batch, 1, axis=1), axis=2).max(axis=1)
        parts = np.ceil(longest / size)
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


def _covered(triangles: Array, n: int) -> Iterator[tuple[Array, Array]]:
    """Centres (k, 3) and areas (k,) of the n^2 triangles that divide each side of each by n."""
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    upright, upside = i + j < n, i + j < n - 1
    u = np.concatenate([i[upright] + 1 / 3, i[upside] + 2 / 3]) / n
    v = np.concatenate([j[upright] + 1 / 3, j[upside] + 2 / 3]) / n
    weights = np.stack([1 - u - v, u, v], axis=1)
    step = max(1, _CHUNK // len(weights))
    for start in range(0, len(triangles), step):
        part = triangles[start : start + step]
        normal = np.cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0])
        area = np.linalg.norm(normal, axis=1) / (2 * n * n)
        yield (weights @ part).reshape(-1, 3), np.repeat(area, len(weights))
