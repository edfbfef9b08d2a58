"""Estimates surface normals from the nearest neighbours of every point, and incidence angles.

The normal is the direction of least spread of the k nearest points (principal components); the
incidence angle is that between beam and normal (method section 5.2). Scanner frame, metres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pykdtree.kdtree import KDTree

from tribrach._types import Array
from tribrach.kernels import in_threads, njit

#: neighbours that a normal is taken from
NEIGHBOURS = 12
#: no incidence is taken as flatter than this cosine, 84 degrees: the model ends there
FLATTEST = 0.1


def normals(
    xyz: Array, neighbours: int = NEIGHBOURS, rows: NDArray[np.int64] | None = None
) -> Array:
    """Estimate unit normals that look towards the scanner; NaN with too few points."""
    at = xyz if rows is None else xyz[rows]
    if len(xyz) <= neighbours:
        return np.full_like(at, np.nan)
    _, near = KDTree(np.ascontiguousarray(xyz)).query(at, k=neighbours)
    out = np.empty_like(at)
    in_threads(_normals, len(at), xyz, at, near.astype(np.int64), out)
    return out


def incidence_cosines(xyz: Array, rows: NDArray[np.int64] | None = None) -> Array:
    """Estimate cosines of incidence angles: at least 0.1, and 1 where no normal is known."""
    normal = normals(xyz, NEIGHBOURS, rows)
    at = xyz if rows is None else xyz[rows]
    length = np.linalg.norm(at, axis=1)
    cosine = np.abs(np.einsum("ni,ni->n", at, normal)) / np.maximum(length, 1e-9)
    known: Array = np.where(np.isfinite(cosine), np.clip(cosine, FLATTEST, 1.0), 1.0)
    return known


@njit(cache=True, nogil=True)
def _normals(first, last, xyz, at, near, out):  # type: ignore[no-untyped-def]
    """Eigenvector of the smallest eigenvalue of the neighbourhood of each point ``at``."""
    count = near.shape[1]
    # element by element: sums of rows compile twice as long, for their error messages
    for n in range(first, last):
        mean, d, spread = np.zeros(3), np.empty(3), np.zeros((3, 3))
        for k in range(count):
            for i in range(3):
                mean[i] += xyz[near[n, k], i]
        for i in range(3):
            mean[i] /= count
        for k in range(count):
            for i in range(3):
                d[i] = xyz[near[n, k], i] - mean[i]
            for i in range(3):
                for j in range(3):
                    spread[i, j] += d[i] * d[j]
        vectors = np.linalg.eigh(spread)[1]
        along = 0.0
        for i in range(3):
            along += vectors[i, 0] * at[n, i]
        sign = -1.0 if along > 0 else 1.0
        for i in range(3):
            out[n, i] = sign * vectors[i, 0]
