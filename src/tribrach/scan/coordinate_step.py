"""The step of coordinates that were rounded when they were stored."""

from __future__ import annotations

import numpy as np

from tribrach._types import Array

#: steps of decimal numbers, the coarsest first [m]
_STEPS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4, 1e-4)
#: steps of numbers of 32 bits [m]
_BINARY = tuple(2.0**-k for k in range(2, 11))
#: a coarser step along an axis is so many common ones, and so many levels lie on it
_COARSER, _LEVELS = 8.0, 20
#: fewer points may be multiples of anything by chance
_FEW = 100
#: points that are looked at, spread over all
_SAMPLE = 5_000


def coordinate_step(xyz: Array, finest: float = _STEPS[-1]) -> float:
    """Coarsest step of all coordinates up to a shift; 0 if below ``finest``, or too few points."""
    if len(xyz) < _FEW or (np.ptp(xyz, axis=0) == 0).all():
        return 0.0
    some = xyz[:: max(1, len(xyz) // _SAMPLE)]
    from_first = some - some[0]
    for step in _STEPS:
        whole = from_first / step
        steps = np.rint(whole)
        # what lies within a part of the step says nothing about it
        if step >= finest and steps.any() and np.abs(whole - steps).max() < 1e-4:
            return step
    return 0.0


def axis_steps(xyz: Array, common: float) -> tuple[float, float, float] | None:
    """Steps along x, y and z where one is far coarser than the common one; None if none is.

    Coordinates that went through numbers of 32 bits have a power of two, rounded to the common
    step (0 for a fine one) afterwards.
    """
    least = max(common, _STEPS[-1])
    some = xyz[:: max(1, len(xyz) // _SAMPLE)]
    if len(some) < _FEW:
        return None
    out = []
    for axis in (some - some[0]).T:
        tried = [s for s in (*_STEPS, *_BINARY) if s >= _COARSER * least]
        fits = [
            s
            for s in tried
            if np.abs(axis - s * np.rint(axis / s)).max() <= 1.01 * least
            and len(np.unique(np.rint(axis / s))) >= _LEVELS
        ]
        out.append(max(fits, default=common))
    return None if max(out) <= common else (out[0], out[1], out[2])
