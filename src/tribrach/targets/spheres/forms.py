"""Forms of low degree by which a body departs from a sphere: real spherical harmonics."""

from __future__ import annotations

import numpy as np

from tribrach._types import Array


def second_degree(n: Array) -> Array:
    """Harmonics (m, 5) of degree two, each of mean square one over the sphere: ellipsoids."""
    x, y, z = n.T
    return np.column_stack(
        [
            15**0.5 * x * y,
            15**0.5 * y * z,
            15**0.5 * x * z,
            (15 / 4) ** 0.5 * (x**2 - y**2),
            (5 / 4) ** 0.5 * (3 * z**2 - 1),
        ]
    )


def third_degree(n: Array) -> Array:
    """Harmonics (m, 7) of degree three, each of mean square one: pears and clover leaves."""
    x, y, z = n.T
    return np.column_stack(
        [
            (35 / 8) ** 0.5 * y * (3 * x**2 - y**2),
            105**0.5 * x * y * z,
            (21 / 8) ** 0.5 * y * (5 * z**2 - 1),
            (7 / 4) ** 0.5 * z * (5 * z**2 - 3),
            (21 / 8) ** 0.5 * x * (5 * z**2 - 1),
            (105 / 4) ** 0.5 * z * (x**2 - y**2),
            (35 / 8) ** 0.5 * x * (x**2 - 3 * y**2),
        ]
    )
