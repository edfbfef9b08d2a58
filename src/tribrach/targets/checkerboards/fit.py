"""Measures a black and white checkerboard of 2x2 quadrants (method section 8.2).

A first round fits the plane of the points around the start, a second one that of the board alone.
In both rounds the pattern is fitted by least squares; a board that passes all tests gets its edges
refined. The blur is predicted from the footprint. Points near an edge are uncertain also by their
angles. Scanner frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.instruments.neighbours import SharedNoise
from tribrach.sentences import Sentence
from tribrach.statistics import robust_sigma
from tribrach.targets.checkerboards.pattern import GATES as PATTERN
from tribrach.targets.checkerboards.pattern import (
    BoardPattern,
    guess_pattern,
    inside_board,
    pattern_light,
    pitch,
    solve_pattern,
)
from tribrach.targets.prints.edges import EdgePoints, locate_edge, noise_of_colours, usual_noise
from tribrach.targets.prints.plane import BoardPlane, fit_board_plane
from tribrach.targets.prints.search import Refused
from tribrach.units import DEG


@dataclass(frozen=True)
class BoardGates:
    """The numbers that decide whether a fitted pattern is a checkerboard.

    Chosen by hand with test_checkerboards, benchmarks/target_search.
    """

    reach_sides: float = 0.95  #: points looked at lie within this many sides of the start
    #: the first plane is that of what lies within this many sides of the start
    first_plane_sides: float = 0.5
    least_blur_m: float = 1e-4  #: least blur of the edges [m]
    #: sigma of the normal beam that blurs an edge as a footprint does, over its diameter
    blur_footprints: float = 0.25
    #: steps of the first round and of the second
    first_steps: int = 18
    steps: int = 40
    #: the board is not looked at more obliquely than this [rad]
    steepest_rad: float = float(np.radians(65.0))
    #: black and white are parted halfway between these quantiles of light
    light_quantiles: tuple[float, float] = (0.1, 0.9)
    #: points belong to the plane within this many of its rms, at least this share of the side
    on_plane_sigmas: float = 5.0
    on_plane_sides: float = 0.1
    #: sine of the flattest beam that the error of the plane is carried along
    flattest_sine: float = 0.1

    square_rad: float = float(np.radians(5.0))  #: edges are at right angles within this [rad] ...
    #: ... or within what one row of points turns them, over the root of the number of points
    square_rows: float = 1.4
    first_square_rad: float = float(np.radians(10.0))  #: what the first plane may add to that [rad]
    least_contrast: float = 4.0  #: least contrast over noise
    explained_share: float = 0.72  #: least share of the variance of light that the pattern explains
    #: the emptiest quadrant holds this share of the mean and so many points
    quadrant_share: float = 0.4
    quadrant_points: int = 6
    onward_share: float = 0.6  #: more of a pattern than this beyond the board is too much
    #: what goes on lies beyond the rim, and within the outer bound [half sides]
    rim_halves: float = 1.15
    outer_halves: float = 1.9
    #: larger quadrants are looked for beyond this, tiles beside a side within this [half sides]
    larger_halves: float = 1.5
    beside_halves: float = 0.95
    onward_points: int = 20  #: fewer points tell of no pattern beyond the board

    #: points that tell where an edge is, about: more say no more than its profile allows
    telling_points: int = 400
    #: edges are looked for within so many distances of points and sigmas of blur
    shift_pitches: float = 1.5
    shift_sigmas: float = 2.0
    turn_shifts: float = 1.5  #: turns of an edge that are looked at, over its shifts at the rim
    refining_rounds: int = 2  #: rounds of refining both edges
    edge_points: int = 4  #: an edge with fewer points stays as it was fitted
    #: plain print begins this many sigmas of blur from an edge, but not beyond this share of half
    #: the side; the other edge stays clear by some more
    plain_sigmas: float = 3.0
    plain_halves: float = 0.3
    clear_halves: float = 0.03
    #: light of plain print is taken from so many points of either colour, or from the fit
    plain_points: int = 6
    #: light that falls off along the board is evened out where so many points of plain print tell
    #: of it, by so many sigmas
    shaded_points: int = 30
    shaded_sigmas: float = 4.0
    #: noise of light is not believed to be below this share of the half swing
    least_noise_swing: float = 0.005


GATES = BoardGates()


# The tests that a fitted pattern has to pass before it is a checkerboard.


def skew_of(p: Array) -> float:
    """Deviation of the two edges from a right angle."""
    return float((p[3] - p[2]) % np.pi - np.pi / 2)


def not_square(skew: float, points: int, more: float = 0.0) -> str:
    """Tell why the edges do not meet at a right angle, give or take ``more`` [rad]."""
    rows = GATES.square_rows / float(np.sqrt(max(1, points)))
    if abs(skew) <= max(GATES.square_rad, rows) + more:
        return ""
    return Sentence("its edges meet at {skew:degrees0}", skew=(90 + np.degrees(skew)) * DEG)


def doubt(
    flat: Array, light: Array, p: Array, half: float, points: int, contrast: float, explained: float
) -> str:
    """Tell why a converged fit is not a board of this size.

    ``contrast`` is black to white over the noise, ``explained`` the share of the variance of
    intensity that the pattern explains.
    """
    reason = not_square(skew_of(p), points)
    if reason:
        return reason
    if contrast < GATES.least_contrast:
        return Sentence(
            "its contrast is {contrast:1} times the noise, {gates.least_contrast:g} are needed",
            contrast=contrast,
            gates=GATES,
        )
    if explained < GATES.explained_share:
        needed = 100 * GATES.explained_share
        return Sentence(
            "the pattern explains {explained:%0} of the light, {needed:0} are needed",
            explained=explained,
            needed=needed,
        )
    d = flat - p[:2]
    a, b = d @ [np.cos(p[2]), np.sin(p[2])], d @ [np.cos(p[3]), np.sin(p[3])]
    inside = (np.abs(a) < half) & (np.abs(b) < half)
    counts = [
        int((inside & (np.sign(a) == i) & (np.sign(b) == j)).sum())
        for i in (-1, 1)
        for j in (-1, 1)
    ]
    if min(counts) < max(GATES.quadrant_share * float(np.mean(counts)), GATES.quadrant_points):
        return f"its quadrants hold {counts} points"
    if _goes_on(a / half, b / half, light / p[5]):
        return "its pattern goes on beyond the side of the board"
    return ""


def _goes_on(a: Array, b: Array, light: Array) -> bool:
    """True if the quadrants are larger, or tiles of their size lie on two sides or more.

    Distances ``a``, ``b`` from the edges are over half the side, ``light`` is over half its swing.
    """
    far, sign = np.maximum(np.abs(a), np.abs(b)), np.sign(a * b)
    if (
        _alike(light, sign, (far > GATES.larger_halves) & (far < GATES.outer_halves))
        > GATES.onward_share
    ):
        return True
    sides = [
        (onto > GATES.rim_halves)
        & (onto < GATES.outer_halves)
        & (np.abs(other) < GATES.beside_halves)
        for onto, other in ((a, b), (-a, b), (b, a), (-b, a))
    ]
    return sum(_alike(light, -sign, side) > GATES.onward_share for side in sides) >= 2


def _alike(light: Array, sign: Array, use: NDArray[np.bool_]) -> float:
    """How much of a pattern of signs (n,) is in the light of some points; 1 for all of it."""
    n = int(use.sum())
    return (
        float(sign[use] @ (light[use] - light[use].mean())) / n if n >= GATES.onward_points else 0.0
    )


def refine_edges(
    flat: Array,
    light: Array,
    solved: BoardPattern,
    scale: tuple[float, float, float],
    plane: BoardPlane,
) -> BoardPattern:
    """Refine centre and turns of a pattern edge by edge, from the points beside each edge.

    ``scale`` is half the side, blur, and error of a point's place by its angles [m].

    Least squares (:mod:`~tribrach.targets.checkerboards.pattern`) give the start; where an edge
    lies is then the posterior of :mod:`~tribrach.targets.prints.edges` (method section 8.2).
    """
    half, blur, jitter = scale
    p, covariance = solved.p.copy(), solved.covariance.copy()
    shift = GATES.shift_pitches * pitch(solved.use, half)
    shift += GATES.shift_sigmas * float(np.hypot(blur, jitter))
    for _ in range(GATES.refining_rounds):
        inside = inside_board(flat, p, half)
        widest = max(plane.stretch(np.array([np.cos(t), np.sin(t)])) for t in p[2:4])
        clear = GATES.plain_sigmas * widest * float(np.hypot(blur, jitter))
        clear = min(clear, GATES.plain_halves * half)
        light = _evened(flat, light, inside, p, clear)
        p, noise = _levels(flat[inside], light[inside], p, clear)
        moves, cofactor = np.zeros(4), np.zeros((4, 4))
        for k in (0, 1):
            points = _near_edge(flat[inside], light[inside], p, k, scale, plane, noise, shift)
            if len(points.along) < GATES.edge_points:
                return solved
            own = slice(2 * k, 2 * k + 2)
            moves[own], cofactor[own, own] = locate_edge(
                points, shift, GATES.turn_shifts * shift / half
            )
        variances = np.diag(cofactor)
        turns = _squared(moves[[1, 3]], variances[[1, 3]], skew_of(p))
        normals = np.stack([np.cos(p[2:4]), np.sin(p[2:4])], axis=1)
        to_place = np.linalg.inv(normals)
        p[:2] += to_place @ moves[[0, 2]]
        p[2:4] += turns
        covariance[:2, :2] = to_place @ np.diag(variances[[0, 2]]) @ to_place.T
    return BoardPattern(p, covariance, solved.use, noise)


def _squared(turns: Array, variances: Array, skew: float) -> Array:
    """Turns (2,) of both edges by which they come nearer to the right angle of prints.

    Rows of few points say little of how an edge turns; that both are at a right angle, but for 2
    degrees, is one more observation. The place of the centre is left to the points.
    """
    gain = variances / (variances.sum() + PATTERN.square_sigma_rad**2)
    lack = skew + turns[1] - turns[0]
    return np.asarray(turns + lack * gain * np.array([1.0, -1.0]))


def _evened(flat: Array, light: Array, inside: NDArray[np.bool_], p: Array, clear: float) -> Array:
    """Light (n,) without its slope along the board, where plain print shows one.

    A near board that is seen obliquely is some tenths nearer on one side and seen at another angle
    there, so that both colours are brighter by one factor, ``1 + g . d``.
    """
    d = flat - p[:2]
    a, b = d @ [np.cos(p[2]), np.sin(p[2])], d @ [np.cos(p[3]), np.sin(p[3])]
    plain = inside & (np.minimum(np.abs(a), np.abs(b)) > clear)
    white = np.sign(a * b) == np.sign(p[5])
    rows, right = [], []
    for colour in (white, ~white):
        on = plain & colour
        if on.sum() < GATES.shaded_points:
            return light
        middle = float(np.median(light[on]))
        noise = max(robust_sigma(light[on]), GATES.least_noise_swing * abs(p[5]))
        rows.append(np.column_stack([middle * d[on], np.ones(on.sum())]) / noise)
        right.append((light[on] - middle) / noise)
    # a level of each colour beside the slope that both share
    first, second = (np.column_stack([r[:, :2], np.zeros((len(r), 2))]) for r in rows)
    first[:, 2], second[:, 3] = rows[0][:, 2], rows[1][:, 2]
    design = np.concatenate([first, second])
    try:
        cofactor = np.linalg.inv(design.T @ design)
    except np.linalg.LinAlgError:
        return light
    slope = (cofactor @ (design.T @ np.concatenate(right)))[:2]
    told = float(slope @ np.linalg.solve(cofactor[:2, :2], slope))
    factor = 1 + d @ slope
    if told < GATES.shaded_sigmas**2 or factor[inside].min() <= 0:
        return light
    return np.asarray(light / np.where(factor > 0, factor, 1.0))


def _near_edge(
    flat: Array,
    light: Array,
    p: Array,
    k: int,
    scale: tuple[float, float, float],
    plane: BoardPlane,
    noise: Array,
    shift: float,
) -> EdgePoints:
    """The points that may tell where edge ``k`` is, none that the other edge may touch."""
    half, blur, jitter = scale
    blur = float(np.sqrt(max(blur**2 - jitter**2, blur**2 / 4)))
    d = flat - p[:2]
    normals = np.stack([np.cos(p[2:4]), np.sin(p[2:4])], axis=1)
    distance = d @ normals.T
    blur, jitter = (size * plane.stretch(normals[k]) for size in (blur, jitter))
    reach = GATES.plain_sigmas * float(np.hypot(blur, jitter))
    clear = np.abs(distance[:, 1 - k]) > reach + GATES.clear_halves * half
    near = np.flatnonzero(clear & (np.abs(distance[:, k]) < reach + 2 * shift))
    near = near[:: max(1, len(near) // GATES.telling_points)]
    sign = np.sign(distance[near, 1 - k])
    return EdgePoints(
        along=d[near] @ [-normals[k, 1], normals[k, 0]],
        across=distance[near, k],
        level=(light[near] - p[4]) / p[5] * sign,
        noise=np.where(sign[:, None] > 0, noise, noise[::-1]) / abs(p[5]),
        blur=blur,
        jitter=jitter,
    )


def _levels(flat: Array, light: Array, p: Array, clear: float) -> tuple[Array, Array]:
    """Parameters with the levels of plain parts of the quadrants; noise (2,) of either colour."""
    d = flat - p[:2]
    a, b = d @ [np.cos(p[2]), np.sin(p[2])], d @ [np.cos(p[3]), np.sin(p[3])]
    plain = np.minimum(np.abs(a), np.abs(b)) > clear
    sign = np.sign(a * b)
    high, low = light[plain & (sign > 0)], light[plain & (sign < 0)]
    if min(len(high), len(low)) < GATES.plain_points:
        return p, np.full(2, GATES.least_noise_swing * abs(p[5]))
    out, ends = p.copy(), np.array([np.median(high), np.median(low)])
    out[4:6] = ends.mean(), (ends[0] - ends[1]) / 2
    left = np.concatenate([low - ends[1], high - ends[0]])
    noise = noise_of_colours(left, np.arange(len(left)) >= len(low))
    return out, np.maximum(noise, GATES.least_noise_swing * abs(out[5]))


@dataclass(frozen=True)
class CheckerboardFit:
    """A measured checkerboard."""

    center: Array  #: (3,), centre in the scanner frame [m]
    covariance: Array  #: (3, 3), its covariance, floor included [m^2]
    plane: BoardPlane  #: plane of the board
    flat: Array  #: (2, 2), covariance of the centre in the plane [m^2]
    rms: float  #: root mean square of the range residuals [m]
    contrast: float  #: black to white over the noise
    explained: float  #: share of the variance of intensity that the pattern explains
    incidence: float  #: angle between beam and normal of the board [rad]
    turn: float  #: turn of the edges in the plane [rad]
    skew: float  #: deviation of the edges from a right angle [rad]
    blur: float  #: sigma of the blurred edges [m]
    points: int  #: number of points used


def fit_checkerboard(
    xyz: Array,
    intensity: NDArray[np.floating[Any]],
    start: Array,
    side: float,
    *,
    footprint: float = 0.006,
    sigma_angle: float = 4e-5,
    floor: float = 3e-4,
    shared: SharedNoise | None = None,
) -> CheckerboardFit | Refused:
    """Fit a checkerboard of a known side near a place (off by up to a third of it), at any turn.

    ``sigma_angle`` holds the place of an echo in the footprint. Where it is not known what
    neighbours share of their range errors, points in one footprint count as one.
    """
    close = np.linalg.norm(xyz - start, axis=1) < GATES.reach_sides * side
    if close.sum() < PATTERN.fewest_points:
        return Refused(
            f"only {int(close.sum())} points, {PATTERN.fewest_points} are needed", texture=True
        )
    xyz, light = xyz[close], np.asarray(intensity[close], dtype=float)
    spread = sigma_angle * float(np.linalg.norm(start))
    scale = (
        side / 2,
        max(float(np.hypot(GATES.blur_footprints * footprint, spread)), GATES.least_blur_m),
        spread,
    )
    use = np.linalg.norm(xyz - start, axis=1) < GATES.first_plane_sides * side
    # the first plane is that of what lies around the start, and some of its points tell enough;
    # the second is that of the board alone
    some = slice(None, None, max(1, len(xyz) // PATTERN.guess_points))
    first = _round(xyz[some], light[some], use[some], start, None, scale, footprint, shared)
    if isinstance(first, Refused):
        return first
    plane, solved = first
    reason = not_square(skew_of(solved.p), int(solved.use.sum()), GATES.first_square_rad)
    if reason:
        return Refused(reason)
    flat = plane.project(xyz)
    use = inside_board(flat, solved.p, side / 2) & _reach(xyz, plane, side)
    near = plane.at(solved.p[:2])
    second = _round(xyz, light, use, near, solved.p, scale, footprint, shared)
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
    shared: SharedNoise | None,
) -> tuple[BoardPlane, BoardPattern] | Refused:
    """Fit plane and pattern to points in use; ``before`` is the first round's pattern or None."""
    plane = _plane(xyz, light, use, near, footprint, shared)
    if isinstance(plane, Refused):
        return plane
    reach = _reach(xyz, plane, 2 * scale[0])
    flat, light = plane.project(xyz[reach]), light[reach]
    guess = guess_pattern(flat, light, 2 * scale[0]) if before is None else _moved(before)
    if guess is None:
        return Refused("light and dark do not alternate around it", texture=True)
    solved = solve_pattern(
        flat, light, guess, scale, GATES.first_steps if before is None else GATES.steps
    )
    if solved is None:
        return Refused("the pattern of its quadrants does not converge", texture=True)
    return plane, solved


def _plane(
    xyz: Array,
    light: Array,
    use: NDArray[np.bool_],
    near: Array,
    footprint: float,
    shared: SharedNoise | None,
) -> BoardPlane | Refused:
    """The plane of some points, if the beam meets it well enough."""
    if use.sum() < PATTERN.fewest_points // 2:
        return Refused(
            f"only {int(use.sum())} points, {PATTERN.fewest_points // 2} are needed", texture=True
        )
    low, high = np.quantile(light[use], GATES.light_quantiles)
    plane = fit_board_plane(xyz[use], light[use] > (low + high) / 2, near, footprint, shared)
    if plane is None:
        return Refused("the points around it lie in no plane", texture=True)
    incidence = _incidence(near, plane)
    if incidence > GATES.steepest_rad:
        return Refused(Sentence("the beam meets it at {incidence:degrees0}", incidence=incidence))
    return plane


def _incidence(point: Array, plane: BoardPlane) -> float:
    return float(
        np.arccos(min(1.0, abs(float(point @ plane.normal)) / float(np.linalg.norm(point))))
    )


def _reach(xyz: Array, plane: BoardPlane, side: float) -> NDArray[np.bool_]:
    """Points near enough to the plane to be its board, or what surrounds it."""
    near: NDArray[np.bool_] = np.abs(xyz @ plane.normal - plane.offset) < max(
        GATES.on_plane_sigmas * plane.rms, GATES.on_plane_sides * side
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
    contrast = 2 * abs(p[5]) / max(usual_noise(solved.noise), 1e-12)
    reason = doubt(flat, light, p, half, int(inside.sum()), contrast, explained)
    if reason:
        return Refused(reason)
    solved = refine_edges(flat, light, solved, scale, plane)
    p = solved.p
    center = plane.at(p[:2])
    in_plane = solved.covariance[:2, :2]
    away = center / np.linalg.norm(center)
    # an offset of the plane moves the centre along the beam, since print is carried along it
    along = plane.sigma(p[:2]) / max(abs(float(away @ plane.normal)), GATES.flattest_sine)
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
