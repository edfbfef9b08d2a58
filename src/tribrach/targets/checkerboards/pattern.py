"""Fits the pattern of a 2x2 checkerboard in its plane (method section 8.2).

A search over turns and shifts gives the start, least squares the pattern ``I = I0 + dI erf(a /
(sqrt2 s)) erf(b / (sqrt2 s))``, with a and b the signed distances from the two edge lines ``(x -
x0) cos t + (y - y0) sin t``. The parameters p (7,) are x0, y0 [m], t1, t2 [rad], I0, dI, ln s.
Points are ``flat`` (n, 2) [m] with intensities ``light`` (n,). A ``scale`` holds half the side, the
predicted blur, and the error of a point's place by its angles, all in metres of the plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from tribrach._types import Array
from tribrach.kernels import njit
from tribrach.targets.prints.edges import noise_of_colours


@dataclass(frozen=True)
class PatternGates:
    """How the pattern of four quadrants is guessed and fitted to light.

    Chosen by hand with test_checkerboards.
    """

    fewest_points: int = 40  #: fewest points within the board
    guess_points: int = 1500  #: points that the first guess is made with, about
    #: turns of the first guess in a right angle, and its shifts over the side
    guess_turns: int = 12
    guess_shift_sides: float = 0.36
    guess_shifts: int = 9
    guess_correlation: float = 0.25  #: least correlation of light and pattern that is followed
    #: the guess compares what lies within this share of the side, at least so many points
    guess_inside_sides: float = 0.45
    guess_fewest: int = 12
    #: what lies within this share of half the side is the board: a little inside of its rim
    inside_halves: float = 0.94
    blur_log_sigma: float = 0.5  #: the blur is predicted to this, sigma of its logarithm
    #: edges are expected at right angles, sigma [rad]: where points lie far apart an edge turns
    #: freely between two of them, and light that says otherwise is stronger than this
    square_sigma_rad: float = float(np.radians(2.0))
    trim_sigmas: float = 3.5  #: residuals of light beyond this many sigmas take no part ...
    #: ... but while the blur narrows only those beyond this share of the half swing
    stray_swing: float = 0.8
    #: blur of the first steps over half the side, from wide to narrow: a far start finds its way
    first_blurs_halves: tuple[float, ...] = (
        0.5, 0.4, 0.3, 0.24, 0.2, 0.16, 0.12, 0.1, 0.08, 0.06, 0.05, 0.04,
    )  # fmt: skip
    #: a blur below this share of the distance of points has no slope that least squares could find
    least_blur_pitches: float = 0.35
    #: a free fit that leaves more light unexplained than this times the led one went astray
    astray_factor: float = 1.2
    #: noise of light is not believed to be below this share of the half swing
    least_noise_swing: float = 0.005
    #: largest move in a step: of the centre over half the side, of the turns [rad], of the
    #: logarithm of the blur
    centre_step_halves: float = 0.25
    turn_step_rad: float = 0.15
    blur_step_log: float = 0.5
    #: a smaller move ends the fit: of the centre over half the side, of the turns [rad]
    settled: float = 1e-5


GATES = PatternGates()

# compiled code reads constants of the module, not attributes of an object
_GUESS_INSIDE_SIDES = GATES.guess_inside_sides
_GUESS_FEWEST = GATES.guess_fewest


@dataclass(frozen=True)
class BoardPattern:
    """A fitted pattern of four quadrants."""

    p: Array  #: (7,), parameters x0, y0 [m], t1, t2 [rad], I0, dI, ln s
    covariance: Array  #: (7, 7), their covariance
    use: NDArray[np.bool_]  #: (n,), points used
    #: (2,), noise of the intensities on the colour of ``I0 - dI`` and on that of ``I0 + dI``
    noise: Array


def guess_pattern(flat: Array, light: Array, side: float) -> Array | None:
    """Search for a pattern over turns and shifts; the blur is not searched, its logarithm is 0."""
    keep = slice(None, None, max(1, len(flat) // GATES.guess_points))
    middle = float(np.median(light[keep]))
    turns = np.arange(0, np.pi / 2, np.pi / 2 / GATES.guess_turns)
    shifts = np.linspace(-GATES.guess_shift_sides, GATES.guess_shift_sides, GATES.guess_shifts)
    best = _patterns(flat[keep], light[keep] - middle, side, turns, shifts * side)
    score, turn, u, v, level = best
    if score < GATES.guess_correlation:
        return None
    centre = u * np.array([np.cos(turn), np.sin(turn)]) + v * np.array(
        [-np.sin(turn), np.cos(turn)]
    )
    return np.array([*centre, turn, turn + np.pi / 2, middle, level, 0.0])


@njit(cache=True, nogil=True)
def _patterns(x, light, side, turns, shifts):  # type: ignore[no-untyped-def]
    """Score of the best pattern of four quadrants, its turn, shifts along its axes and half swing.

    The score is the correlation of intensity and pattern within the board, times the root of the
    board's share of the points.
    """
    best, pattern = 0.0, (0.0, 0.0, 0.0, 0.0)
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
                    if max(abs(du), abs(dv)) < _GUESS_INSIDE_SIDES * side:
                        sign = 1 if (du > 0) == (dv > 0) else -1
                        n += 1
                        total += light[k]
                        square += light[k] ** 2
                        own += sign * light[k]
                        odd += sign
                if n < _GUESS_FEWEST:
                    continue
                own -= odd * total / n
                spread = np.sqrt(max(square - total**2 / n, 0.0))
                score = abs(own) / (np.sqrt(n) * spread + 1e-12) * np.sqrt(n / len(x))
                if score > best:
                    best, pattern = score, (turn, u, v, own / n)
    return (best, *pattern)


def pattern_light(flat: Array, p: Array) -> tuple[Array, Array]:
    """Intensities of a pattern at places, and derivatives by x0, y0, t1, t2, I0, dI, ln s."""
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


def solve_pattern(
    flat: Array, light: Array, guess: Array, scale: tuple[float, float, float], steps: int
) -> BoardPattern | None:
    """Fit the pattern with its blur going from wide to narrow, then with a free blur.

    ``scale`` is half the side, predicted blur, and error of a point's place by its angles [m].

    Where points lie far apart, the free blur may lead an edge over a row of points, which are then
    trimmed and no longer hold it. A solution that explains less of the intensity than the one
    before is therefore not taken.
    """
    narrow = max(
        scale[1], GATES.least_blur_pitches * pitch(inside_board(flat, guess, scale[0]), scale[0])
    )
    led_steps = len(GATES.first_blurs_halves)
    led = _descend(flat, light, guess, scale, narrow, range(led_steps))
    if led is None:
        return None
    free = _descend(flat, light, led.p, scale, narrow, range(led_steps, steps))
    if free is None:
        return None
    # the same blur for both, since a wide one explains less of the light wherever the edges are
    sharp = np.append(led.p[:6], free.p[6])
    before, after = (_unexplained(flat, light, p, scale[0]) for p in (sharp, free.p))
    return free if after < GATES.astray_factor * before else led


def _unexplained(flat: Array, light: Array, p: Array, half: float) -> float:
    """Mean squared residual of light within the board over its half swing, strays cut."""
    inside = inside_board(flat, p, half)
    v = (light[inside] - pattern_light(flat[inside], p)[0]) / p[5]
    return float(np.mean(np.minimum(v**2, GATES.stray_swing**2))) if inside.any() else np.inf


def _descend(
    flat: Array,
    light: Array,
    start: Array,
    scale: tuple[float, float, float],
    narrow: float,
    steps: range,
) -> BoardPattern | None:
    """Damped Gauss-Newton steps with trimming; the first steps have a given blur."""
    half, _, jitter = scale
    p, noise, blurs = start.copy(), np.zeros(2), GATES.first_blurs_halves
    if inside_board(flat, p, half).sum() < GATES.fewest_points // 2:
        return None
    for step in steps:
        fixed = step < len(blurs)
        if fixed:
            p[6] = np.log(max(narrow, blurs[step] * half))
        value, j = pattern_light(flat, p)
        drift = np.hypot(j[:, 0], j[:, 1]) * jitter
        use = inside_board(flat, p, half)
        v = light - value
        least = GATES.least_noise_swing * abs(p[5])
        # while the blur narrows residuals are misfit: a colour that fits worse is no noisier
        bright = j[use, 5] > 0
        noise = noise_of_colours(v[use], np.zeros_like(bright) if fixed else bright)
        noise = np.maximum(noise, least)
        # light between the colours is as noisy as its level says
        own = np.hypot(noise[0] + (noise[1] - noise[0]) * (j[:, 5] + 1) / 2, drift)
        use &= np.abs(v) < np.maximum(
            GATES.trim_sigmas * own,
            GATES.stray_swing * abs(p[5]) if fixed else 0,
        )
        if use.sum() < GATES.fewest_points // 2 or not noise.min() > 0:
            return None
        w = 1 / own[use] ** 2
        n = j[use].T @ (j[use] * w[:, None])
        right = j[use].T @ (w * v[use])
        tight = 1e8 if fixed else 1 / GATES.blur_log_sigma**2
        n[6, 6] += tight
        right[6] += tight * (np.log(narrow) - p[6]) * (not fixed)
        turn = np.array([-1.0, 1.0]) / GATES.square_sigma_rad
        n[2:4, 2:4] += np.outer(turn, turn)
        skew = (p[3] - p[2]) % np.pi - np.pi / 2
        right[2:4] -= turn * skew / GATES.square_sigma_rad
        move = np.linalg.lstsq(n + 1e-9 * np.diag(np.diag(n)), right)[0]
        if not np.isfinite(move).all():
            return None
        limit = np.array(
            [
                *[GATES.centre_step_halves * half] * 2,
                *[GATES.turn_step_rad] * 2,
                np.inf,
                np.inf,
                GATES.blur_step_log,
            ]
        )
        p = p + np.clip(move, -limit, limit)
        if not fixed and np.abs(move[:4] / [half, half, 1, 1]).max() < GATES.settled:
            break
    chi = float(np.mean(v[use] ** 2 * w))
    try:
        return BoardPattern(p, np.asarray(np.linalg.inv(n)) * max(1.0, chi), use, noise)
    except np.linalg.LinAlgError:
        return None


def inside_board(flat: Array, p: Array, half: float) -> NDArray[np.bool_]:
    """Mask of the points within the board's square, a little inside of its rim."""
    d = flat - p[:2]
    limit = GATES.inside_halves * half
    a = d @ [np.cos(p[2]), np.sin(p[2])]
    b = d @ [np.cos(p[3]), np.sin(p[3])]
    return np.asarray((np.abs(a) < limit) & (np.abs(b) < limit))


def pitch(use: NDArray[np.bool_], half: float) -> float:
    """Mean distance of the points within the board."""
    return 2 * half / float(np.sqrt(max(1, int(use.sum()))))
