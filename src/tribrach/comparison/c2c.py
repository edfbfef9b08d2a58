"""Compares two clouds point to nearest point, and says how much of the distance is sampling.

Each figure has its floor beside it: what two clouds without any error would show at these pitches
(method sections 5.5 and 9.1). What is left after the floor is the part across the surface,
``s_perp^2 = RMS^2 - (s_x^2 + s_y^2) / 12``.

Beside them stand signed distances from the plane through the nearest points of the reference. A
plane has no gaps: this takes most of the sampling out of nearest-neighbour distances. What remains
is the noise of both clouds, that of the plane reduced by its points.

Metres; A is compared with B, the reference. Millions of distances are summed up chunk by chunk and
tile by tile; a tile takes its share of every sample, so that its result depends on no other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Progress
from tribrach.answers import Result
from tribrach.comparison.nearest import Neighbours
from tribrach.comparison.sampling_floor import Floor, SamplingPattern, pattern
from tribrach.comparison.tiles import Tile, Tiles
from tribrach.kernels import in_threads, njit
from tribrach.sentences import Sentence
from tribrach.tasks.engine import HERE, Call, Engine

#: bins of the histogram that quantiles are read from
BINS = 20_000
#: points through which a plane is laid
NEIGHBOURS = 16
#: thickness over the lesser width of points that are still a plane
_THIN = 0.35
#: places at which the pattern is looked at: per million points, and at least so many in a chunk
_PLACES, _FEWEST = 400, 50
#: points for local planes, over all; points on the map; places of the compared cloud
_PLANES, _MAP, _OWN = 400_000, 20_000, 2_000
#: a lattice is named as the model of the floor where more of the places than this are on one
_MOSTLY = 0.5
#: below this many points a figure is not worth its name; noise over pitch where debiasing fails
_FEW, _COARSE = 30, 0.25
#: nothing is called sampling where the mean of the distances from local planes is beyond this share
#: of their standard deviation, or a larger share of the distances along normals beyond their levels
_SHIFTED, _CHANGED = 0.5, 0.2
SAMPLING = "the RMS is not above the sampling floor: nothing but sampling is left in it"
_ACROSS = (
    "the RMS of the nearest points is not above the sampling floor and does not show what the "
    "distances across the surface show: go by the mean from local planes and by M3C2"
)


@dataclass(frozen=True)
class Pitch(Result):
    """Pitch of the points of a cloud on its surface."""

    #: medians across and upwards [m]
    across: float
    up: float
    lattice: float  #: share of places that are lattices


@dataclass(frozen=True)
class Signed(Result):
    """Distances from local planes [m]."""

    count: int
    mean: float
    std: float
    rms: float
    median: float
    q95: float  #: size that 95 % do not exceed


@dataclass(frozen=True)
class C2C(
    Result,
    without=("limit", "floor", "tally", "sample", "places", "normals"),
    also=("floor_mean", "floor_std", "floor_rms"),
):
    """Distances to nearest points [m] beside what sampling alone makes of them."""

    limit: float  #: largest distance that counts
    n: int  #: points with a neighbour within the limit
    beyond: float  #: share of the points without
    #: of the distances, None without any
    mean: float | None
    std: float | None
    rms: float | None
    median: float | None
    q95: float | None
    floor: Floor | None  #: distances that sampling alone makes, None where no surface was seen
    floor_model: str | None  #: ``lattice`` or ``measured``: what the floor rests on
    #: of either cloud, None where no surface was seen
    pitch_a: Pitch | None
    pitch_b: Pitch | None
    #: RMS across the surface, None where nothing is left beside sampling
    debiased_rms: float | None
    local_plane: Signed | None  #: None where no plane was seen
    notes: tuple[str, ...]  #: what to know before the figures are used
    tally: Tally  #: the distances for a histogram
    sample: Array  #: points and their distances (k, 4)
    #: where the surface was looked at (p, 3), and its unit normals, NaN where there is none
    places: Array
    normals: Array

    def beside(self, changed: float | None) -> C2C:
        """The same, with nothing called sampling that distances along normals call a change."""
        plane = self.local_plane
        moved = changed is not None and changed > _CHANGED
        if plane is not None and plane.count > _FEW:
            moved |= abs(plane.mean) > _SHIFTED * plane.std
        if not moved:
            return self
        return replace(self, notes=tuple(_ACROSS if n == SAMPLING else n for n in self.notes))

    @property
    def floor_mean(self) -> float | None:
        """Mean of the floor."""
        return None if self.floor is None else self.floor.mean

    @property
    def floor_std(self) -> float | None:
        """Standard deviation of the floor."""
        return None if self.floor is None else self.floor.std

    @property
    def floor_rms(self) -> float | None:
        """Root mean square of the floor."""
        return None if self.floor is None else self.floor.rms


def tile_distances(
    cut: Tiles,
    limit: float,
    *,
    viewpoint: Array | None = None,
    what: str = "distances",
    engine: Engine = HERE,
    progress: Progress = lambda what, done, total: None,
) -> C2C:
    """Compare every point of a cloud with the nearest of a reference, tile by tile.

    Distances from local planes are positive towards the viewpoint.
    """
    calls = [Call(what, (tile, limit, viewpoint, what), cost=tile.asked) for tile in cut]
    found = dict(engine.completed(_look_at, calls, progress))
    looked = [found[number] for number in sorted(found)]
    # some of the places, by their numbers over all tiles
    own = Sample(_OWN, 2)
    for number, tile in enumerate(looked):
        count = len(tile.places)
        own.add(np.column_stack([np.full(count, number), np.arange(count)]))
    chosen = own.rows.astype(np.int64)
    calls = [
        Call(what, (tile, limit, looked[k].places[chosen[chosen[:, 0] == k, 1]]), cost=tile.asked)
        for k, tile in enumerate(cut)
        if (chosen[:, 0] == k).any()
    ]
    patterns = dict(engine.completed(_own_pattern, calls, progress))
    return _result(looked, limit, SamplingPattern.join([patterns[k] for k in sorted(patterns)]))


@dataclass(eq=False)
class _Looked:
    """Distances found in one tile."""

    #: distances to points, from planes, and the sizes of these
    tally: Tally
    signed: Tally
    sizes: Tally
    sample: Array  #: (k, 4), points on the map with their distances [m]
    pattern: SamplingPattern  #: how the reference lies around the places
    places: Array  #: (p, 3), where it was looked at [m]
    weights: Array  #: (p,), how many points each stands for


def _look_at(
    tile: Tile, limit: float, viewpoint: Array | None, what: str, *, progress: Progress
) -> _Looked:
    """Distances, planes and patterns of one tile."""
    tree = Neighbours(tile.reference(limit)[:, :3])
    tally, signed, sizes = Tally(0.0, limit), Tally(-limit, limit), Tally(0.0, limit)
    total = tile.tiles.total
    on_map, on_planes = _every(total, _MAP), max(1, -(-total // _PLANES))
    # the tile's share of the places that even a small cloud has
    least = -(-_PLACES * tile.asked // total)
    sample, patterns, places, weights = [], [], [], []
    at = tile.before
    for chunk in tile.queries():
        distances, _ = tree.query(chunk, limit)
        tally.add(distances)
        near = np.isfinite(distances)
        some = np.arange(-at % on_map, len(chunk), on_map)
        some = some[near[some]]
        sample.append(np.column_stack([chunk[some], distances[some]]))
        at += len(chunk)
        matched = chunk[near]
        if len(matched):
            count = max(least, _FEWEST, len(matched) * _PLACES // 1_000_000)
            count = min(len(matched), count)
            where = matched[np.linspace(0, len(matched) - 1, count).astype(np.int64)]
            patterns.append(pattern(tree, where, limit))
            places.append(where)
            weights.append(np.full(count, len(matched) / count))
            least = max(least - count, 0)
            across = plane_distances(tree, matched[::on_planes], limit, viewpoint)
            signed.add(across)
            sizes.add(np.abs(across))
        progress(what, at, total)
    return _Looked(
        tally,
        signed,
        sizes,
        np.concatenate([np.empty((0, 4)), *sample]),
        SamplingPattern.join(patterns),
        np.concatenate([np.empty((0, 3)), *places]),
        np.concatenate([np.empty(0), *weights]),
    )


def _own_pattern(tile: Tile, limit: float, places: Array, *, progress: Progress) -> SamplingPattern:
    """How the compared cloud lies around some places of a tile."""
    return pattern(Neighbours(tile.compared(limit)[:, :3]), places)


def _every(total: int, most: int) -> int:
    """The power of two by which so many rows become at most so many."""
    step = 1
    while -(-total // step) > most:
        step *= 2
    return step


def _result(looked: Sequence[_Looked], limit: float, own: SamplingPattern) -> C2C:
    """All figures of all tiles."""
    sampling = SamplingPattern.join([tile.pattern for tile in looked])
    places = np.concatenate([np.empty((0, 3)), *(tile.places for tile in looked)])
    weights = np.concatenate([np.empty(0), *(tile.weights for tile in looked)])
    floor, model = _floor(sampling, weights)
    t = Tally.joined(0.0, limit, [tile.tally for tile in looked])
    signed = Tally.joined(-limit, limit, [tile.signed for tile in looked])
    sizes = Tally.joined(0.0, limit, [tile.sizes for tile in looked])
    some = t.count > 0
    rms = t.rms if some else None
    pitch_b = _pitch(sampling)
    debiased = _debiased(rms, floor)
    return C2C(
        limit=limit,
        n=t.count,
        beyond=t.share_beyond,
        mean=t.mean if some else None,
        std=t.std if some else None,
        rms=rms,
        median=t.quantile(0.5) if some else None,
        q95=t.quantile(0.95) if some else None,
        floor=floor,
        floor_model=model,
        pitch_a=_pitch(own),
        pitch_b=pitch_b,
        debiased_rms=debiased,
        local_plane=_plane_figures(signed, sizes),
        notes=tuple(_sentences(t, floor, pitch_b, debiased, limit)),
        tally=t,
        sample=np.concatenate([np.empty((0, 4)), *(tile.sample for tile in looked)]),
        places=places,
        normals=sampling.normal,
    )


def _plane_figures(signed: Tally, sizes: Tally) -> Signed | None:
    """Figures of the distances from local planes."""
    s = signed
    if s.count == 0:
        return None
    return Signed(s.count, s.mean, s.std, s.rms, s.quantile(0.5), sizes.quantile(0.95))


def _floor(sampling: SamplingPattern, weights: Array) -> tuple[Floor | None, str | None]:
    """The floor over all places, each for as many points as it stands for; what it rests on."""
    known = sampling.known
    if not known.any():
        return None, None
    weight = weights[known]
    mean = float(np.average(sampling.mean[known], weights=weight))
    square = float(np.average(sampling.square[known], weights=weight))
    regular = float(np.average(sampling.lattice[known], weights=weight))
    return Floor.from_moments(mean, square), "lattice" if regular > _MOSTLY else "measured"


def _pitch(sampling: SamplingPattern) -> Pitch | None:
    """Medians over the lattices if most places are on one, else over all places."""
    known = sampling.known
    if not known.any():
        return None
    share = float(sampling.lattice[known].mean())
    rows = sampling.lattice if share > _MOSTLY else known
    across, up = np.median(sampling.pitch[rows], axis=0)
    return Pitch(float(across), float(up), share)


def _debiased(rms: float | None, floor: Floor | None) -> float | None:
    """RMS across the surface after the floor is subtracted; None if nothing remains."""
    if rms is None or floor is None or rms <= floor.rms:
        return None
    return float(np.sqrt(rms**2 - floor.rms**2))


def _sentences(
    tally: Tally, floor: Floor | None, pitch: Pitch | None, debiased: float | None, limit: float
) -> list[str]:
    """Remarks to read before these figures are used."""
    if tally.count == 0:
        return ["no point of the compared cloud has a neighbour within the limit"]
    notes = []
    if tally.count < _FEW:
        notes.append(f"only {tally.count} points have a neighbour within the limit")
    if floor is None or pitch is None:
        return [*notes, "no surface was found around the points: the sampling floor is not known"]
    if pitch.lattice <= _MOSTLY:
        notes.append(
            "the points of the reference are no lattice here; the sampling floor was measured on "
            "the points themselves"
        )
    if debiased is None:
        notes.append(SAMPLING)
    elif debiased > _COARSE * min(pitch.across, pitch.up):
        notes.append(
            "the points scatter across the surface by more than a quarter of the pitch, so that "
            "the nearest one is often nearer than the surface: the debiased RMS is too small, go "
            "by the distances along normals (M3C2)"
        )
    if floor.mean + 2 * floor.std > limit:
        notes.append(
            Sentence(
                "the reference is too thin for the limit of {limit:mmg}, which cuts distances "
                "off that the floor has: give {floor:mm0} or more",
                limit=limit,
                floor=floor.mean + 3 * floor.std,
            )
        )
    return notes


def plane_distances(
    cloud: Neighbours,
    points: Array,
    limit: float,
    viewpoint: Array | None = None,
) -> Array:
    """Compute signed distances from the local planes of a cloud, NaN where there is none.

    They are positive towards the viewpoint, or on the side of the normal's largest coordinate.
    """
    out = np.full(len(points), np.nan)
    if cloud.count < NEIGHBOURS:
        return out
    near, indices = cloud.local_query(points, k=NEIGHBOURS)
    rows = np.flatnonzero(near[:, 0] <= limit)
    towards = np.full(3, np.nan) if viewpoint is None else viewpoint - cloud.origin
    found = np.full(len(rows), np.nan)
    given = cloud.points, points[rows] - cloud.origin, indices[rows], towards
    in_threads(_distances, len(rows), *given, found)
    out[rows] = found
    out[np.abs(out) > limit] = np.nan
    return out


@njit(cache=True, nogil=True)
def _distances(first, last, points, places, indices, towards, out):  # type: ignore[no-untyped-def]
    """One plane per place, by principal components."""
    count = indices.shape[1]
    for n in range(first, last):
        mean = np.zeros(3)
        for k in range(count):
            mean += points[indices[n, k]] - places[n]
        mean /= count
        spread = np.zeros((3, 3))
        for k in range(count):
            d = points[indices[n, k]] - places[n] - mean
            for i in range(3):
                for j in range(3):
                    spread[i, j] += d[i] * d[j]
        values, axes = np.linalg.eigh(spread)
        if values[0] > _THIN * _THIN * values[1]:
            continue
        normal = axes[:, 0]
        height = -(normal * mean).sum()
        # beyond a border the middle of the neighbours is further than their width
        if (mean * mean).sum() - height * height > values[2] / count:
            continue
        if np.isnan(towards[0]):
            side = normal[np.argmax(np.abs(normal))]
        else:
            side = (normal * (towards - places[n])).sum()
        out[n] = height if side > 0 else -height


@dataclass
class Tally:
    """Distances so far, summed about the middle of the first chunk to lose no digits."""

    #: limits of distances that count [m]
    low: float
    high: float
    #: distances within and beyond the limits
    count: int = 0
    beyond: int = 0
    shift: float = 0.0  #: what sums are taken about [m]
    #: sums of distances and their squares, less the shift [m, m^2]
    total: float = 0.0
    squares: float = 0.0
    #: histogram from low to high
    bins: NDArray[np.int64] = field(default_factory=lambda: np.zeros(BINS, dtype=np.int64))

    def add(self, distances: Array) -> None:
        """Take in distances (n,); those that are not finite or out of the limits are beyond."""
        near = distances[(distances >= self.low) & (distances <= self.high)]
        self.beyond += len(distances) - len(near)
        if len(near) == 0:
            return
        if self.count == 0:
            self.shift = float(near.mean())
        self.count += len(near)
        self.total += float((near - self.shift).sum())
        self.squares += float(((near - self.shift) ** 2).sum())
        scaled = (near - self.low) * (BINS / (self.high - self.low))
        self.bins += np.bincount(np.minimum(scaled.astype(np.int64), BINS - 1), minlength=BINS)

    @classmethod
    def joined(cls, low: float, high: float, several: Sequence[Tally]) -> Tally:
        """All distances of tallies with these limits."""
        out = cls(low, high)
        for one in several:
            out.beyond += one.beyond
            if one.count == 0:
                continue
            if out.count == 0:
                out.shift = one.shift
            by = one.shift - out.shift
            out.count += one.count
            out.total += one.total + one.count * by
            out.squares += one.squares + 2 * by * one.total + one.count * by**2
            out.bins += one.bins
        return out

    @property
    def mean(self) -> float:
        """Mean [m]."""
        return self.shift + self.total / self.count

    @property
    def std(self) -> float:
        """Standard deviation about the mean [m]."""
        return float(np.sqrt(max(self.squares / self.count - (self.total / self.count) ** 2, 0.0)))

    @property
    def rms(self) -> float:
        """Root mean square [m]."""
        return float(np.hypot(self.mean, self.std))

    @property
    def share_beyond(self) -> float:
        """Share of all distances that were beyond."""
        return self.beyond / max(self.beyond + self.count, 1)

    def quantile(self, share: float) -> float:
        """The distance that a share does not exceed, to a twenty-thousandth of the limits."""
        wanted = share * self.count
        cumulated = np.cumsum(self.bins)
        k = int(np.searchsorted(cumulated, wanted))
        before = cumulated[k] - self.bins[k]
        within = (wanted - before) / max(self.bins[k], 1)
        return float(self.low + (k + within) * (self.high - self.low) / BINS)

    def histogram(self, bins: int) -> tuple[Array, NDArray[np.int64]]:
        """Edges (bins + 1,) [m] and counts (bins,); the number of bins divides 20,000."""
        return np.linspace(self.low, self.high, bins + 1), self.bins.reshape(bins, -1).sum(axis=1)


@dataclass
class Sample:
    """Rows of a long table, thinned evenly."""

    most: int  #: rows at most
    width: int  #: columns
    step: int = 1  #: one row of so many is taken
    seen: int = 0  #: rows that were offered
    #: (k, width), the rows that were taken
    rows: NDArray[Any] = field(default_factory=lambda: np.empty((0, 0)))

    def __post_init__(self) -> None:
        self.rows = np.empty((0, self.width))

    def add(self, rows: NDArray[Any]) -> None:
        """Take in rows (n, width)."""
        first = -self.seen % self.step
        self.seen += len(rows)
        self.rows = np.concatenate([self.rows, rows[first :: self.step]])
        while len(self.rows) > self.most:
            self.rows, self.step = self.rows[::2], 2 * self.step
