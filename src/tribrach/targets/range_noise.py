"""Estimates the range noise of a scan from the scan itself, where it is not given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.kernels import njit
from tribrach.scan.range_image import RangeImage


@dataclass(frozen=True)
class RangeNoiseGates:
    """How the noise of ranges is estimated from a scan (by hand: test_sphere_search)."""

    least_m: float = 5e-5  #: smaller noise [m] is not believed: points on disk have steps
    sample: int = 200_000  #: differences looked at, about: bounds the time
    edge_m: float = 0.05  #: second differences beyond this [m] are edges
    fewest: int = 10  #: fewer differences tell nothing
    #: lower quartile of the size of a standard normal variable, Phi^-1(5/8)
    normal_quartile: float = 0.318639


GATES = RangeNoiseGates()

# compiled code reads constants of the module, not attributes of an object
_EDGE_M = GATES.edge_m


def estimate_range_noise(image: RangeImage) -> float:
    """Estimate the sigma of one range from second differences of neighbours in the rows.

    On a plane ``r(j-1) - 2 r(j) + r(j+1)`` is noise of variance ``6 sigma^2``, up to the curvature
    of 1/cos over three pixels. The lower quartile of its size is proof against edges, curved
    surfaces and leaves on more than half of the image. Scans that the scanner has smoothed give too
    small a sigma.
    """
    stride = max(1, image.index.size // GATES.sample)
    differences = _second_differences(image.range, stride | 1)
    if len(differences) < GATES.fewest:
        return GATES.least_m
    return max(
        GATES.least_m, float(np.quantile(differences, 0.25)) / GATES.normal_quartile / 6**0.5
    )


@njit(cache=True, nogil=True)
def _second_differences(ranges: NDArray[np.float32], stride: int) -> NDArray[np.float64]:
    """Sizes [m] of second differences at every ``stride``-th pixel, edges left out."""
    rows, columns = ranges.shape
    out = np.empty(rows * columns // stride + 1)
    n = 0
    for at in range(0, rows * columns, stride):
        i, j = at // columns, at % columns
        if 0 < j < columns - 1:
            left, mid, right = ranges[i, j - 1], ranges[i, j], ranges[i, j + 1]
            d = abs(np.float64(left) - 2 * np.float64(mid) + np.float64(right))
            if d < _EDGE_M and abs(left - right) < _EDGE_M:
                out[n] = d
                n += 1
    return out[:n]
