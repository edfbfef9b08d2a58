"""A compared surface in patches, which of them keep their places among each other, which go along.

Each patch has the normal equations of a rigid motion about one place, ``N q = b`` with
``Omega = c - b^T N^+ b`` left (method section 12.9), so that patches are put together by adding. A
motion q of several explains a patch if ``(q - q_p)^T N_p (q - q_p)`` is below its limit. Metres;
turns are scaled by one length.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.comparison.rigid_motion import UNSEEN, PlaceDistances
from tribrach.comparison.station_pair import along_normals
from tribrach.geometry.rotation import skew
from tribrach.statistics import chi2

#: sides of patches over the width of cylinders; distances that a patch needs
_SIDE, _FEWEST = 3.0, 5
#: a patch is explained by a motion below the first, and not above the second [probability]
_EXPLAINED, _BEYOND = 0.99, 0.999
#: scatter on a patch beyond this is no rigid motion [probability]
_RIGID = 0.999
#: samples of three patches, and their seed: the result of one input is always the same
_SAMPLES, _SEED = 400, 20
#: patches that moved, at most, so that neighbours are put together in seconds
MOST_MOVED = 4000
#: steps from a patch to half of its neighbours
_FORWARD = [
    (i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if (i, j, k) > (0, 0, 0)
]


@dataclass(frozen=True, eq=False)
class Patches:
    """Patches p of a surface."""

    of: Index  #: (m,), patch of each distance, -1 where there are too few for one
    cells: Index  #: (p, 3), cells of the grid
    normal: Array  #: (p, 6, 6), N of each
    right: Array  #: (p, 6), b of each
    square: Array  #: (p,), c of each
    count: Index  #: (p,), distances of each
    #: (p, 5), number, sum and sum of squares of the places of each from the common one [m]
    moments: Array
    lever: float  #: length that turns are scaled by [m]

    def __len__(self) -> int:
        return len(self.count)

    @cached_property
    def inverse(self) -> tuple[Array, Index]:
        """``N^+`` (p, 6, 6) and the ranks (p,)."""
        return _inverse(self.normal, self.moments, self.lever)

    @cached_property
    def own(self) -> Array:
        """The motion of each (p, 6)."""
        out: Array = np.einsum("pij,pj->pi", self.inverse[0], self.right)
        return out

    @cached_property
    def left(self) -> Array:
        """``Omega`` (p,) of each."""
        out: Array = np.maximum(self.square - (self.right * self.own).sum(axis=1), 0.0)
        return out

    @cached_property
    def dof(self) -> Index:
        """Redundancy (p,) of each."""
        return self.count - self.inverse[1]

    @cached_property
    def factor(self) -> float:
        """How much more distances scatter within patches than stated, one at least."""
        good = self.dof > 0
        if not good.any():
            return 1.0
        return max(1.0, float(np.median(self.left[good] / chi2.ppf(0.5, self.dof[good]))))

    @cached_property
    def rigid(self) -> Mask:
        """Which patches (p,) one motion explains."""
        flags: Mask = self.left <= self.factor * chi2.ppf(_RIGID, np.maximum(self.dof, 1))
        return flags

    def misfit(self, motion: Array) -> Array:
        """What a motion (6,) for all leaves beyond that of each (p,)."""
        off = motion - self.own
        out: Array = np.einsum("pi,pij,pj->p", off, self.normal, off)
        return out

    def within(self, motion: Array, probability: float) -> Mask:
        """Which patches (p,) a motion explains."""
        limit = self.factor * chi2.ppf(probability, np.maximum(self.inverse[1], 1))
        flags: Mask = self.misfit(motion) <= limit
        return flags

    def together(self, rows: Index | Mask) -> Array:
        """The motion (6,) of some of them."""
        total = self.normal[rows].sum(axis=0), self.moments[rows].sum(axis=0)
        inverse, _ = _inverse(total[0][None], total[1][None], self.lever)
        out: Array = inverse[0] @ self.right[rows].sum(axis=0)
        return out


def patches_of(distances: PlaceDistances, cylinder: float) -> Patches:
    """Cut a surface into cells of a grid, each three cylinders wide."""
    side = _SIDE * cylinder
    origin = distances.core.min(axis=0) if len(distances) else np.zeros(3)
    cells = np.floor((distances.core - origin) / side).astype(np.int64)
    # distances of one cell on both sides of an edge, and of two sites, are apart
    keys = np.column_stack([distances.site, cells])
    known, at, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    at = at.reshape(-1)
    enough = count >= _FEWEST
    number = np.where(enough, np.cumsum(enough) - 1, -1)
    of = number[at]
    p = int(enough.sum())
    middle = distances.core.mean(axis=0) if len(distances) else np.zeros(3)
    rows = along_normals(distances.core, distances.normals, middle)
    lever = float(np.sqrt(((distances.core - middle) ** 2).sum(axis=1).mean())) or 1.0
    rows[:, 3:] /= lever
    rows /= distances.sigma[:, None]
    seen = distances.values / distances.sigma
    normal, right, square = np.zeros((p, 6, 6)), np.zeros((p, 6)), np.zeros(p)
    used = of >= 0
    np.add.at(normal, of[used], rows[used, :, None] * rows[used, None, :])
    np.add.at(right, of[used], rows[used] * seen[used, None])
    np.add.at(square, of[used], seen[used] ** 2)
    moments, arm = np.zeros((p, 5)), distances.core[used] - middle
    each = np.column_stack([np.ones(len(arm)), arm, (arm**2).sum(axis=1)])
    np.add.at(moments, of[used], each)
    cells_of = known[enough][:, 1:]
    return Patches(of, cells_of, normal, right, square, count[enough], moments, lever)


def stable_patches(patches: Patches) -> Mask | None:
    """The patches that more than half of the surface agrees with in one rigid motion, or None.

    Nothing is assumed of the registration, nor of which motion it is (method section 12.9).
    """
    rigid = np.flatnonzero(patches.rigid)
    if len(rigid) < 3:
        return None
    rng = np.random.default_rng(_SEED)
    area = patches.count.astype(float)
    best, most = None, -1.0
    for _ in range(_SAMPLES):
        motion = patches.together(rng.choice(rigid, 3, replace=False))
        inside = patches.within(motion, _EXPLAINED) & patches.rigid
        if area[inside].sum() > most:
            best, most = inside, float(area[inside].sum())
    assert best is not None
    for _ in range(20):
        if not best.any():
            return None
        again = patches.within(patches.together(best), _EXPLAINED) & patches.rigid
        if (again == best).all():
            break
        best = again
    return best if area[best].sum() > 0.5 * area.sum() else None


def moving_parts(patches: Patches, stable: Mask) -> list[Index]:
    """Parts of patches that move alike, unlike the stable ones, largest first (section 12.9)."""
    motion = patches.together(stable)
    moved = ~stable & patches.rigid & ~patches.within(motion, _BEYOND)
    rows = np.flatnonzero(moved)[:MOST_MOVED]
    n, b, c, m = patches.normal, patches.right, patches.square, patches.moments
    sums = {int(k): (n[k], b[k], float(c[k]), m[k]) for k in rows}
    lever = patches.lever
    left = {k: _left(*part, lever)[0] for k, part in sums.items()}
    rank = {k: _left(*part, lever)[1] for k, part in sums.items()}
    members = {k: [k] for k in sums}
    near = _neighbours(patches.cells, rows)
    limit = patches.factor

    def cost(i: int, j: int) -> float:
        """How much worse one motion is than two, over its limit."""
        one, two = sums[i], sums[j]
        after, together = _left(
            one[0] + two[0], one[1] + two[1], one[2] + two[2], one[3] + two[3], lever
        )
        dof = max(rank[i] + rank[j] - together, 1)
        more = (after - left[i] - left[j]) / limit
        return float(more / chi2.ppf(_BEYOND, dof))

    # how often each was put together: an entry of another time is not of these parts any more
    version = dict.fromkeys(sums, 0)
    queue = [(cost(i, j), i, j, 0, 0) for i in near for j in near[i] if i < j]
    heapq.heapify(queue)
    while queue:
        worse, i, j, of_i, of_j = heapq.heappop(queue)
        if worse > 1:
            break
        if version.get(i) != of_i or version.get(j) != of_j:
            continue
        one, two = sums[i], sums[j]
        sums[i] = one[0] + two[0], one[1] + two[1], one[2] + two[2], one[3] + two[3]
        left[i], rank[i] = _left(*sums[i], lever)
        members[i] += members.pop(j)
        near[i] = (near[i] | near[j]) - {i, j}
        for other in near.pop(j):
            near[other].discard(j)
            if other != i:
                near[other].add(i)
        for table in (sums, version):
            del table[j]
        version[i] += 1
        for other in near[i]:
            first, second = min(i, other), max(i, other)
            entry = (cost(first, second), first, second, version[first], version[second])
            heapq.heappush(queue, entry)
    parts = [np.array(sorted(some)) for some in members.values()]
    return sorted(parts, key=lambda some: (-int(patches.count[some].sum()), int(some[0])))


def edges_of(patches: Patches, parts: list[Index]) -> list[bool]:
    """Which parts are but borders of larger ones: their cylinders hold points of both sides."""
    every = np.concatenate([np.zeros(0, dtype=np.int64), *parts])
    near = _neighbours(patches.cells, every)
    owner = {int(k): number for number, part in enumerate(parts) for k in part}
    out: list[bool] = []
    for number, part in enumerate(parts):
        beside = [{owner[j] for j in near[int(k)]} for k in part]
        larger = set.intersection(*beside) if beside else set()
        out.append(any(other < number and not out[other] for other in larger))
    return out


def _neighbours(cells: Index, rows: Index) -> dict[int, set[int]]:
    """Which of some patches touch."""
    at: dict[tuple[int, ...], list[int]] = {}
    for k in rows.tolist():
        at.setdefault(tuple(cells[k].tolist()), []).append(k)
    near: dict[int, set[int]] = {int(k): set() for k in rows}
    for place, here in at.items():
        for i in here:
            near[i] |= {j for j in here if j != i}
        for step in _FORWARD:
            there = at.get(tuple(a + b for a, b in zip(place, step, strict=True)), ())
            for i in here:
                for j in there:
                    near[i].add(j)
                    near[j].add(i)
    return near


def _inverse(normal: Array, moments: Array, lever: float) -> tuple[Array, Index]:
    """Inverses (p, 6, 6) of normal matrices in the directions that are seen, and their ranks.

    What a patch shows is asked about its own middle and by its own extent: far from the common
    place all of its motions look like one shift.
    """
    count = np.maximum(moments[:, 0], 1.0)
    middle = moments[:, 1:4] / count[:, None]
    own = np.sqrt(np.maximum(moments[:, 4] / count - (middle**2).sum(axis=1), 1e-12))
    carry = np.zeros((len(normal), 6, 6))
    carry[:, :3, :3] = np.eye(3)
    carry[:, :3, 3:] = skew(middle) / own[:, None, None]
    carry[:, 3:, 3:] = (lever / own)[:, None, None] * np.eye(3)
    local = carry.transpose(0, 2, 1) @ normal @ carry
    values, vectors = np.linalg.eigh((local + local.transpose(0, 2, 1)) / 2)
    seen = values > UNSEEN**2 * values[:, -1:]
    inverted = np.where(seen, 1 / np.where(seen, values, 1.0), 0.0)
    inside = np.einsum("pik,pk,pjk->pij", vectors, inverted, vectors)
    out: Array = carry @ inside @ carry.transpose(0, 2, 1)
    return out, seen.sum(axis=1)


def _left(
    normal: Array, right: Array, square: float, moments: Array, lever: float
) -> tuple[float, int]:
    """``Omega`` and rank of one part."""
    inverse, rank = _inverse(normal[None], moments[None], lever)
    return max(square - float(right @ inverse[0] @ right), 0.0), int(rank[0])
