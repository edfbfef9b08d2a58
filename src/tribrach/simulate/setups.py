"""Poses of simulated stations, levelled by a compensator or not levelled."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp


def levelled(place: ArrayLike, heading: float, sigma: float, rng: np.random.Generator) -> Pose:
    """A levelled scanner, its axis off the vertical by errors of a compensator in x and y."""
    a, b = rng.normal(0, sigma, 2) if sigma > 0 else (0.0, 0.0)
    return _placed(place, heading, (a, b))


def tilted(place: ArrayLike, heading: float, tilt: float, rng: np.random.Generator) -> Pose:
    """A scanner that leans by up to a tilt about each of both level axes."""
    a, b = rng.uniform(-tilt, tilt, 2)
    return _placed(place, heading, (a, b))


def _placed(place: ArrayLike, heading: float, lean: tuple[float, float]) -> Pose:
    turn = exp(np.array([0.0, 0.0, heading]))
    rotation = turn @ exp(np.array([lean[0], lean[1], 0.0]))
    return Pose(rotation, np.asarray(place, dtype=float))
