"""Plan coordinates, orientations and heights along sights: what total stations and levels do.

Each rule places everything it can at once and takes medians where several ties propose. Azimuth ``A
= orientation + reading``; a ray of length d leads to ``(E, N) + d (sin A, cos A)``.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array, Index
from tribrach.geometry.alignment import Groups, group_planar
from tribrach.network.start.frame import Frame
from tribrach.network.start.grouping import azimuth, grouped_angle, grouped_median, wrap

#: (1 - k) / 2R of method section 2.3 with k = 0.13 [1/m]
CURVATURE = 0.87 / (2 * 6371000.0)
#: two places nearer than this [m] give no direction
_COINCIDENT = 1e-4


def unit(azimuths: Array) -> Array:
    """Plan vectors (n, 2) of azimuths (n,)."""
    return np.stack([np.sin(azimuths), np.cos(azimuths)], axis=1)


def orient(f: Frame) -> None:
    """Orientations of sets from their rays between known places (median on the circle)."""
    known = f.known_plan
    r = f.rays[np.isnan(f.orientation[f.rays.set]) & known[f.rays.start] & known[f.rays.end]]
    chord = f.plan[r.end] - f.plan[r.start]
    apart = np.hypot(chord[:, 0], chord[:, 1]) > _COINCIDENT
    r, chord = r[apart], chord[apart]
    if len(r):
        turned = azimuth(chord) - r.reading - f.convergence(r.start)
        sets, values, _ = grouped_angle(r.set, turned)
        f.orientation[sets] = wrap(values)


def transfer(f: Frame) -> None:
    """Orientations handed on where two set-ups sight each other: ``o' = o + r + pi - r'``.

    Places play no part in this. Orientations from places that were themselves reached by a few
    rays would feed errors back into the next places, layer by layer, and grow exponentially.
    """
    r, known = f.rays, np.isfinite(f.orientation)
    ahead = r.start * f.ties.n_nodes + r.end
    back = r.end * f.ties.n_nodes + r.start
    given, sought = known[r.set], ~known[r.set] & (r.set != f.ties.north)
    keys, medians, _ = grouped_angle(ahead[given], f.azimuths(r[given]))
    rows = np.flatnonzero(sought & np.isin(back, keys))
    if len(rows) == 0:
        return
    azimuths = medians[np.searchsorted(keys, back[rows])] + np.pi
    r = r[rows]
    sets, values, _ = grouped_angle(r.set, azimuths - r.reading - f.convergence(r.start))
    f.orientation[sets] = wrap(values)


def traverse(f: Frame) -> None:
    """Places along oriented rays with a distance, forwards and backwards."""
    known = f.known_plan
    oriented = np.isfinite(f.orientation[f.rays.set])
    for a, b, sign in (("start", "end", 1.0), ("end", "start", -1.0)):
        at, to = getattr(f.rays, a), getattr(f.rays, b)
        rows = oriented & known[at] & ~known[to]
        if not rows.any():
            continue
        r = f.rays[rows]
        length = f.pair_flats(r.start, r.end)
        step = sign * length[:, None] * unit(f.azimuths(r))
        good = np.isfinite(length)
        f.place_plan(to[rows][good], f.plan[at[rows][good]] + step[good])


def set_ups(f: Frame) -> None:
    """Free stations: sets at unknown places with distances to two or more known places."""
    known = f.known_plan
    r = f.rays[
        np.isnan(f.orientation[f.rays.set])
        & known[f.rays.end]
        & ~known[f.rays.start]
        & (f.ties.set_node[f.rays.set] >= 0)
    ]
    length = f.pair_flats(r.start, r.end)
    r, length = r[np.isfinite(length)], length[np.isfinite(length)]
    if len(r) == 0:
        return
    sets, group = np.unique(r.set, return_inverse=True)
    local, world = length[:, None] * unit(r.reading), f.plan[r.end]
    fit, rms = robust_planar(group, len(sets), local, world)
    limit = 0.3 if f.relaxed else 0.1
    good = (fit.count >= 2) & (fit.spread > 1e-3) & (rms < limit * fit.spread)
    sets, nodes = sets[good], f.ties.set_node[sets[good]]
    f.place_plan(nodes, fit.translation[good])
    turn = np.arctan2(fit.rotation[good, 0, 1], fit.rotation[good, 0, 0])
    f.orientation[sets] = wrap(turn - f.convergence(nodes))


def robust_planar(
    group: Index,
    size: int,
    local: Array,
    world: Array,
    *,
    scale: bool = False,
    mirror: bool = False,
) -> tuple[Groups, Array]:
    """Align groups of pairs of points in the plane, outliers trimmed.

    The worst pair of a group of four or more that lies far outside the others' residuals is left
    out, one after another.

    ``group`` (n,): number of the group of each pair; ``local``, ``world`` (n, 2): the pairs [m].
    Returns (size,): median of its residuals [m].
    """
    weights = np.ones(len(group))
    fit = group_planar(group, size, local, world, scale=scale, mirror=mirror)
    medians = np.zeros(size)
    for _ in range(6):
        v = np.hypot(*fit.residuals(group, local, world).T)
        used = weights > 0
        keys, median, count = grouped_median(group[used], v[used, None])
        medians[keys] = median[:, 0]
        worst = np.zeros(size)
        np.maximum.at(worst, group, v * used)
        many = np.zeros(size, dtype=bool)
        many[keys] = count >= 4
        out = used & many[group] & (v == worst[group]) & (v > 2.0 * medians[group] + 1e-6)
        if not out.any():
            break
        weights[out] = 0.0
        fit = group_planar(group, size, local, world, weights, scale=scale, mirror=mirror)
    return fit, medians


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
    """Heights from differences (n,) [m] between nodes of which one is known."""
    up = f.known_up
    ahead, back = up[start] & ~up[end], up[end] & ~up[start]
    nodes = np.concatenate([end[ahead], start[back]])
    heights = [f.up[start[ahead]] + value[ahead], f.up[end[back]] - value[back]]
    f.place_up(nodes, np.concatenate(heights))
