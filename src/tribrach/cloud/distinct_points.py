"""A point that is in several sets is measured once: sets that have points in common become one.

What is new with a point enters a quantity by the sum of all that the quantity takes from the point,
squared after it is summed. Where the same points come in two sets, or twice in one, their gradients
are therefore joined first (method section 5.10). A point is known by its result, its scan and its
coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Array, Index
from tribrach.cloud.shared_part import CloudPoints


def distinct_points(
    sets: Sequence[CloudPoints], gradients: Sequence[Array]
) -> tuple[list[CloudPoints], list[Array]]:
    """Join what a quantity takes from each point, wherever the point comes in several times.

    ``gradients`` (n, ...) are what the quantity takes from each point, set by set.

    A joined point has the smallest cosine that is stated of it. Of sets whose points are said to
    count for fewer, all points of the joined set count for as few as those of the worst.

    Method section 5.10.
    """
    alike: dict[tuple[bytes, str], list[int]] = {}
    for k, one in enumerate(sets):
        alike.setdefault((one.shared.identity, one.scan), []).append(k)
    out: list[tuple[int, CloudPoints, Array]] = []
    for members in alike.values():
        number = _numbers(np.concatenate([sets[k].xyz for k in members]))
        owner = np.repeat(np.arange(len(members)), [len(sets[k]) for k in members])
        whose = csr_array((np.ones(len(owner)), (owner, number)))
        _, label = connected_components(whose @ whose.T, directed=False)
        for c in range(int(label.max()) + 1):
            some = [members[k] for k in np.flatnonzero(label == c)]
            every, first = np.unique(number[label[owner] == c], return_inverse=True)
            if len(every) == len(first):
                out.append((some[0], sets[some[0]], gradients[some[0]]))
                continue
            g = np.concatenate([gradients[k] for k in some])
            total = np.zeros((len(every), *g.shape[1:]))
            np.add.at(total, first, g)
            out.append((some[0], _joined([sets[k] for k in some], first, len(every)), total))
    out.sort(key=lambda item: item[0])
    return [one for _, one, _ in out], [g for _, _, g in out]


def _numbers(xyz: Array) -> Index:
    """A number for each point (n,): those of equal coordinates have the same."""
    order = np.lexsort(xyz.T)
    steps = np.any(np.diff(xyz[order], axis=0) != 0, axis=1)
    out = np.empty(len(xyz), dtype=np.int64)
    out[order] = np.concatenate([[0], np.cumsum(steps)])
    return out


def _joined(sets: Sequence[CloudPoints], number: Index, count: int) -> CloudPoints:
    """One set of the distinct points of several; number (n,): which of them each point is."""
    xyz = np.empty((count, 3))
    xyz[number] = np.concatenate([one.xyz for one in sets])
    cosine = intensity = effective = None
    if any(one.cosine is not None for one in sets):
        given = [np.ones(len(one)) if one.cosine is None else one.cosine for one in sets]
        cosine = np.full(count, np.inf)
        np.minimum.at(cosine, number, np.concatenate(given))
    if any(one.intensity is not None for one in sets):
        lit = [np.full(len(p), np.nan) if p.intensity is None else p.intensity for p in sets]
        intensity = np.full(count, np.nan)
        np.fmax.at(intensity, number, np.concatenate(lit))
    parts = np.split(number, np.cumsum([len(one) for one in sets])[:-1])
    fewer = [
        max(len(np.unique(part)) / one.effective, 1.0)
        for one, part in zip(sets, parts, strict=True)
        if one.effective is not None
    ]
    if fewer:
        effective = count / max(fewer)
    return replace(sets[0], xyz=xyz, cosine=cosine, intensity=intensity, effective=effective)
