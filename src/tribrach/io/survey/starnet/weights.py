"""Standard errors of sights as STAR*NET computes them.

What the instrument says is combined in squares with the errors of centring of both ends (method
section 2.3). A standard error that is given with an observation is taken as it is, unless the file
says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tribrach._types import Array
from tribrach.instruments import centring
from tribrach.io.survey.starnet.records import Quantity, Sight, SigmaMark

#: finds horizontal length and height difference (n, 2) of lines by the names of their ends
Lines = Callable[[Sequence[tuple[str, str]]], Array]


def sigmas_of(sights: Sequence[Sight], lines: Lines) -> tuple[Array, Array]:
    """Standard errors of sights of one quantity.

    ``lines``: gives horizontal length and height difference (n, 2) [m] of lines, NaN where not
    known. Returns ``sigmas`` (n,): [m or rad]; NaN where the observation is fixed; ``lacking``
    (n,): centring is left out because the length of the sight is not known.
    """
    quantity = sights[0].quantity
    given = np.array([s.sigma if isinstance(s.sigma, float) else np.nan for s in sights])
    default = np.array([s.sigma in (SigmaMark.DEFAULT, SigmaMark.FREE) for s in sights])
    fixed = np.array([s.sigma is SigmaMark.FIXED for s in sights])
    length = np.array([np.nan if s.length is None else s.length for s in sights])
    rise = np.array([s.rise for s in sights])
    unknown = np.isnan(length)
    if unknown.any():
        pairs = [(s.at, s.to) for s, u in zip(sights, unknown, strict=True) if u]
        length[unknown], rise[unknown] = lines(pairs).T
    own = _instrument(quantity, sights, np.hypot(np.nan_to_num(length), np.nan_to_num(rise)))
    sigma = np.where(default, own, given)
    grows = default | np.array([s.centring for s in sights])
    errors = _end_errors(sights)
    if quantity is Quantity.ANGLE:
        backs = lines([(s.at, s.back) for s in sights])[:, 0]
        across = lines([(s.back, s.to) for s in sights])[:, 0]
        variance = _of_angle(errors, length, backs, across, np.array([s.value for s in sights]))
    else:
        variance = _of_sight(quantity, errors, length, rise)
    lacking = grows & np.isnan(variance) & (errors > 0).any(axis=1) & ~fixed
    variance = np.where(grows & ~np.isnan(variance), variance, 0.0)
    return np.where(fixed, np.nan, np.sqrt(sigma**2 + variance)), lacking


def _end_errors(sights: Sequence[Sight]) -> Array:
    """Errors (n, 3) of centring: instrument, target, height [m]."""
    return np.array([(s.errors.instrument, s.errors.target, s.errors.vertical) for s in sights])


def _instrument(quantity: Quantity, sights: Sequence[Sight], slope: Array) -> Array:
    """Standard errors (n,) of the instruments, without centring."""

    def column(name: str) -> Array:
        return np.array([getattr(s.errors, name) for s in sights], dtype=float)

    if quantity in (Quantity.SLOPE, Quantity.LEVEL_DISTANCE, Quantity.RISE):
        rise = quantity is Quantity.RISE
        value = np.array([np.nan if s.value is None else s.value for s in sights])
        # the ppm are of the distance itself
        length = slope if rise else np.where(np.isnan(value), slope, value)
        constant = column("rise" if rise else "distance")
        part = column("rise_ppm" if rise else "distance_ppm") * length
        propagated = np.array([s.propagated for s in sights])
        return np.where(propagated, np.hypot(constant, part), constant + part)
    name = {
        Quantity.DIRECTION: "direction",
        Quantity.ANGLE: "angle",
        Quantity.BEARING: "azimuth",
        Quantity.ZENITH: "zenith",
    }[quantity]
    return column(name)


def _of_sight(quantity: Quantity, errors: Array, length: Array, rise: Array) -> Array:
    """Variances (n,) of centring; NaN where they need a length that is not known."""
    instrument, target, height = errors.T
    if quantity is Quantity.LEVEL_DISTANCE:
        variance: Array = instrument**2 + target**2
    elif quantity is Quantity.RISE:
        variance = 2 * height**2
    elif quantity is Quantity.SLOPE:
        variance = centring.of_slope_distances(length, rise, instrument, target, height)
    elif quantity is Quantity.ZENITH:
        variance = centring.of_zeniths(length, rise, instrument, target, height)
    else:
        variance = centring.of_directions(length, instrument, target)
    return np.where(np.isfinite(variance), variance, np.nan)


def _of_angle(errors: Array, ahead: Array, back: Array, across: Array, angle: Array) -> Array:
    """Variances (n,) of centring of angles; NaN where a length is not known."""
    # the third side of the triangle where its length is not known by itself
    known2 = ahead**2 + back**2 - 2 * ahead * back * np.cos(angle.astype(float))
    third = np.where(np.isnan(across), np.sqrt(np.maximum(known2, 0.0)), across)
    variance = centring.of_angles(ahead, back, third, errors[:, 0], errors[:, 1])
    return np.where(np.isfinite(variance), variance, np.nan)
