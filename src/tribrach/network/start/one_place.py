"""Finds given coordinates that cannot be: several places at one spot, with metres between them.

Jobs of total stations are often begun with the same dummy coordinates at every set-up. Start values
and datum must not come from them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tribrach._types import Array
from tribrach.network.network import Datum, Network, is_given
from tribrach.network.start.gather import gather
from tribrach.network.start.ties import Ties
from tribrach.observations.declaration import End

__all__ = ["dummy_places", "dummy_words", "without_dummies"]

#: coordinates that agree to this are the same [m]
_SAME = 5e-4
#: lengths that tell two places apart [m]
_APART = 1.0
#: names that a sentence lists
_NAMED = 8


def dummy_places(network: Network, places: Mapping[str, Array]) -> list[tuple[str, ...]]:
    """Find names that share coordinates although the observations put metres between them.

    Parameters
    ----------
    network
        Tells by its lengths and vectors what lies apart.
    places
        E, N, U (3,) by the name of a point [m].

    Notes
    -----
    A length between two of them says it, or two lengths to a common target that differ by more.
    """
    layout = network.start.layout
    names = [
        n for n, xyz in places.items() if np.isfinite(xyz[:2]).all() and layout.has("point", n)
    ]
    if len(names) < 2:
        return []
    spot = np.round(np.nan_to_num([places[n] for n in names]) / _SAME)
    _, group, count = np.unique(spot, axis=0, return_inverse=True, return_counts=True)
    group = np.ravel(group)
    if not (count > 1).any():
        return []
    ties = gather(network, np.nan_to_num(network.start.vectors))
    out = []
    for g in np.flatnonzero(count > 1):
        members = [names[k] for k in np.flatnonzero(group == g)]
        nodes = np.array([layout.index("point", name) for name in members])
        if _apart(ties, nodes):
            out.append(tuple(members))
    return out


def _apart(ties: Ties, nodes: np.ndarray) -> bool:
    """True if a length, a vector or two lengths to one target separate some of the nodes."""
    lengths, vectors = ties.lengths, ties.vectors
    start, end = np.isin(lengths.start, nodes), np.isin(lengths.end, nodes)
    size = np.where(np.isfinite(lengths.flat), lengths.flat, lengths.value)
    between = start & end & (lengths.start != lengths.end)
    if (size[between] > _APART).any():
        return True
    joined = np.isin(vectors.start, nodes) & np.isin(vectors.end, nodes)
    if (np.linalg.norm(vectors.value[joined], axis=1) > _APART).any():
        return True
    one = start ^ end
    target = np.where(start, lengths.end, lengths.start)[one]
    if not len(target):
        return False
    high = np.full(int(target.max()) + 1, -np.inf)
    low = np.full(len(high), np.inf)
    np.maximum.at(high, target, size[one])
    np.minimum.at(low, target, size[one])
    return bool((high[target] - low[target] > _APART).any())


def dummy_words(groups: list[tuple[str, ...]]) -> str:
    """One sentence on names whose coordinates are not used."""
    names = [name for group in groups for name in group]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    where = "the same coordinates" if len(groups) == 1 else "the same coordinates in groups"
    return (
        f"Points {', '.join(names[:_NAMED])}{more} are given {where}, while the observations put "
        "metres between them: these coordinates are placeholders and are not used; give real ones "
        "where the network is to be tied to a frame."
    )


def without_dummies(network: Network) -> Network:
    """Drop start values that cannot be, with a warning, also from the datum."""
    start, layout = network.start, network.start.layout
    free = network.free[: start.points.size].reshape(-1, 3)[:, :2]
    weighted = np.zeros(len(start.positions), dtype=bool)
    for o in network.observations:
        at = o.end_field(End.AT)
        if is_given(type(o), o.group) and at is not None and at.family == "position":
            weighted[np.asarray(getattr(o, at.name))] = True
    usable = (free & np.isfinite(start.points[:, :2])).all(axis=1)
    chosen = np.flatnonzero(usable & ~weighted[: len(start.points)])
    if len(chosen) < 2:
        return network
    places = {layout.names["point"][k]: start.points[k] for k in chosen}
    groups = dummy_places(network, places)
    if not groups:
        return network
    names = {name for group in groups for name in group}
    index = np.array([layout.index("point", name) for name in names])
    points = start.points.copy()
    points[index] = np.nan
    datum = network.datum
    components = datum.components
    if components is not None:
        components = components.copy()
        components[layout.columns("point", index).ravel()] = False
        components = components if components.any() else None
    kept = tuple(name for name in datum.names if name not in names)
    if datum.kind == "free":
        datum = Datum("free", kept if len(kept) > 1 else (), components)
    return replace(
        network,
        start=replace(start, points=points),
        datum=datum,
        warnings=(*network.warnings, dummy_words(groups)),
    )
