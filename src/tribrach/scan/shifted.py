"""A scan whose file has the scanner elsewhere than at zero, brought into the scanner frame.

Clouds that were placed by other programs keep the axes of their file: only the origin moves, so
that lines of sight start where the scanner stood.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.scan.scan import CHUNK, Chunk, Scan

__all__ = ["ShiftedScan", "seen_from"]

Array = NDArray[np.float64]

#: a scanner this many times the extent of the points away from their middle took none of them
_FAR = 20.0
#: points that are looked at where the header states no bounds
_GLANCE = 50_000


@dataclass(frozen=True)
class ShiftedScan(Scan):
    """Points of another scan less the place of the scanner among them."""

    source_scan: Scan = field(kw_only=True)

    def chunks(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """The points of the other scan, see there; xyz from the scanner."""
        for chunk in self.source_scan.chunks(size, start):
            yield replace(chunk, xyz=chunk.xyz - np.array(self.scanner))


def seen_from(scan: Scan, scanner: tuple[float, float, float]) -> ShiftedScan:
    """A scan with its scanner, given in the coordinates of its file [m], at zero.

    A pose of the file carries the shifted points to where it carried those of the file; where the
    scanner was unknown, the points are taken to be placed already and the pose is left out.

    Raises
    ------
    InputError : coordinates that are not finite, or so far from the points that the scanner cannot
        have stood there; a damaged file.
    """
    at = np.array(scanner, dtype=float)
    if at.shape != (3,) or not np.isfinite(at).all():
        raise InputError(
            "the scanner's place has coordinates that are no finite numbers",
            file=scan.path,
            record=scan.name,
            cure='say origin = [x, y, z] in metres, or "scanner"',
        )
    _refuse_far(scan, at)
    common = {f.name: getattr(scan, f.name) for f in fields(Scan)}
    common["origin"], common["scanner"] = "stated", (float(at[0]), float(at[1]), float(at[2]))
    if scan.bounds is not None:
        common["bounds"] = scan.bounds - at
    if scan.pose is not None:
        known = scan.origin != "unknown"
        common["pose"] = Pose(scan.pose.rotation, scan.pose @ at) if known else None
    return ShiftedScan(**common, source_scan=scan)


def _refuse_far(scan: Scan, at: Array) -> None:
    """Swapped or mistyped coordinates of the scanner are far from its points."""
    bounds = scan.bounds
    if bounds is None or not np.isfinite(bounds).all():
        first = next(scan.chunks(_GLANCE), None)
        if first is None or not len(first):
            return
        bounds = np.stack([first.xyz.min(axis=0), first.xyz.max(axis=0)])
    away = float(np.linalg.norm(at - np.clip(at, *bounds)))
    if away > _FAR * max(1.0, float(np.linalg.norm(bounds[1] - bounds[0]))):
        raise InputError(
            f"the place given for the scanner is {away:.0f} m from the points",
            file=scan.path,
            record=scan.name,
            cure="give it in the coordinates of the file, x first, or leave origin out",
        )
