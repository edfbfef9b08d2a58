"""Points and scanner stations as they are given beforehand, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.network.observations.base import Array, Observations
from tribrach.network.observations.coordinates import Coordinates
from tribrach.network.unknowns import Layout

__all__ = ["GivenPoint", "GivenStation", "control_observations"]


@dataclass
class GivenPoint:
    """A point with what is known of it beforehand.

    xyz (3,) E, N, U [m], NaN where unknown; free (3,) False for fixed or unused components;
    covariance (3, 3) [m^2] if the coordinates are weighted control; datum (3,) components that
    carry inner constraints when the reader's format marks them; source ``file:line``.
    """

    xyz: Array
    free: NDArray[np.bool_]
    role: str = "free"
    covariance: Array | None = None
    datum: NDArray[np.bool_] | None = None
    source: str = ""


@dataclass
class GivenStation:
    """A scanner station with six unknowns: approximate pose (NaN if unknown) and fixed parts."""

    translation: Array
    rotation: Array
    free: NDArray[np.bool_]
    source: str = ""


def control_observations(points: Mapping[str, GivenPoint], layout: Layout) -> list[Observations]:
    """Weighted control coordinates as observations, one table of them or none."""
    control = [(n, p) for n, p in points.items() if p.covariance is not None]
    if not control:
        return []
    return [
        Coordinates(
            values=np.array([p.xyz for _, p in control]),
            covariance=np.array([p.covariance for _, p in control]),
            position=np.array([layout.index("point", n) for n, _ in control]),
            source=np.array([p.source for _, p in control], dtype=object),
            group="control",
        )
    ]
