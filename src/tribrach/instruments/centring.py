"""How errors of centring enter observations along a sight (method section 2.3).

Variances of both ends together, with the errors I and T of instrument and target in plan and V of
either height. Lengths are the horizontal parts ``d`` of sights and their rises ``e`` [m]; a length
of zero tells no variance of an angle.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array


def of_directions(length: Array, instrument: Array | float, target: Array | float) -> Array:
    """Variances (n,) [rad^2] of directions and azimuths, ``(I^2 + T^2) / d^2``.

    ``length`` (n,): horizontal lengths [m]; ``instrument``, ``target`` (n,): errors of centring
    [m].
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        variance: Array = (np.square(instrument) + np.square(target)) / length**2
    return variance


def of_angles(
    ahead: Array,
    back: Array,
    across: Array,
    instrument: Array | float,
    target: Array | float,
) -> Array:
    """Variances (n,) [rad^2] of angles, ``(I d3 / (d1 d2))^2 + T^2 (1/d1^2 + 1/d2^2)``.

    ``ahead``, ``back``, ``across`` (n,): horizontal lengths to foresight and backsight, and between
    these two [m]; ``instrument``, ``target`` (n,): errors of centring [m].
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.square(target) * (1 / ahead**2 + 1 / back**2)
        variance: Array = np.square(instrument * across / (ahead * back)) + ends
    return variance


def of_slope_distances(
    length: Array,
    rise: Array | float,
    instrument: Array | float,
    target: Array | float,
    height: Array | float,
) -> Array:
    """Variances (n,) [m^2] of slope distances, ``(d^2 (I^2 + T^2) + 2 e^2 V^2) / s^2``.

    ``length`` (n,): horizontal lengths [m]; ``rise`` (n,): height differences [m]; ``instrument``,
    ``target``, ``height`` (n,): errors of centring, and of the height of either end [m].
    """
    plan = np.square(instrument) + np.square(target)
    with np.errstate(divide="ignore", invalid="ignore"):
        both = length**2 * plan + 2 * np.square(rise * height)
        variance: Array = both / (length**2 + np.square(rise))
    return variance


def of_zeniths(
    length: Array,
    rise: Array | float,
    instrument: Array | float,
    target: Array | float,
    height: Array | float,
) -> Array:
    """Variances (n,) [rad^2] of zenith angles, ``(e^2 (I^2 + T^2) + 2 d^2 V^2) / s^4``.

    ``length`` (n,): horizontal lengths [m]; ``rise`` (n,): height differences [m]; ``instrument``,
    ``target``, ``height`` (n,): errors of centring, and of the height of either end [m].
    """
    plan = np.square(instrument) + np.square(target)
    with np.errstate(divide="ignore", invalid="ignore"):
        both = np.square(rise) * plan + 2 * np.square(length * height)
        variance: Array = both / (length**2 + np.square(rise)) ** 2
    return variance
