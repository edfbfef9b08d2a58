"""Heights along levelled lines and trigonometric sights."""

from __future__ import annotations

import numpy as np

from tribrach._types import Array, Index
from tribrach.network.start.frame import Frame

__all__ = ["CURVATURE", "rises", "zeniths"]


#: (1 - k) / 2R of method section 2.3 with k = 0.13 [1/m]
CURVATURE = 0.87 / (2 * 6371000.0)


def rises(f: Frame) -> None:
    """Heights from measured height differences, forwards and backwards."""
    _climb(f, f.rises.start, f.rises.end, f.rises.value)


def zeniths(f: Frame) -> None:
    """Heights from zenith angles between places whose plan is known."""
    plan, up = f.known_plan, f.known_up
    z = f.zeniths
    z = z[plan[z.start] & plan[z.end] & (up[z.start] ^ up[z.end])]
    flat = np.hypot(*(f.plan[z.end] - f.plan[z.start]).T)
    curve = CURVATURE * flat**2 if f.bent else 0.0
    _climb(f, z.start, z.end, flat * z.slope - z.lift + curve)


def _climb(f: Frame, start: Index, end: Index, value: Array) -> None:
    up = f.known_up
    ahead, back = up[start] & ~up[end], up[end] & ~up[start]
    nodes = np.concatenate([end[ahead], start[back]])
    heights = [f.up[start[ahead]] + value[ahead], f.up[end[back]] - value[back]]
    f.place_up(nodes, np.concatenate(heights))
