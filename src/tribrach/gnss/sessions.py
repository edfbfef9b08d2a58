"""Which baselines of a session are independent, and how are they correlated?

n receivers that observe together give n - 1 independent baselines; all others are combinations of
them and would pretend a control that is none (method section 2.7). The shortest ones are taken: a
minimum spanning tree, or a star around one station.

Two baselines that share a receiver share its errors. With equal shares of both receivers in the
variance of a baseline the correlation is 1/2, the same as that of single differences (Hofmann-
Wellenhof, Lichtenegger and Wasle 2008, GNSS, section 6.3); over all baselines of the session it is
``1/2 B^T B`` with the incidence matrix B of the tree, which is positive definite.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

__all__ = ["independent_baselines", "session_covariance"]

Array = NDArray[np.float64]


def independent_baselines(
    positions: Array, known: Sequence[int], *, star: int | None = None
) -> list[tuple[int, int]]:
    """The n - 1 baselines (from, to) of n stations, each from a station reached before.

    positions (n, 3) [m], approximate; known : stations with coordinates, the first one is where
    the chain starts (the first station if none is known); star : take all from this one.
    """
    n = len(positions)
    root = star if star is not None else (known[0] if len(known) else 0)
    if star is not None:
        return [(star, k) for k in range(n) if k != star]
    if n < 2:
        return []
    # equal positions are still two stations
    apart = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    distance = np.maximum(apart, 1e-3)
    tree = minimum_spanning_tree(distance)
    order, before = breadth_first_order(tree, root, directed=False)
    return [(int(before[k]), int(k)) for k in order[1:]]


def session_covariance(baselines: Sequence[tuple[int, int]], covariance: Array) -> Array:
    """Covariance (3m, 3m) of m independent baselines of one session from their own (m, 3, 3)."""
    m = len(baselines)
    names = {name: k for k, name in enumerate(dict.fromkeys(np.ravel(baselines).tolist()))}
    incidence = np.zeros((len(names), m))
    for k, (a, b) in enumerate(baselines):
        incidence[names[a], k], incidence[names[b], k] = -1.0, 1.0
    correlation = incidence.T @ incidence / 2
    values, axes = np.linalg.eigh(covariance)
    roots = np.einsum("nij,nj,nkj->nik", axes, np.sqrt(values), axes)
    joint: Array = np.einsum("aij,ab,bjk->aibk", roots, correlation, roots)
    return joint.reshape(3 * m, 3 * m)
