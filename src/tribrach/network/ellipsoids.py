"""Confidence ellipses and ellipsoids of positions.

Factor on the standard ellipsoid: ``sqrt(chi2_d)`` with the a-priori sigma0, ``sqrt(d F_{d,r})``
with the a-posteriori one of redundancy r (method section 3.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.statistics import chi2, f

__all__ = [
    "ConfidenceEllipse",
    "ConfidenceEllipsoid",
    "Ellipses",
    "confidence_factor",
    "plan_ellipses",
    "principal_axes",
]


def confidence_factor(dimension: int, confidence: float, dof: int | None = None) -> float:
    """Factor from the standard ellipsoid to that of a confidence."""
    if dof is None:
        return float(np.sqrt(chi2.ppf(confidence, dimension)))
    return float(np.sqrt(dimension * f.ppf(confidence, dimension, dof)))


@dataclass(frozen=True)
class Ellipses:
    """Ellipses in plan."""

    #: (n,), semi-axes [m]
    major: Array
    minor: Array
    #: (n,), azimuth of the major axis, clockwise from north [rad]
    azimuth: Array


def plan_ellipses(covariances: Array, factor: float = 1.0) -> Ellipses:
    """Ellipses of the E, N part of covariances (n, 3, 3) [m^2], enlarged by a factor."""
    values, vectors = np.linalg.eigh(covariances[:, :2, :2])
    axes = factor * np.sqrt(np.maximum(values, 0.0))
    azimuth = np.arctan2(vectors[:, 0, 1], vectors[:, 1, 1]) % np.pi
    return Ellipses(axes[:, 1], axes[:, 0], azimuth)


def principal_axes(covariances: Array, factor: float = 1.0) -> tuple[Array, Array]:
    """Semi-axes (n, 3) [m], longest first, and unit directions (n, 3, 3) as rows."""
    values, vectors = np.linalg.eigh(covariances)
    axes = factor * np.sqrt(np.maximum(values[:, ::-1], 0.0))
    return axes, vectors[:, :, ::-1].transpose(0, 2, 1)


@dataclass(frozen=True)
class ConfidenceEllipse:
    """Confidence ellipse of a point in plan."""

    #: semi-axes [m]
    major: float
    minor: float
    #: of the major axis, clockwise from north, in [0, pi) [rad]
    azimuth: float
    #: probability that it holds the point
    confidence: float


@dataclass(frozen=True)
class ConfidenceEllipsoid:
    """Confidence ellipsoid of a point."""

    #: semi-axes (3,) [m], longest first
    axes: Array
    #: their unit directions (3, 3) in the work frame, as rows
    directions: Array
    #: probability that it holds the point
    confidence: float
