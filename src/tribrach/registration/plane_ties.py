"""Which planes of which stations are one surface, once the stations have approximate poses?

Two patches are one if they look the same way, overlap, and agree in tilt and offset within their
covariances and what the poses may be wrong by; what agrees with one patch that agrees with another
is one surface with both. A surface that one station alone sees ties nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach.geometry.pose import Pose
from tribrach.network.unknowns import plane_basis
from tribrach.registration.plane_poses import Surroundings, common_planes, offsets

__all__ = ["PlaneTies", "tie_planes"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: planes that are one agree within these [rad], [m] even where the covariances are small ...
_TURN, _OFFSET = 1e-3, 0.004
#: ... and within so many sigmas, but never beyond [rad], [m]
_SIGMAS, _MOST = 4.0, (0.0175, 0.02)


@dataclass(frozen=True, eq=False)
class PlaneTies:
    """Surfaces that several stations see.

    station (n,) : names; number (n,) : of the plane at its station; surface (n,) : of the surface,
    from 0; normal (s, 3), offset (s,) : of the surfaces in the frame of the poses, from the largest
    patch; members (s,) : stations that see each; pairs : by two stations the numbers (p, 2) of
    their common planes.
    """

    station: tuple[str, ...]
    number: Index
    surface: Index
    normal: Array
    offset: Array
    members: Index
    pairs: Mapping[tuple[str, str], Index]


def tie_planes(
    stations: Sequence[Surroundings], poses: Mapping[str, Pose], slack: float = 0.0
) -> PlaneTies:
    """Surfaces common to several stations.

    poses : world from scanner, of all stations that take part; slack [m] : what the poses may be
    wrong by besides.
    """
    taking = [s for s in stations if s.name in poses and len(s.planes)]
    first = np.cumsum([0] + [len(s.planes) for s in taking])
    rows: list[Index] = []
    pairs: dict[tuple[str, str], Index] = {}
    for a, b in combinations(range(len(taking)), 2):
        one, two = taking[a], taking[b]
        between = poses[one.name].inverse @ poses[two.name]
        found = _agreeing(one, two, between, slack)
        if len(found):
            pairs[one.name, two.name] = found
            rows.append(found + np.array([first[a], first[b]]))
    links = np.concatenate(rows) if rows else np.zeros((0, 2), dtype=np.int64)
    size = int(first[-1])
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(size, size))
    _, label = connected_components(graph, directed=False)
    owner = np.repeat(np.arange(len(taking)), np.diff(first))
    place = np.arange(size) - first[owner] if size else np.zeros(0, dtype=np.int64)
    return _numbered(taking, poses, label.astype(np.int64), owner, place, pairs)


def _agreeing(one: Surroundings, two: Surroundings, between: Pose, slack: float) -> Index:
    """Pairs (p, 2) of planes that overlap and agree within what is known of them."""
    turn, away = _MOST[0], _MOST[1] + slack
    found = common_planes(one.planes, two.planes, between, turn, away)
    i, j = found.T
    joint = one.planes.covariance[i] + two.planes.covariance[j]
    turned = two.planes.normal[j] @ between.rotation.T
    basis = plane_basis(one.planes.normal[i]).transpose(0, 2, 1)
    tilt = np.linalg.norm(np.einsum("pki,pi->pk", basis, turned), axis=1)
    sigma = np.sqrt(np.trace(joint[:, :2, :2], axis1=1, axis2=2))
    alike = tilt < _TURN + _SIGMAS * sigma
    off = np.abs(offsets(one.planes, two.planes, i, j, between))
    near = off < _OFFSET + slack + _SIGMAS * np.sqrt(joint[:, 2, 2])
    return np.asarray(found[alike & near])


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
    wanted = np.flatnonzero(members > 1)
    wanted = wanted[np.argsort(-total[wanted], kind="stable")]
    rank = np.full(len(members) + 1, -1, dtype=np.int64)
    rank[wanted] = np.arange(len(wanted))
    chosen = np.flatnonzero(rank[label] >= 0)
    chosen = chosen[np.argsort(rank[label[chosen]], kind="stable")]
    normal, offset = np.zeros((len(wanted), 3)), np.zeros(len(wanted))
    for surface in range(len(wanted)):
        mine = chosen[rank[label[chosen]] == surface]
        largest = mine[np.argmax(area[mine])]
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
        members[wanted],
        pairs,
    )
