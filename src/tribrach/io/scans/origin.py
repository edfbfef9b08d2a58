"""Where the scanner stood, and what a scan is called, if the format does not say.

The scanner is taken to be at (0, 0, 0) if that lies among the points, or if they lie in rows and
columns of directions from there.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.scan.angular_step import on_lattice
from tribrach.scan.scan import Origin, Scan

#: the scanner is taken to be at zero if that lies within the bounds and this margin [m]
MARGIN = 10.0
#: points that are looked at where zero lies outside
_GLANCE = 100_000
#: coordinates beyond this are damaged [m]
_EARTH = 1e8
#: suffixes of compressed text
_PACKED = (".gz", ".xz", ".bz2")


def assumed_origin(bounds: Array | None) -> Origin:
    """``assumed`` if zero lies within bounds (2, 3) [m] and :data:`MARGIN`, else ``unknown``."""
    if bounds is None or not np.isfinite(bounds).all():
        return "unknown"
    inside = (bounds[0] - MARGIN <= 0).all() and (bounds[1] + MARGIN >= 0).all()
    return "assumed" if inside else "unknown"


def seen_from_zero(scan: Scan) -> Scan:
    """The scan with its origin ``assumed`` if its points form rows and columns as seen from zero.

    A dam, a quarry or a cropped facade has nothing about its scanner. Points further from zero than
    they extend are taken as placed and not looked at.
    """
    if scan.origin != "unknown" or not _near(scan.bounds):
        return scan
    try:
        first = next(scan.chunks(_GLANCE), None)
    except InputError:
        return scan
    if first is None or not _near(bounds_of(first.xyz)) or not on_lattice(first.xyz):
        return scan
    return replace(scan, origin="assumed")


def _near(bounds: Array | None) -> bool:
    """True if zero is no further from bounds (2, 3) than they extend, or none are known."""
    if bounds is None or not (np.abs(bounds) < _EARTH).all():
        return bounds is None
    away = np.linalg.norm(np.maximum(np.maximum(bounds[0], -bounds[1]), 0))
    return bool(away <= np.linalg.norm(bounds[1] - bounds[0]))


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
