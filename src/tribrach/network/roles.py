"""What is each unknown for: which points carry the frame, what a scalar means and measures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tribrach.instruments.calibration import unit_of
from tribrach.network.facts import AssumedSigmas, facts_of
from tribrach.network.network import axes_in_use, is_given
from tribrach.network.solved import SolvedSystem
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import IndexField

#: what a point is in the adjustment
Role = Literal["control", "free", "check"]


def used_axes(adjustment: SolvedSystem) -> NDArray[np.bool_]:
    """Which of E, N, U (3,) the network has: free somewhere, or given and not zero."""
    layout = adjustment.layout
    free = adjustment.network.free
    points = free[: 3 * layout.count("point")].reshape(-1, 3).any(axis=0)
    given = (np.nan_to_num(adjustment.network.start.points) != 0).any(axis=0)
    network = adjustment.network
    tables = [*network.observations, *(c.observations for c in network.constraints)]
    telling = [o for o in tables if not is_given(type(o), o.group)]
    observed = axes_in_use((o.observed_axes(vars(o)) for o in telling), network.site)
    out: NDArray[np.bool_] = points | (given & observed) | (layout.count("pose") > 0)
    return out


def held_axes(adjustment: SolvedSystem) -> dict[str, NDArray[np.bool_]]:
    """Which of E, N, U (3,) are held at given values, of points that have any such coordinate."""
    layout = adjustment.layout
    held = ~adjustment.network.free[: 3 * layout.count("point")].reshape(-1, 3)
    held &= used_axes(adjustment)
    names = layout.names["point"]
    return {names[k]: held[k] for k in np.flatnonzero(held.any(axis=1))}


def held_names(adjustment: SolvedSystem) -> tuple[str, ...]:
    """Points that have a coordinate held at a given value."""
    return tuple(held_axes(adjustment))


def _held_words(adjustment: SolvedSystem) -> list[str]:
    """Points that are held without error, by the axes that are."""
    used = used_axes(adjustment)
    groups: dict[tuple[bool, ...], list[str]] = {}
    for name, axes in held_axes(adjustment).items():
        groups.setdefault(tuple(axes.tolist()), []).append(name)
    out = []
    alone: dict[tuple[bool, ...], str] = {
        (True, True, False): " in plan alone",
        (False, False, True): " in height alone",
    }
    for held, names in groups.items():
        which = " in " + ", ".join(axis for axis, known in zip("ENU", held, strict=True) if known)
        words = "" if (np.array(held) == used).all() else alone.get(held, which)
        out.append(f"{_listed(tuple(names))} held without error{words}")
    return out


def given_coordinates(adjustment: SolvedSystem) -> list[Observations]:
    """Tables of given coordinates: control and check points with a covariance."""
    tables = adjustment.network.observations
    return [o for o in tables if o.group == "control" or o.facts.listed_as_control]


def joined_positions(adjustment: SolvedSystem) -> tuple[tuple[str, str], ...]:
    """Pairs of positions joined by an observation that takes part, each pair once."""
    layout = adjustment.layout
    known = {*layout.names["point"], *layout.names["pose"]}
    pairs: dict[tuple[str, str], None] = {}
    for o in adjustment.network.observations:
        active = o.use == Use.ACTIVE
        start, end = o.end_names(layout)
        for a, b in dict.fromkeys(zip(start[active], end[active], strict=True)):
            if a in known and b in known:
                pairs[(a, b) if a <= b else (b, a)] = None
    return tuple(pairs)


def weighted_names(adjustment: SolvedSystem) -> tuple[str, ...]:
    """Points whose coordinates are observed and take part."""
    out: dict[str, None] = {}
    for o in given_coordinates(adjustment):
        ends = o.ends(adjustment.layout)
        out |= {ends[i][0]: None for i in np.flatnonzero(o.use == Use.ACTIVE)}
    return tuple(out)


def point_roles(adjustment: SolvedSystem) -> dict[str, Role]:
    """By name the points that are control or check; the others are free."""
    in_plan = used_axes(adjustment)[:2].any()
    # held in height alone, a point is no control where places in plan are adjusted
    roles: dict[str, Role] = {
        name: "control"
        for name, axes in held_axes(adjustment).items()
        if axes[:2].any() or not in_plan
    }
    for o in given_coordinates(adjustment):
        for (name, _), use in zip(o.ends(adjustment.layout), o.use, strict=True):
            if use == Use.ACTIVE:
                roles[name] = "control"
            elif use == Use.CHECK:
                roles.setdefault(name, "check")
    return roles


def unknown_references(
    adjustment: SolvedSystem, family: str
) -> Iterator[tuple[Observations, IndexField, int, int]]:
    """Table, field, unknown and first observation wherever a table refers to a family."""
    for o in adjustment.network.observations:
        for reference in o.references():
            if reference.family == family and len(o):
                index = getattr(o, reference.name).reshape(len(o), -1)
                used, first = np.unique(index, return_index=True)
                for i, flat in zip(used.tolist(), first.tolist(), strict=True):
                    if i >= 0:
                        yield o, reference, i, flat // index.shape[1]


def scalar_roles(adjustment: SolvedSystem) -> dict[int, tuple[str, str, str]]:
    """Unit, role and place of each scalar index, from the first observation that refers to it."""
    out: dict[int, tuple[str, str, str]] = {}
    ends: dict[int, list[tuple[str, str]]] = {}
    for o, reference, i, item in unknown_references(adjustment, "scalar"):
        if not reference.means or i in out:
            continue
        if reference.by_set and id(o) not in ends:
            ends[id(o)] = o.ends(adjustment.layout)
        # the name of a calibration parameter says its unit
        unit = reference.unit or unit_of(adjustment.layout.names["scalar"][i].split("(")[0])
        out[i] = unit, reference.means, ends[id(o)][item][0] if reference.by_set else ""
    return out


def _carriers(adjustment: SolvedSystem) -> tuple[str, ...]:
    """Names of the points and stations that a mask of datum components marks."""
    mask, layout = adjustment.network.datum.components, adjustment.layout
    if mask is None:
        return ()
    position = np.arange(layout.count("point") + layout.count("pose"))
    carries = mask[layout.position_columns(position)].any(axis=1)
    return tuple(layout.position_name(int(i)) for i in np.flatnonzero(carries))


def datum_names(adjustment: SolvedSystem) -> tuple[str, ...]:
    """Points and stations that carry the datum; empty where all of them do."""
    if adjustment.defect:
        return adjustment.network.datum.names or _carriers(adjustment)
    return held_names(adjustment) + weighted_names(adjustment)


def datum_sentence(adjustment: SolvedSystem) -> str:
    """The datum in a sentence."""
    if adjustment.defect:
        names = datum_names(adjustment)
        who = _listed(names) if names else f"all {_positions(adjustment)}"
        motions = f"{adjustment.defect} open motion" + "s" * (adjustment.defect != 1)
        return (
            f"Free network: inner constraints over {who} close {motions}; the standard "
            "deviations of coordinates hold in this datum only."
        )
    held, weighted = held_names(adjustment), weighted_names(adjustment)
    parts = _held_words(adjustment)
    assumed = {name for fact in assumed_sigmas(adjustment) for name in fact.points}
    for words, some in (
        ("given", tuple(name for name in weighted if name not in assumed)),
        ("assumed", tuple(name for name in weighted if name in assumed)),
    ):
        if some:
            parts.append(f"{_listed(some)} weighted by {words} covariances")
    if not parts:
        parts.append("no control point, the observations themselves fix the frame")
    nouns = {"fixed": "Fixed points", "free": "Inner constraints were asked for but none is needed"}
    kind = adjustment.network.datum.kind
    noun = nouns.get(kind, "Control" if held or weighted else "Observations")
    return f"{noun}: {'; '.join(parts)}."


def assumed_sigmas(adjustment: SolvedSystem) -> list[AssumedSigmas]:
    """Assumed sigmas of coordinates stated without sigmas."""
    weighted = set(weighted_names(adjustment))
    found = facts_of(adjustment.network.facts, AssumedSigmas)
    return [one for one in found if one.assumed and not weighted.isdisjoint(one.points)]


def _positions(adjustment: SolvedSystem) -> str:
    """What there is in a network: points, stations, or both."""
    families = {"points": "point", "stations": "pose"}
    there = [words for words, name in families.items() if adjustment.layout.count(name)]
    return " and ".join(there)


def _listed(names: tuple[str, ...], most: int = 12) -> str:
    """Names in a sentence, shortened when there are many."""
    if len(names) > most:
        return ", ".join(names[:most]) + f" and {len(names) - most} more"
    return ", ".join(names)
