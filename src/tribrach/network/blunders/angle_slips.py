"""Angles that run the other way: all of them, those of a file or of a station, or single ones.

An angle ``at, from, to`` whose ends are exchanged is a full circle less what it should be. That is
a slip without any parameter, so that a network that fits with it undone, and far better than
before, has it explained; it is said only where no other angles explain as much (method section
3.4). All angles and directions of a network run the other way as well where easting and northing
of its coordinates are exchanged: nothing tells the two apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tribrach.errors import TribrachError
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.slip_search import FEW, Slip, SlipSearch, explains
from tribrach.network.blunders.suspects import Key
from tribrach.network.network import Network
from tribrach.network.reliability import weigh
from tribrach.observations.base import Observations, Use, wrap
from tribrach.observations.sights import Angles, Directions

#: single angles that are tried, the most suspicious first
_MOST = 12
#: angles that are exchanged together at most, and the share of the variance factor that each but
#: the last must leave at most
_EXCHANGED, _HELPS = 3, 0.8
#: an exchange must change an angle by at least this many of its sigmas
_CLEAR = 50.0
_MIRRORED = "angles count clockwise from backsight to foresight: exchange the two in the file"


@dataclass(frozen=True)
class _Turned:
    """Some angles as one slip."""

    words: str  #: what is wrong, as a clause
    #: the angles (table, item)
    keys: frozenset[Key]
    cure: str
    kind: str


def turned_angles(
    network: Network, adjustment: Adjustment | None, before: float, search: SlipSearch
) -> Slip | None:
    """Find the angles that fit the other way round, where only one choice of them does.

    ``network``: it does not fit; ``adjustment``: of the network, None if it could not be adjusted.
    """
    for level in (_whole(network), _lists(network), _stations(network)):
        good = []
        for turned in level:
            after = search.explained(_other_way(network, turned.keys), before)
            if after is not None:
                good.append((after, turned))
        if good:
            return _only(good, before)
    return _exchanged(network, adjustment, before, search)


def _exchanged(
    network: Network, adjustment: Adjustment | None, before: float, search: SlipSearch
) -> Slip | None:
    """Single angles whose ends are exchanged: the one that helps most, until all is explained."""
    keys: frozenset[Key] = frozenset()
    words: list[str] = []
    least = before
    for _ in range(_EXCHANGED):
        search.go_on()
        tried: list[tuple[float, bool, _Turned, Adjustment]] = []
        for turned in _single(network, adjustment):
            if turned.keys <= keys:
                continue
            if search.over and not tried:
                return None
            try:
                trial = search.run(_other_way(network, keys | turned.keys), FEW)
            except TribrachError:
                continue
            explained = explains(trial.vtpv, trial.dof, before) is not None
            tried.append((trial.posterior_factor, explained, turned, trial))
        if not tried:
            return None
        good = [one for one in tried if one[1]]
        factor, explained, turned, adjustment = min(good or tried, key=lambda one: one[0])
        keys, words = keys | turned.keys, [*words, turned.words]
        if explained:
            all_of_them = _Turned(" and ".join(words), keys, turned.cure, turned.kind)
            return _only([(factor, all_of_them)] * len(good), before)
        if not factor < _HELPS * least:
            return None
        least = factor
    return None


def _only(good: list[tuple[float, _Turned]], before: float) -> Slip | None:
    """The slip, where only one choice of angles explains the misfit."""
    if len(good) != 1:
        return None
    after, turned = good[0]
    undone = "with the angles the other way round"
    return Slip(
        turned.words, undone, before, after, turned.cure, turned.kind, turned.keys
    )  # fmt: skip


def _tables(network: Network, kind: type[Observations]) -> Iterator[tuple[int, Observations]]:
    """The tables of a kind that take part."""
    for table, o in enumerate(network.observations):
        if isinstance(o, kind) and (o.use == Use.ACTIVE).any():
            yield table, o


def _keys(network: Network, kind: type[Observations]) -> frozenset[Key]:
    """All observations of a kind that take part."""
    return frozenset(
        (table, int(item))
        for table, o in _tables(network, kind)
        for item in np.flatnonzero(o.use == Use.ACTIVE)
    )


def _whole(network: Network) -> Iterator[_Turned]:
    """All angles, all directions, or both."""
    angles, directions = _keys(network, Angles), _keys(network, Directions)
    mirrored = ", or easting and northing of the given coordinates are exchanged"
    parts = [("angles", angles), ("directions", directions)]
    if angles and directions:
        parts.insert(0, ("angles and directions", angles | directions))
    for words, keys in parts:
        if len(keys) > 1:
            clause = f"all {len(keys)} {words} run the other way{mirrored}"
            yield _Turned(clause, keys, f"{_MIRRORED}, or the two axes", "counter_clockwise")


def _lists(network: Network) -> Iterator[_Turned]:
    """Angles and directions of one file among several."""
    files: dict[str, set[Key]] = {}
    for table, item in sorted(_keys(network, Angles) | _keys(network, Directions)):
        source = str(network.observations[table].source[item])
        files.setdefault(source.rpartition(":")[0], set()).add((table, item))
    if len(files) < 2:
        return
    for name, keys in files.items():
        if len(keys) > 1:
            clause = f"all {len(keys)} angles of {name} run the other way"
            yield _Turned(clause, frozenset(keys), _MIRRORED, "counter_clockwise")


def _stations(network: Network) -> Iterator[_Turned]:
    """Angles of one station that has several."""
    stations: dict[int, set[Key]] = {}
    for table, o in _tables(network, Angles):
        for item in np.flatnonzero(o.use == Use.ACTIVE):
            stations.setdefault(int(_start(o)[item]), set()).add((table, int(item)))
    if len(stations) < 2:
        return
    for station, keys in stations.items():
        if len(keys) > 1:
            name = network.start.layout.position_name(station)
            clause = f"all {len(keys)} angles at {name} run the other way"
            yield _Turned(clause, frozenset(keys), _MIRRORED, "counter_clockwise")


def _single(network: Network, adjustment: Adjustment | None) -> list[_Turned]:
    """Single angles, the most suspicious first."""
    w: dict[Key, float] = {}
    if adjustment is not None:
        rows = adjustment.rows
        size = np.nan_to_num(np.abs(weigh(adjustment).w))
        w = {
            (int(t), int(i)): float(x) for t, i, x in zip(rows.table, rows.item, size, strict=True)
        }
    ranked: list[tuple[float, _Turned]] = []
    for table, o in _tables(network, Angles):
        change = np.abs(wrap(2 * o.values[:, 0])) / o.sigma[:, 0]
        for item in np.flatnonzero((o.use == Use.ACTIVE) & (change > _CLEAR)):
            key = (table, int(item))
            words = Network.describe(o, int(item), network.start)
            clause = f"the ends of the {words.removeprefix('the ')} are exchanged"
            cure = "exchange its backsight and foresight in the file"
            ranked.append((w.get(key, 0.0), _Turned(clause, frozenset([key]), cure, "angle_ends")))
    ranked.sort(key=lambda one: -one[0])
    return [turned for _, turned in ranked[:_MOST]]


def _start(o: Observations) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Positions (n,) of the stations of angles."""
    assert isinstance(o, Angles)
    return np.asarray(o.start)


def _other_way(network: Network, keys: frozenset[Key]) -> Network:
    """The network with some angles counted the other way."""
    observations = list(network.observations)
    for table in {t for t, _ in keys}:
        o = observations[table]
        values = o.values.copy()
        items = [i for t, i in keys if t == table]
        values[items, 0] = (2 * np.pi - values[items, 0]) % (2 * np.pi)
        observations[table] = replace(o, values=values)
    return replace(network, observations=tuple(observations))
