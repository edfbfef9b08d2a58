"""Joins stations by relative poses that loops do not contradict.

Joints that several loops confirm are believed. A loop that does not close costs the joint that
nothing else confirms: of several the ones that cannot stand alone, or all, since none is better
than another. A joint in no loop at all rests on the agreement of its own two views. Poses are in
the frame of the first station of their group until something ties the group to the world.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tribrach.geometry.pose import Pose
from tribrach.sentences import Sentence


@dataclass(frozen=True)
class LoopGates:
    """When a loop of three relative poses closes; longer ones by the root of their number.

    Chosen by hand with test_pose_graph, test_plane_poses.
    """

    #: gap [m] and turn [rad] that a good loop may leave
    gap_m: float = 0.05
    turn_rad: float = float(np.radians(0.25))


GATES = LoopGates()


@dataclass(frozen=True, eq=False)
class Joint:
    """A relative pose of two stations."""

    #: names of the stations
    first: str
    second: str
    pose: Pose  #: first from second
    strength: float  #: what it is worth among others
    alone: bool = True  #: true if it is good enough without any loop that confirms it

    @property
    def ends(self) -> frozenset[str]:
        """Names of both stations."""
        return frozenset((self.first, self.second))

    def from_to(self, start: str) -> Pose:
        """The pose of one station in the other, ``start from other``."""
        return self.pose if start == self.first else self.pose.inverse


@dataclass(frozen=True, eq=False)
class PoseGraph:
    """Groups of stations and the joints that hold them together."""

    #: poses of the stations in the frame of each group, the largest group first
    groups: tuple[Mapping[str, Pose], ...]
    joints: tuple[Joint, ...]  #: joints that are held to be good
    sentences: tuple[str, ...]  #: what is wrong with the others


@dataclass(frozen=True, eq=False)
class _Loop:
    """Joints around a loop and by how much it fails to close [m], [rad]."""

    joints: tuple[Joint, ...]
    gap: float
    turn: float

    @property
    def closes(self) -> bool:
        """True if it closes within the tolerance for so many joints."""
        room = np.sqrt(len(self.joints) / 3)
        return bool(self.gap < GATES.gap_m * room and self.turn < GATES.turn_rad * room)


def join(stations: Sequence[str], joints: Sequence[Joint]) -> PoseGraph:
    """Join stations by those joints that are good."""
    kept, sentences = _consistent(list(joints))
    good = {id(j) for loop in _loops(kept) for j in loop.joints}
    weak = [j for j in kept if id(j) not in good and not j.alone]
    for joint in weak:
        sentences.append(
            f"{joint.first} and {joint.second} fit together, but on too little to be believed "
            "without a third station that confirms it"
        )
    kept = [j for j in kept if id(j) in good or j.alone]
    ways = _ways(_tree(kept))
    strength: dict[str, float] = dict.fromkeys(stations, 0.0)
    for joint in kept:
        for name in joint.ends:
            strength[name] += joint.strength
    groups = []
    left = list(stations)
    while left:
        root = max(left, key=lambda name: strength[name])
        group = _spread(root, ways)
        groups.append(group)
        left = [name for name in left if name not in group]
    groups.sort(key=lambda group: -len(group))
    return PoseGraph(tuple(groups), tuple(kept), tuple(sentences))


def _consistent(joints: list[Joint]) -> tuple[list[Joint], list[str]]:
    """Joints without those that loops speak against, and what was dropped."""
    sentences: list[str] = []
    while True:
        loops = _loops(joints)
        bad = [loop for loop in loops if not loop.closes]
        if not bad:
            return joints, sentences
        closing = Counter(id(j) for loop in loops if loop.closes for j in loop.joints)
        confirmed = {id(j): closing[id(j)] for j in joints}
        worst = max(bad, key=lambda loop: loop.gap)
        least = min(confirmed[id(j)] for j in worst.joints)
        doubtful = [j for j in worst.joints if confirmed[id(j)] == least]
        # what needed a loop to be believed has not found one
        doubtful = [j for j in doubtful if not j.alone] or doubtful
        if least > 0:
            doubtful = [min(doubtful, key=lambda j: j.strength)]
        sentences.append(_words(worst, doubtful))
        left_out = {id(j) for j in doubtful}
        joints = [j for j in joints if id(j) not in left_out]


def _words(loop: _Loop, doubtful: Sequence[Joint]) -> str:
    names = _around(loop.joints)
    pairs = " and ".join(f"{j.first} - {j.second}" for j in doubtful)
    return Sentence(
        "the loop {names} does not close by {loop.gap:2} m and {degrees:2} deg: the "
        "registration of {pairs} is not used",
        names=" - ".join(names),
        loop=loop,
        degrees=np.degrees(loop.turn),
        pairs=pairs,
    )


def _around(joints: Sequence[Joint]) -> list[str]:
    """Names of the stations along a loop."""
    at = next(iter(joints[0].ends - joints[1].ends), joints[0].first)
    names = [at]
    for joint in joints:
        at = next(iter(joint.ends - {at}))
        names.append(at)
    return names


def _loops(joints: Sequence[Joint]) -> list[_Loop]:
    """All triangles, and the loops that single joints close over the strongest tree."""
    to: dict[str, dict[str, Joint]] = {}
    for j in joints:
        to.setdefault(j.first, {})[j.second] = j
        to.setdefault(j.second, {})[j.first] = j
    out = []
    # each triangle once, from its first name: only stations with joints are looked at
    for a in sorted(to):
        beyond = sorted(name for name in to[a] if name > a)
        for b in beyond:
            for c in beyond:
                if c > b and c in to[b]:
                    out.append(_closed([to[a][b], to[b][c], to[a][c]], a))
    tree = _tree(joints)
    members = {id(j) for j in tree}
    ways = _ways(tree)
    for joint in joints:
        if id(joint) in members:
            continue
        path = _path(ways, joint.second, joint.first)
        if len(path) > 2:
            out.append(_closed([joint, *path], joint.first))
    return out


def _closed(joints: Sequence[Joint], start: str) -> _Loop:
    """The loop along joints that follow each other from a station."""
    pose, at = Pose.identity(), start
    for joint in joints:
        pose = pose @ joint.from_to(at)
        at = next(iter(joint.ends - {at}))
    cosine = np.clip((np.trace(pose.rotation) - 1) / 2, -1, 1)
    gap = float(np.linalg.norm(pose.translation))
    return _Loop(tuple(joints), gap, float(np.arccos(cosine)))


def _tree(joints: Sequence[Joint]) -> list[Joint]:
    """The strongest spanning forest (Kruskal 1956)."""
    group: dict[str, str] = {}

    def head(name: str) -> str:
        while group.setdefault(name, name) != name:
            name = group[name]
        return name

    out = []
    for joint in sorted(joints, key=lambda j: -j.strength):
        a, b = head(joint.first), head(joint.second)
        if a != b:
            group[a] = b
            out.append(joint)
    return out


def _ways(tree: Sequence[Joint]) -> dict[str, list[Joint]]:
    """The joints of a tree at each station, in their order."""
    out: dict[str, list[Joint]] = {}
    for joint in tree:
        for name in joint.ends:
            out.setdefault(name, []).append(joint)
    return out


def _path(ways: Mapping[str, Sequence[Joint]], start: str, end: str) -> list[Joint]:
    """Joints of a tree from one station to another."""
    come: dict[str, Joint | None] = {start: None}
    queue = [start]
    for at in queue:
        for joint in ways.get(at, ()):
            other = next(iter(joint.ends - {at}))
            if other not in come:
                come[other] = joint
                queue.append(other)
    path: list[Joint] = []
    at = end
    while (step := come.get(at)) is not None:
        path.append(step)
        at = next(iter(step.ends - {at}))
    return path[::-1] if at == start else []


def _spread(root: str, ways: Mapping[str, Sequence[Joint]]) -> dict[str, Pose]:
    """Poses of all stations that a tree joins to a root, in its frame."""
    poses = {root: Pose.identity()}
    queue = [root]
    for at in queue:
        for joint in ways.get(at, ()):
            other = next(iter(joint.ends - {at}))
            if other not in poses:
                poses[other] = poses[at] @ joint.from_to(at)
                queue.append(other)
    return poses
