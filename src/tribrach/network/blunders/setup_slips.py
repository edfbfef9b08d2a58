"""A whole set-up that contradicts everything else: turned, at another point, or of another job.

Where no single sight explains a misfit, each set-up is taken out with all that it alone places. If
the rest fits, and fits without no other set-up, the set-up is named, not its sights. Nothing is
said where too little is left to check anything (method section 3.4).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Index, Mask
from tribrach.errors import TribrachError
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.clearing import Cleared
from tribrach.network.blunders.robust import with_sigmas
from tribrach.network.blunders.slip_search import Slip, SlipSearch, explains
from tribrach.network.blunders.suspects import Key
from tribrach.network.network import Network, is_given
from tribrach.network.quality import check_covariances
from tribrach.network.reliability import redundancy_numbers, weigh
from tribrach.network.start.placeholders import listed
from tribrach.observations.base import Observations, Use, wrap
from tribrach.observations.control import Centrings
from tribrach.observations.declaration import End, StartTie
from tribrach.observations.sights import Sights
from tribrach.sentences import Sentence

#: set-ups that are tried
_MOST = 30
#: redundancy that must be left, and its share of all
_LEAST, _SHARE = 5, 0.2
#: factor on the sigmas of sights that must not pull
_LOOSE = 1e6
#: share of the variance factor of the next best, and of that before, that may be left
_FAR_LESS = 1e-3
#: sights that make a set-up
_SIGHTS = 3
#: sigmas within which sights are turned by the same angle, and how rarely chance may make them so
_AGREES, _BY_CHANCE = 4.0, 0.01
#: sights of it that are taken out, the most suspicious first, and how much worse than without
#: the set-up the network may then fit for the sight to be as likely
_ALONE, _ALIKE = 12, 4.0
#: sights that are taken out together
_FEW = 2
#: occupations of marks that are tried, and how far from its mark one is no error of centring [m]
_OCCUPATIONS, _APART = 6, 0.1


@dataclass(frozen=True)
class _Without:
    """A network in which the sights of one set-up pull at nothing."""

    network: Network
    keys: frozenset[Key]  #: of the set-up
    loose: frozenset[Key]  #: the same, and sights of others to points that nothing else places


def wrong_setup(
    network: Network, adjustment: Adjustment | None, before: float, search: SlipSearch
) -> Slip | None:
    """Find the set-up without which a network fits, if it is the only one and no sight will do.

    ``network``: it does not fit; ``adjustment``: of the network, None if it could not be adjusted;
    ``before``: its variance factor, infinite then.
    """
    setups = _setups(network)
    if not 1 < len(setups) <= _MOST:
        return None
    good: list[tuple[float, int, int, _Without]] = []
    for position in setups:
        if search.over and not good:
            return None
        tried = _without(network, position, setups[position])
        try:
            trial = search.run(tried.network)
        except TribrachError:
            continue
        left = _redundancy(trial, tried.loose)
        if left >= max(_LEAST, _SHARE * trial.dof):
            good.append((trial.vtpv / left, left, position, tried))
    if len(good) < 2:
        return None
    good.sort(key=lambda one: one[0])
    (after, left, position, tried), second = good[0], good[1]
    if explains(after * left, left, before) is not None:
        if explains(second[0] * second[1], second[1], before) is not None:
            return None
    elif after > _FAR_LESS * min(before, second[0]):
        # sigmas that are too small everywhere hide nothing where all others are far worse
        return None
    return _setup_or_few(network, adjustment, position, tried.keys, before, after, search)


def _setup_or_few(
    network: Network,
    adjustment: Adjustment | None,
    position: int,
    keys: frozenset[Key],
    before: float,
    after: float,
    search: SlipSearch,
) -> Slip | None:
    """A set-up as a slip, unless a few of its sights explain as much: what those have in common."""
    few = _few_sights(network, adjustment, keys, after, search)
    if few is not None:
        return _turned(network, position, few, before, search)
    return _slip(network, position, keys, before, after)


def _few_sights(
    network: Network,
    adjustment: Adjustment | None,
    keys: frozenset[Key],
    after: float,
    search: SlipSearch,
) -> Cleared | None:
    """A network without at most half of the sights of a set-up, if it fits as without them all."""
    size: dict[Key, float] = {}
    if adjustment is not None:
        rows, w = adjustment.rows, np.nan_to_num(np.abs(weigh(adjustment).w))
        size = {(int(t), int(i)): x for t, i, x in zip(rows.table, rows.item, w, strict=True)}
    order = sorted(keys, key=lambda key: (-size.get(key, 0.0), key))[:_ALONE]
    out: frozenset[Key] = frozenset()
    for _ in range(min(_FEW, len(keys) // 2)):
        tried: list[tuple[float, Cleared]] = []
        for key in order:
            if key in out:
                continue
            factors = [np.ones(o.values.shape) for o in network.observations]
            for table, item in out | {key}:
                factors[table][item] = _LOOSE
            try:
                trial = search.run(with_sigmas(network, factors))
            except TribrachError:
                continue
            left = trial.dof - sum(network.observations[t].rows for t, _ in out | {key})
            if left > 0:
                cleared = Cleared(trial, out | {key}, trial.vtpv, left)
                tried.append((trial.vtpv / left, cleared))
        if not tried:
            return None
        least, cleared = min(tried, key=lambda one: one[0])
        if least < _ALIKE * max(after, 1.0):
            return cleared
        out = cleared.wild
    return None


def setup_elsewhere(
    network: Network, adjustment: Adjustment | None, before: float, search: SlipSearch
) -> Slip | None:
    """Find the set-up or target that does not stand over the mark that it is named after.

    What its sights share of centring, a vector, is let go; nobody else may explain as much.
    """
    size: dict[int, float] = {}
    for o in network.observations:
        if isinstance(o, Centrings):
            size |= dict.fromkeys(o.vector[o.use == Use.ACTIVE].tolist(), 0.0)
    if adjustment is not None:
        w = np.nan_to_num(np.abs(weigh(adjustment).w))
        for table, item, value in zip(adjustment.rows.table, adjustment.rows.item, w, strict=True):
            o = network.observations[table]
            if isinstance(o, Centrings):
                size[int(o.vector[item])] = max(size[int(o.vector[item])], float(value))
    good: list[tuple[float, int, Adjustment]] = []
    for vector in sorted(size, key=lambda v: -size[v])[:_OCCUPATIONS]:
        if search.over:
            return None
        factors = [np.ones(o.values.shape) for o in network.observations]
        values = 0
        for table, o in enumerate(network.observations):
            if isinstance(o, Centrings):
                mine = (o.vector == vector) & (o.use == Use.ACTIVE)
                factors[table][mine] = _LOOSE
                values += int(mine.sum())
        try:
            trial = search.run(with_sigmas(network, factors))
        except TribrachError:
            continue
        after = explains(trial.vtpv, trial.dof - values, before)
        if after is not None:
            good.append((after, vector, trial))
    if len(good) != 1:
        return None
    after, vector, trial = good[0]
    name = network.start.layout.names["vector"][vector].removeprefix(f"{Centrings.kind} ")
    length = float(np.hypot(*trial.state.vectors[vector, :2]))
    if length < _APART:
        return None
    return Slip(
        Sentence(
            "what stands {name} is {length:m2} off that mark: its name may be wrong",
            name=name,
            length=length,
        ),
        "with another place for it",
        before,
        after,
        "correct the name of the point that was occupied",
        "setup_elsewhere",
        names=(name,),
    )


def of_one_mark(network: Network, clear: Cleared) -> bool:
    """True if the sights without which a network fits all go to or from one place."""
    points = network.start.layout.count("point")
    common: set[int] | None = None
    for table, item in clear.wild:
        ends = {int(at[item]) for at in _ends(network.observations[table], points)}
        common = ends if common is None else common & ends
    return clear.fits and len(clear.wild) >= _SIGHTS and bool(common)


def setup_of(network: Network, clear: Cleared, before: float, search: SlipSearch) -> Slip | None:
    """The set-up that the sights without which a network fits belong to, if one does.

    ``network``: it does not fit; ``clear``: the network with the sights loosened that do not fit;
    ``before``: its variance factor, infinite if it could not be adjusted.
    """
    if not clear.fits:
        return None
    for position, keys in _setups(network).items():
        if not clear.wild <= keys | _lengths(network, position):
            continue
        if slip := _turned(network, position, clear, before, search):
            return slip
        wild = clear.wild & keys
        if len(wild) >= _SIGHTS and 2 * len(wild) > len(keys):
            keys |= clear.wild
            after = clear.vtpv / clear.dof
            return _setup_or_few(network, clear.adjustment, position, keys, before, after, search)
    return None


def _turned(
    network: Network, position: int, clear: Cleared, before: float, search: SlipSearch
) -> Slip | None:
    """Sights of a set-up that are all turned by one angle, against its others or as a whole."""
    tables = {t for t, _ in clear.wild}
    if len(clear.wild) < 2 or len(tables) != 1:
        return None
    table = tables.pop()
    o, items = network.observations[table], np.array(sorted(i for _, i in clear.wild))
    if o.rows != 1 or o.facts.start is not StartTie.RAY:
        return None
    off = wrap(o.values[items, 0] - o.predict(clear.adjustment.state)[items, 0])
    sigma = np.sqrt(check_covariances(clear.adjustment, o, items)[:, 0, 0])
    best = int(np.argmin(sigma))
    angle, spread = float(off[best]), _AGREES * np.hypot(sigma, sigma[best])
    if (np.abs(wrap(off - angle)) > spread).any():
        return None
    # errors of that size would rarely be so alike by chance
    if not (spread.max() / abs(angle)) ** (len(items) - 1) < _BY_CHANCE:
        return None
    values = o.values.copy()
    values[items, 0] = (values[items, 0] - angle) % (2 * np.pi)
    observations = list(network.observations)
    observations[table] = replace(o, values=values)
    turned = replace(network, observations=tuple(observations))
    after = search.explained(turned.with_start(clear.adjustment.state), before)
    if after is None:
        return None
    layout = network.start.layout
    name = layout.position_name(position)
    same = (o.use == Use.ACTIVE) & (next(_ends(o, layout.count("point"))) == position)
    if hasattr(o, "orientation"):
        same &= np.isin(o.orientation, o.orientation[items])
    same[items] = False
    names = [str(name) for name in o.end_names(layout)[-1]]
    title, part = f"{o.facts.title}s", bool(same.any())
    these, others = (
        listed(tuple(names[k] for k in which)) for which in (items, np.flatnonzero(same))
    )
    words = (
        "the {title} at {name} to {these} and those to {others} are turned against each other by "
        if part
        else "all {title} at {name} ({these}) are turned by "
    )
    return Slip(
        Sentence(
            words + "{angle:gon4} ± {sigma:gon4}",
            title=title,
            name=name,
            these=these,
            others=others,
            angle=abs(angle),
            sigma=float(sigma[best]),
        ),
        "turned back",
        before,
        after,
        f"the instrument at {name} was turned between them: make a set of each"
        if part
        else f"look at what the circle at {name} was set by",
        "turned",
        clear.wild | {(table, int(item)) for item in np.flatnonzero(same)},
    )


def _slip(
    network: Network, position: int, keys: frozenset[Key], before: float, after: float
) -> Slip:
    """A set-up as a slip."""
    name = network.start.layout.position_name(position)
    return Slip(
        f"the set-up at {name} contradicts everything else",
        f"without its {len(keys)} sights",
        before,
        after,
        f"look at the names, the point and the circle of the set-up at {name} before any single "
        "sight",
        "setup",
        keys,
    )


def _ends(o: Observations, points: int) -> Iterator[Index]:
    """Positions (n,) of each end."""
    for end in (End.FROM, End.TO, End.AT):
        field = o.end_field(end)
        if field is not None and field.family in ("position", "pose", "point"):
            at = np.asarray(getattr(o, field.name))
            yield at + (points if field.family == "pose" else 0)
    foresight = getattr(o, "foresight", None)
    if foresight is not None:
        yield np.asarray(foresight)


def _setups(network: Network) -> dict[int, frozenset[Key]]:
    """Sights of each set-up that has several, by the position of the set-up."""
    points = network.start.layout.count("point")
    out: dict[int, set[Key]] = {}
    for table, o in enumerate(network.observations):
        start = o.end_field(End.FROM)
        if start is None or not o.angular or is_given(type(o), o.group):
            continue
        at = np.asarray(getattr(o, start.name)) + (points if start.family == "pose" else 0)
        for item in np.flatnonzero(o.use == Use.ACTIVE):
            out.setdefault(int(at[item]), set()).add((table, int(item)))
    return {at: frozenset(keys) for at, keys in out.items() if len(keys) >= _SIGHTS}


def _lengths(network: Network, position: int) -> frozenset[Key]:
    """Distances from a set-up."""
    return frozenset(
        (table, int(item))
        for table, o in enumerate(network.observations)
        if isinstance(o, Sights)
        for item in np.flatnonzero((o.start == position) & (o.use == Use.ACTIVE))
    )


def _without(network: Network, position: int, keys: frozenset[Key]) -> _Without:
    """The network with a set-up, and what only it places, held and their sights loose."""
    layout = network.start.layout
    points = layout.count("point")
    loose = set(keys)
    free = network.free.copy()
    held: set[int] = set()
    for _ in range(len(layout.names["point"])):
        alone = _hanging(network, loose, free) - held
        if not alone:
            break
        held |= alone
        for table, o in enumerate(network.observations):
            if is_given(type(o), o.group):
                continue
            touching = np.zeros(len(o), dtype=bool)
            for at in _ends(o, points):
                touching |= np.isin(at, list(alone))
            loose |= {(table, int(i)) for i in np.flatnonzero(touching & (o.use == Use.ACTIVE))}
        free[layout.position_columns(np.array(sorted(alone))).ravel()] = False
    factors = [np.ones(o.values.shape) for o in network.observations]
    for table, item in loose:
        factors[table][item] = _LOOSE
    return _Without(with_sigmas(replace(network, free=free), factors), keys, frozenset(loose))


def _hanging(network: Network, loose: set[Key], free: Mask) -> set[int]:
    """Free points of the plan that fewer than two sights of different ends still place."""
    layout = network.start.layout
    points = layout.count("point")
    others: dict[int, set[int]] = {}
    for table, o in enumerate(network.observations):
        keep = (o.use == Use.ACTIVE) & ~np.isin(
            np.arange(len(o)), [i for t, i in loose if t == table]
        )
        ends = list(_ends(o, points))
        for k, at in enumerate(ends):
            # two values of one sight, or a given coordinate, place a point as well as two sights
            apart = 2 if o.rows > 1 or len(ends) == 1 or not o.angular else 1
            for item in np.flatnonzero(keep):
                end = int(ends[1 - k][item]) if len(ends) == 2 else -1 - k
                seen = others.setdefault(int(at[item]), set())
                seen |= {end} if apart == 1 else {end, -100 - end}
    out = set()
    for k in range(points):
        columns = layout.position_columns(np.array([k])).ravel()[:2]
        if free[columns].any() and np.isfinite(network.start.points[k, :2]).all():
            out |= {k} if len(others.get(k, ())) < 2 else set()
    return out


def _redundancy(trial: Adjustment, loose: frozenset[Key]) -> int:
    """Redundancy of the values that still pull."""
    rows = trial.rows
    among = np.array(
        [(int(t), int(i)) in loose for t, i in zip(rows.table, rows.item, strict=True)], dtype=bool
    )
    return round(trial.dof - float(np.nansum(redundancy_numbers(weigh(trial))[among])))
