"""Given coordinates that no shift and turn brings near the places that the sights put together.

Placeholders, and names that were exchanged in the list of control, spoil a network as a whole:
least squares bends it between them, and every sight looks wrong. The free network needs none of
them. If it fits, what contradicts it by metres is named, and said to explain the misfit only if the
network fits without it (method section 3.4).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.network.blunders.equal_heights import without_heights
from tribrach.network.blunders.slip_search import LEFT, Slip, SlipSearch, explains
from tribrach.network.network import Network, is_given
from tribrach.network.start.placeholders import (
    Contradiction,
    contradiction,
    listed,
    unplaced,
)
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import End
from tribrach.sentences import Sentence

#: how near an exchanged coordinate must be to its place [m]
_NEAR = 1.0


def given_places(
    network: Network, before: float, search: SlipSearch, *, single: bool
) -> Slip | None:
    """Find given coordinates without which, or exchanged, a network fits.

    ``network``: it does not fit; ``before``: its variance factor, infinite if it could not be
    adjusted; ``single``: one point alone is looked at as well; others test its coordinates one by
    one.
    """
    places = _given(network)
    found = contradiction(network, places, search.run)
    if found is None:
        return None
    if not found.off:
        return _heights(network, found, before, search)
    if slip := _exchanged(network, places, found, before, search):
        return slip
    if len(found.off) == 1 and not single:
        return None
    if _of_one_setup(network, found):
        return None
    index = np.array([network.start.layout.index("point", n) for n in found.off])
    if len(found.kept) > 1:
        after = search.explained(unplaced(network, index), before)
    else:
        after = explains(found.solved.vtpv, found.solved.dof, before)
    if after is None:
        return None
    return Slip(
        Sentence(
            "the given coordinates of {off} contradict the sights ({a} and {b} are given "
            "{own.given:1} m apart and are {own.found:1} m apart)",
            own=found,
            off=listed(found.off),
            a=found.pair[0],
            b=found.pair[1],
        ),
        "without them",
        before,
        after,
        "they are placeholders or keyed wrongly: correct them, or leave them out",
        "placeholders",
        names=found.off,
    )


def _heights(
    network: Network, found: Contradiction, before: float, search: SlipSearch
) -> Slip | None:
    """Heights of several points that the others contradict."""
    if len(found.heights) < 2 or len(found.kept) - len(found.heights) < 2:
        return None
    without, loosened = without_heights(network, list(found.heights))
    after = search.explained(without, before, loosened)
    if after is None:
        return None
    return Slip(
        f"the given heights of {listed(found.heights)} contradict the sights and those of the "
        "other points",
        "without them",
        before,
        after,
        "they are placeholders or keyed wrongly: correct them, or leave them out",
        "placeholder_heights",
        names=found.heights,
    )


def _coordinates(o: Observations) -> Iterator[tuple[int, int, int, int]]:
    """Item, row, axis and position of each given coordinate of a table that takes part."""
    axes, at = o.coordinate_axes(), o.end_field(End.AT)
    if not is_given(type(o), o.group) or axes is None or at is None or at.family != "position":
        return
    position = np.asarray(getattr(o, at.name))
    for item in np.flatnonzero(o.use == Use.ACTIVE):
        for row, axis in enumerate(np.atleast_1d(np.asarray(axes)[item])):
            yield int(item), row, int(axis), int(position[item])


def _given(network: Network) -> dict[str, Array]:
    """Coordinates E, N, U (3,) of points that are held or weighted in plan, NaN for others."""
    layout, start = network.start.layout, network.start.points
    held = ~network.free[: start.size].reshape(-1, 3) & np.isfinite(start)
    values = np.where(held, start, np.nan)
    for o in network.observations:
        for item, row, axis, position in _coordinates(o):
            if position < len(values):
                values[position, axis] = o.values[item, row]
    known = np.flatnonzero(np.isfinite(values[:, :2]).all(axis=1))
    return {layout.names["point"][k]: values[k] for k in known}


def _exchanged(
    network: Network,
    places: dict[str, Array],
    found: Contradiction,
    before: float,
    search: SlipSearch,
) -> Slip | None:
    """The two points whose given coordinates belong to each other, if one exchange does."""
    index = network.start.layout.index
    there = {name: found.places[index("point", name)][:2] for name in found.off}

    def near(name: str, other: str) -> bool:
        """True if the coordinates of a point are those of the place of another."""
        return bool(np.abs(places[name][:2] - there[other]).max() < _NEAR)

    pairs = [(a, b) for a, b in combinations(found.off, 2) if near(a, b) and near(b, a)]
    if len(pairs) != 1 or len(found.off) != 2:
        return None
    a, b = pairs[0]
    after = search.factor(_other_way(network, index("point", a), index("point", b)))
    if after is None or not after < LEFT * before:
        return None
    return Slip(
        f"The names {a} and {b} are exchanged in the given coordinates",
        "with them the other way round",
        before,
        after,
        "correct the names in the file",
        "exchanged_control",
        names=(a, b),
    )


def _other_way(network: Network, first: int, second: int) -> Network:
    """The network with the given coordinates of two points exchanged."""
    points = network.start.points.copy()
    points[[first, second]] = points[[second, first]]
    observations = list(network.observations)
    for table, o in enumerate(network.observations):
        at = o.end_field(End.AT)
        if not list(_coordinates(o)) or at is None:
            continue
        position = np.asarray(getattr(o, at.name))
        to = np.where(position == first, second, np.where(position == second, first, position))
        changed: dict[str, Any] = {at.name: to}
        observations[table] = replace(o, **changed)
    start = replace(network.start, points=points)
    return replace(network, start=start, observations=tuple(observations))


def _of_one_setup(network: Network, found: Contradiction) -> bool:
    """True if one set-up alone leads to all that contradicts: it may as well be the set-up."""
    index = {network.start.layout.index("point", n) for n in found.off}
    leads: dict[int, set[int]] = {k: set() for k in index}
    for o in network.observations:
        start, end = o.end_field(End.FROM), o.end_field(End.TO)
        if start is None or end is None or start.family == "pose" or end.family == "pose":
            continue
        a, b = np.asarray(getattr(o, start.name)), np.asarray(getattr(o, end.name))
        active = o.use == Use.ACTIVE
        for k in index:
            leads[k] |= set(a[active & (b == k)].tolist())
            if (active & (a == k)).any():
                leads[k].add(k)
    return len(found.off) > 1 and len(set().union(*leads.values())) == 1
