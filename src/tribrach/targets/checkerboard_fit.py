"""The centre of a black and white checkerboard of 2x2 quadrants, from its points (section 8.2).

``I = I0 + dI erf(a / (sqrt2 s)) erf(b / (sqrt2 s))`` over the board's plane, a and b the signed
distances from its two edge lines ``(x - x0) cos t + (y - y0) sin t``: least squares for x0, y0,
t1, t2, I0, dI and the blur s, which the footprint foretells. Points near an edge are uncertain by
their angles as well. Scanner frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import erf

from tribrach.targets.board_edges import EdgePoints, locate_edge
from tribrach.targets.board_plane import BoardPlane, fit_board_plane
from tribrach.targets.checkerboard_doubt import doubt, not_square, skew_of

__all__ = ["CheckerboardFit", "Refused", "fit_checkerboard"]

Array = NDArray[np.float64]

#: fewest points within the board
FEWEST = 40
#: the board is not looked at more obliquely than this [rad]
_STEEPEST = np.radians(65.0)
#: the blur is foretold to within this share of itself
_BLUR_SHARE = 0.5
_TRIM = 3.5
#: blur of the first steps over half the side, so that a far start finds its way
_WIDTHS = (0.5, 0.4, 0.3, 0.24, 0.2, 0.16, 0.12, 0.1, 0.08, 0.06, 0.05, 0.04)
#: points that tell where an edge is, about; more than these say no more than its profile allows
_PLENTY = 400
#: points, turns and shifts over the side that the first guess is made with
_SOME, _TURNS, _SHIFTS = 1500, np.arange(0, np.pi / 2, np.pi / 24), np.linspace(-0.36, 0.36, 9)
#: steps of the first round and of the second; what the first plane may add to the skew [rad]
_FIRST, _STEPS, _FIRST_SKEW = 18, 40, np.radians(10.0)
#: a blur below this share of the pitch has no slope
_COARSE = 0.35
#: light that is off by more than this share of the half swing is a stray while the blur narrows
_STRAY = 0.8
#: a fit that leaves more light unexplained than this times what it began with went astray
_WORSE = 1.2


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
    some = slice(None, None, max(1, len(xyz) // _SOME))
    first = _round(xyz[some], light[some], use[some], start, None, scale, footprint)
    if isinstance(first, Refused):
        return first
    plane, solved = first
    reason = not_square(skew_of(solved.p), int(solved.use.sum()), _FIRST_SKEW)
    if reason:
        return Refused(reason)
    flat = plane.project(xyz)
    use = _inside(flat, solved.p, side / 2) & _reach(xyz, plane, side)
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
) -> tuple[BoardPlane, _Solved] | Refused:
    """Plane of the points ``use`` around a place (3,) and the pattern in it.

    before (7,) : the pattern in the plane of the first round, None in the first round.
    """
    plane = _plane(xyz, light, use, near, footprint)
    if isinstance(plane, Refused):
        return plane
    reach = _reach(xyz, plane, 2 * scale[0])
    flat, light = plane.project(xyz[reach]), light[reach]
    guess = _guess(flat, light, 2 * scale[0]) if before is None else _moved(before)
    if guess is None:
        return Refused("light and dark do not alternate around it")
    solved = _solve(flat, light, guess, scale, _FIRST if before is None else _STEPS)
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


def _guess(flat: Array, light: Array, side: float) -> Array | None:
    """x0, y0, t1, t2, I0, dI, s from a search over turns and shifts."""
    keep = slice(None, None, max(1, len(flat) // _SOME))
    middle = float(np.median(light[keep]))
    found = _patterns(flat[keep], light[keep] - middle, side, _TURNS, _SHIFTS * side)
    score, turn, u, v, level = found
    if score < 0.25:
        return None
    centre = u * np.array([np.cos(turn), np.sin(turn)]) + v * np.array(
        [-np.sin(turn), np.cos(turn)]
    )
    return np.array([*centre, turn, turn + np.pi / 2, middle, level, 0.0])


@njit(cache=True, nogil=True)
def _patterns(x, light, side, turns, shifts):  # type: ignore[no-untyped-def]
    """Score of the best pattern of four quadrants, its turn, shifts along its axes, half swing.

    The score is the correlation of light and pattern within the board, times the root of its share
    of the points.
    """
    best, found = 0.0, (0.0, 0.0, 0.0, 0.0)
    a, b = np.empty(len(x)), np.empty(len(x))
    for turn in turns:
        c, s = np.cos(turn), np.sin(turn)
        for k in range(len(x)):
            a[k], b[k] = x[k, 0] * c + x[k, 1] * s, x[k, 1] * c - x[k, 0] * s
        for u in shifts:
            for v in shifts:
                n, total, square, own, odd = 0, 0.0, 0.0, 0.0, 0
                for k in range(len(x)):
                    du, dv = a[k] - u, b[k] - v
                    if abs(du) < 0.45 * side and abs(dv) < 0.45 * side:
                        sign = 1 if (du > 0) == (dv > 0) else -1
                        n += 1
                        total += light[k]
                        square += light[k] ** 2
                        own += sign * light[k]
                        odd += sign
                if n < 12:
                    continue
                own -= odd * total / n
                spread = np.sqrt(max(square - total**2 / n, 0.0))
                score = abs(own) / (np.sqrt(n) * spread + 1e-12) * np.sqrt(n / len(x))
                if score > best:
                    best, found = score, (turn, u, v, own / n)
    return (best, *found)


def _model(flat: Array, p: Array) -> tuple[Array, Array]:
    """Intensities (n,) and derivatives (n, 7) by x0, y0, t1, t2, I0, dI, ln s."""
    s = np.exp(p[6])
    d = flat - p[:2]
    out, terms = [], []
    for t in (p[2], p[3]):
        c, k = np.cos(t), np.sin(t)
        a = d[:, 0] * c + d[:, 1] * k
        slope = np.sqrt(2 / np.pi) / s * np.exp(-(a**2) / (2 * s**2))
        out.append(erf(a / (np.sqrt(2) * s)))
        terms.append((a, -c * slope, -k * slope, (d[:, 1] * c - d[:, 0] * k) * slope, -a * slope))
    (ea, eb), (ta, tb) = out, terms
    j = np.empty((len(flat), 7))
    j[:, 0] = p[5] * (ta[1] * eb + ea * tb[1])
    j[:, 1] = p[5] * (ta[2] * eb + ea * tb[2])
    j[:, 2] = p[5] * ta[3] * eb
    j[:, 3] = p[5] * ea * tb[3]
    j[:, 4] = 1.0
    j[:, 5] = ea * eb
    j[:, 6] = p[5] * (ta[4] * eb + ea * tb[4])
    return p[4] + p[5] * ea * eb, j


@dataclass(frozen=True)
class _Solved:
    """Parameters (7,), their covariance (7, 7), points used, noise of light."""

    p: Array
    covariance: Array
    use: NDArray[np.bool_]
    noise: float


def _solve(
    flat: Array, light: Array, guess: Array, scale: tuple[float, float, float], steps: int
) -> _Solved | None:
    """The pattern with its blur going from wide to narrow, then with a free blur.

    Where points lie far apart the second may lead an edge over a row of points, which are then
    trimmed and hold it no more; what explains less light than before is not taken.
    """
    narrow = max(scale[1], _COARSE * _pitch(_inside(flat, guess, scale[0]), scale[0]))
    led = _descend(flat, light, guess, scale, narrow, range(len(_WIDTHS)))
    if led is None:
        return None
    free = _descend(flat, light, led.p, scale, narrow, range(len(_WIDTHS), steps))
    if free is None:
        return None
    # the same blur for both, since a wide one explains less of the light wherever the edges are
    sharp = np.append(led.p[:6], free.p[6])
    before, after = (_unexplained(flat, light, p, scale[0]) for p in (sharp, free.p))
    return free if after < _WORSE * before else led


def _unexplained(flat: Array, light: Array, p: Array, half: float) -> float:
    """Mean squared residual of light within the board over its half swing, strays cut."""
    inside = _inside(flat, p, half)
    v = (light[inside] - _model(flat[inside], p)[0]) / p[5]
    return float(np.mean(np.minimum(v**2, _STRAY**2))) if inside.any() else np.inf


def _descend(
    flat: Array,
    light: Array,
    start: Array,
    scale: tuple[float, float, float],
    narrow: float,
    steps: range,
) -> _Solved | None:
    """Damped Gauss-Newton with trimming; steps : those of ``_WIDTHS`` have a blur given there.

    narrow : the blur that is foretold [m].
    """
    half, _, jitter = scale
    p, noise = start.copy(), 0.0
    if _inside(flat, p, half).sum() < FEWEST // 2:
        return None
    for step in steps:
        fixed = step < len(_WIDTHS)
        if fixed:
            p[6] = np.log(max(narrow, _WIDTHS[step] * half))
        value, j = _model(flat, p)
        drift = np.hypot(j[:, 0], j[:, 1]) * jitter
        use = _inside(flat, p, half)
        v = light - value
        noise = (
            max(1.4826 * float(np.median(np.abs(v[use]))), 0.005 * abs(p[5])) if use.any() else 0
        )
        use &= np.abs(v) < np.maximum(
            _TRIM * np.hypot(noise, drift), _STRAY * abs(p[5]) if fixed else 0
        )
        if use.sum() < FEWEST // 2 or noise <= 0:
            return None
        w = 1 / (noise**2 + drift[use] ** 2)
        n = j[use].T @ (j[use] * w[:, None])
        right = j[use].T @ (w * v[use])
        tight = 1e8 if fixed else 1 / _BLUR_SHARE**2
        n[6, 6] += tight
        right[6] += tight * (np.log(narrow) - p[6]) * (not fixed)
        move = np.linalg.lstsq(n + 1e-9 * np.diag(np.diag(n)), right)[0]
        if not np.isfinite(move).all():
            return None
        limit = np.array([half / 4, half / 4, 0.15, 0.15, np.inf, np.inf, 0.5])
        p = p + np.clip(move, -limit, limit)
        if not fixed and np.abs(move[:4] / [half, half, 1, 1]).max() < 1e-5:
            break
    chi = float(np.mean(v[use] ** 2 * w))
    try:
        return _Solved(p, np.asarray(np.linalg.inv(n)) * max(1.0, chi), use, noise)
    except np.linalg.LinAlgError:
        return None


def _pitch(use: NDArray[np.bool_], half: float) -> float:
    """Mean distance of points within the board [m]."""
    return 2 * half / float(np.sqrt(max(1, int(use.sum()))))


def _refined(
    flat: Array, light: Array, solved: _Solved, scale: tuple[float, float, float], plane: BoardPlane
) -> _Solved:
    """Centre and turns from the posteriors of the two edges."""
    half, blur, jitter = scale
    p, covariance = solved.p.copy(), solved.covariance.copy()
    shift = 1.5 * _pitch(solved.use, half) + 2 * float(np.hypot(blur, jitter))
    for _ in range(2):
        inside = _inside(flat, p, half)
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
    return _Solved(p, covariance, solved.use, noise)


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


def _inside(flat: Array, p: Array, half: float) -> NDArray[np.bool_]:
    """Points within the board's square, a little inside of its rim."""
    d = flat - p[:2]
    limit = 0.94 * half
    a = d @ [np.cos(p[2]), np.sin(p[2])]
    b = d @ [np.cos(p[3]), np.sin(p[3])]
    return np.asarray((np.abs(a) < limit) & (np.abs(b) < limit))


def _judged(
    flat: Array,
    light: Array,
    plane: BoardPlane,
    solved: _Solved,
    scale: tuple[float, float, float],
    floor: float,
) -> CheckerboardFit | Refused:
    """The fit, if it passes every test."""
    p, half = solved.p, scale[0]
    inside = _inside(flat, p, half)
    value, _ = _model(flat, p)
    left = light[inside] - value[inside]
    explained = 1 - float(left.var()) / max(float(light[inside].var()), 1e-12)
    contrast = 2 * abs(p[5]) / max(solved.noise, 1e-12)
    reason = doubt(flat, light, p, half, int(inside.sum()), contrast, explained)
    if reason:
        return Refused(reason)
    solved = _refined(flat, light, solved, scale, plane)
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
