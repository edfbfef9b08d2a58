"""Why a pattern of four quadrants that was fitted to light is no checkerboard."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["doubt", "not_square", "skew_of"]

Array = NDArray[np.float64]

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
