"""Where is the scanner, if the format does not say? At (0, 0, 0) if that lies among the points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.scan.scan import Origin

__all__ = ["MARGIN", "assumed_origin", "bounds_of"]

Array = NDArray[np.float64]

#: the scanner is taken to be at zero if that lies within the bounds and this margin [m]
MARGIN = 10.0


def assumed_origin(bounds: Array | None) -> Origin:
    """``assumed`` if zero lies within bounds (2, 3) [m] and `MARGIN`, ``unknown`` otherwise."""
    if bounds is None or not np.isfinite(bounds).all():
        return "unknown"
    inside = (bounds[0] - MARGIN <= 0).all() and (bounds[1] + MARGIN >= 0).all()
    return "assumed" if inside else "unknown"


def bounds_of(xyz: Array) -> Array | None:
    """Smallest and largest coordinates (2, 3) of the finite points of (n, 3); None without any."""
    finite = xyz[np.isfinite(xyz).all(axis=1)]
    return None if len(finite) == 0 else np.stack([finite.min(axis=0), finite.max(axis=0)])
