"""The step of coordinates that were rounded when they were stored."""

from __future__ import annotations

import numpy as np

from tribrach._types import Array

#: steps of decimal numbers, the coarsest first [m]
_STEPS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4, 1e-4)
#: fewer points may be multiples of anything by chance
_FEW = 100
#: points that are looked at, spread over all
_SAMPLE = 5_000


def coordinate_step(xyz: Array, finest: float = _STEPS[-1]) -> float:
    """Find the coarsest step of which all coordinates are multiples, up to a shift of all.

    0 if they are finer than ``finest`` (a tenth of a millimetre at least), or too few to tell.
    """
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
