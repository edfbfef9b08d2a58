"""Weighted mean positions in projection cylinders, with the covariance that single points pass on.

Each point weighs ``w = 1 / (n^T C n)`` by its own random covariance C, so that the mean along the
normal has ``Sigma w d / Sigma w`` and the covariance ``S = Sigma w^2 C / (Sigma w)^2`` (Winiwarter,
Anders and Höfle 2021; method section 9.3). What the station contributes is not in C: it
is common to all points and never averages out. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tribrach.comparison.cloud_parts import Source, centred
from tribrach.comparison.point_cells import Cells, cylinder_ranges
from tribrach.comparison.projection_cylinders import Cylinders
from tribrach.errors import InputError

__all__ = ["WeightedPositions", "weighted_means"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: no point is taken as better known than this along the normal [m^2]: a thousandth of a micrometre
_SMALLEST = 1e-18


@dataclass(frozen=True)
class WeightedPositions:
    """A cloud in each cylinder.

    count (m,); position (m,) along the normal [m]; spread (m,) [m] : weighted standard deviation;
    expected (m,) [m] : what the covariances of the points foretell of it on a plane; covariance
    (m, 3, 3) [m^2] of the mean, all points independent.
    """

    count: Index
    position: Array
    spread: Array
    expected: Array
    covariance: Array


def weighted_means(cloud: Source, cylinders: Cylinders) -> WeightedPositions:
    """Weighted means of a cloud whose points have random covariances; NaN without points.

    Raises
    ------
    InputError : a part of the cloud has no covariances.
    """
    sums = np.zeros((len(cylinders.core), 10))
    for part in centred(cloud, cylinders.origin, *cylinders.box):
        if part.random is None:
            raise InputError(
                "the points of a cloud have no covariances to propagate",
                cure="compare with plain M3C2",
            )
        cells = Cells.of(part.xyz, cylinders.radius)
        _add(
            cylinders.core,
            cylinders.normal,
            cylinders.radius,
            cylinders.depth,
            cells.arrays,
            part.random,
            cells.order,
            sums,
        )
    return _concluded(sums)


def _concluded(sums: Array) -> WeightedPositions:
    """Figures from counts, sums of weights and the rest."""
    n, weight, first, second = sums[:, :4].T
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = first / weight
        variance = np.maximum(second / weight - mean**2, 0.0) * n / (n - 1)
        flat = sums[:, 4:] / weight[:, None] ** 2
        # sum w (n^T C n) / sum w, and every w (n^T C n) is one
        expected = np.sqrt(n / weight)
    covariance = flat[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    spread = np.sqrt(np.where(n > 1, variance, np.nan))
    return WeightedPositions(n.astype(np.int64), mean, spread, expected, covariance)


@njit(cache=True, parallel=True, nogil=True)
def _add(core, normal, radius, depth, cells, random, order, sums):  # type: ignore[no-untyped-def]
    """Add count, weight, weighted distances and squares, and ``w^2 C`` of the points within."""
    xyz = cells[0]
    for c in prange(len(core)):
        n0, n1, n2 = normal[c, 0], normal[c, 1], normal[c, 2]
        if np.isnan(n0):
            continue
        out = sums[c]
        for begin, end in cylinder_ranges(core[c], normal[c], radius, depth, cells):
            for k in range(begin, end):
                x, y, z = xyz[k, 0] - core[c, 0], xyz[k, 1] - core[c, 1], xyz[k, 2] - core[c, 2]
                d = x * n0 + y * n1 + z * n2
                if abs(d) > depth or x * x + y * y + z * z - d * d > radius * radius:
                    continue
                s = random[order[k]]
                variance = n0 * n0 * s[0] + n1 * n1 * s[1] + n2 * n2 * s[2]
                variance += 2 * (n0 * n1 * s[3] + n0 * n2 * s[4] + n1 * n2 * s[5])
                w = 1.0 / max(variance, _SMALLEST)
                out[0] += 1
                out[1] += w
                out[2] += w * d
                out[3] += w * d * d
                for e in range(6):
                    out[4 + e] += w * w * s[e]
