"""Confidence ellipses and ellipsoids of positions.

Factor on the standard ellipsoid: ``sqrt(chi2_d)`` with the a-priori sigma0, ``sqrt(d F_{d,r})``
with the a-posteriori one of redundancy r or with variances of r degrees of freedom (method sections
3.4 and 3.6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.statistics import chi2, f


def confidence_factor(
    dimension: int, confidence: float, dof: Array | float | None = None
) -> NDArray[np.float64]:
    """Factors from standard ellipsoids to a confidence, by ``dof``; None if variances are known."""
    freedom = np.asarray(np.inf if dof is None else dof, dtype=float)
    known = np.isinf(freedom)
    finite = dimension * f.ppf(confidence, dimension, np.where(known, 1.0, freedom))
    factors: NDArray[np.float64] = np.sqrt(np.where(known, chi2.ppf(confidence, dimension), finite))
    return factors


@dataclass(frozen=True)
class Ellipses:
    """Ellipses in plan."""

    #: (n,), semi-axes [m]
    major: Array
    minor: Array
    azimuth: Array  #: (n,), azimuth of the major axis, clockwise from north [rad]


def plan_ellipses(covariances: Array, factor: Array | float = 1.0) -> Ellipses:
    """Ellipses of the E, N part of covariances (n, 3, 3) [m^2], enlarged by a factor or (n,)."""
    values, vectors = np.linalg.eigh(covariances[:, :2, :2])
    axes = np.reshape(factor, (-1, 1)) * np.sqrt(np.maximum(values, 0.0))
    azimuth = np.arctan2(vectors[:, 0, 1], vectors[:, 1, 1]) % np.pi
    return Ellipses(axes[:, 1], axes[:, 0], azimuth)


def principal_axes(covariances: Array, factor: Array | float = 1.0) -> tuple[Array, Array]:
    """Semi-axes (n, 3) [m], longest first, and unit directions (n, 3, 3) as rows."""
    values, vectors = np.linalg.eigh(covariances)
    axes = np.reshape(factor, (-1, 1)) * np.sqrt(np.maximum(values[:, ::-1], 0.0))
    return axes, vectors[:, :, ::-1].transpose(0, 2, 1)


@dataclass(frozen=True)
class ConfidenceEllipse:
    """Confidence ellipse of a point in plan."""

    #: semi-axes [m]
    major: float
    minor: float
    azimuth: float  #: of the major axis, clockwise from north, in [0, pi) [rad]
    confidence: float  #: probability that it holds the point


@dataclass(frozen=True)
class ConfidenceEllipsoid:
    """Confidence ellipsoid of a point."""

    axes: Array  #: semi-axes (3,) [m], longest first
    directions: Array  #: their unit directions (3, 3) in the work frame, as rows
    confidence: float  #: probability that it holds the point
