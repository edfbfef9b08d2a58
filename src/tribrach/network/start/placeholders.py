"""Finds given coordinates that cannot be: placeholders that were keyed in to begin a job.

Jobs of total stations are often begun with dummy coordinates: the same at every set-up, or 1, 1 and
2, 2 and 5, 5. Start values and datum must not come from them. Equal ones are told by lengths alone.
Others are told by the free network, which needs no given coordinate: what no shift and turn brings
near the given coordinates contradicts the sights (method section 3.4).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.errors import TribrachError
from tribrach.network.network import Datum, Network, is_given
from tribrach.network.solved import SolvedSystem
from tribrach.network.start.gather import gather
from tribrach.network.start.start_values import find_start
from tribrach.network.start.ties import Ties
from tribrach.observations.base import Use
from tribrach.observations.declaration import End, StartTie
from tribrach.sentences import Sentence

#: coordinates that agree to this are the same [m]
_SAME = 5e-4
#: lengths that tell two places apart [m]
_APART = 1.0
#: names that a sentence lists
_NAMED = 8
#: what a keyed coordinate may be off: metres, share of the size of the network, sigmas
_METRES, _SHARE, _SIGMAS = 1.0, 1e-3, 100.0
#: what a height may be off [m]: heights that are none follow the terrain
_HIGH = 0.3
#: share of the size of the network up to which coordinates are rough, and no placeholders
_ROUGH = 0.2
#: a free network with a larger variance factor tells nothing
_MISFIT = 25.0
#: how much better than any other pair two points must agree
_BY_CHANCE = 0.1
#: an international foot [m]
_FOOT = 0.3048
#: kinds that tell how long anything is
_METRIC = (StartTie.LENGTH, StartTie.VECTOR, StartTie.SHOT, StartTie.FIX, StartTie.LINK)
#: pairs of points by which the two figures are laid onto each other, at most
_PAIRS = 400
#: points among which exchanged names are looked for
_EXCHANGED = 12


def dummy_places(network: Network, places: Mapping[str, Array]) -> list[tuple[str, ...]]:
    """Find names that share coordinates although the observations put metres between them.

    A length between two of them says it, or two lengths to a common target that differ by more.

    ``network``: tells by its lengths and vectors what lies apart; ``places``: e, N, U (3,) by the
    name of a point [m].
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


def listed(names: tuple[str, ...]) -> str:
    """Names in a sentence, the first of many."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def dummy_words(groups: list[tuple[str, ...]]) -> str:
    """One sentence on names whose coordinates are not used."""
    names = tuple(name for group in groups for name in group)
    where = "the same coordinates" if len(groups) == 1 else "the same coordinates in groups"
    return (
        f"Points {listed(names)} are given {where}, while the observations put "
        "metres between them: these coordinates are placeholders and are not used; give real ones "
        "where the network is to be tied to a frame."
    )


@dataclass(frozen=True)
class Contradiction:
    """Given coordinates of points that no shift and turn brings near the places of a network."""

    #: points whose coordinates contradict the sights, and those that agree with each other
    off: tuple[str, ...]
    kept: tuple[str, ...]
    heights: tuple[str, ...]  #: points that agree in plan, with heights that do not
    #: two of the points, and how far apart they are given and are [m]
    pair: tuple[str, str]
    given: float
    found: float
    #: the free network, and its places (points, 3) in the frame of those that agree; NaN for none
    solved: SolvedSystem
    places: Array

    def sentence(self) -> str:
        """Sentence on coordinates not used, with the pair that shows it best."""
        out = []
        if self.off:
            out.append(
                Sentence(
                    "The given coordinates of {off} contradict the sights ({a} and {b} are given "
                    "{own.given:1} m apart and are {own.found:1} m apart): they are placeholders "
                    "or keyed wrongly, and are not used.",
                    own=self,
                    off=listed(self.off),
                    a=self.pair[0],
                    b=self.pair[1],
                )
            )
        if self.heights:
            out.append(
                Sentence(
                    "The given heights of {points} contradict the sights: they are not used.",
                    points=listed(self.heights),
                )
            )
        return " ".join(out) if len(out) > 1 else out[0]


def contradiction(
    network: Network,
    places: Mapping[str, Array],
    solve: Callable[[Network], SolvedSystem],
    *,
    rough: bool = False,
) -> Contradiction | None:
    """Compare given coordinates with the places that the observations alone put together.

    ``network``: its points may have start values, be held or be weighted; ``places``: e, N, U (3,)
    by the name of a point [m]; U may be NaN; ``rough``: the coordinates are approximate: only what
    is off by a share of the network is a contradiction. Returns None if nothing contradicts, or if
    the observations alone give no figure that fits.
    """
    layout, seen = network.start.layout, _observed(network)
    names = [
        n
        for n, xyz in places.items()
        if np.isfinite(xyz[:2]).all() and layout.has("point", n) and seen[layout.index("point", n)]
    ]
    if len(names) < 2:
        return None
    index = np.array([layout.index("point", n) for n in names])
    given = np.array([places[n] for n in names])
    figure = _figure(network, index, given, solve, rough)
    if figure is None:
        return None
    free, solved = figure
    scaled = _scaled(free)
    factor = max(solved.posterior_factor, 1.0) if solved.dof > 0 else 1.0
    if factor > _MISFIT:
        return None
    figure = solved.state.points[index]
    columns = layout.columns("point", index)
    blocks = solved.cofactor.blocks(solved.reduced[columns])
    sigma = np.sqrt(np.maximum(np.diagonal(blocks, axis1=1, axis2=2), 0.0) * factor)
    limits = np.maximum(_limits(figure, rough), _SIGMAS * sigma[:, :2].max(axis=1))
    good, turn, shift = _agreeing(given, figure, limits, scaled)
    if not _handed(free):
        mirrored = figure * (-1, 1, 1)
        other = _agreeing(given, mirrored, limits, scaled)
        if other[0].sum() > good.sum():
            (good, turn, shift), figure = other, mirrored
            turn = turn * (-1, 1)
    if not (good.all() or rough) and (swapped := _exchanged(given, figure, limits, scaled)):
        good, turn, shift = swapped
    if not good.any() and (
        _as_a_whole(given, figure, scaled) or _in_another_unit(given, figure, limits)
    ):
        return None
    level = np.maximum(_HIGH, _SIGMAS * sigma[:, 2])
    high = good & ~_same_heights(given, figure, level, good)
    # heights that nothing observes contradict nothing
    high &= solved.reduced[columns[:, 2]] >= 0
    if rough:
        high[:] = False
    if good.all() and not high.any():
        return None
    moved = np.full((layout.count("point"), 3), np.nan)
    if good.any():
        moved = solved.state.points.copy()
        moved[:, :2] = moved[:, :2] @ turn.T + shift
        agree = good & ~high & np.isfinite(given[:, 2])
        moved[:, 2] += np.median((given - figure)[agree, 2]) if agree.any() else np.nan
    pair, apart, true = _worst_pair(given, figure, good)
    return Contradiction(
        tuple(np.array(names)[~good].tolist()),
        tuple(np.array(names)[good].tolist()),
        tuple(np.array(names)[high].tolist()),
        (names[pair[0]], names[pair[1]]),
        apart,
        true,
        solved,
        moved,
    )


def _observed(network: Network) -> Mask:
    """Points (n,) that observations tell something of."""
    out = np.zeros(network.start.layout.count("point"), dtype=bool)
    for o in network.observations:
        for reference in o.references():
            if reference.family in ("point", "position") and not is_given(type(o), o.group):
                at = np.asarray(getattr(o, reference.name))[o.use == Use.ACTIVE]
                out[at[(at >= 0) & (at < len(out))]] = True
    return out


def _figure(
    network: Network,
    index: Index,
    given: Array,
    solve: Callable[[Network], SolvedSystem],
    rough: bool,
) -> tuple[Network, SolvedSystem] | None:
    """The free network and its solution; None if there is none, or if nothing contradicts it."""
    # heights that are held come free as well, unless nothing observes them
    for heights in (True, False):
        free = unplaced(network, index, heights=heights)
        try:
            start = find_start(free)
            figure = start.points[index]
            near = _agreeing(given, figure, _limits(figure, rough), _scaled(free))[0].all()
            if near and (rough or _same_heights(given, figure, np.full(len(index), _HIGH)).all()):
                return None
            return free, solve(free.with_start(start))
        except TribrachError:
            continue
    return None


def unplaced(network: Network, index: Index, *, heights: bool = True) -> Network:
    """The network without the given coordinates of some points, free to move in plan.

    heights : the points are free to move in height as well, where other points are.
    """
    layout = network.start.layout
    points, free = network.start.points.copy(), network.free.copy()
    flat = layout.columns("point", index)
    if heights and free[2 : points.size : 3].any():
        free[flat[:, 2]] = True
    sought = free[flat[:, 2]]
    points[index, :2] = np.nan
    points[index[sought], 2] = np.nan
    free[flat[:, :2].ravel()] = True
    keys = []
    for table, o in enumerate(network.observations):
        at = o.end_field(End.AT)
        if is_given(type(o), o.group) and at is not None and at.family == "position":
            there = np.isin(np.asarray(getattr(o, at.name)), index)
            keys += [(table, int(k)) for k in np.flatnonzero(there & (o.use == Use.ACTIVE))]
    freed = network.switched(keys, Use.OFF, "tried without it") if keys else network
    start = replace(network.start, points=points)
    held = ~free[: points.size].reshape(-1, 3)[:, :2]
    held &= np.isfinite(points[:, :2])
    datum = Datum("control" if held.any() else "free")
    return replace(freed, free=free, start=start, datum=datum)


def _handed(network: Network) -> bool:
    """True if an observation tells a figure from its mirror image."""
    return any(
        o.facts.start not in (StartTie.LENGTH, StartTie.RISE, StartTie.ZENITH)
        and not is_given(type(o), o.group)
        and bool((o.use == Use.ACTIVE).any())
        for o in network.observations
    )


def _scaled(network: Network) -> bool:
    """True if an observation tells how long anything is."""
    return any(
        o.facts.start in _METRIC
        and not is_given(type(o), o.group)
        and bool((o.use == Use.ACTIVE).any())
        for o in network.observations
    )


def _limits(figure: Array, rough: bool) -> Array:
    """How far (n,) points may be off in plan [m]."""
    size = float(np.hypot(*(figure[:, :2] - figure[:, :2].mean(axis=0)).T).max())
    return np.full(len(figure), max(_METRES, _ROUGH * size) if rough else _METRES + _SHARE * size)


def _agreeing(
    given: Array, figure: Array, limits: Array, scaled: bool
) -> tuple[Mask, Array, Array]:
    """The points (n,) that most agree, and turn (2, 2) and shift (2,) onto the given ones.

    None of them where only two agree and two others do nearly as well.
    """
    a, b = figure[:, :2], given[:, :2]
    pairs = np.array(list(combinations(range(len(a)), 2)) if len(a) < 40 else [])
    if len(a) >= 40:
        pairs = np.random.default_rng(0).integers(0, len(a), (_PAIRS, 2))
        pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    pairs = pairs[:: max(1, len(pairs) // _PAIRS)]
    first, second = pairs.T
    # as complex numbers a turn with a scale is one factor
    u, v = a @ (1, 1j), b @ (1, 1j)
    with np.errstate(all="ignore"):
        factor = (v[second] - v[first]) / (u[second] - u[first])
        stretch = np.abs(factor)
        factor = factor if not scaled else factor / stretch
        middle = (u[first] + u[second]) / 2, (v[first] + v[second]) / 2
        # two places that coincide give no factor, and nothing that is near
        left = np.abs(v - (middle[1][:, None] + factor[:, None] * (u - middle[0][:, None])))
    inside = np.nan_to_num(left, nan=np.inf) <= limits
    count = inside.sum(axis=1)
    most = int(count.max(initial=0))
    none = np.zeros(len(a), dtype=bool), np.eye(2), np.zeros(2)
    least = 2 if scaled else 3
    if most < least:
        return none
    best = np.flatnonzero(count == most)
    sums = np.where(inside[best], left[best], 0.0).sum(axis=1)
    k = best[np.argmin(sums)]
    others = sums[(inside[best] != inside[k]).any(axis=1)]
    # two may agree by chance, but hardly as well as two that belong together
    if most == least < len(a) and len(others) and sums.min() > _BY_CHANCE * others.min():
        return none
    f = factor[k]
    turn = np.array([[f.real, -f.imag], [f.imag, f.real]])
    good = inside[k]
    return good, turn, b[good].mean(axis=0) - a[good].mean(axis=0) @ turn.T


def _exchanged(
    given: Array, figure: Array, limits: Array, scaled: bool
) -> tuple[Mask, Array, Array] | None:
    """As :func:`_agreeing`, without the only two points that, exchanged, let all agree."""
    found = []
    if 2 < len(given) <= _EXCHANGED:
        for i, j in combinations(range(len(given)), 2):
            other = given.copy()
            other[[i, j]] = other[[j, i]]
            good, turn, shift = _agreeing(other, figure, limits, scaled)
            if good.all():
                good[[i, j]] = False
                found.append((good, turn, shift))
    return found[0] if len(found) == 1 else None


def _as_a_whole(given: Array, figure: Array, scaled: bool) -> bool:
    """True if coordinates that do not agree still have the shape of the figure, roughly."""
    a, b = ((x[:, :2] - x[:, :2].mean(axis=0)) @ (1, 1j) for x in (figure, given))
    factor = np.vdot(a, b) / np.vdot(a, a)
    if scaled:
        factor /= max(abs(factor), 1e-12)
    if len(a) == 2:
        ratio = abs(b[1] - b[0]) / abs(a[1] - a[0])
        return bool(1 - _ROUGH < ratio < 1 + _ROUGH) or not scaled
    return float(np.abs(b - factor * a).max()) < _ROUGH * float(np.abs(a).max())


def _in_another_unit(given: Array, figure: Array, limits: Array) -> bool:
    """True if the coordinates agree but for a scale, that of feet where there are two."""
    if len(given) > 2:
        return bool(_agreeing(given, figure, limits, scaled=False)[0].all())
    a, b = (np.hypot(*(x[1] - x[0])[:2]) for x in (figure, given))
    return bool(min(abs(b / a * f - 1) for f in (_FOOT, 1 / _FOOT)) < 0.01)


def _same_heights(given: Array, figure: Array, limits: Array, among: Mask | None = None) -> Mask:
    """Points (n,) whose heights agree with those of most, or are not given."""
    off = given[:, 2] - figure[:, 2]
    counts = np.isfinite(off) if among is None else np.isfinite(off) & among
    if not counts.any():
        return np.ones(len(off), dtype=bool)
    near = np.abs(off[counts][:, None] - off[counts]) <= limits[counts]
    if near.sum(axis=1).max() < 2 and counts.sum() > 1:
        return ~np.isfinite(off)
    centre = off[counts][int(near.sum(axis=1).argmax())]
    return np.asarray(~np.isfinite(off) | (np.abs(off - centre) <= limits))


def _worst_pair(given: Array, figure: Array, good: Mask) -> tuple[tuple[int, int], float, float]:
    """The pair whose distance is most off, its given and its true length [m]."""
    d = [
        np.abs(x[:, None] - x) for x in (given[:, :2] @ (1, 1j), figure[:, :2] @ (1, 1j))
    ]  # fmt: skip
    apart = np.abs(d[0] - d[1])
    apart[np.ix_(good, good)] = -1.0
    i, j = sorted(map(int, np.unravel_index(int(np.argmax(apart)), apart.shape)))
    return (i, j), float(d[0][i, j]), float(d[1][i, j])


def without_dummies(network: Network) -> Network:
    """Drop start values that cannot be, with a warning, also from the datum."""
    places = _approximate(network)
    groups = dummy_places(network, places) if len(places) > 1 else []
    if not groups:
        return network
    return _dropped(network, [n for group in groups for n in group], dummy_words(groups))


def misplaced(network: Network, solved: SolvedSystem) -> bool:
    """True if a free network lies far from start values that were given for its datum."""
    if network.datum.kind != "free" or not network.start.missing():
        return False
    places = _approximate(network)
    index = [network.start.layout.index("point", n) for n in places]
    if len(index) < 2:
        return False
    there = solved.state.points[index]
    off = np.abs(there[:, :2] - np.array(list(places.values()))[:, :2])
    return bool((off.max(axis=1) > _limits(there, rough=True)).any())


def without_placeholders(
    network: Network, solve: Callable[[Network], SolvedSystem]
) -> Network | None:
    """Drop start values that contradict the sights; None if no value does."""
    if not network.start.missing():
        return None
    found = contradiction(network, _approximate(network), solve, rough=True)
    if found is None:
        return None
    return _dropped(network, [*found.off, *found.heights], found.sentence())


def _approximate(network: Network) -> dict[str, Array]:
    """Start values of points (3,) that are neither held nor weighted, by name."""
    start, layout = network.start, network.start.layout
    free = network.free[: start.points.size].reshape(-1, 3)[:, :2]
    weighted = np.zeros(len(start.positions), dtype=bool)
    for o in network.observations:
        at = o.end_field(End.AT)
        if is_given(type(o), o.group) and at is not None and at.family == "position":
            weighted[np.asarray(getattr(o, at.name))] = True
    usable = (free & np.isfinite(start.points[:, :2])).all(axis=1)
    chosen = np.flatnonzero(usable & ~weighted[: len(start.points)])
    return {layout.names["point"][k]: start.points[k] for k in chosen}


def _dropped(network: Network, names: list[str], words: str) -> Network:
    """The network without the start values of some points, also in its datum."""
    start, layout = network.start, network.start.layout
    index = np.array([layout.index("point", name) for name in names])
    points = start.points.copy()
    points[index] = np.where(network.free[layout.columns("point", index)], np.nan, points[index])
    datum = network.datum
    components = datum.components
    if components is not None:
        components = components.copy()
        components[layout.columns("point", index).ravel()] = False
        components = components if components.any() else None
    kept = tuple(name for name in datum.names if name not in set(names))
    if datum.kind == "free":
        datum = Datum("free", kept if len(kept) > 1 else (), components)
    return replace(
        network,
        start=replace(start, points=points),
        datum=datum,
        warnings=(*network.warnings, words),
    )
