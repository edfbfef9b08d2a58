"""What moved between two clouds: stable area, parts that moved as bodies, and what cannot be told.

Everything is from the distances along normals of one comparison, with the joint covariance of both
stations (method sections 9.3, 12.8 and 12.9).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from tribrach._types import Array, Index, Mask, Progress
from tribrach.answers import Number, Result
from tribrach.comparison.cloud_parts import plain
from tribrach.comparison.common_effect import CommonEffect, common_effect
from tribrach.comparison.core_points import core_points
from tribrach.comparison.m3c2_ep import M3C2EP
from tribrach.comparison.not_compared import (
    COMPARED,
    ComparedSurface,
    Reason,
    areas_without,
    reasons_of,
)
from tribrach.comparison.results import SiteResult
from tribrach.comparison.rigid_motion import (
    PartMotion,
    PlaceDistances,
    distances_of,
    part_motion,
    relative_motion,
)
from tribrach.comparison.sites import ComparisonSite
from tribrach.comparison.station_pair import StationPair
from tribrach.comparison.surface_patches import (
    Patches,
    edges_of,
    moving_parts,
    patches_of,
    stable_patches,
)
from tribrach.job.cloud_file import CloudFile
from tribrach.job.compare import Registration
from tribrach.statistics import chi2

#: of all tests, and the power that detectable motions are stated for
CONFIDENCE, POWER = 0.95, 0.8
#: patches that a part needs: a single one is an edge more often than a part
_PATCHES = 2
#: a site whose distances scatter more about one motion did not move as one body [probability]
_ONE_BODY = 0.999

#: one deformation tilts its pieces by at least so many sigmas against each other, and leaves no
#: step between them beyond so many
_TILTS, _STEP = 3.0, 3.0
#: parts touch that are nearer than two patches, in cells, and their border is where they are
#: nearest, times this
_ACROSS, _NEAREST = 6.0, 1.2
#: faces look the same way up to this cosine
_ONE_FACE = 0.9

Verdict = Literal["moved", "bends", "no motion found", "not one body", "too few distances"]


@dataclass(frozen=True, eq=False)
class MovedPart(Result):
    """A part of the surface, and how it moved."""

    #: of a site, or a number
    name: str
    verdict: Verdict
    area: float  #: that it was compared on, about [m^2]
    #: against the control of both clouds; null with too few distances
    motion: PartMotion | None = None
    #: null without a stable area, or where the distances do not show it
    against_stable: PartMotion | None = None
    limit: float | None = None  #: of the statistic of the motion
    detectable: Number | None = None  #: shift outwards that would have been found with 80 % [m]

    @property
    def differs(self) -> bool:
        """Did it move, as one body or not?"""
        return self.verdict in ("moved", "bends", "not one body")


@dataclass(frozen=True, eq=False)
class StableArea(Result, also=("agrees",)):
    """The largest group of patches that keep their places among each other."""

    #: their number, and their share of the surface in patches
    patches: int
    share: float
    area: float  #: about [m^2]
    motion: PartMotion  #: against the control of both clouds: what the registration is wrong by
    limit: float  #: of its statistic
    #: error of the registration along its mean normal that would have been found with 80 % [m]
    detectable: Number

    @property
    def agrees(self) -> bool:
        """Is the registration as good as its covariance says?"""
        return self.motion.statistic <= self.limit


@dataclass(frozen=True, eq=False)
class ComparedPlaces:
    """Distances that motions are from, and what each is part of."""

    #: core points (m, 3) [m] and normals
    xyz: Array
    normals: Array
    #: later less earlier along the normal (m,) [m]; sigmas of points and both stations
    distance: Array
    sigma: Array
    stable: Mask  #: in the stable area?
    part: Index  #: number of the part from 1, in the order of the parts; 0 where it is in none
    core: Index  #: number of the core point among those of all sites one after the other


@dataclass(frozen=True, eq=False)
class CloudMotions(Result, without=("places",)):
    """What moved between two clouds."""

    #: sites in their order; of parts that were found the largest first
    parts: tuple[MovedPart, ...]
    sites: bool  #: are the parts sites that were given, or were they found?
    stable: StableArea | None  #: null where no more than half of the surface agrees in one motion
    patches: int  #: of the surface
    loose: float  #: share of the surface in patches that is neither stable nor in a part
    #: variance factor of the points, one at least
    factor: float
    compared: ComparedSurface
    not_compared: tuple[Reason, ...]
    places: ComparedPlaces  #: the distances, with the stable area and the parts that they are in
    #: what the campaigns measured otherwise, taken off the distances; null for nothing
    effect: CommonEffect | None = None
    given_alike: tuple[str, ...] = ()  #: given values that both registrations rest on
    one_result: bool = False  #: are both clouds of one run?


@dataclass
class MotionCollector:
    """Keeps the distances of a comparison, and says what moved when it is done."""

    #: the stations of the earlier cloud B and of the later one A, or how well A lies on B
    known: StationPair | Registration
    scanners: tuple[Array, ...] = ()  #: places (3,) [m] of those that the clouds themselves state
    #: number and distances of each site
    found: list[tuple[int, M3C2EP]] = field(default_factory=list)

    def __call__(self, number: int, distances: M3C2EP) -> None:
        """Take the distances of a site."""
        self.found.append((number, distances))

    def labelled(self, places: ComparedPlaces) -> Iterator[tuple[int, M3C2EP, Mask, Index]]:
        """Number and distances of each site; stable area and part of each core point."""
        count = sum(len(found.core) for _, found in self.found)
        stable, part = np.zeros(count, dtype=bool), np.zeros(count, dtype=np.int64)
        stable[places.core], part[places.core] = places.stable, places.part
        start = 0
        for number, found in self.found:
            rows = slice(start, start + len(found.core))
            yield number, found, stable[rows], part[rows]
            start = rows.stop

    def motions(
        self,
        earlier: CloudFile,
        results: Sequence[SiteResult],
        sites: Sequence[ComparisonSite],
        *,
        one_result: bool = False,
        progress: Progress = lambda what, done, total: None,
    ) -> CloudMotions:
        """What moved."""
        cells, whole, reasons = [], [], []
        places = np.concatenate([np.empty((0, 3)), *(found.core for _, found in self.found)])
        known = self.known
        pair = known.pair(places) if isinstance(known, Registration) else known
        for number, found in self.found:
            figures = results[number].m3c2
            assert figures is not None
            why = reasons_of(found, pair)
            cells.append(figures.cylinder)
            reasons.append(why)
            rows = why == COMPARED
            whole.append(distances_of(found, pair, figures.cylinder, rows, number))
        cell = float(np.median(cells)) if cells else 0.1
        scanners = self.scanners or ((pair.first, pair.second) if pair.sides else ())
        distances, effect = common_effect(_joined(whole, pair), cell, scanners)
        only_b = _only(earlier, places, sites, cell, progress)
        compared, missed = areas_without(places, np.concatenate([_EMPTY, *reasons]), cell, only_b)
        patches = patches_of(distances, cell)
        stable = stable_patches(patches)
        area = _stable_area(distances, patches, stable, cell)
        if sites:
            parts = _sites(distances, patches, area, sites, cell)
            part_of = distances.site + 1
        else:
            parts, part_of = _found(distances, patches, stable, area, cell)
        settled = 0 if area is None or stable is None else int(patches.count[stable].sum())
        in_parts = sum(p.motion.kept.size for p in parts if p.motion is not None)
        whole_count = max(int(patches.count.sum()), 1)
        return CloudMotions(
            parts=tuple(parts),
            sites=bool(sites),
            stable=area,
            patches=len(patches),
            loose=0.0 if sites else max(1 - (settled + in_parts) / whole_count, 0.0),
            factor=patches.factor,
            compared=compared,
            not_compared=missed,
            places=self._places(np.concatenate([_EMPTY, *reasons]), patches, stable, part_of),
            effect=effect,
            given_alike=pair.alike,
            one_result=one_result,
        )

    def _places(
        self, reasons: Index, patches: Patches, stable: Mask | None, part: Index
    ) -> ComparedPlaces:
        """What the compared core points are part of; all have their reasons (c,)."""
        core = np.flatnonzero(reasons == COMPARED)
        inside = np.zeros(len(core), dtype=bool)
        if stable is not None:
            inside = np.isin(patches.of, np.flatnonzero(stable))

        def of(values: Callable[[M3C2EP], Array], width: tuple[int, ...]) -> Array:
            """Of every core point, then of those that were compared."""
            every = [np.empty((0, *width)), *(values(found) for _, found in self.found)]
            out: Array = np.concatenate(every)[core]
            return out

        return ComparedPlaces(
            xyz=of(lambda found: found.core, (3,)),
            normals=of(lambda found: found.normals.vectors, (3,)),
            distance=of(lambda found: found.distance, ()),
            sigma=of(lambda found: found.sigma, ()),
            stable=inside,
            part=part,
            core=core,
        )


_EMPTY: Index = np.zeros(0, dtype=np.int64)


def _joined(several: Sequence[PlaceDistances], pair: StationPair) -> PlaceDistances:
    """All distances in one."""
    return PlaceDistances(
        np.concatenate([np.empty((0, 3)), *(d.core for d in several)]),
        np.concatenate([np.empty((0, 3)), *(d.normals for d in several)]),
        np.concatenate([np.empty(0), *(d.values for d in several)]),
        np.concatenate([np.empty(0), *(d.sigma for d in several)]),
        np.concatenate([_EMPTY, *(d.site for d in several)]),
        pair,
    )


def _only(
    earlier: CloudFile,
    places: Array,
    sites: Sequence[ComparisonSite],
    cell: float,
    progress: Progress,
) -> Array:
    """Places (k, 3) of the earlier cloud that the later one has nothing near."""
    done = 0

    def chunks() -> Iterator[Array]:
        nonlocal done
        for chunk in earlier.stream():
            done += len(chunk)
            progress(f"surface of {earlier.path.name}", done, earlier.records)
            if sites:
                inside = np.any([site.inside(chunk) for site in sites], axis=0)
                chunk = chunk[inside]
            if len(chunk):
                yield chunk

    if not len(places):
        return np.empty((0, 3))
    there = core_points(plain(chunks), cell, origin=places[0])
    near, _ = cKDTree(places).query(there, distance_upper_bound=2 * cell)
    out: Array = there[~np.isfinite(near)]
    return out


def _stable_area(
    distances: PlaceDistances, patches: Patches, stable: Mask | None, cell: float
) -> StableArea | None:
    """The registration on the patches that keep their places."""
    if stable is None:
        return None
    rows = np.isin(patches.of, np.flatnonzero(stable))
    motion = part_motion(distances.some(rows), patches.factor)
    if motion is None:
        return None
    alpha = 1 - CONFIDENCE
    count = patches.count
    return StableArea(
        patches=int(stable.sum()),
        share=float(count[stable].sum() / count.sum()),
        area=cell**2 * int(count[stable].sum()),
        motion=motion,
        limit=motion.limit(alpha),
        detectable=motion.detectable(alpha, POWER),
    )


def _sites(
    distances: PlaceDistances,
    patches: Patches,
    stable: StableArea | None,
    sites: Sequence[ComparisonSite],
    cell: float,
) -> list[MovedPart]:
    """Each site as one body."""
    out = []
    for number, site in enumerate(sites):
        rows = distances.site == number
        motion = None if stable is None else stable.motion
        some = distances.some(rows)
        out.append(_part(site.name, some, patches.factor, motion, 1 - CONFIDENCE, cell))
    return out


def _found(
    distances: PlaceDistances,
    patches: Patches,
    stable: Mask | None,
    area: StableArea | None,
    cell: float,
) -> tuple[list[MovedPart], Index]:
    """Parts beside the stable area, tested as the largest of many, and each distance's (m,)."""
    number = np.zeros(len(distances), dtype=np.int64)
    if stable is None or area is None:
        return [], number
    alpha = 1 - CONFIDENCE ** (1 / max(len(patches), 1))
    out: list[MovedPart] = []
    parts = [part for part in moving_parts(patches, stable) if len(part) >= _PATCHES]
    edges = edges_of(patches, parts)
    whole = [part for part, edge in zip(parts, edges, strict=True) if not edge]
    for pieces in _bodies(distances, patches, whole, _ACROSS * cell):
        rows = np.isin(patches.of, np.concatenate([whole[k] for k in pieces]))
        number[rows] = len(out) + 1
        name = f"{len(out) + 1}"
        part = _part(name, distances.some(rows), patches.factor, area.motion, alpha, cell)
        bends = len(pieces) > 1 and part.motion is not None
        out.append(replace(part, verdict="bends") if bends else part)
    return out, number


def _bodies(
    distances: PlaceDistances, patches: Patches, parts: list[Index], reach: float
) -> list[list[int]]:
    """Numbers of parts, those together that are pieces of one deformation; the largest first."""
    places = [distances.some(np.isin(patches.of, part)) for part in parts]
    motions = [part_motion(some, patches.factor) for some in places]
    body = list(range(len(parts)))
    for i, j in combinations(range(len(parts)), 2):
        one, two = motions[i], motions[j]
        if one is None or two is None or float(one.normal @ two.normal) < _ONE_FACE:
            continue
        away, at = map(np.asarray, cKDTree(places[j].core).query(places[i].core))
        gap = float(away.min())
        near: Mask = np.asarray(away <= _NEAREST * gap)
        between = (places[i].core[near] + places[j].core[at[near]]) / 2
        border = replace(places[i].some(near), core=between)
        if gap <= reach and _one_bend(one, two, border, gap):
            first, last = sorted((body[i], body[j]))
            body = [first if k == last else k for k in body]
    return [[k for k, b in enumerate(body) if b == first] for first in dict.fromkeys(body)]


def _one_bend(one: PartMotion, two: PartMotion, border: PlaceDistances, gap: float) -> bool:
    """True if two pieces of a face tilt against each other and meet within the gap [m]."""
    own = [m.in_words(m.parameters, m.own)[1] for m in (one, two)]
    spread = np.diag(own[0] + own[1])
    ends = [k for k in (3, 4) if one.seen[k] and two.seen[k]]
    against = np.abs(one.values[ends] - two.values[ends])
    if not (against > _TILTS * np.sqrt(spread[ends])).any():
        return False
    a, b = one.moves(border), two.moves(border)
    step = a @ one.parameters - b @ two.parameters
    variance = np.einsum("mi,ij,mj->m", a, one.own, a) + np.einsum("mi,ij,mj->m", b, two.own, b)
    allowed = _STEP * float(np.sqrt(variance.mean())) + float(np.linalg.norm(against)) * gap
    return bool(np.sqrt(np.mean(step**2)) <= allowed)


def _part(
    name: str,
    some: PlaceDistances,
    factor: float,
    stable: PartMotion | None,
    alpha: float,
    cell: float,
) -> MovedPart:
    """One part, by its test."""
    area = cell**2 * len(some)
    motion = part_motion(some, factor)
    if motion is None:
        return MovedPart(name, "too few distances", area)
    limit = motion.limit(alpha)
    bends = motion.misfit > factor * float(chi2.ppf(_ONE_BODY, motion.redundancy))
    bends |= motion.left_out > 0.2 * len(some)
    verdict: Verdict = "moved" if motion.statistic > limit else "no motion found"
    relative = None if stable is None else relative_motion(some, motion, stable)
    return MovedPart(
        name=name,
        verdict="not one body" if bends else verdict,
        area=area,
        motion=motion,
        against_stable=relative,
        limit=limit,
        detectable=motion.detectable(alpha, POWER),
    )
