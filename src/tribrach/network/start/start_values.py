"""Finds start values of all unknowns from the observations.

1. All active observations are written as a few sorts of ties (:mod:`ties`, :mod:`gather`).
2. The work frame grows from the control (:mod:`parts`): heights, vectors, polar chains, free
   stations, scanner poses; then intersections, distances, resections; medians everywhere.
3. What does not hang on the control grows in frames of its own and is fitted in by common places
   (:mod:`parts`). Without control the first part makes the frame.
4. Kinds that give no ties find their unknowns from the places: axes, telescopes.
5. Places are proposed once more by all their ties, if that fits better (:mod:`settle`).
6. What is left is named in sentences (:mod:`missing`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import NoStartValues
from tribrach.network.network import Network
from tribrach.network.start.frame import Frame
from tribrach.network.start.gather import gather
from tribrach.network.start.grouping import azimuth, grouped_angle, grouped_median, wrap
from tribrach.network.start.missing import missing_ties
from tribrach.network.start.parts import join_parts
from tribrach.network.start.sights import unit
from tribrach.network.start.space import placed_poses, robust_rigid
from tribrach.network.start.ties import Ties
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import End, StartTie
from tribrach.observations.unknowns import State

# While a frame grows, a place is set by the few ties known then; a gross error among them would
# stay. Here orientations and places are replaced, in turn, by the medians of what all their ties
# propose. A sweep is kept only if it brings the bulk of the observations closer.

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
    """Sweep once over orientations and places of ``f``; ``held`` (n, 3) coordinates stay."""
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


def find_start(network: Network) -> State:
    """Find start values for all unknowns; scalars that are no orientation start at zero."""
    start = _given(network)
    if not start.missing():
        return _by_places(network, start)
    ties = gather(network, start.vectors)
    frame = _world(network, start, ties)
    join_parts(frame)
    state = _by_places(network, _state(frame, start))
    if state.missing():
        sentences = missing_ties(network, frame, state)
        what = "no start values can be found for all unknowns"
        raise NoStartValues(what, sentences, state.missing())
    return _settled(network, frame, start, state)


def _by_places(network: Network, state: State) -> State:
    """The state with the unknowns that kinds find from places."""
    for o in (*network.observations, *(x.observations for x in network.constraints)):
        state = o.from_places(np.flatnonzero(o.use == Use.ACTIVE), state, network.start)
    return state


def _settled(network: Network, frame: Frame, start: State, state: State) -> State:
    """The state after as many sweeps as bring it closer to the bulk of the observations."""
    best = disagreement(network.observations, state)
    held = np.ones((frame.ties.n_nodes, 3), dtype=bool)
    held[: frame.ties.n_positions] = np.isfinite(start.positions)
    for _ in range(SWEEPS):
        if best <= network.count():
            break
        frame = settle(frame, held)
        trial = _by_places(network, _state(frame, start))
        score = disagreement(network.observations, trial)
        if not score < 0.999 * best:
            break
        state, best = trial, score
    return state


def _given(network: Network) -> State:
    """The given values and known parameters; zero where they are missing but not sought."""
    start = network.start
    points = start.points.copy()
    held = ~network.free[: points.size].reshape(points.shape)
    points[held & np.isnan(points)] = 0.0
    scalars, vectors = start.scalars.copy(), np.nan_to_num(start.vectors)
    sought = np.zeros(len(scalars), dtype=bool)
    for observations in network.observations:
        for reference in observations.references():
            if reference.by_set:
                sought[getattr(observations, reference.name)] = True
        known = observations.end_field(End.AT)
        if observations.facts.start is not StartTie.VALUE or known is None:
            continue
        index = getattr(observations, known.name)
        if known.family == "scalar":
            blank = np.isnan(scalars[index])
            scalars[index] = np.where(blank, observations.values[:, 0], scalars[index])
        elif known.family == "vector":
            blank = ~vectors[index].any(axis=1, keepdims=True)
            vectors[index] = np.where(blank, observations.values, vectors[index])
    scalars[~sought] = np.nan_to_num(scalars[~sought])
    return replace(start, points=points, scalars=scalars, vectors=vectors)


def _world(network: Network, start: State, ties: Ties) -> Frame:
    """The work frame with what is given."""
    extra = ties.n_nodes - ties.n_positions
    xyz = np.concatenate([start.positions, np.full((extra, 3), np.nan)])
    orientation = np.full(ties.n_sets, np.nan)
    orientation[: ties.n_scalars] = start.scalars
    orientation[ties.pose_set(np.arange(len(ties.heading)))] = ties.heading
    orientation[ties.north] = 0.0
    frame = Frame(
        kind="world",
        ties=ties,
        site=network.site,
        plan=xyz[:, :2].copy(),
        up=np.full(len(xyz), np.nan),
        turn=start.pose_r.copy(),
        orientation=orientation,
        normal=start.plane_n.copy(),
        offset=start.plane_d.copy(),
        open_set=np.ones(ties.n_sets, dtype=bool),
        open_pose=np.ones(len(start.pose_t), dtype=bool),
    )
    frame.up[:] = frame.heights(xyz)
    return frame


def _state(frame: Frame, start: State) -> State:
    """The frame's places as a state; given values stay as they are."""
    ties = frame.ties
    xyz = frame.space(np.arange(ties.n_positions))
    placed = placed_poses(frame)

    def filled(given: np.ndarray, computed: np.ndarray) -> np.ndarray:
        return np.where(np.isnan(given), computed, given)

    turn = np.where(placed[:, None, None], frame.turn, np.nan)
    return replace(
        start,
        points=filled(start.points, xyz[: ties.n_points]),
        pose_t=filled(start.pose_t, xyz[ties.n_points :]),
        pose_r=filled(start.pose_r, turn),
        plane_n=filled(start.plane_n, frame.normal),
        plane_d=filled(start.plane_d, frame.offset),
        scalars=filled(start.scalars, frame.orientation[: ties.n_scalars]),
    )
