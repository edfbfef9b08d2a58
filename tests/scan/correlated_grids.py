"""Grids of errors whose neighbours share a part: white texture averaged over discs."""

from __future__ import annotations

import numpy as np
from scipy.signal import fftconvolve

from tribrach._types import Array, Index

#: cells of texture for each pixel of the grid, along either axis
_FINE = 6


def shared_errors(rng: np.random.Generator, shape: tuple[int, int], width: float) -> Array:
    """Errors (rows, columns) of variance one whose discs are so many pixels wide."""
    half = int(np.ceil(width * _FINE / 2))
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    disc = (np.hypot(x, y) <= width * _FINE / 2).astype(float)
    texture = rng.standard_normal([(n + 1) * _FINE + 2 * half for n in shape])
    seen = fftconvolve(texture, disc / np.sqrt(disc.sum()), mode="valid")
    return np.asarray(seen[::_FINE, ::_FINE][: shape[0], : shape[1]])


def patch_grid(
    rng: np.random.Generator,
    share: float,
    width: float,
    *,
    patches: int = 100,
    size: int = 10,
    filled: float = 0.9,
) -> tuple[Array, Index, Index, Index]:
    """Residuals [m], rows, columns and patch numbers (n,) of planes through windows of a grid."""
    beside = int(np.ceil(np.sqrt(patches)))
    shape = beside * size, beside * size
    errors = np.sqrt(1 - share) * rng.standard_normal(shape)
    if share > 0:
        errors += np.sqrt(share) * shared_errors(rng, shape, width)
    parts = []
    for number in range(patches):
        i, j = (at.ravel() for at in np.mgrid[:size, :size])
        kept = rng.random(len(i)) < filled
        i, j = i[kept] + number // beside * size, j[kept] + number % beside * size
        plane = np.column_stack([np.ones(len(i)), i - i.mean(), j - j.mean()])
        error = 0.002 * errors[i, j]
        left = error - plane @ np.linalg.lstsq(plane, error, rcond=None)[0]
        parts.append((left, i, j, np.full(len(i), number)))
    residual, row, column, patch = (np.concatenate(part) for part in zip(*parts, strict=True))
    return residual, row, column, patch
