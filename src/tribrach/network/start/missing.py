"""Names the ties that are missing where start values cannot be found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Index
from tribrach.errors import InputError
from tribrach.geometry.alignment import kabsch, upright_rms
from tribrach.network.assembly import Assembly
from tribrach.network.defects import closed_elsewhere
from tribrach.network.network import Network
from tribrach.network.start.frame import Frame
from tribrach.network.start.space import placed_poses
from tribrach.observations.base import Observations, Use
from tribrach.observations.ties import TieTable
from tribrach.observations.unknowns import Layout, State
from tribrach.sentences import Sentence

#: sentences at most
_MOST_SENTENCES = 12
#: places of a network whose rank is asked for
_MODERATE = 100
#: what would place a point in plan, and in height
_CURES = {
    "plan": "a distance and a direction from a known station, a second direction from another "
    "one, or coordinates would place it",
    "height": "a levelled height difference, a zenith angle with a distance, or a given height "
    "would place it",
}


def missing_ties(network: Network, f: Frame, state: State) -> list[str]:
    """Describe each place or part of the network that could not be placed."""
    layout = state.layout
    positions = f.ties.n_positions
    known = f.known[:positions].copy()
    poses = layout.count("pose")
    known[positions - poses :] &= placed_poses(f)
    lost = np.flatnonzero(~known)
    tables = _tables(f)
    sentences: list[str] = []
    for members in _components(lost, tables, f.ties.n_nodes):
        if len(sentences) == _MOST_SENTENCES:
            sentences.append(f"and {len(lost)} places in all have no start values")
            break
        apart = len(members) > 1 and known.any() and not _touched(tables, members, known)
        if len(members) > 3 or apart:
            sentences.append(_part(network, f, members, tables, known))
        else:
            sentences += [_place(network, f, int(m), tables, known) for m in members]
    for family, name in state.missing():
        if family in ("plane", "scalar") and not sentences:
            sentences.append(f"{name} is tied to no placed station")
    return [*sentences, *left_out(network)]


def left_out(network: Network) -> list[str]:
    """What takes no part in a network, and why, for whoever reads that it cannot be adjusted."""
    groups: dict[str, list[tuple[Observations, int]]] = {}
    for o in network.observations:
        for i in np.flatnonzero(o.use == Use.OFF):
            if o.reason[i]:
                groups.setdefault(str(o.reason[i]), []).append((o, int(i)))
    return [
        f"{_counted([o.facts.title for o, _ in found])} {'takes' if len(found) == 1 else 'take'} "
        f"no part: {reason} ({network.describe(*found[0], network.start)}"
        f"{f' and {len(found) - 1} more' if len(found) > 1 else ''})"
        for reason, found in groups.items()
    ]


def _counted(titles: Sequence[str]) -> str:
    """Observations by kind: ``4 slope distances and 4 zenith angles``."""
    counts = Counter(titles)
    return " and ".join(f"{n} {title}{'s' if n > 1 else ''}" for title, n in counts.items())


def _tables(f: Frame) -> list[tuple[str, Index, Index]]:
    """Name, from-nodes and to-nodes of every sort of tie."""
    t = f.ties
    free = t.rays.set < t.n_scalars
    angles = ~free & (t.rays.set < t.north) & (t.rays.set >= t.n_scalars + len(f.turn))
    north = t.rays.set == t.north
    shot = t.pose_node(t.shots.pose)
    # rays, lengths and rises of levelled scanners are their shots once more
    of_pose = (t.lengths.start >= t.n_points) & np.isin(t.lengths.start, shot)
    length, rise = t.lengths[~of_pose], t.rises[~np.isin(t.rises.start, shot)]
    parts: list[tuple[str, TieTable]] = [
        ("direction", t.rays[free]),
        ("angle", t.rays[angles]),
        ("azimuth", t.rays[north]),
        ("distance", length),
        ("height difference", rise),
        ("zenith angle", t.zeniths),
        ("GNSS baseline", t.vectors),
    ]
    out = [(name, table.start, table.end) for name, table in parts]  # type: ignore[attr-defined]
    out.append(("target centre", shot, t.shots.target))
    out.append(("relative pose", t.pose_node(t.links.first), t.pose_node(t.links.second)))
    return out


def _components(lost: Index, tables: Sequence[tuple[str, Index, Index]], n: int) -> list[Index]:
    """Lost nodes that hang together through ties between lost nodes, largest part last."""
    start = np.concatenate([t[1] for t in tables])
    end = np.concatenate([t[2] for t in tables])
    number = np.full(n, -1)
    number[lost] = np.arange(len(lost))
    rows = (number[start] >= 0) & (number[end] >= 0)
    ones = np.ones(int(rows.sum()))
    graph = coo_array((ones, (number[start[rows]], number[end[rows]])), (len(lost), len(lost)))
    count, label = connected_components(graph, directed=False)
    return [lost[label == i] for i in range(count)]


def _noun(layout: Layout, node: int) -> str:
    is_pose = node >= layout.count("point")
    return f"{'station' if is_pose else 'point'} {layout.position_name(node)}"


def _figure(members: Index, layout: Layout, tables: Sequence[tuple[str, Index, Index]]) -> str:
    """What would fix a figure of places that nothing else places."""
    inside = set(members.tolist())
    kinds = {
        name: {int(a) for a in start if int(a) in inside}
        for name, start, _ in tables
        if any(int(a) in inside for a in start)
    }
    stations = set[int]().union(*kinds.values())
    if len(stations) == 1 and kinds.keys() <= {"angle", "direction"}:
        where = layout.position_name(stations.pop())
        return (
            f"all of them are taken at {where}, which is a station adjustment and no network; give "
            "coordinates or distances of its targets, or sights from another station"
        )
    return "give coordinates of two points, or of one with an azimuth and a distance"


def _touched(
    tables: Sequence[tuple[str, Index, Index]], members: Index, known: NDArray[np.bool_]
) -> bool:
    """True if an observation joins some places to any that are known."""
    inside = np.zeros(max(int(members.max()) + 1, len(known)), dtype=bool)
    inside[members] = True
    for _, start, end in tables:
        for a, b in ((start, end), (end, start)):
            rows = (a < len(known)) & (b < len(inside))
            if (known[a[rows]] & inside[b[rows]]).any():
                return True
    return False


def _part(
    network: Network,
    f: Frame,
    members: Index,
    tables: Sequence[tuple[str, Index, Index]],
    known: NDArray[np.bool_],
) -> str:
    """A part of more than three places and what ties it to the rest."""
    layout = network.start.layout
    names = [layout.position_name(int(m)) for m in members if m < len(known)]
    shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
    inside = np.zeros(max(int(members.max()) + 1, len(known)), dtype=bool)
    inside[members] = True
    shared: set[int] = set()
    for _, start, end in tables:
        for a, b in ((start, end), (end, start)):
            rows = (a < len(known)) & (b < len(inside))
            a_, b_ = a[rows], b[rows]
            shared |= set(a_[known[a_] & inside[b_]].tolist())
    if not known.any() and f.known_plan[members].any() and not f.known_up[members].any():
        return (
            f"{shown} hang together, but nothing tells the height of any of them, which slope "
            "distances need: give heights or zenith angles, or give the distances as horizontal "
            "ones"
        )
    if not known.any():
        return (
            f"{shown} are connected, but their observations do not fix a figure to start from: "
            f"{_figure(members, layout, tables)}"
        )
    if not shared:
        cure = "give coordinates of some of them"
        if f.known_plan[members].all():
            cure = "give the height of one of them"
        return (
            f"{shown} are connected, but no observation ties them to the rest of the network: "
            f"observe common points or {cure}"
        )
    ties = ", ".join(layout.position_name(i) for i in sorted(shared)[:4])
    heights = network.free[: 3 * layout.count("point")].reshape(-1, 3)[:, 2]
    in_plan = not heights.any() and not layout.count("pose")
    need = 2 if in_plan else 3
    if len(shared) < need:
        count = f"only {len(shared)} place{'s' if len(shared) != 1 else ''} ({ties})"
        needed = "2 common points" if in_plan else "3 common points (2 if the set-ups are levelled)"
        return f"{shown} are connected, but share {count} with the rest: {needed} are needed"
    near = [
        layout.position_name(node)
        for node in members.tolist()
        if node < len(known) and _touches(tables, node, shared)
    ]
    first = " or ".join(near[:3])
    if _open(network, f):
        return (
            f"{shown} are connected and share {len(shared)} places ({ties}) with the rest, but "
            "their observations leave them open wherever they lie: observe more between them, or "
            f"give coordinates, first of {first}"
        )
    return (
        f"{shown} are connected and share {len(shared)} places ({ties}) with the rest, but no "
        "figure of theirs can be put together from nothing: give a rough coordinate of one of "
        f"them, first of {first}"
    )


def _open(network: Network, f: Frame) -> bool:
    """True if a network of moderate size that hangs on control has a rank defect everywhere."""
    if network.datum.kind != "control" or f.ties.n_positions > _MODERATE:
        return False
    return not closed_elsewhere(Assembly(network), network.start)


def _touches(tables: Sequence[tuple[str, Index, Index]], node: int, places: set[int]) -> bool:
    """True if an observation joins a node to one of some places."""
    return any(
        bool(set(end[start == node].tolist()) & places)
        or bool(set(start[end == node].tolist()) & places)
        for _, start, end in tables
    )


def _place(
    network: Network,
    f: Frame,
    node: int,
    tables: Sequence[tuple[str, Index, Index]],
    known: NDArray[np.bool_],
) -> str:
    """A single place: what observes it, and what would place it."""
    layout = network.start.layout
    noun = _noun(layout, node)
    if node >= layout.count("point"):
        sentence = _scanner(f, node, noun, known)
        if sentence:
            return sentence
    phrases = [
        _phrase(layout, name, start, end, node)
        for name, start, end in tables
        if ((start == node) | (end == node)).any()
    ]
    plan = bool(f.known_plan[node])
    what = "the height of " + noun if plan else noun
    cure = _CURES["height" if plan else "plan"]
    if off := _off(network, node):
        cure = f"unused, see why below: {off}"
    if not phrases:
        return f"{noun} is observed by nothing{_of_no_use(network, f, node)}; {cure}"
    return f"{what} is observed only by {' and '.join(phrases)}; {cure}"


def _of_no_use(network: Network, f: Frame, node: int) -> str:
    """What observes a place without a tie to it: `` that gives start values: 6 components``."""
    counts: dict[str, int] = {}
    shift = {"point": 0, "position": 0, "pose": f.ties.n_points}
    for o in [*network.observations, *(x.observations for x in network.constraints)]:
        refers = np.zeros(len(o), dtype=bool)
        for reference in o.references():
            if reference.family in shift:
                index = getattr(o, reference.name)
                refers |= (index >= 0) & (index + shift[reference.family] == node)
        count = int((refers & (o.use == Use.ACTIVE)).sum())
        if count:
            counts[o.facts.title] = counts.get(o.facts.title, 0) + count
    if not counts:
        return ""
    if f.known[node]:
        part = " of its rotation"
    else:
        part = " of its height" if f.known_plan[node] else " in plan" if f.known_up[node] else ""
    return f" that gives start values{part}: {' and '.join(map(_count, counts, counts.values()))}"


def _off(network: Network, node: int) -> str:
    """Kinds of observations of a place that are off; empty without any."""
    name = network.start.layout.position_name(node)
    titles = [
        o.facts.title
        for o in network.observations
        for item in np.flatnonzero(o.use == Use.OFF)
        if name in o.ends(network.start.layout)[int(item)]
    ]
    return _counted(titles) if titles else ""


def _count(title: str, number: int) -> str:
    """``one direction`` or ``3 directions``."""
    return f"one {title}" if number == 1 else f"{number} {title.removesuffix('s')}s"


def _scanner(f: Frame, node: int, noun: str, known: NDArray[np.bool_]) -> str:
    """Common targets of a scanner station; empty if it sees none at all."""
    pose = node - f.ties.n_points
    targets = np.unique(f.ties.shots.target[f.ties.shots.pose == pose])
    if len(targets) == 0:
        return ""
    targets = targets[targets < len(known)]
    targets = targets[known[targets]]
    shared = len(targets)
    misfit = _misfit(f, pose, targets) if shared else ""
    if misfit:
        return Sentence(
            "{noun} does not fit its {shared} common targets: {misfit}",
            noun=noun,
            shared=shared,
            misfit=misfit,
        )
    level = bool(f.ties.levelled[pose])
    need = "2 common targets" if level else "3 common targets (2 if levelled) not on one line"
    few = f"only {shared} target{'s' if shared != 1 else ''}" if shared else "no target"
    return f"{noun} shares {few} with the rest: {need} are needed"


def _misfit(f: Frame, pose: int, targets: Index) -> str:
    """Why a scanner with enough common targets could not be placed; empty if it has too few."""
    shots = f.ties.shots
    rows = (shots.pose == pose) & np.isin(shots.target, targets)
    try:
        local, world = shots.u[rows], f.space(shots.target[rows])
        fit, upright = kabsch(local, world), upright_rms(local, world)
    except InputError:
        return ""
    return fit.hint(upright) or (
        Sentence(
            "residuals of {fit.rms:mg3} (root mean square of all, none left out by a "
            "limit) remain; check the names of its targets",
            fit=fit,
        )
    )


def _phrase(layout: Layout, name: str, start: Index, end: Index, node: int) -> str:
    """``one direction from S1`` or ``3 distances from A, B, C``."""
    others = [int(i) for i in np.unique(start[end == node])]
    onwards = [int(i) for i in np.unique(end[start == node])]
    total = int((end == node).sum() + (start == node).sum())

    def names(nodes: list[int]) -> str:
        shown = [layout.position_name(i) for i in nodes[:3]]
        return ", ".join(shown) + (" and others" if len(nodes) > 3 else "")

    parts = [f"from {names(others)}"] if others else []
    parts += [f"to {names(onwards)}"] if onwards else []
    return f"{_count(name, total)} {' and '.join(parts)}"
