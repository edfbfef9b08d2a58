"""Given heights that are all one and the same number, as where none was keyed in.

Three or more points whose given heights are all alike, or two of the height zero, are no
coincidence in a network that does not fit: the heights stand for none. It is said only if the
network fits without them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribrach._types import Index
from tribrach.network.blunders.robust import with_sigmas
from tribrach.network.blunders.slip_search import Slip, SlipSearch
from tribrach.network.network import Network, is_given
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import End, ObservedAxes
from tribrach.sentences import Sentence

#: points from which equal heights are looked at, and how near they are alike [m]
_LEAST, _SAME = 3, 5e-4
#: points whose height is kept in turn, where all are alike
_KEPT = 4
#: factor on the sigmas of heights that must not pull
_LOOSE = 1e6
#: names that a sentence lists
_NAMED = 8


def equal_heights(network: Network, before: float, search: SlipSearch) -> Slip | None:
    """Find given heights that are all alike and without which a network fits.

    ``network``: it does not fit; ``before``: its variance factor, infinite if it could not be
    adjusted.
    """
    observed = _observed_upward(network)
    heights = {n: h for n, h in _given_heights(network).items() if n in observed}
    value = float(np.median(list(heights.values()))) if heights else 0.0
    alike = _alike(heights, value)
    if len(alike) < _LEAST or len(alike) < len(heights) - 1:
        # zero is what is written where nothing is known, beside heights that are known as well
        value, alike = 0.0, _alike(heights, 0.0)
        if not 1 < len(alike) < len(heights):
            return None
    # one of them stays, so that the heights have a datum, unless another given height is there; it
    # has to be one that the rest hangs on
    after = None
    for keep in alike[:_KEPT] if len(alike) == len(heights) else [""]:
        without, loosened = without_heights(network, [n for n in alike if n != keep])
        after = search.explained(without, before, loosened)
        if after is not None:
            break
    if after is None:
        return None
    listed = ", ".join(alike[:_NAMED]) + (
        f" and {len(alike) - _NAMED} more" if len(alike) > _NAMED else ""
    )
    return Slip(
        Sentence(
            "the given heights of {listed} are {all} {value:3} m, which stands for none",
            listed=listed,
            all="both" if len(alike) == 2 else "all",
            value=value,
        ),
        "without them",
        before,
        after,
        "leave the heights out that are not known, or adjust the plan alone",
        "equal_heights",
    )


def _alike(heights: dict[str, float], value: float) -> list[str]:
    """Names of the points that have a height."""
    return [name for name, height in heights.items() if abs(height - value) < _SAME]


def _heights_of(o: Observations) -> tuple[Index, Index, int] | None:
    """Items and points (n,) of a table of given heights, and the row of the height."""
    axes, at = o.coordinate_axes(), o.end_field(End.AT)
    if not is_given(type(o), o.group) or axes is None or at is None or at.family != "position":
        return None
    upward = np.asarray(axes) == 2
    if upward.ndim == 1:
        upward = np.broadcast_to(upward, (len(o), len(upward)))
    rows = np.flatnonzero(upward.any(axis=0))
    if len(rows) != 1:
        return None
    items = np.flatnonzero(upward[:, rows[0]] & (o.use == Use.ACTIVE))
    return items, np.asarray(getattr(o, at.name))[items], int(rows[0])


def _observed_upward(network: Network) -> set[str]:
    """Names of points that an observation sees which depends on heights."""
    out: set[str] = set()
    for o in network.observations:
        if not is_given(type(o), o.group) and o.facts.axes is not ObservedAxes.PLAN:
            for names in o.end_names(network.start.layout):
                out.update(names[o.use == Use.ACTIVE])
    return out


def _given_heights(network: Network) -> dict[str, float]:
    """Given heights [m] by the name of the point: held ones, and those with a sigma."""
    layout = network.start.layout
    out = {}
    for k, name in enumerate(layout.names["point"]):
        height = float(network.start.points[k, 2])
        if not network.free[3 * k + 2] and np.isfinite(height):
            out[name] = height
    for o in network.observations:
        if (found := _heights_of(o)) is not None:
            for item, point in zip(found[0], found[1], strict=True):
                out[layout.position_name(int(point))] = float(o.values[item, found[2]])
    return out


def without_heights(network: Network, names: list[str]) -> tuple[Network, int]:
    """The network without the given heights of some points; values that are only loosened."""
    layout = network.start.layout
    free, start = network.free.copy(), network.start
    points = start.points.copy()
    for name in names:
        k = layout.index("point", name)
        if not free[3 * k + 2]:
            free[3 * k + 2] = True
            points[k, 2] = np.nan
    factors = [np.ones(o.values.shape) for o in network.observations]
    loosened = 0
    for table, o in enumerate(network.observations):
        if (found := _heights_of(o)) is not None:
            items, at, row = found
            off = items[[layout.position_name(int(p)) in names for p in at]]
            factors[table][off, row] = _LOOSE
            loosened += len(off)
    without = replace(network, free=free, start=replace(start, points=points))
    return (with_sigmas(without, factors) if loosened else without), loosened
