"""Were the names of two targets exchanged at one set-up? Adjusted again with each pair exchanged.

Two names that changed places put two targets metres away at once; tests of single observations
cannot tell which pair it was, since everything around is distorted. The pair without which the
network fits is the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import TribrachError
from tribrach.network.adjustment import Adjustment, Options, adjust
from tribrach.network.network import Network
from tribrach.network.observations.base import Observations, Use
from tribrach.network.reliability import weigh
from tribrach.network.snooping import switch
from tribrach.network.suspects import find_suspects

__all__ = ["SwappedNames", "swapped_names"]

Index = NDArray[np.int64]

#: networks that fit worse than this many times their sigmas are looked at; pairs that are tried
_GROSS, _MOST = 5.0, 60
#: of an attempt
_ITERATIONS = 15
#: what must be left of the variance factor
_LEFT = 0.05


@dataclass(frozen=True)
class SwappedNames:
    """Two targets whose names were exchanged at a set-up; variance factors before
    (infinite if it could not be adjusted) and without.
    """

    setup: str
    first: str
    second: str
    before: float
    after: float
    network: Network

    def sentence(self) -> str:
        """The finding in one sentence."""
        fits = f"sigma0 falls from {np.sqrt(self.before):.1f} to {np.sqrt(self.after):.2f}"
        if not np.isfinite(self.before):
            fits = f"the network can be adjusted, with sigma0 {np.sqrt(self.after):.2f}"
        return (
            f"The names {self.first} and {self.second} are exchanged at {self.setup}: with them "
            f"the other way round {fits}"
        )


def _hurried(network: Network) -> Adjustment:
    """An adjustment that soon gives up: with the right names few iterations are needed."""
    return adjust(network, options=Options(max_iterations=_ITERATIONS))


def swapped_names(
    network: Network,
    adjustment: Adjustment | None = None,
    run: Callable[[Network], Adjustment] = _hurried,
) -> SwappedNames | None:
    """The exchange of two names that makes a network fit which does not; None if there is none.

    adjustment : of the network as it is, None if it could not be adjusted.
    """
    before = np.inf if adjustment is None else adjustment.posterior_factor
    if not before > _GROSS**2 or (adjustment is not None and _one_alone(adjustment, run)):
        return None
    best: SwappedNames | None = None
    for setup, first, second in _pairs(network, adjustment):
        changed = _exchanged(network, setup, first, second)
        try:
            after = run(changed).posterior_factor
        except TribrachError:
            continue
        if after < (_LEFT * before if best is None else best.after):
            name = network.start.layout.position_name
            best = SwappedNames(name(setup), name(first), name(second), before, after, changed)
            if after < 2.0:
                break
    return best


def _one_alone(adjustment: Adjustment, run: Callable[[Network], Adjustment]) -> bool:
    """True if the network fits without its worst observation: then that one was misread."""
    suspects = find_suspects(weigh(adjustment))
    if not suspects:
        return True
    try:
        rest = run(switch(adjustment.network, *suspects[0].key, Use.OFF, "tried without it"))
    except TribrachError:
        return False
    return rest.posterior_factor < _LEFT * adjustment.posterior_factor


def _ends(o: Observations, points: int) -> tuple[Index, Index, str] | None:
    """Positions (n,) of set-up and target, and the field of the target."""
    some: Any = o
    if hasattr(o, "station") and hasattr(o, "target"):
        return np.asarray(some.station) + points, np.asarray(some.target), "target"
    if hasattr(o, "start") and hasattr(o, "end") and hasattr(o, "height_instrument"):
        return np.asarray(some.start), np.asarray(some.end), "end"
    return None


def _pairs(network: Network, adjustment: Adjustment | None) -> Iterator[tuple[int, int, int]]:
    """Set-up and two targets (positions), the most suspicious pairs first."""
    points = network.start.layout.count("point")
    worst: dict[tuple[int, int], float] = {}
    w = None if adjustment is None else np.nan_to_num(np.abs(weigh(adjustment).w))
    for table, o in enumerate(network.observations):
        ends = _ends(o, points)
        if ends is None:
            continue
        size = np.zeros(len(o))
        if adjustment is not None and w is not None:
            mine = adjustment.rows.table == table
            np.maximum.at(size, adjustment.rows.item[mine], w[mine])
        for k in np.flatnonzero(o.use == Use.ACTIVE):
            key = (int(ends[0][k]), int(ends[1][k]))
            worst[key] = max(worst.get(key, 0.0), float(size[k]))
    setups: dict[int, list[int]] = {}
    for setup, target in worst:
        setups.setdefault(setup, []).append(target)
    pairs = [
        (min(worst[setup, p], worst[setup, q]), setup, p, q)
        for setup, targets in setups.items()
        for p, q in combinations(targets, 2)
    ]
    pairs.sort(key=lambda pair: -pair[0])
    return ((setup, p, q) for _, setup, p, q in pairs[:_MOST])


def _exchanged(network: Network, setup: int, first: int, second: int) -> Network:
    """The network with two targets exchanged in all that was observed from a set-up."""
    points = network.start.layout.count("point")
    changed = []
    for o in network.observations:
        ends = _ends(o, points)
        if ends is None:
            changed.append(o)
            continue
        start, target, field = ends
        swapped = np.where(target == first, second, np.where(target == second, first, target))
        further: dict[str, Any] = {field: np.where(start == setup, swapped, target)}
        changed.append(replace(o, **further))
    return replace(network, observations=tuple(changed))
