"""Explains a network that fits nowhere by one slip: what was read, written or named wrongly.

Every explanation is a network with that slip undone. It is adjusted, and it is said only if the
corrected network passes its global test, the network as it is fails by far, and no other
explanation passes as well. Looked at are

* angles that run the other way, all of them, those of a file or of a station, or a single one whose
  ends are exchanged;
* given heights that are all equal, as where none was keyed in;
* given coordinates that contradict the sights by metres, and names exchanged in them;
* given coordinates that are all in another unit, or whose axes are exchanged or reversed;
* circle readings off by 100, 200 or 300 gon, zenith angles of the other face or counted from the
  horizon, height differences with their ends exchanged;
* angles in another unit, and degrees, minutes and seconds taken for decimals of a degree;
* distances in feet that are taken for metres, and the reverse;
* names of two targets exchanged at a set-up, or of two given points exchanged;
* a whole set-up that contradicts everything else.

Each part of the search ends after ten adjustments or two seconds, whichever is more, and says so
(method section 3.4).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from tribrach._types import Array, Index
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.angle_slips import turned_angles
from tribrach.network.blunders.clearing import Cleared, from_adjusted, from_start, loosened
from tribrach.network.blunders.equal_heights import equal_heights
from tribrach.network.blunders.given_lists import given_lists
from tribrach.network.blunders.given_places import given_places
from tribrach.network.blunders.setup_slips import (
    of_one_mark,
    setup_elsewhere,
    setup_of,
    wrong_setup,
)
from tribrach.network.blunders.slip_search import GROSS, LEFT, Slip, SlipSearch
from tribrach.network.blunders.suspects import Key
from tribrach.network.network import Network, is_given
from tribrach.network.quality import check_covariances
from tribrach.network.reliability import weigh
from tribrach.observations.base import Observations, Use, wrap
from tribrach.observations.declaration import End, StartTie
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.unknowns import State
from tribrach.sentences import Sentence
from tribrach.units import MM

#: pairs of names that are tried where nothing points at one
_MOST_PAIRS = 60
#: predictions that cannot tell a quarter of the circle are not used [rad]
_SHARP = 0.05
#: sigmas within which a corrected reading must be predicted
_AGREES = 4.0
#: height differences are at least this many sigmas where their sign is doubted
_CLEAR = 10.0
#: an international foot [m]
_FOOT = 0.3048
#: names or readings that a sentence lists
_NAMED = 6
_RIGHT = np.pi / 2
#: no circle reading is larger [rad]
_ROUND = 2 * np.pi + 1e-6


def explain(
    network: Network, adjustment: Adjustment | None = None, search: SlipSearch | None = None
) -> Slip | None:
    """Find the one slip without which a network fits."""
    search = search or SlipSearch()
    if adjustment is None or network is not adjustment.network or search.adjuster is not None:
        return _explained(network, adjustment, search)
    # asked for by what accuses coordinates as well
    slip, done = adjustment.once(explain, lambda: (_explained(network, adjustment, search), search))
    search.runs, search.earlier, search.given_up = done.runs, done.earlier, done.given_up
    return slip


def _explained(network: Network, adjustment: Adjustment | None, search: SlipSearch) -> Slip | None:
    """The one slip without which a network fits, sought anew."""
    before = np.inf if adjustment is None else adjustment.posterior_factor
    if not before > GROSS**2:
        return None
    if adjustment is not None and adjustment.given is not None and network is adjustment.network:
        # start values that were found with the slip in them would lead astray without it
        network = network.with_start(adjustment.given)
    if found := turned_angles(network, adjustment, before, search):
        return found
    if found := equal_heights(network, before, search):
        return found
    search.go_on()
    if found := _angle_unit(network, before, search):
        return found
    search.go_on()
    if found := given_lists(network, before, search):
        other = _length_unit(network, before, search)
        if other is None or found.after < LEFT * other.after:
            return found
        if other.after < LEFT * found.after:
            return other
        return replace(found, words=f"{found.words}, or {other.words}")
    search.go_on()
    if found := given_places(network, before, search, single=adjustment is None):
        return found
    search.go_on()
    clear = from_start(network, search.run)
    fitting = clear is not None and clear.fits
    if clear is not None and (found := _of_cleared(network, clear, before, search)):
        return _placed(network, adjustment, found, before, search)
    if found := _length_unit(network, before, search):
        return found
    if adjustment is not None:
        clear = from_adjusted(network, adjustment, search.run)
        fitting |= clear is not None and clear.fits
        if clear is not None and (found := _of_cleared(network, clear, before, search)):
            return _placed(network, adjustment, found, before, search)
        if clear is not None and of_one_mark(network, clear):
            search.go_on()
            if found := setup_elsewhere(network, adjustment, before, search):
                return found
    if fitting:
        return None
    search.go_on()
    if found := setup_elsewhere(network, adjustment, before, search):
        return found
    search.go_on()
    if found := wrong_setup(network, adjustment, before, search):
        return found
    search.go_on()
    return _exchange(network, _suspicious(network, adjustment), before, search, None)


def _placed(
    network: Network,
    adjustment: Adjustment | None,
    found: Slip,
    before: float,
    search: SlipSearch,
) -> Slip:
    """A slip; of a whole set-up, that it stands elsewhere if that explains it."""
    if found.kind != "setup" or adjustment is None:
        return found
    search.go_on()
    return setup_elsewhere(network, adjustment, before, search) or found


def _of_cleared(network: Network, clear: Cleared, before: float, search: SlipSearch) -> Slip | None:
    """What explains the observations without which a network fits."""
    if not clear.fits:
        return None
    return (
        _circle(network, clear, before, search)
        or _exchange(network, _pointed_at(network, clear), before, search, clear)
        or setup_of(network, clear, before, search)
    )


# readings


def _circle(network: Network, clear: Cleared, before: float, search: SlipSearch) -> Slip | None:
    """Circle readings that fit when they are turned or counted otherwise."""
    values = [o.values.copy() for o in network.observations]
    said: dict[tuple[str, str], list[Key]] = {}
    for table in sorted({t for t, _ in clear.wild}):
        o = network.observations[table]
        if o.rows != 1 or not (_is_reading(o) or isinstance(o, HeightDifferences)):
            continue
        items = np.array(sorted(i for t, i in clear.wild if t == table))
        sigma = np.sqrt(check_covariances(clear.adjustment, o, items)[:, 0, 0])
        predicted = o.predict(clear.adjustment.state)[items, 0]
        for item, computed, spread in zip(items, predicted, sigma, strict=True):
            found = _recounted(o, float(o.values[item, 0]), float(computed), float(spread))
            if found is not None:
                values[table][item, 0] = found[1]
                said.setdefault((o.facts.title, found[0]), []).append((table, int(item)))
    if not said:
        return None
    corrected = replace(
        network,
        observations=tuple(
            replace(o, values=v) for o, v in zip(network.observations, values, strict=True)
        ),
    )
    right = {key for keys in said.values() for key in keys}
    size = [np.full(len(o), 1e4) for o in network.observations]
    rest = frozenset(clear.wild - right)
    if len(rest) > len(right):
        # most of what does not fit has another cause, which may be that of all
        return None
    after = search.factor(loosened(corrected, rest, size).with_start(clear.adjustment.state))
    if after is None:
        return None
    words = [
        _of_readings(network, clear.adjustment.state, title, how, keys)
        for (title, how), keys in said.items()
    ]
    others = f" (and without {len(rest)} other observations)" if rest else ""
    return Slip(
        " and ".join(words), f"corrected so{others},", before, after, "correct them in the file"
    )


def _is_reading(o: Observations) -> bool:
    """True for readings of a circle."""
    return o.facts.start in (StartTie.RAY, StartTie.ZENITH)


def _recounted(
    o: Observations, value: float, computed: float, sigma: float
) -> tuple[str, float] | None:
    """Slip that explains the misfit of a value, and the value without it; None without one."""
    if isinstance(o, HeightDifferences):
        clear = abs(value) > _CLEAR * sigma and abs(value + computed) <= _AGREES * sigma
        return ("fit with their ends exchanged", -value) if clear else None
    if not sigma < _SHARP / _AGREES:
        return None
    if o.facts.start is StartTie.ZENITH:
        ways = {
            "fit when they are taken from 400 gon, as readings in face two": 2 * np.pi - value,
            "fit when 200 gon is added": value + np.pi,
            "fit when 200 gon is subtracted": value - np.pi,
            "fit as elevations from the horizon": _RIGHT - value,
            "fit when they are taken from 200 gon": np.pi - value,
            "fit when 100 gon is added": value + _RIGHT,
            "fit when 100 gon is subtracted": value - _RIGHT,
        }
        close = {w: v for w, v in ways.items() if abs(v - computed) <= _AGREES * sigma}
    else:
        ways = {f"fit when {k}00 gon is added": value + k * _RIGHT for k in (1, 2, 3)}
        off = {w: float(wrap(np.array(v - computed))) for w, v in ways.items()}
        close = {w: ways[w] for w, d in off.items() if abs(d) <= _AGREES * sigma}
    return next(iter(close.items())) if len(close) == 1 else None


def _of_readings(network: Network, state: State, title: str, how: str, keys: list[Key]) -> str:
    """Some readings of a kind and what is true of them."""
    names = [
        Network.describe(network.observations[t], i, state).removeprefix(title).strip()
        for t, i in sorted(keys)
    ]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    listed = ", ".join(names[:_NAMED]) + more
    if len(names) == 1:
        return f"the {title} {listed} {how.replace('fit ', 'fits ', 1)}".replace(
            "they are", "it is"
        ).replace("their ends", "its ends")
    return f"{len(names)} {_plural(title)} {how}: {listed}"


def _plural(title: str) -> str:
    """A kind in the plural."""
    return f"{title} angles" if title in ("zenith", "vertical") else f"{title}s"


def _length_unit(network: Network, before: float, search: SlipSearch) -> Slip | None:
    """All distances in another unit of length than the coordinates."""
    lengths = [o.facts.start is StartTie.LENGTH for o in network.observations]
    if not any(lengths):
        return None
    for factor, words in (
        (MM, "the distances are in millimetres, or all else is in kilometres"),
        (_FOOT, "the distances are in feet and were taken for metres"),
        (
            1 / _FOOT,
            "the distances are in metres, the coordinates or all else in feet",
        ),
    ):
        observations = tuple(
            replace(o, values=o.values * factor) if length else o
            for o, length in zip(network.observations, lengths, strict=True)
        )
        after = search.explained(replace(network, observations=observations), before)
        if after is not None:
            return Slip(
                words,
                Sentence("times {factor:4}", factor=factor),
                before,
                after,
                "give the unit in the file",
            )
    return None


def _angle_unit(network: Network, before: float, search: SlipSearch) -> Slip | None:
    """All circle readings in another unit of angle, if one explains the misfit."""
    circle = [o.rows == 1 and _is_reading(o) and len(o) > 0 for o in network.observations]
    if not any(circle):
        return None
    ways: tuple[tuple[str, Callable[[Array], Array]], ...] = (
        ("the angles are in degrees and were taken for gon", lambda v: v / 0.9),
        ("the angles are in gon and were taken for degrees", lambda v: v * 0.9),
        ("the angles are degrees, minutes and seconds and were taken for decimals", _unpacked),
    )
    good: list[tuple[str, float]] = []
    for words, read in ways:
        observations = tuple(
            replace(o, values=read(o.values)) if c else o
            for o, c in zip(network.observations, circle, strict=True)
        )
        turned = [o.values for o, c in zip(observations, circle, strict=True) if c]
        if any(not np.isfinite(v).all() or v.max() > _ROUND for v in turned):
            continue
        after = search.explained(replace(network, observations=observations), before)
        if after is not None:
            good.append((words, after))
    if len(good) != 1:
        return None
    words, after = good[0]
    cure = "give the unit of the angles in the file"
    return Slip(words, "read so,", before, after, cure, "angle_unit")


def _unpacked(values: Array) -> Array:
    """Angles [rad] of which the decimals of the degrees are minutes and seconds; NaN if not."""
    total = np.rint(np.degrees(values) * 1e8)
    degrees, rest = np.divmod(total, 1e8)
    minutes, seconds = np.divmod(rest, 1e6)
    read: Array = np.radians(degrees + minutes / 60 + seconds / 1e4 / 3600)
    return np.where((minutes < 60) & (seconds < 60e4), read, np.nan)


# names


@dataclass(frozen=True)
class _Pair:
    """Two positions whose names may be exchanged, at a set-up or (-1) in the given coordinates."""

    setup: int
    first: int
    second: int
    #: in the directions of the set-up alone, not in what else was measured with them
    alone: bool = False


def _exchange(
    network: Network,
    pairs: Iterable[_Pair],
    before: float,
    search: SlipSearch,
    clear: Cleared | None,
) -> Slip | None:
    """The exchange of two names that makes a network fit, if it is the only one."""
    pairs = list(pairs)
    state = None if clear is None else clear.adjustment.state
    good: list[tuple[float, _Pair]] = []
    for tried, pair in enumerate(pairs):
        if search.over:
            search.given_up = len(pairs) - tried
            break
        changed = _exchanged(network, pair)
        after = search.factor(changed if state is None else changed.with_start(state))
        if after is not None and after < LEFT * before:
            good.append((after, pair))
    names = {frozenset((pair.first, pair.second)) for _, pair in good}
    if len(names) != 1 or (search.given_up and clear is None):
        return None
    return _in_words(network, min(good, key=lambda g: g[0])[0], [p for _, p in good], before)


def _in_words(network: Network, after: float, pairs: list[_Pair], before: float) -> Slip:
    """An exchange of names in words; where several set-ups explain it, all of them."""
    name = network.start.layout.position_name
    where = [f"at {name(p.setup)}" if p.setup >= 0 else "in the given coordinates" for p in pairs]
    where = [f"in the directions {w}" if p.alone else w for w, p in zip(where, pairs, strict=True)]
    pair = pairs[0]
    return Slip(
        f"The names {name(pair.first)} and {name(pair.second)} are exchanged {' or '.join(where)}",
        "with them the other way round",
        before,
        after,
        "correct the names in the file",
    )


def _ends(o: Observations, points: int) -> tuple[Index, Index, str] | None:
    """Positions (n,) of set-up and target, and the field of the target."""
    start, end = o.end_field(End.FROM), o.end_field(End.TO)
    if not o.facts.names_target or start is None or end is None:
        return None
    setup = np.asarray(getattr(o, start.name)) + (points if start.family == "pose" else 0)
    return setup, np.asarray(getattr(o, end.name)), end.name


def _places(o: Observations) -> tuple[Index, str] | None:
    """Positions (n,) of given coordinates, and their field."""
    at = o.end_field(End.AT)
    if not is_given(type(o), o.group) or at is None or at.family != "position":
        return None
    return np.asarray(getattr(o, at.name)), at.name


def _pointed_at(network: Network, clear: Cleared) -> Iterator[_Pair]:
    """Pairs of names that what was loosened points at."""
    points = network.start.layout.count("point")
    bad: dict[int, set[int]] = {}
    seen: dict[int, set[int]] = {}
    beside: dict[int, set[int]] = {}
    for table, o in enumerate(network.observations):
        wild = np.array(sorted(i for t, i in clear.wild if t == table), dtype=np.int64)
        if (places := _places(o)) is not None:
            bad.setdefault(-1, set()).update(places[0][wild].tolist())
        if (ends := _ends(o, points)) is None:
            continue
        for k in np.flatnonzero(o.use == Use.ACTIVE):
            seen.setdefault(int(ends[0][k]), set()).add(int(ends[1][k]))
            if o.facts.start is not StartTie.RAY:
                beside.setdefault(int(ends[0][k]), set()).add(int(ends[1][k]))
        for k in wild:
            bad.setdefault(int(ends[0][k]), set()).add(int(ends[1][k]))
    names = [
        (setup, *pair)
        for setup, targets in bad.items()
        for pair in combinations(sorted(targets), 2)
    ]
    # where only two set-ups see both targets, the names may be exchanged at either
    also = [
        (setup, p, q)
        for _, p, q in names
        for setup, targets in seen.items()
        if p in targets and q in targets
    ]
    yield from (_Pair(*name) for name in dict.fromkeys([*names, *also]))
    # where distances belong to them, the names may be exchanged in the directions alone
    yield from (
        _Pair(setup, p, q, alone=True)
        for setup, p, q in dict.fromkeys(names)
        if {p, q} & beside.get(setup, set())
    )


def _suspicious(network: Network, adjustment: Adjustment | None) -> list[_Pair]:
    """Pairs of targets of each set-up, the most suspicious first."""
    points = network.start.layout.count("point")
    worst: dict[tuple[int, int], float] = {}
    w = None if adjustment is None else np.nan_to_num(np.abs(weigh(adjustment).w))
    for table, o in enumerate(network.observations):
        ends = _ends(o, points)
        if ends is None:
            continue
        size = np.zeros(len(o))
        if adjustment is not None and w is not None:
            rows = adjustment.rows.table == table
            np.maximum.at(size, adjustment.rows.item[rows], w[rows])
        for k in np.flatnonzero(o.use == Use.ACTIVE):
            key = (int(ends[0][k]), int(ends[1][k]))
            worst[key] = max(worst.get(key, 0.0), float(size[k]))
    setups: dict[int, list[int]] = {}
    for setup, target in worst:
        setups.setdefault(setup, []).append(target)
    pairs = [
        (min(worst[setup, p], worst[setup, q]), _Pair(setup, p, q))
        for setup, targets in setups.items()
        for p, q in combinations(targets, 2)
    ]
    pairs.sort(key=lambda pair: -pair[0])
    return [pair for _, pair in pairs[:_MOST_PAIRS]]


def _exchanged(network: Network, pair: _Pair) -> Network:
    """The network with two names exchanged in all that was observed from a set-up, or given."""
    points = network.start.layout.count("point")
    changed = []
    for o in network.observations:
        if pair.setup < 0:
            places = _places(o)
            if places is not None:
                o = replace(o, **_other(places[1], places[0], pair, np.ones(len(o), dtype=bool)))
        elif pair.alone and o.facts.start is not StartTie.RAY:
            pass
        elif (ends := _ends(o, points)) is not None:
            o = replace(o, **_other(ends[2], ends[1], pair, ends[0] == pair.setup))
        changed.append(o)
    return replace(network, observations=tuple(changed))


def _other(name: str, target: Index, pair: _Pair, where: Array) -> dict[str, Any]:
    """A field with two indices exchanged where a mask (n,) holds."""
    swapped = np.where(target == pair.first, pair.second, target)
    swapped = np.where(target == pair.second, pair.first, swapped)
    return {name: np.where(where, swapped, target)}
