"""Is a print flat, and how well is the distance of its plane known? From its range residuals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["bend", "distance"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: residuals beyond this many sigmas take no part
_TRIM = 3.5
#: cells along a side of the patch for the test of independence, points that one must hold
_CELLS, _HELD = 7, 4
#: a foretold sigma counts as much as so many points
_HELD_BY = 6


def bend(place: Array, residual: Array, bright: Flags) -> tuple[float, float]:
    """Largest departure from the plane [m] at distance 1 of a second-degree surface, its sigma.

    place (n, 2) : in units of the radius around the centre; residual (n,) : range minus plane [m];
    bright (n,) : each colour may have an offset of its own.
    """
    x, y = place.T
    a = np.column_stack([bright, ~bright, x, y, x * x, x * y, y * y]).astype(float)
    if len(a) < 12:
        return 0.0, 0.0
    found, _, rank, _ = np.linalg.lstsq(a, residual)
    if rank < a.shape[1]:
        a = np.delete(a, 1, axis=1)
        found = np.linalg.lstsq(a, residual)[0]
    left = residual - a @ found
    variance = float(left @ left) / max(len(a) - a.shape[1], 1)
    cover = np.linalg.pinv(a.T @ a) * variance
    xx, xy, yy = found[-3:]
    values, vectors = np.linalg.eigh([[xx, xy / 2], [xy / 2, yy]])
    worst = int(np.argmax(np.abs(values)))
    c, s = vectors[:, worst]
    direction = np.array([c * c, c * s, s * s])
    return float(abs(values[worst])), float(np.sqrt(direction @ cover[-3:, -3:] @ direction))


def distance(
    place: Array,
    residual: Array,
    bright: Flags,
    telling: Flags,
    radius: float,
    sigma: float,
) -> tuple[float, float]:
    """Distance of the surface at the centre minus that of the plane [m], and its sigma [m].

    Least squares with tilt and the offset of the other colour free. place (n, 2) [m] : around the
    centre; residual (n,) : range minus plane [m]; telling (n,) : of the colour whose range is the
    true one; sigma [m] : of one range, 0 if not known. Neighbours that err together (filtered
    ranges, an uneven print) show in means over cells that scatter more than their numbers allow,
    and raise the sigma.
    """
    x = place / radius
    a = np.column_stack([np.ones(len(x)), x, ~telling]).astype(float)
    if telling.all() or not telling.any():
        a = a[:, :3]
    use, found = np.ones(len(x), dtype=bool), np.zeros(a.shape[1])
    left, own = residual, np.ones(len(x))
    for turn in range(6):
        own = _sigmas(left, bright, use, sigma, robust=turn == 0)
        before, use = use, np.abs(left) < _TRIM * own
        w = use / own**2
        cover = np.linalg.pinv((a * w[:, None]).T @ a)
        found = cover @ (a.T @ (w * residual))
        left = residual - a @ found
        if turn > 1 and (before == use).all():
            break
    excess = _excess(x[use], (left / own)[use])
    return float(found[0]), float(np.sqrt(cover[0, 0] * excess))


def _sigmas(left: Array, bright: Flags, use: Flags, sigma: float, *, robust: bool) -> Array:
    """Sigma (n,) [m] of each point: that of its colour, held by what is foretold."""
    out = np.empty(len(left))
    for colour in (False, True):
        own = bright == colour
        mine = left[own & use]
        n = len(mine)
        if robust and n > 3:
            size = 1.4826 * float(np.median(np.abs(mine - np.median(mine))))
            square = max(size, sigma) ** 2 * n
        else:
            square = float(mine @ mine)
        held = _HELD_BY if sigma > 0 else 0
        # two of the four unknowns are each colour's; the spread of a spread widens what it says
        freedom = max(n - 2 + held - 2, 1)
        out[own] = np.sqrt((square + held * sigma**2) / freedom)
    return np.maximum(out, 1e-6)


def _excess(x: Array, left: Array) -> float:
    """Variance of means over cells times their numbers, over that of single points, at least 1."""
    cell = np.floor((x + 1.5) * (_CELLS / 3)).astype(int).clip(0, _CELLS - 1)
    number = cell[:, 0] * _CELLS + cell[:, 1]
    count = np.bincount(number, minlength=_CELLS**2)
    held = count >= _HELD
    if held.sum() < 12:
        return 1.0
    total = np.bincount(number, left, _CELLS**2)[held]
    ratio = float((total**2 / count[held]).sum() / (held.sum() - 4))
    # what chance makes of independent points is not taken for more
    chance = 1 + 2 * float(np.sqrt(2 / (held.sum() - 4)))
    return max(1.0, ratio) if ratio > chance else 1.0
