"""Where the scanner stood, and what a scan is called, if the format does not say.

The scanner is taken to be at (0, 0, 0) if that lies among the points.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.scan.scan import Origin

__all__ = ["assumed_origin", "bounds_of", "scan_name"]


#: the scanner is taken to be at zero if that lies within the bounds and this margin [m]
MARGIN = 10.0
#: suffixes of compressed text
_PACKED = (".gz", ".xz", ".bz2")


def assumed_origin(bounds: Array | None) -> Origin:
    """``assumed`` if zero lies within bounds (2, 3) [m] and :data:`MARGIN`, else ``unknown``."""
    if bounds is None or not np.isfinite(bounds).all():
        return "unknown"
    inside = (bounds[0] - MARGIN <= 0).all() and (bounds[1] + MARGIN >= 0).all()
    return "assumed" if inside else "unknown"


def bounds_of(xyz: Array) -> Array | None:
    """Smallest and largest coordinates (2, 3) of the finite points of (n, 3); None without any."""
    finite = xyz[np.isfinite(xyz).all(axis=1)]
    return None if len(finite) == 0 else np.stack([finite.min(axis=0), finite.max(axis=0)])


def scan_name(path: Path, index: int = 0) -> str:
    """The file's name without its suffixes, with a number after it for all scans but the first."""
    name = path.name
    for packed in _PACKED:
        if name.lower().endswith(packed):
            name = name[: -len(packed)]
    name = name.rpartition(".")[0] or name
    if name.lower().endswith(".copc"):
        name = name[: -len(".copc")] or name
    return name if index == 0 else f"{name}-{index + 1}"
