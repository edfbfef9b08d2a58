"""What the project knows of a scan better than its file, applied to the points as they are read.

The scanner stood elsewhere than at zero
    Clouds that were placed by other programs keep the axes of their file: only the origin moves, so
    that lines of sight start where the scanner stood.
The points were measured on two faces
    A panoramic scanner turns its head with the columns of its grid; its mirror looks ahead on the
    front face and behind on the back. Where a column has points on both sides of the standing axis,
    the side of the head's direction is the front: with half a turn H is below 180 degrees there, as
    makers have it, and with a full turn every direction was seen on both faces. Which side is
    called front does not matter as long as it is the same in calibration and use (method section
    4.4). Formats that sort the points into columns of one direction have lost the face.
The scanner is calibrated
    Points are corrected by the parameters of its model.

Each function returns the scan with one of these noted in its fields; ``Scan.chunks`` does it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.instruments.correction import Correction
from tribrach.instruments.tilt_drift import Sweep
from tribrach.scan.face import HeadTurn, ScanFace
from tribrach.scan.scan import Scan

Integers = NDArray[np.integer]

#: a scanner this many times the extent of the points away from them took none of them, ...
_FAR = 20.0

#: ... unless they are a part cut out of a scan, which may be a single board: so far scanners for
#: survey stations measure to targets and walls [m]
_TARGET_REACH = 350.0

#: 0, 0, 0 says that the coordinates are the scanner's own: those end where the longest ranging
#: tripod scanners do (maker's figure for 90 % reflectance, long range mode) [m]
_LONGEST_REACH = 6000.0

#: points that are looked at where the header states no bounds
_GLANCE = 50_000

#: points closer to the axis than this [rad] do not tell a direction
_POLE = 0.1

#: points that are looked at
_SAMPLE = 2_000_000

#: parts of a scan whose mean directions tell how its head turned
_PARTS = 360

#: share of the rarer side from which on a scan has two faces
_TWO_FACES = 0.02

#: columns deviate from an even turn by less than this [rad]
_STRAIGHT = np.radians(1.0)

#: turns of the head that a panoramic scanner makes [rad]
_LEAST_TURN, _MOST_TURN = np.radians(5.0), np.radians(400.0)


def seen_from(scan: Scan, scanner: tuple[float, float, float]) -> Scan:
    """Place the scanner of a scan at zero.

    A pose of the file carries the shifted points to where it carried those of the file; where the
    scanner was unknown, the points are taken to be placed already and the pose is left out.
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
    pose = None
    if scan.pose is not None and scan.origin != "unknown":
        pose = Pose(scan.pose.rotation, scan.pose @ at)
    return replace(
        scan,
        origin="stated",
        scanner=(float(at[0]), float(at[1]), float(at[2])),
        bounds=None if scan.bounds is None else scan.bounds - at,
        pose=pose,
    )


def _refuse_far(scan: Scan, at: Array) -> None:
    """Swapped or mistyped coordinates of the scanner are far from its points.

    What was cut out of a scan does not surround its scanner: the extent of a distant board says
    nothing about how far it is.
    """
    bounds = scan.bounds
    if bounds is None or not np.isfinite(bounds).all():
        first = next(scan.chunks(_GLANCE), None)
        if first is None or not len(first):
            return
        bounds = np.stack([first.xyz.min(axis=0), first.xyz.max(axis=0)])
    away = float(np.linalg.norm(at - np.clip(at, *bounds)))
    own = not at.any()
    reach = _LONGEST_REACH if own else _TARGET_REACH
    if away > max(reach, _FAR * float(np.linalg.norm(bounds[1] - bounds[0]))):
        raise InputError(
            f"the place given for the scanner is {away:.0f} m from the points",
            file=scan.path,
            record=scan.name,
            cure="these are not the scanner's own coordinates, so give its place in them, x first"
            if own
            else "give it in the coordinates of the file, x first, or 0, 0, 0 if these are the "
            "scanner's own",
        )


def sides(scan: Scan) -> tuple[Scan, Scan]:
    """Part a scan of two faces into two scans."""
    turn = head_turn(scan)
    return (
        replace(scan, name=f"{scan.name} front", face=ScanFace(turn, 1.0)),
        replace(scan, name=f"{scan.name} back", face=ScanFace(turn, -1.0)),
    )


def head_turn(scan: Scan) -> HeadTurn:
    """Tell how the head turned, from the rows and columns of a scan."""

    def refused(why: str) -> InputError:
        return InputError(
            f"the faces of the points cannot be told: {why}",
            file=scan.path,
            record=scan.name,
            cure='say face = "front", "back" or "dome" in [[scans]] if you know it',
        )

    if scan.origin == "unknown":
        raise refused("where the scanner stood among the points is unknown")
    if "column" not in scan.names or "row" not in scan.names:
        raise refused("the file has no rows and columns of the scanner's grid")
    xyz, column = _sample(scan)
    h = np.arctan2(xyz[:, 1], xyz[:, 0])
    used, at = np.unique(column, return_inverse=True)
    first, step = _even_turn(h, used, at, refused)
    turn = abs(step) * (used[-1] - used[0] + 1)
    if not _LEAST_TURN < turn < _MOST_TURN:
        raise refused(f"the columns turn by {np.degrees(turn):.0f} degrees")
    first = _ahead(first, step, used, h, at)
    head = HeadTurn(float(first), float(step), int(used[-1]) + 1)
    behind = float((head.faces(xyz, column) < 0).mean())
    if min(behind, 1 - behind) < _TWO_FACES:
        raise refused(
            "every column lies on one side of the standing axis, as if there were one face; the "
            "format has sorted the points by direction, or the scanner is a hybrid one"
        )
    return head


def sweep_of(scan: Scan) -> Sweep:
    """Tell how the head turned through a scan, from columns, times or the order of its points."""

    def refused(why: str) -> InputError:
        return InputError(
            f"when the points of the scan were measured cannot be told: {why}",
            file=scan.path,
            record=scan.name,
            cure="give sweep_start_deg and sweep_deg of the station",
        )

    if scan.origin == "unknown":
        raise refused("where the scanner stood among the points is unknown")
    order = next((name for name in ("column", "time") if name in scan.names), None)
    xyz, when = _sample(scan, order)
    if order != "column" and len(when):
        through = (when - when.min()) / max(float(np.ptp(when)), 1e-9)
        when = np.minimum(through * _PARTS, _PARTS - 1).astype(np.int64)
    h = np.arctan2(xyz[:, 1], xyz[:, 0])
    used, at = np.unique(when, return_inverse=True)
    first, step = _even_turn(h, used, at, refused)
    sweep = Sweep(first + step * (used[0] - 0.5), step * (used[-1] - used[0] + 1))
    if sweep.period > 4 and np.cos(h - first - step * used[at]).mean() < 0:
        sweep = Sweep(sweep.start + np.pi, sweep.turn)
    return sweep


def _even_turn(
    h: Array, used: Integers, at: Integers, refused: Callable[[str], InputError]
) -> tuple[float, float]:
    """Direction [rad] at column zero and turn from one column to the next, ahead or behind.

    h (n,) : directions [rad]; used : the columns; at (n,) : which of them a point is of.
    """
    if len(h) < 100:
        raise refused("it has too few points")
    if len(used) < 4:
        raise refused("its grid has fewer than four columns")
    # twice the angle is the same ahead and behind
    double = np.bincount(at, np.cos(2 * h)) + 1j * np.bincount(at, np.sin(2 * h))
    weight = np.bincount(at)
    if np.median(np.abs(double) / weight) < 0.99:
        raise refused("the points of a column do not lie in one plane through the standing axis")
    axis = np.unwrap(np.angle(double)) / 2
    step, first = np.polyfit(used, axis, 1, w=np.sqrt(weight))
    if np.median(np.abs(axis - first - step * used)) > _STRAIGHT:
        raise refused("the columns do not turn evenly")
    return float(first), float(step)


def _ahead(first: float, step: float, used: Integers, h: Array, at: Integers) -> float:
    """The direction, not its opposite, that is below 180 degrees in the middle of half a turn.

    With more than half a turn both ends serve: the first column looks below 180 degrees.
    """
    turn = abs(step) * (used[-1] - used[0] + 1)
    column = used.mean() if turn < np.radians(200.0) else used[0]
    middle = (first + step * column) % (2 * np.pi)
    return first if middle < np.pi else first + np.pi


def _sample(scan: Scan, order: str | None = "column") -> tuple[Array, NDArray[Any]]:
    """Points off the poles and their columns, or another field; None : their numbers."""
    total = max(scan.records or 0, 1)
    every = max(1, total // _SAMPLE)
    places, columns, read = [], [], 0
    for chunk in scan.chunks():
        flat = np.hypot(chunk.xyz[:, 0], chunk.xyz[:, 1])
        steep = np.arctan2(flat, np.abs(chunk.xyz[:, 2]))
        keep = np.flatnonzero(np.isfinite(steep) & (steep > _POLE))[::every]
        places.append(chunk.xyz[keep])
        given = read + np.arange(len(chunk)) if order is None else np.asarray(chunk.values[order])
        columns.append(given[keep].astype(np.int64 if order == "column" else float))
        read += len(chunk)
    if not places:
        return np.empty((0, 3)), np.empty(0, dtype=np.int64)
    return np.concatenate(places), np.concatenate(columns)


def corrected_scan(scan: Scan, correction: Correction) -> Scan:
    """Apply a correction to a scan, in place of any that it has."""
    if scan.origin == "unknown":
        raise InputError(
            "a calibration cannot be applied: where the scanner stood among the points is unknown",
            file=scan.path,
            record=scan.name,
            cure='say origin = "scanner" in [[scans]] if it is at 0, 0, 0, or give its place',
        )
    return replace(scan, correction=correction)
