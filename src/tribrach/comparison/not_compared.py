"""Surface that two clouds cannot be compared on: how much, why, and where.

Every core point stands for a cell of the grid that it was chosen from. Areas are as many cells as
the cylinders are wide, so they are about right on faces along the axes and too large by up to two
thirds on slanted ones; shares are of the same cells. Metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tribrach._types import Array, Index, Mask
from tribrach.answers import Result
from tribrach.comparison.m3c2_ep import M3C2EP
from tribrach.comparison.station_pair import StationPair

#: why a place is not compared, in the order in which it is asked
REASONS = (
    "hardly a point of B",
    "too few points",
    "too oblique",
    "edge or rough",
    "no point of A near",
)
#: a place that is compared
COMPARED = -1
#: seen at more than this from the normal by either scanner [rad]
STEEPEST = float(np.radians(75.0))
#: points that scatter by more than so many of their sigmas are of an edge, a plant, two surfaces
ROUGH = 2.0
#: a neighbourhood that scatters about its plane by more than so many times what the points of the
#: cylinder do is of two surfaces, such as the foot of a wall: its normal is of neither
MIXED = 3.0
#: places within so many cells of each other lie together; places that are listed for a reason
_TOGETHER, _LISTED = 1.8, 5


@dataclass(frozen=True)
class Where(Result):
    """Cells that lie together: middle, extent [m] and area [m^2]."""

    middle: tuple[float, float, float]
    extent: tuple[float, float, float]
    area: float


@dataclass(frozen=True)
class Reason(Result):
    """Surface that is not compared for one reason."""

    words: str  #: one of :data:`REASONS`
    area: float  #: [m^2], about
    share: float  #: of all
    places: tuple[Where, ...]  #: the largest


@dataclass(frozen=True)
class ComparedSurface(Result):
    """Surface that is compared: area [m^2], about, and its share of all."""

    area: float
    share: float


def reasons_of(found: M3C2EP, pair: StationPair) -> Index:
    """Why each core point (m,) is not compared: a number of a reason, -1 where it is."""
    out = np.full(len(found.core), COMPARED, dtype=np.int64)
    normals = found.normals.vectors
    bare = ~np.isfinite(normals[:, 0]) | (found.first.count == 0)
    few = ~found.usable | ~np.isfinite(found.distance) | ~np.isfinite(found.sigma)
    oblique = np.zeros(len(out), dtype=bool)
    for side in pair.sides or ():
        beam = found.core - side.placement.pose.translation
        length = np.maximum(np.linalg.norm(beam, axis=1), 1e-9)
        cosine = np.abs(np.einsum("mi,mi->m", beam, np.nan_to_num(normals))) / length
        oblique |= cosine < np.cos(STEEPEST)
    with np.errstate(invalid="ignore", divide="ignore"):
        rough = found.first.spread > ROUGH * found.first.expected
        rough |= found.second.spread > ROUGH * found.second.expected
        own = np.fmax(found.first.spread, found.first.expected)
        rough |= found.normals.roughness > MIXED * own
    flags: list[Mask] = [bare, few, oblique, rough]
    for number in reversed(range(len(flags))):
        out[flags[number]] = number
    return out


def areas_without(
    places: Array, reasons: Index, cell: float, only_b: Array
) -> tuple[ComparedSurface, tuple[Reason, ...]]:
    """Sum up core points that are not compared, and places of B that A has nothing near."""
    everywhere = np.concatenate([places, only_b])
    why = np.concatenate([reasons, np.full(len(only_b), len(REASONS) - 1, dtype=np.int64)])
    total, area = max(len(everywhere), 1), cell**2
    rows = []
    for number, words in enumerate(REASONS):
        here = everywhere[why == number]
        if len(here):
            share = len(here) / total
            rows.append(Reason(words, area * len(here), share, _places(here, cell)))
    good = int((why == COMPARED).sum())
    return ComparedSurface(area * good, good / total), tuple(rows)


def _places(points: Array, cell: float) -> tuple[Where, ...]:
    """The largest groups of points (n, 3) that lie together."""
    pairs = cKDTree(points).query_pairs(_TOGETHER * cell, output_type="ndarray")
    n = len(points)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(links, directed=False)
    sizes = np.bincount(label)
    chosen: Sequence[int] = np.argsort(-sizes, kind="stable")[:_LISTED].tolist()
    out = []
    for k in chosen:
        some = points[label == k]
        low, high = some.min(axis=0), some.max(axis=0)
        middle, extent = ((low + high) / 2).tolist(), (high - low + cell).tolist()
        out.append(Where(tuple(middle), tuple(extent), cell**2 * int(sizes[k])))
    return tuple(out)
