"""Finds the planes of stations that are one surface, once the stations have poses.

Two patches are one if they look the same way, overlap, and agree in tilt and offset within their
covariances and what the poses may be wrong by; what agrees with one patch that agrees with another
is one surface with both. A surface that one station alone sees ties nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Array, Index
from tribrach.geometry.pose import Pose
from tribrach.observations.unknowns import plane_basis
from tribrach.registration.planes.poses import common_planes, offsets
from tribrach.registration.views import Surroundings


@dataclass(frozen=True)
class PlaneTieGates:
    """When planes of two stations are one surface, once both have poses.

    Chosen by hand with test_plane_ties, test_edges.
    """

    #: planes that are one agree within these [rad], [m] even where the covariances are small ...
    turn_rad: float = 1e-3
    offset_m: float = 0.004
    sigmas: float = 4.0  #: ... and within so many sigmas ...
    #: ... but never beyond these [rad], [m]
    most_turn_rad: float = 0.0175
    most_offset_m: float = 0.02


GATES = PlaneTieGates()


@dataclass(frozen=True, eq=False)
class PlaneTies:
    """Surfaces that several stations see."""

    station: tuple[str, ...]  #: names of the stations of the patches
    number: Index  #: (n,), numbers of the patches among the planes of their station
    surface: Index  #: (n,), numbers of their surfaces, from 0
    #: (s, 3), normals of the surfaces in the frame of the poses, from the largest patch
    normal: Array
    offset: Array  #: (s,), offsets of the surfaces in that frame [m]
    members: Index  #: (s,), how many stations see each surface
    #: by two stations, the numbers (p, 2) of their common planes
    pairs: Mapping[tuple[str, str], Index]


def tie_planes(
    stations: Sequence[Surroundings],
    poses: Mapping[str, Pose],
    slack: float = 0.0,
    groups: Sequence[Collection[str]] | None = None,
) -> PlaneTies:
    """Find the surfaces that several stations have in common.

    ``slack`` is a further error that the poses may have [m]. Stations are tied within ``groups``
    alone, if given.
    """
    taking = [s for s in stations if s.name in poses and len(s.planes)]
    first = np.cumsum([0] + [len(s.planes) for s in taking])
    size = int(first[-1])
    agreeing: dict[tuple[int, int], tuple[Index, Array]] = {}
    for a, b in combinations(range(len(taking)), 2):
        one, two = taking[a], taking[b]
        if groups is not None and not any(one.name in g and two.name in g for g in groups):
            continue
        pairs, away = _agreeing(one, two, poses[one.name].inverse @ poses[two.name], slack)
        if len(pairs):
            agreeing[a, b] = pairs, away
    none = np.zeros((0, 2), dtype=np.int64)
    links = np.concatenate(
        [none, *(p + np.array([first[a], first[b]]) for (a, b), (p, _) in agreeing.items())]
    )
    away = np.concatenate([np.zeros(0), *(w for _, w in agreeing.values())])
    owner = np.repeat(np.arange(len(taking)), np.diff(first))
    place = np.arange(size) - first[owner] if size else np.zeros(0, dtype=np.int64)
    label, good = _labels(taking, owner, place, links, away)
    ends = np.cumsum([0] + [len(p) for p, _ in agreeing.values()])
    kept = {
        (taking[a].name, taking[b].name): p[good[ends[k] : ends[k + 1]]]
        for k, ((a, b), (p, _)) in enumerate(agreeing.items())
    }
    return _numbered(taking, poses, label, owner, place, kept)


def _labels(
    stations: Sequence[Surroundings], owner: Index, place: Index, links: Index, away: Array
) -> tuple[Index, NDArray[np.bool_]]:
    """Number of the surface of every patch, and mask (m,) of the links that were kept.

    If a station would see one surface as two, a wall and what is let into it for instance, both
    were joined by mistake: of its patches there the one that fits worse is taken out.
    """
    size = len(owner)
    good = np.ones(len(links), dtype=bool)
    while True:
        rows, columns = links[good].T
        graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
        _, components = connected_components(graph, directed=False)
        label: Index = np.asarray(components, dtype=np.int64)
        worst = _doubled(stations, owner, place, label, links[good], away[good])
        if worst is None:
            return label, good
        good &= ~(links == worst).any(axis=1)


def _doubled(
    stations: Sequence[Surroundings],
    owner: Index,
    place: Index,
    label: Index,
    links: Index,
    away: Array,
) -> int | None:
    """A patch that its surface should not have, None if there is none."""
    linked = np.unique(links)
    key = label[linked] * (len(stations) + 1) + owner[linked]
    for group in np.flatnonzero(np.bincount(key, minlength=1) > 1) if len(key) else ():
        patches = linked[key == group]
        planes = stations[owner[patches[0]]].planes
        for a, b in combinations(patches.tolist(), 2):
            i, j = np.array([place[a]]), np.array([place[b]])
            off = abs(float(offsets(planes, planes, i, j, Pose.identity())[0]))
            sigma = np.sqrt(planes.covariance[[i[0], j[0]], 2, 2].sum())
            if off > GATES.offset_m + GATES.sigmas * sigma:
                misfit = [float(away[(links == k).any(axis=1)].mean()) for k in (a, b)]
                return int(a if misfit[0] > misfit[1] else b)
    return None


def _agreeing(
    one: Surroundings, two: Surroundings, between: Pose, slack: float
) -> tuple[Index, Array]:
    """Pairs (p, 2) of planes that overlap and agree within what is known, and misfits (p,) [m]."""
    turn, most = GATES.most_turn_rad, GATES.most_offset_m + slack
    common = common_planes(one.planes, two.planes, between, turn, most)
    i, j = common.T
    joint = one.planes.covariance[i] + two.planes.covariance[j]
    turned = two.planes.normal[j] @ between.rotation.T
    basis = plane_basis(one.planes.normal[i]).transpose(0, 2, 1)
    tilt = np.linalg.norm(np.einsum("pki,pi->pk", basis, turned), axis=1)
    sigma = np.sqrt(np.trace(joint[:, :2, :2], axis1=1, axis2=2))
    alike = tilt < GATES.turn_rad + GATES.sigmas * sigma
    away = np.abs(offsets(one.planes, two.planes, i, j, between))
    good = alike & (away < GATES.offset_m + slack + GATES.sigmas * np.sqrt(joint[:, 2, 2]))
    return np.asarray(common[good]), np.asarray(away[good])


def _numbered(
    stations: Sequence[Surroundings],
    poses: Mapping[str, Pose],
    label: Index,
    owner: Index,
    place: Index,
    pairs: Mapping[tuple[str, str], Index],
) -> PlaneTies:
    """Surfaces with members at two stations or more, the largest first."""
    seen = np.unique(np.stack([label, owner], axis=1), axis=0)[:, 0]
    members = np.bincount(seen, minlength=int(label.max(initial=-1)) + 1)
    area = np.concatenate([np.zeros(0), *(s.planes.area for s in stations)])
    total = np.bincount(label, area, minlength=len(members))
    surfaces = np.flatnonzero(members > 1)
    surfaces = surfaces[np.argsort(-total[surfaces], kind="stable")]
    rank = np.full(len(members) + 1, -1, dtype=np.int64)
    rank[surfaces] = np.arange(len(surfaces))
    chosen = np.flatnonzero(rank[label] >= 0)
    chosen = chosen[np.argsort(rank[label[chosen]], kind="stable")]
    normal, offset = np.zeros((len(surfaces), 3)), np.zeros(len(surfaces))
    for surface in range(len(surfaces)):
        patches = chosen[rank[label[chosen]] == surface]
        largest = patches[np.argmax(area[patches])]
        station = stations[owner[largest]]
        pose = poses[station.name]
        normal[surface] = pose.rotation @ station.planes.normal[place[largest]]
        offset[surface] = normal[surface] @ (pose @ station.planes.center[place[largest]])
    return PlaneTies(
        tuple(stations[k].name for k in owner[chosen]),
        place[chosen],
        rank[label[chosen]],
        normal,
        offset,
        members[surfaces],
        pairs,
    )
