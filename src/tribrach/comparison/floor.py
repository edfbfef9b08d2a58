"""Which distances do two perfect clouds of one surface have, because points are not surfaces?

The nearest point of a rectangular lattice is the middle of the cell that a query falls into, so
that the distances over a rectangle are the floor (method section 5.5). A scan is such a lattice on
every small piece of surface: steps of the angles times the range, stretched by the incidence.
For points at random the floor is that of a Poisson process. Lengths in metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Floor", "lattice_floor", "lattice_mean", "lattice_square", "random_floor"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Floor:
    """Mean, standard deviation and RMS [m] of the distances that sampling alone makes."""

    mean: float
    std: float
    rms: float

    @classmethod
    def from_moments(cls, mean: float, square: float) -> Floor:
        """From the mean [m] and the mean square [m^2]."""
        return cls(mean, float(np.sqrt(max(square - mean**2, 0.0))), float(np.sqrt(square)))


def lattice_mean(pitch_x: Array, pitch_y: Array) -> Array:
    """Mean distances (n,) [m] on lattices of pitches (n,) and (n,) [m] at right angles.

    The mean distance from the corner of a rectangle ``p x q`` with diagonal d to its points,
    ``d/3 + p^2/(6q) asinh(q/p) + q^2/(6p) asinh(p/q)``, for a quarter of the cell.
    """
    p, q = np.asarray(pitch_x) / 2, np.asarray(pitch_y) / 2
    mean: Array = np.hypot(p, q) / 3
    mean = mean + p**2 / (6 * q) * np.arcsinh(q / p) + q**2 / (6 * p) * np.arcsinh(p / q)
    return mean


def lattice_square(pitch_x: Array, pitch_y: Array) -> Array:
    """Mean squared distances (n,) [m^2], ``(s_x^2 + s_y^2) / 12``."""
    square: Array = (np.asarray(pitch_x) ** 2 + np.asarray(pitch_y) ** 2) / 12
    return square


def lattice_floor(pitch_x: float, pitch_y: float, incidence: float = 0.0) -> Floor:
    """Floor of one lattice; the first pitch is stretched by an incidence angle [rad] across it."""
    x, y = np.array([pitch_x / np.cos(incidence)]), np.array([pitch_y])
    return Floor.from_moments(float(lattice_mean(x, y)[0]), float(lattice_square(x, y)[0]))


def random_floor(spacing: float) -> Floor:
    """Floor of points at random, one on ``spacing^2``: mean ``s / 2``, RMS ``s / sqrt(pi)``."""
    return Floor.from_moments(spacing / 2, spacing**2 / np.pi)
