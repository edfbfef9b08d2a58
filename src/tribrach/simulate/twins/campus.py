"""The control traverse of a campus survey in Hanoi (method S0, Table 2).

The leg lengths are published; the shape of the polygon and the heights are reconstructed.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array

NAMES = ("A", "B", "C", "D", "E")
#: lengths of AB, BC, CD, DE, EA [m]
LEGS = (43.244, 31.631, 28.867, 30.008, 66.711)
HEIGHTS = (6.214, 6.391, 6.302, 6.118, 6.047)
#: heights of instrument and prism over the marks [m]
HEIGHT_INSTRUMENT = dict(zip(NAMES, (1.562, 1.548, 1.571, 1.590, 1.555), strict=True))
HEIGHT_TARGET = 1.500


def traverse() -> Array:
    """True local coordinates (5, 3) E, N, U [m] of the points A to E."""
    a = np.array([1000.0, 2000.0])
    b = a + LEGS[0] * _azimuth(28.0)
    e = a + LEGS[4] * _azimuth(104.0)
    c = b + LEGS[1] * _azimuth(96.0)
    d = _intersect(c, LEGS[2], e, LEGS[3])
    return np.column_stack([np.stack([a, b, c, d, e]), HEIGHTS])


def lines() -> list[tuple[str, str]]:
    """Sights of the traverse: both neighbours from everywhere, and two diagonals."""
    pairs = [(i, (i + step) % 5) for i in range(5) for step in (1, 4)] + [(0, 2), (4, 1)]
    return [(NAMES[a], NAMES[b]) for a, b in sorted(pairs)]


def _azimuth(degrees: float) -> Array:
    return np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])


def _intersect(p: Array, r: float, q: Array, s: float) -> Array:
    """Point at distance r from p and s from q, on the left of the way from q to p."""
    base = np.linalg.norm(q - p)
    along = (r**2 - s**2 + base**2) / (2 * base)
    across = np.sqrt(r**2 - along**2)
    unit = (q - p) / base
    point: Array = p + along * unit + across * np.array([-unit[1], unit[0]])
    return point
