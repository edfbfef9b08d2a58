"""Joins all stations by their planes, and explains those that are not joined.

A pair that fits in several ways is not decided by itself; where one of its stations is joined with
others, their views may leave one way only. What stays open is described in words, with what would
decide it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.registration.alternatives import OpenPair, Witnesses, by_loops
from tribrach.registration.clouds.graph import CloudEdge
from tribrach.registration.clouds.likeness import Walls, likeness
from tribrach.registration.clouds.proposals import (
    Choice,
    all_pairs,
    promise_of,
    try_all,
    try_proposed,
)
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.planes.poses import (
    PairPoses,
    PlanePose,
    contradicted,
    decided,
    open_directions,
    pair_poses,
    with_rivals,
)
from tribrach.registration.pose_graph import GATES as LOOP
from tribrach.registration.pose_graph import Joint, PoseGraph, join
from tribrach.registration.views import Surroundings, merged, seen
from tribrach.sentences import Sentence, joined
from tribrach.units import GON


@dataclass(frozen=True)
class StationJoinGates:
    """When a pair of stations may be joined by its planes alone.

    Chosen by hand with test_plane_poses, test_tying.
    """

    #: a pair that no loop confirms has at most this share of points in empty space ...
    most_conflict: float = 0.03
    fewest_planes: int = 4  #: ... and at least so many common planes
    #: poses from targets may be wrong by this [m], [rad]
    known_m: float = 0.3
    known_rad: float = float(np.radians(1.0))
    #: in words: two places differ by a shift if they are turned by less [rad]
    shifted_rad: float = float(np.radians(1.0))
    #: in words: a direction is the height above this cosine, level below that one
    height_cosine: float = 0.9
    level_cosine: float = 0.2
    #: the reach of a station holds this share of what its planes cover
    radius_quantile: float = 0.9
    #: sigma of a pair by its planes over the gates of loops, where loops say which pair to try next
    loop_share: float = 0.125


GATES = StationJoinGates()

#: covariance of a pair by its planes where loops say which pair is tried next
_LOOSE = np.diag(np.square(GATES.loop_share * np.repeat([LOOP.gap_m, LOOP.turn_rad], 3)))


@dataclass(frozen=True, eq=False)
class PlaneRegistration:
    """Groups of stations that planes hold together."""

    #: poses of the stations of each group in the frame of the group, largest first
    groups: tuple[Mapping[str, Pose], ...]
    pairs: tuple[PairPoses, ...]  #: possible poses of every pair
    sentences: tuple[str, ...]  #: joints that were not used
    obstacles: Mapping[str, str]  #: why a station that is alone was not joined


def register_by_planes(
    stations: Sequence[Surroundings],
    progress: Callable[[int, int], None] = lambda done, total: None,
    further: Sequence[Joint] = (),
    known: Mapping[str, Pose] | None = None,
    *,
    doubtful: Sequence[OpenPair] = (),
    witnesses: Witnesses | None = None,
    choice: Choice = "proposed",
    pair: Callable[[Surroundings, Surroundings], PairPoses] = pair_poses,
) -> PlaneRegistration:
    """Find the relative poses of all stations from their planes.

    ``further`` are joints of clouds for instance: one that a pair has from its planes as well
    confirms it; if the two contradict each other neither is used. A joint that contradicts
    ``known`` poses needs a loop to be believed. At the places of ``doubtful`` pairs planes look as
    well, and ``witnesses`` decide between places that look alike. ``pair`` finds the possible poses
    of a pair, or recalls them.

    Pairs are tried as those of clouds are (:mod:`tribrach.registration.clouds.proposals`): more
    until all stations are joined, or every pair across their groups was tried.
    """
    names = [s.name for s in stations]
    by_name = {s.name: s for s in stations}
    known, witnesses = known or {}, witnesses or Witnesses()
    priors = {**witnesses.approximate, **known}
    pairs = _tried(stations, pair, progress, priors, witnesses.sigma.shift, choice)
    rivals = {open_.ends: open_ for open_ in doubtful}
    pairs = [_doubtful(by_name, p, rivals.get(p.ends)) for p in pairs]
    joints, clashes = _united([_joint(p) for p in pairs if p.sure], further)
    joints = [_doubted(joint, known) for joint in joints]
    graph = join(names, joints)
    sentences = [*clashes, *graph.sentences]
    while True:
        used = {joint.ends for joint in joints}
        chosen = _settled(by_name, [p for p in pairs if p.ends not in used], graph, witnesses)
        if not chosen:
            break
        for joint, what in chosen:
            joints.append(joint)
            sentences.append(
                f"{joint.first} and {joint.second} fit in several ways by their planes; {what} "
                "decides"
            )
        graph = join(names, joints)
    while True:
        more = _together(by_name, joints, graph)
        if more is None:
            break
        joints.append(more)
        graph = join(names, joints)
        group = next(group for group in graph.groups if more.first in group)
        sentences.append(
            f"{more.second} shares too few planes with any one station, but enough with several "
            f"of {', '.join(name for name in group if name != more.second)} together"
        )
    alone = [next(iter(group)) for group in graph.groups if len(group) == 1]
    obstacles = {name: _obstacle(by_name[name], pairs) for name in alone}
    return PlaneRegistration(graph.groups, tuple(pairs), tuple(sentences), obstacles)


def _tried(
    stations: Sequence[Surroundings],
    pair: Callable[[Surroundings, Surroundings], PairPoses],
    progress: Callable[[int, int], None],
    priors: Mapping[str, Pose],
    sigma: float,
    choice: Choice,
) -> list[PairPoses]:
    """What the pairs that are needed say, in the order of the stations."""
    number = {station.name: k for k, station in enumerate(stations)}
    found: dict[tuple[int, int], PairPoses] = {}

    def attempt(a: str, b: str) -> tuple[CloudEdge | None, int]:
        i, j = sorted((number[a], number[b]))
        tried = found[i, j] = pair(stations[i], stations[j])
        if not tried.sure:
            return None, 0
        return CloudEdge(tried.first, tried.second, tried.poses[0].pose, _LOOSE), 6

    def told(what: str, done: int, total: int | None) -> None:
        progress(done, total or done)

    names = list(number)
    if all_pairs(len(names), choice):
        try_all(names, attempt, told)
    else:
        walls = [_walls(station.planes) for station in stations]
        radii = {name: w.radius for name, w in zip(names, walls, strict=True)}
        promise = promise_of(names, likeness(walls), radii, priors, sigma)
        try_proposed(names, promise, radii, attempt, told)
    return [found[ends] for ends in sorted(found)]


def _walls(planes: PlaneSet) -> Walls:
    """What planes cover, as pieces of surface; the radius holds nine tenths of it."""
    counts = [len(sample) for sample in planes.samples]
    center = np.concatenate([np.zeros((0, 3)), *planes.samples])
    area = np.repeat(planes.area / np.maximum(counts, 1), counts)
    far = np.linalg.norm(center, axis=1)
    radius = float(np.quantile(far, GATES.radius_quantile)) if len(far) else 0.0
    return Walls(center, np.repeat(planes.normal, counts, axis=0), area, radius)


def _joint(pair: PairPoses, chosen: PlanePose | None = None) -> Joint:
    """A joint of the graph from the pose of a pair."""
    best = pair.poses[0] if chosen is None else chosen
    alone = best.seen.conflict <= GATES.most_conflict and len(best.pairs) >= GATES.fewest_planes
    return Joint(pair.first, pair.second, best.pose, float(best.seen.agree), alone)


def _united(joints: Sequence[Joint], further: Sequence[Joint]) -> tuple[list[Joint], list[str]]:
    """Joints of two kinds, one for each pair; pairs on which they contradict each other."""
    others = {j.ends: j for j in further}
    out, sentences = [], list[str]()
    for joint in joints:
        other = others.pop(joint.ends, None)
        if other is None:
            out.append(joint)
            continue
        left = joint.pose.inverse @ other.from_to(joint.first)
        gap = float(np.linalg.norm(left.translation))
        turn = float(np.arccos(np.clip((np.trace(left.rotation) - 1) / 2, -1, 1)))
        if gap < LOOP.gap_m and turn < LOOP.turn_rad:
            out.append(replace(joint, alone=True))
        else:
            sentences.append(
                Sentence(
                    "planes and clouds of {joint.first} and {joint.second} contradict each other "
                    "by {gap:2} m and {degrees:2} deg: neither joins them",
                    joint=joint,
                    gap=gap,
                    degrees=np.degrees(turn),
                )
            )
    return [*out, *others.values()], sentences


def _doubted(joint: Joint, known: Mapping[str, Pose]) -> Joint:
    """The joint, not to be believed by itself if known poses of both stations contradict it."""
    if joint.first not in known or joint.second not in known:
        return joint
    left = joint.pose.inverse @ known[joint.first].inverse @ known[joint.second]
    gap = float(np.linalg.norm(left.translation))
    turn = float(np.arccos(np.clip((np.trace(left.rotation) - 1) / 2, -1, 1)))
    return joint if gap < GATES.known_m and turn < GATES.known_rad else replace(joint, alone=False)


def _doubtful(
    stations: Mapping[str, Surroundings], pair: PairPoses, rivals: OpenPair | None
) -> PairPoses:
    """The pair with the places that its clouds leave open, where its planes do not exclude them."""
    if rivals is None or not pair.poses:
        return pair
    here = pair.first == rivals.first
    places = [pose if here else pose.inverse for pose in rivals.poses]
    return with_rivals(stations[pair.first], stations[pair.second], pair, places)


def _settled(
    stations: Mapping[str, Surroundings],
    pairs: Sequence[PairPoses],
    graph: PoseGraph,
    witnesses: Witnesses,
) -> list[tuple[Joint, str]]:
    """Pairs with several poses of which something leaves one, and what it is."""
    group_of = {name: group for group in graph.groups for name in group}
    across = [p for p in pairs if group_of[p.first] is not group_of[p.second]]
    several = [p for p in across if len(p.poses) > 1]
    for pair in several:
        found = witnesses.choose(_open(pair))
        left = None if found is None else (_pose_at(pair, found[0]), found[1])
        left = left or _by_views(stations, pair, group_of)
        if left is not None and not len(left[0].open):
            return [(replace(_joint(pair, left[0]), alone=True), left[1])]
    of = {pair.ends: pair for pair in several}
    looped = []
    for open_, pose in by_loops(graph.groups, [_open(pair) for pair in several]):
        pair = of[open_.ends]
        looped.append((replace(_joint(pair, _pose_at(pair, pose)), alone=True), "their loop"))
    return looped


def _open(pair: PairPoses) -> OpenPair:
    """The places of a pair."""
    return OpenPair(pair.first, pair.second, tuple(f.pose for f in pair.poses))


def _pose_at(pair: PairPoses, pose: Pose) -> PlanePose:
    """The fit of a pair at one of its places."""
    return next(f for f in pair.poses if f.pose is pose)


def _by_views(
    stations: Mapping[str, Surroundings],
    pair: PairPoses,
    group_of: Mapping[str, Mapping[str, Pose]],
) -> tuple[PlanePose, str] | None:
    """The only pose of a pair that the other stations of its groups leave."""
    one_group, other_group = group_of[pair.first], group_of[pair.second]
    if len(one_group) + len(other_group) < 3:
        return None
    here, there = merged(stations, one_group), merged(stations, other_group)
    trials = []
    for pose in pair.poses:
        between = one_group[pair.first] @ pose.pose @ other_group[pair.second].inverse
        trials.append(replace(pose, seen=seen(here, there, between)[0]))
    best = decided(trials)[0]
    if any(trial is not best and not contradicted(best, trial) for trial in trials):
        return None
    return best, "what the stations around see"


def _together(
    stations: Mapping[str, Surroundings], joints: Sequence[Joint], graph: PoseGraph
) -> Joint | None:
    """Two groups that no two of their stations hold together, but all of them do."""
    known = {joint.ends for joint in joints}
    for one, two in combinations(graph.groups, 2):
        if len(one) + len(two) < 3:
            continue
        pair = pair_poses(merged(stations, one), merged(stations, two))
        free = [(a, b) for a in one for b in two if frozenset((a, b)) not in known]
        if not pair.sure or not free:
            continue
        a, b = free[0]
        joint = _joint(pair)
        moved = one[a].inverse @ joint.pose @ two[b]
        if joint.alone:
            return replace(joint, first=a, second=b, pose=moved)
    return None


def _obstacle(station: Surroundings, pairs: Sequence[PairPoses]) -> str:
    """Why a station was not joined to any other."""
    own = open_directions(station.planes.normal)
    if len(own):
        return lacking_words(station, own)
    own_pairs = [p for p in pairs if station.name in (p.first, p.second)]
    several = [p for p in own_pairs if len(p.poses) > 1]
    if several:
        return _ways(station.name, max(several, key=lambda p: len(p.poses)))
    lacking = [p for p in own_pairs if p.lacking and len(p.open)]
    shared = [p for p in lacking if p.lacking == p.first and len(p.open) < 3]
    if shared and len(shared) == len(own_pairs) and not any(p.sure for p in own_pairs):
        pair = min(shared, key=lambda p: len(p.open))
        other = pair.second if pair.first == station.name else pair.first
        return Sentence(
            "the planes that it has in common with {other} leave open {along}; a plane "
            "across that direction that both see, a target or their clouds would hold it",
            other=other,
            along=_along(pair.open),
        )
    if any(p.sure for p in own_pairs):
        return "the pairs that it fits contradict the others, or nothing confirms them"
    return (
        f"none of its {len(station.planes)} planes lie on those of another station without putting "
        "surfaces where others look through: it overlaps with none, or too little"
    )


def _ways(name: str, pair: PairPoses) -> str:
    """A pair that fits in several ways, in words."""
    other = pair.second if pair.first == name else pair.first
    best, rival = pair.poses[0].pose, pair.poses[1].pose
    shift = best.translation - rival.translation
    turn = best.inverse @ rival
    angle = np.degrees(np.arccos(np.clip((np.trace(turn.rotation) - 1) / 2, -1, 1)))
    how = (
        Sentence("shifted by {length:2} m", length=np.linalg.norm(shift))
        if angle < np.degrees(GATES.shifted_rad)
        else Sentence("turned by {angle:0} deg", angle=angle)
    )
    return Sentence(
        "it fits on {other} in {ways} ways ({how} for instance: a repeated pattern or "
        "a symmetric room) and nothing that they see tells which; a target that both "
        "see, or a station that sees the end of the pattern, would",
        other=other,
        ways=len(pair.poses),
        how=how,
    )


def lacking_words(station: Surroundings, lacking: Array) -> str:
    """Describe the directions that planes of a station leave open, and what would close them."""
    count = len(station.planes)
    if count == 0:
        return "no plane was found in its scans; a target or an overlapping cloud would place it"
    kinds = 3 - len(lacking)
    return Sentence(
        "its {count} planes stand in only {kinds} independent direction{plural} and "
        "leave open {along}; a plane across that, a target or an overlapping cloud "
        "would hold it",
        count=count,
        kinds=kinds,
        plural="s" * (kinds > 1),
        along=_along(lacking),
    )


def _along(directions: Array) -> str:
    """Directions of a scanner's frame in words."""
    words = []
    for d in directions:
        if abs(d[2]) > GATES.height_cosine:
            words.append("its height")
            continue
        around = np.degrees(np.arctan2(d[1], d[0])) % 180 / 0.9
        level = "level " if abs(d[2]) < GATES.level_cosine else ""
        words.append(
            Sentence(
                "the shift {level}along H = {around:gon0} of its scan",
                level=level,
                around=around * GON,
            )
        )
    return joined(" and ", words)
