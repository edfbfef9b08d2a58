"""From arrays to plain numbers, None where there is no number."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from tribrach._types import Array

__all__ = ["matrix", "number", "numbers", "sigmas", "triple"]


def number(value: float) -> float | None:
    """A float, None for NaN and infinities; minus zero loses its sign."""
    value = float(value)
    return value + 0.0 if math.isfinite(value) else None


def numbers(values: Iterable[float]) -> tuple[float | None, ...]:
    """Floats, None for NaN and infinities."""
    return tuple(number(value) for value in values)


def triple(values: Array) -> tuple[float | None, float | None, float | None]:
    """Three floats, None for NaN."""
    return (number(values[0]), number(values[1]), number(values[2]))


def matrix(values: Array) -> tuple[tuple[float | None, ...], ...]:
    """Rows of floats, None for NaN."""
    return tuple(numbers(row) for row in values)


def sigmas(covariance: Array) -> Array:
    """Standard deviations (..., k) of covariances (..., k, k); NaN where a value is held."""
    variance = np.einsum("...ii->...i", covariance)
    return np.sqrt(np.where(variance > 0, variance, np.nan))
