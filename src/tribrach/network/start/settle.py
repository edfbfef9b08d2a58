"""Improves start values by all ties of every place, once all places are known.

While a frame grows, a place is set by the few ties known then; a gross error among them would stay.
Here orientations and places are replaced, in turn, by the medians of what all their ties propose. A
sweep is kept only if it brings the bulk of the observations closer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.network.start.frame import Frame
from tribrach.network.start.grouping import azimuth, grouped_angle, grouped_median, wrap
from tribrach.network.start.sights import unit
from tribrach.network.start.space import robust_rigid
from tribrach.observations.base import Observations, Use
from tribrach.observations.unknowns import State

#: sweeps at most
SWEEPS = 6
#: fewer proposals than this cannot outvote a gross error
_QUORUM = 3


def disagreement(observations: Sequence[Observations], state: State) -> float:
    """Sum of ``log(1 + (w/sigma)^2)`` over active observations: gross errors count little."""
    total = 0.0
    for o in observations:
        rows = o.use == Use.ACTIVE
        w = (o.misclosure(state) / o.sigma)[rows]
        total += float(np.log1p(np.where(np.isfinite(w), w, 1e6) ** 2).sum())
    return total


def settle(f: Frame, held: NDArray[np.bool_]) -> Frame:
    """Sweep once over all orientations and places.

    ``f``: a frame in which every place is known; ``held`` (n, 3): true for coordinates that were
    given and stay.
    """
    f = replace(
        f,
        plan=f.plan.copy(),
        up=f.up.copy(),
        turn=f.turn.copy(),
        orientation=f.orientation.copy(),
        open_set=np.ones_like(f.open_set),
        open_pose=np.ones_like(f.open_pose),
    )
    _orientations(f)
    _plan(f, held)
    _heights(f, held)
    _scanners(f, held)
    return f


def _orientations(f: Frame) -> None:
    """Orientations of sets by all their rays."""
    r = f.rays[f.rays.set != f.ties.north]
    chord = f.plan[r.end] - f.plan[r.start]
    apart = np.hypot(chord[:, 0], chord[:, 1]) > 1e-4
    r, chord = r[apart], chord[apart]
    sets, values, count = grouped_angle(r.set, azimuth(chord) - r.reading - f.convergence(r.start))
    enough = count >= _QUORUM
    f.orientation[sets[enough]] = wrap(values[enough])


def _plan(f: Frame, held: NDArray[np.bool_]) -> None:
    """Places by all rays with a distance, from either end."""
    r = f.rays
    length = f.pair_flats(r.start, r.end)
    good = np.isfinite(length)
    r, length = r[good], length[good]
    step = length[:, None] * unit(f.azimuths(r))
    nodes = np.concatenate([r.end, r.start])
    proposed = np.concatenate([f.plan[r.start] + step, f.plan[r.end] - step])
    _replace(f.plan, nodes, proposed, held[:, :2])


def _heights(f: Frame, held: NDArray[np.bool_]) -> None:
    """Heights by all height differences, from either end."""
    s = f.rises
    nodes = np.concatenate([s.end, s.start])
    proposed = np.concatenate([f.up[s.start] + s.value, f.up[s.end] - s.value])
    _replace(f.up[:, None], nodes, proposed[:, None], held[:, 2:])


def _scanners(f: Frame, held: NDArray[np.bool_]) -> None:
    """Targets by all scanners, then scanners by all their targets."""
    s = f.shots
    if len(s) == 0 or f.curved:
        return
    xyz = np.concatenate([f.plan, f.up[:, None]], axis=1)
    turned = np.einsum("nij,nj->ni", f.turn[s.pose], s.u)
    _replace(xyz, s.target, xyz[f.ties.pose_node(s.pose)] + turned, held)
    numbers, group = np.unique(s.pose, return_inverse=True)
    fit, _ = robust_rigid(group, len(numbers), s.u, xyz[s.target])
    nodes = f.ties.pose_node(numbers)
    good = (fit.count > _QUORUM) & (fit.spread > 1e-2) & ~held[nodes].any(axis=1)
    f.turn[numbers[good]] = fit.rotation[good]
    xyz[nodes[good]] = fit.translation[good]
    f.plan[:], f.up[:] = xyz[:, :2], xyz[:, 2]


def _replace(values: Array, nodes: Index, proposed: Array, held: NDArray[np.bool_]) -> None:
    """Medians of enough proposals (n, k) in place of values (m, k) that are not held."""
    good = np.isfinite(proposed).all(axis=1)
    keys, medians, count = grouped_median(nodes[good], proposed[good])
    enough = count >= _QUORUM
    keys, medians = keys[enough], medians[enough]
    values[keys] = np.where(held[keys], values[keys], medians)
