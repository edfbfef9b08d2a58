"""Standard errors of sights as STAR*NET computes them (method section 2.14).

What the instrument says is combined in squares with the errors of centring of both ends, which turn
into angles by the horizontal length ``d`` of the sight. With ``s`` the slope distance and ``e`` the
height difference, I and T the errors of centring of instrument and target in plan and V those of
their heights:

* directions and bearings ``I^2/d^2 + T^2/d^2``
* angles ``(d3 I / (d1 d2))^2 + T^2 (d1^2 + d2^2) / (d1 d2)^2``, d3 between the targets
* horizontal distances ``I^2 + T^2``
* slope distances ``(d/s)^2 (I^2 + T^2) + 2 (e/s)^2 V^2``
* zenith angles ``((e/s)^2 (I^2 + T^2) + 2 (d/s)^2 V^2) / s^2``
* height differences ``2 V^2``

A standard error that is given with an observation is taken as it is, unless the file says
otherwise. Source: STAR*NET reference manual, appendix on additional technical information.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tribrach._types import Array
from tribrach.io.survey.starnet.records import Quantity, Sight, SigmaMark

__all__ = ["sigmas_of"]

#: finds horizontal length and height difference (n, 2) of lines by the names of their ends
Lines = Callable[[Sequence[tuple[str, str]]], Array]


def sigmas_of(sights: Sequence[Sight], lines: Lines) -> tuple[Array, Array]:
    """Standard errors of sights of one quantity.

    Parameters
    ----------
    sights
        Sights, all of the same quantity.
    lines
        Gives horizontal length and height difference (n, 2) [m] of lines, NaN where not known.

    Returns
    -------
    sigmas : (n,) array
        [m or rad]; NaN where the observation is fixed.
    lacking : (n,) array of bool
        Centring is left out because the length of the sight is not known.
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
    centring = default | np.array([s.centring for s in sights])
    errors = _end_errors(sights)
    if quantity is Quantity.ANGLE:
        backs = lines([(s.at, s.back) for s in sights])[:, 0]
        across = lines([(s.back, s.to) for s in sights])[:, 0]
        variance = _of_angle(errors, length, backs, across, np.array([s.value for s in sights]))
    else:
        variance = _of_sight(quantity, errors, length, rise)
    lacking = centring & np.isnan(variance) & (errors > 0).any(axis=1) & ~fixed
    variance = np.where(centring & ~np.isnan(variance), variance, 0.0)
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
    plan = errors[:, 0] ** 2 + errors[:, 1] ** 2
    height = 2 * errors[:, 2] ** 2
    if quantity is Quantity.LEVEL_DISTANCE:
        return plan
    if quantity is Quantity.RISE:
        return height
    slope2 = length**2 + rise**2
    with np.errstate(divide="ignore", invalid="ignore"):
        if quantity is Quantity.SLOPE:
            variance = (length**2 * plan + rise**2 * height) / slope2
        elif quantity is Quantity.ZENITH:
            variance = (rise**2 * plan + length**2 * height) / slope2**2
        else:
            variance = plan / length**2
    out: Array = np.where(np.isfinite(variance), variance, np.nan)
    return out


def _of_angle(errors: Array, ahead: Array, back: Array, across: Array, angle: Array) -> Array:
    """Variances (n,) of centring of angles; NaN where a length is not known."""
    # the third side of the triangle where its length is not known by itself
    known = ahead**2 + back**2 - 2 * ahead * back * np.cos(angle.astype(float))
    third2 = np.where(np.isnan(across), known, across**2)
    product2 = ahead**2 * back**2
    with np.errstate(divide="ignore", invalid="ignore"):
        instrument = errors[:, 0] ** 2 * third2 / product2
        targets = errors[:, 1] ** 2 * (ahead**2 + back**2) / product2
    variance = instrument + targets
    out: Array = np.where(np.isfinite(variance), variance, np.nan)
    return out
