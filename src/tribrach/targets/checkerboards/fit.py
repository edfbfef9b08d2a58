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

from tribrach._types import Array
from tribrach.targets.checkerboards.pattern import (
    ENOUGH,
    FEWEST,
    BoardPattern,
    guess_pattern,
    inside_board,
    pattern_light,
    pitch,
    solve_pattern,
)
from tribrach.targets.prints.edges import EdgePoints, locate_edge
from tribrach.targets.prints.plane import BoardPlane, fit_board_plane

__all__ = ["CheckerboardFit", "fit_checkerboard"]

# Why a pattern of four quadrants that was fitted to light is no checkerboard.


#: edge lines are at right angles within this [rad], or what one row of points turns them
_SQUARE = np.radians(5.0)


#: least contrast over noise, least share of the variance of intensity that the pattern explains
_CONTRAST, _EXPLAINED = 4.0, 0.72


#: share of a pattern beyond the board that is too much; rim over half the side
_ONWARD, _RIM = 0.6, 1.15


def skew_of(p: Array) -> float:
    """Deviation of the edges from a right angle [rad]; p (7,) : as fitted."""
    return float((p[3] - p[2]) % np.pi - np.pi / 2)


def not_square(skew: float, points: int, more: float = 0.0) -> str:
    """Do the edges meet at a wrong angle? "" if not.

    points : within the board, their rows let an edge turn a little; more [rad] : that is allowed.
    """
    rows = 1.4 / float(np.sqrt(max(1, points)))
    if abs(skew) <= max(_SQUARE, rows) + more:
        return ""
    return f"its edges meet at {90 + np.degrees(skew):.0f} degrees"


def doubt(
    flat: Array, light: Array, p: Array, half: float, points: int, contrast: float, explained: float
) -> str:
    """Why a converged fit is no board of this size; "" if it is one.

    flat (n, 2) [m], light (n,) : on and around the board; p (7,) : as fitted; half : of the side
    [m]; points : within the board; contrast : over noise; explained : share of the variance.
    """
    reason = not_square(skew_of(p), points)
    if reason:
        return reason
    if contrast < _CONTRAST:
        return f"its contrast is {contrast:.1f} times the noise, {_CONTRAST:g} are needed"
    if explained < _EXPLAINED:
        return f"the pattern explains {100 * explained:.0f} % of the light, 72 are needed"
    d = flat - p[:2]
    a, b = d @ [np.cos(p[2]), np.sin(p[2])], d @ [np.cos(p[3]), np.sin(p[3])]
    inside = (np.abs(a) < half) & (np.abs(b) < half)
    counts = [
        int((inside & (np.sign(a) == i) & (np.sign(b) == j)).sum())
        for i in (-1, 1)
        for j in (-1, 1)
    ]
    if min(counts) < 0.4 * np.mean(counts) or min(counts) < 6:
        return f"its quadrants hold {counts} points"
    if _goes_on(a / half, b / half, light / p[5]):
        return "its pattern goes on beyond the side of the board"
    return ""


def _goes_on(a: Array, b: Array, light: Array) -> bool:
    """Are there larger quadrants, or tiles of their size on two sides of the board or more?

    a, b (n,) : distances from the edges over half the side; light (n,) over its half swing.
    """
    far, sign = np.maximum(np.abs(a), np.abs(b)), np.sign(a * b)
    if _alike(light, sign, (far > 1.5) & (far < 1.9)) > _ONWARD:
        return True
    sides = [
        (onto > _RIM) & (onto < 1.9) & (np.abs(other) < 0.95)
        for onto, other in ((a, b), (-a, b), (b, a), (-b, a))
    ]
    return sum(_alike(light, -sign, side) > _ONWARD for side in sides) >= 2


def _alike(light: Array, sign: Array, use: NDArray[np.bool_]) -> float:
    """How much of a pattern of signs (n,) is in the light of some points; 1 for all of it."""
    n = int(use.sum())
    return float(sign[use] @ (light[use] - light[use].mean())) / n if n >= 20 else 0.0


# The edges of a checkerboard once its pattern is known: each from the points beside it.
#
# What the least squares of :mod:`~tribrach.targets.checkerboards.pattern` gives is a start;
# where an edge lies is then the posterior of :mod:`~tribrach.targets.prints.edges` (section
# 8.2).


#: points that tell where an edge is, about; more than these say no more than its profile allows
_PLENTY = 400


def refine_edges(
    flat: Array,
    light: Array,
    solved: BoardPattern,
    scale: tuple[float, float, float],
    plane: BoardPlane,
) -> BoardPattern:
    """Centre and turns from the posteriors of the two edges; ``solved`` if one has too few points.

    flat (n, 2) [m] in the plane, light (n,); scale : half the side, blur, error by the angles [m].
    """
    half, blur, jitter = scale
    p, covariance = solved.p.copy(), solved.covariance.copy()
    shift = 1.5 * pitch(solved.use, half) + 2 * float(np.hypot(blur, jitter))
    for _ in range(2):
        inside = inside_board(flat, p, half)
        widest = max(plane.stretch(np.array([np.cos(t), np.sin(t)])) for t in p[2:4])
        clear = min(3 * widest * float(np.hypot(blur, jitter)), 0.3 * half)
        p, noise = _levels(flat[inside], light[inside], p, clear)
        moves, cofactors = [], []
        for k in (0, 1):
            points = _near_edge(flat[inside], light[inside], p, k, scale, plane, noise, shift)
            if len(points.along) < 4:
                return solved
            move, cofactor = locate_edge(points, shift, 1.5 * shift / half)
            moves.append(move)
            cofactors.append(cofactor)
        normals = np.stack([np.cos(p[2:4]), np.sin(p[2:4])], axis=1)
        to_place = np.linalg.inv(normals)
        p[:2] += to_place @ [moves[0][0], moves[1][0]]
        p[2:4] += [moves[0][1], moves[1][1]]
        spread = np.diag([cofactors[0][0, 0], cofactors[1][0, 0]])
        covariance[:2, :2] = to_place @ spread @ to_place.T
    return BoardPattern(p, covariance, solved.use, noise)


def _near_edge(
    flat: Array,
    light: Array,
    p: Array,
    k: int,
    scale: tuple[float, float, float],
    plane: BoardPlane,
    noise: float,
    shift: float,
) -> EdgePoints:
    """The points that may tell where edge ``k`` is, none that the other edge may touch."""
    half, blur, jitter = scale
    blur = float(np.sqrt(max(blur**2 - jitter**2, blur**2 / 4)))
    d = flat - p[:2]
    normals = np.stack([np.cos(p[2:4]), np.sin(p[2:4])], axis=1)
    distance = d @ normals.T
    blur, jitter = (size * plane.stretch(normals[k]) for size in (blur, jitter))
    reach = 3 * float(np.hypot(blur, jitter))
    clear = np.abs(distance[:, 1 - k]) > reach + 0.03 * half
    near = np.flatnonzero(clear & (np.abs(distance[:, k]) < reach + 2 * shift))
    near = near[:: max(1, len(near) // _PLENTY)]
    sign = np.sign(distance[near, 1 - k])
    return EdgePoints(
        along=d[near] @ [-normals[k, 1], normals[k, 0]],
        across=distance[near, k],
        level=(light[near] - p[4]) / p[5] * sign,
        noise=noise / abs(p[5]),
        blur=blur,
        jitter=jitter,
    )


def _levels(flat: Array, light: Array, p: Array, clear: float) -> tuple[Array, float]:
    """Parameters with the levels of the plain parts of the quadrants, and the noise of light."""
    d = flat - p[:2]
    a, b = d @ [np.cos(p[2]), np.sin(p[2])], d @ [np.cos(p[3]), np.sin(p[3])]
    plain = np.minimum(np.abs(a), np.abs(b)) > clear
    sign = np.sign(a * b)
    high, low = light[plain & (sign > 0)], light[plain & (sign < 0)]
    if min(len(high), len(low)) < 6:
        return p, 0.005 * abs(p[5])
    out, ends = p.copy(), np.array([np.median(high), np.median(low)])
    out[4:6] = ends.mean(), (ends[0] - ends[1]) / 2
    left = np.concatenate([high - ends[0], low - ends[1]])
    return out, max(1.4826 * float(np.median(np.abs(left))), 0.005 * abs(out[5]))


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
) -> tuple[BoardPlane, BoardPattern] | Refused:
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
    solved: BoardPattern,
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
