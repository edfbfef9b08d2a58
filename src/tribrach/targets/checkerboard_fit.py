"""The centre of a black and white checkerboard of 2x2 quadrants, from its points (section 8.2).

A first round takes the plane of what lies around the start, a second that of the board alone; in
either the pattern is fitted by least squares, and what passes every test gets its edges refined.
The blur is foretold by the footprint. Points near an edge are uncertain by their angles as well.
Scanner frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.targets.board_plane import BoardPlane, fit_board_plane
from tribrach.targets.checkerboard_doubt import doubt, not_square, skew_of
from tribrach.targets.checkerboard_edges import refine_edges
from tribrach.targets.checkerboard_pattern import (
    ENOUGH,
    FEWEST,
    Pattern,
    guess_pattern,
    inside_board,
    pattern_light,
    solve_pattern,
)

__all__ = ["CheckerboardFit", "Refused", "fit_checkerboard"]

Array = NDArray[np.float64]

#: the board is not looked at more obliquely than this [rad]
_STEEPEST = np.radians(65.0)
#: steps of the first round and of the second; what the first plane may add to the skew [rad]
_FIRST, _STEPS, _FIRST_SKEW = 18, 40, np.radians(10.0)


@dataclass(frozen=True)
class CheckerboardFit:
    """A measured board.

    center (3,), covariance (3, 3) : scanner frame; plane; flat (2, 2) : covariance in the plane;
    rms [m] : of the range residuals; contrast : black to white over the noise; explained : share
    of the variance of intensity; incidence, turn, skew [rad] : turn of the edges in the plane,
    deviation from a right angle; blur [m]; points used.
    """

    center: Array
    covariance: Array
    plane: BoardPlane
    flat: Array
    rms: float
    contrast: float
    explained: float
    incidence: float
    turn: float
    skew: float
    blur: float
    points: int


@dataclass(frozen=True)
class Refused:
    """Why points are no checkerboard, in one sentence without the stop."""

    reason: str

    def __bool__(self) -> bool:
        """A refusal is no fit."""
        return False


def fit_checkerboard(
    xyz: Array,
    intensity: NDArray[np.floating[Any]],
    start: Array,
    side: float,
    *,
    footprint: float = 0.006,
    sigma_angle: float = 4e-5,
    floor: float = 3e-4,
) -> CheckerboardFit | Refused:
    """The board of a side [m] near a place (3,), wrong by up to a third of the side, any turn.

    footprint : diameter of the beam [m]; sigma_angle [rad] : of one point, its place in the
    footprint included; floor : added to the covariance in each direction [m].
    """
    close = np.linalg.norm(xyz - start, axis=1) < 0.95 * side
    if close.sum() < FEWEST:
        return Refused(f"only {int(close.sum())} points, {FEWEST} are needed")
    xyz, light = xyz[close], np.asarray(intensity[close], dtype=float)
    spread = sigma_angle * float(np.linalg.norm(start))
    scale = side / 2, max(float(np.hypot(footprint / 4, spread)), 1e-4), spread
    use = np.linalg.norm(xyz - start, axis=1) < 0.5 * side
    # the first plane is that of what lies around the start, and some of its points tell enough;
    # the second is that of the board alone
    some = slice(None, None, max(1, len(xyz) // ENOUGH))
    first = _round(xyz[some], light[some], use[some], start, None, scale, footprint)
    if isinstance(first, Refused):
        return first
    plane, solved = first
    reason = not_square(skew_of(solved.p), int(solved.use.sum()), _FIRST_SKEW)
    if reason:
        return Refused(reason)
    flat = plane.project(xyz)
    use = inside_board(flat, solved.p, side / 2) & _reach(xyz, plane, side)
    near = plane.at(solved.p[:2])
    second = _round(xyz, light, use, near, solved.p, scale, footprint)
    if isinstance(second, Refused):
        return second
    plane, solved = second
    reach = _reach(xyz, plane, side)
    return _judged(plane.project(xyz)[reach], light[reach], plane, solved, scale, floor)


def _round(
    xyz: Array,
    light: Array,
    use: NDArray[np.bool_],
    near: Array,
    before: Array | None,
    scale: tuple[float, float, float],
    footprint: float,
) -> tuple[BoardPlane, Pattern] | Refused:
    """Plane of the points ``use`` around a place (3,) and the pattern in it.

    before (7,) : the pattern in the plane of the first round, None in the first round.
    """
    plane = _plane(xyz, light, use, near, footprint)
    if isinstance(plane, Refused):
        return plane
    reach = _reach(xyz, plane, 2 * scale[0])
    flat, light = plane.project(xyz[reach]), light[reach]
    guess = guess_pattern(flat, light, 2 * scale[0]) if before is None else _moved(before)
    if guess is None:
        return Refused("light and dark do not alternate around it")
    solved = solve_pattern(flat, light, guess, scale, _FIRST if before is None else _STEPS)
    if solved is None:
        return Refused("the pattern of its quadrants does not converge")
    return plane, solved


def _plane(
    xyz: Array, light: Array, use: NDArray[np.bool_], near: Array, footprint: float
) -> BoardPlane | Refused:
    """The plane of some points, if the beam meets it well enough."""
    if use.sum() < FEWEST // 2:
        return Refused(f"only {int(use.sum())} points, {FEWEST // 2} are needed")
    low, high = np.quantile(light[use], [0.1, 0.9])
    plane = fit_board_plane(xyz[use], light[use] > (low + high) / 2, near, footprint)
    if plane is None:
        return Refused("the points around it lie in no plane")
    incidence = _incidence(near, plane)
    if incidence > _STEEPEST:
        return Refused(f"the beam meets it at {np.degrees(incidence):.0f} degrees")
    return plane


def _incidence(point: Array, plane: BoardPlane) -> float:
    return float(
        np.arccos(min(1.0, abs(float(point @ plane.normal)) / float(np.linalg.norm(point))))
    )


def _reach(xyz: Array, plane: BoardPlane, side: float) -> NDArray[np.bool_]:
    """Points near enough to the plane to be its board, or what surrounds it."""
    near: NDArray[np.bool_] = np.abs(xyz @ plane.normal - plane.offset) < max(
        5 * plane.rms, 0.1 * side
    )
    return near


def _moved(p: Array) -> Array:
    """A solution as the start in the coordinates of a plane whose origin is its centre."""
    return np.array([0.0, 0.0, *p[2:]])


def _judged(
    flat: Array,
    light: Array,
    plane: BoardPlane,
    solved: Pattern,
    scale: tuple[float, float, float],
    floor: float,
) -> CheckerboardFit | Refused:
    """The fit, if it passes every test."""
    p, half = solved.p, scale[0]
    inside = inside_board(flat, p, half)
    value, _ = pattern_light(flat, p)
    left = light[inside] - value[inside]
    explained = 1 - float(left.var()) / max(float(light[inside].var()), 1e-12)
    contrast = 2 * abs(p[5]) / max(solved.noise, 1e-12)
    reason = doubt(flat, light, p, half, int(inside.sum()), contrast, explained)
    if reason:
        return Refused(reason)
    solved = refine_edges(flat, light, solved, scale, plane)
    p = solved.p
    center = plane.at(p[:2])
    in_plane = solved.covariance[:2, :2]
    away = center / np.linalg.norm(center)
    # an offset of the plane moves the centre along the beam, since print is carried along it
    along = plane.sigma(p[:2]) / max(abs(float(away @ plane.normal)), 0.1)
    covariance = plane.axes.T @ in_plane @ plane.axes + along**2 * np.outer(away, away)
    return CheckerboardFit(
        center=center,
        covariance=covariance + floor**2 * np.eye(3),
        plane=plane,
        flat=in_plane,
        rms=plane.rms,
        contrast=contrast,
        explained=explained,
        incidence=_incidence(center, plane),
        turn=float(p[2]),
        skew=skew_of(p),
        blur=float(np.exp(p[6])),
        points=int(solved.use.sum()),
    )
