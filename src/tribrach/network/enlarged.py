"""A network with further points and stations, the old ones where they were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from tribrach.network.network import Constraint, Network
from tribrach.network.observations.base import Observations
from tribrach.network.unknowns import Layout, State

__all__ = ["Addition", "add_observations", "enlarged"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Addition:
    """Points (p, 3) and stations, translations (s, 3) and rotations (s, 3, 3), with names."""

    point_names: tuple[str, ...] = ()
    points: Array | None = None
    pose_names: tuple[str, ...] = ()
    translations: Array | None = None
    rotations: Array | None = None


def enlarged(network: Network, state: State, new: Addition) -> tuple[Network, State]:
    """The network and state with free points and stations added, before any observation of them."""
    old, p = state.layout, len(new.point_names)
    names = old.names
    layout = Layout(
        (*names["point"], *new.point_names),
        (*names["pose"], *new.pose_names),
        names["plane"],
        names["vector"],
        names["scalar"],
    )
    cut = 3 * old.count("point"), old.offset["plane"]
    poses = 6 * len(new.pose_names)

    def mask(given: NDArray[np.bool_], value: bool) -> NDArray[np.bool_]:
        parts = [given[: cut[0]], np.full(3 * p, value), given[cut[0] : cut[1]]]
        return np.concatenate([*parts, np.full(poses, value), given[cut[1] :]])

    datum = network.datum
    if datum.components is not None:
        datum = replace(datum, components=mask(datum.components, False))
    grown = replace(
        state,
        layout=layout,
        points=_joined(state.points, new.points),
        pose_t=_joined(state.pose_t, new.translations),
        pose_r=_joined(state.pose_r, new.rotations),
    )
    count = old.count("point")
    moved = replace(
        network,
        start=grown,
        free=mask(network.free, True),
        observations=tuple(_moved(o, count, p) for o in network.observations),
        constraints=tuple(
            Constraint(_moved(c.observations, count, p), c.label) for c in network.constraints
        ),
        datum=datum,
    )
    return moved, grown


def _joined(old: Array, new: Array | None) -> Array:
    return old if new is None else np.concatenate([old, new])


def _moved(o: Observations, count: int, by: int) -> Observations:
    """Observations whose positions of stations come after more points."""
    changes = {}
    for item in fields(o):
        if item.metadata.get("refers") == "position":
            index = getattr(o, item.name)
            changes[item.name] = np.where(index >= count, index + by, index)
    return replace(o, **changes) if changes and by else o


def add_observations(network: Network, further: Sequence[Observations]) -> Network:
    """The network with more observations."""
    return replace(network, observations=(*network.observations, *further))
